//! Next request of a download: a burst, a single read, or none yet.

use super::{
    Burst, Get, Got, MOST_OCCUPIED, MOST_RANGES, MOST_READS, OVERHEAD, PIECE, USUAL_BURST,
    WORTH_A_BURST, WORTH_A_TAIL,
};
use crate::ftp::FtpError;
use crate::link::clock::{MS, Micros, S};
use crate::link::conversation::{Conversation as _, Step};
use crate::link::frame::MavMessage;
use crate::protocol::ftp::{MOST_DATA, Op, Packet};
use crate::sink::Sink;

impl<S: Sink> Get<S> {
    /// From when on the current burst's silence is suspicious.
    pub(super) fn suspicious_at(&self) -> Option<Micros> {
        let burst = self.bursts.front()?;
        let timeout = self.caller.timeout();
        Some(match burst.heard {
            None => burst.since + 2 * timeout,
            Some((at, _)) => at + timeout.max((burst.spacing * 24.0) as Micros).max(150 * MS),
        })
    }

    fn is_silent(&self, now: Micros) -> bool {
        self.suspicious_at().is_some_and(|at| now >= at)
    }

    pub(super) fn burst_length(&self) -> u64 {
        self.burst_packets.unwrap_or(USUAL_BURST) * PIECE
    }

    /// A burst would keep the link for too long.
    fn is_slow(&self) -> bool {
        let packets = self.burst_packets.unwrap_or(USUAL_BURST) as f64;
        self.spacing.is_some_and(|each| each * packets > MOST_OCCUPIED as f64)
    }

    /// Where the next burst is worth its packets.
    pub(super) fn burst_start(&mut self) -> Option<u64> {
        let (sink, size) = (self.sink.as_ref()?, self.size?);
        if self.no_bursts || self.is_slow() || sink.have().count() > MOST_RANGES {
            return None;
        }
        // Behind what is on its way.
        let mut from = self.bursts.back().map_or(0, |burst| burst.offset + self.burst_length());
        while let Some((start, end)) = sink.have().gap(from, size) {
            let packets = (end - start).div_ceil(PIECE);
            if packets >= WORTH_A_BURST || (end == size && packets >= WORTH_A_TAIL) {
                return Some(start);
            }
            from = end;
        }
        // Gaps only shrink.
        self.no_bursts = self.bursts.is_empty();
        None
    }

    pub(super) fn wants_burst(&self) -> bool {
        match (self.bursts.front(), self.bursts.len()) {
            (None, _) => self.reads.is_empty(),
            // One more while one comes, once its length is known: it is served right after it.
            (Some(Burst { heard: Some((_, number)), .. }), 1) => {
                self.burst_packets.is_some_and(|packets| number + 1 > packets / 2)
            }
            _ => false,
        }
    }

    pub(super) fn send_burst(&mut self, now: Micros, offset: u64) -> MavMessage {
        let mut packet = Packet::request(Op::BurstReadFile);
        packet.size = MOST_DATA as u8;
        packet.offset = offset as u32;
        let packet = self.caller.number(packet);
        self.caller.skip();
        self.tally.bursts += 1;
        let spacing = self.bursts.front().map_or(0.0, |burst| burst.spacing);
        self.bursts.push_back(Burst {
            sequence: packet.sequence,
            offset,
            since: now,
            is_first: self.bursts.is_empty(),
            first: None,
            heard: None,
            spacing,
        });
        self.caller.message(&packet)
    }

    pub(super) fn poll_reading(&mut self, now: Micros) -> Step<Got<S>> {
        let (Some(sink), Some(size)) = (&self.sink, self.size) else {
            return Step::Wait(Micros::MAX);
        };
        if sink.have().gap(0, size).is_none() {
            self.close(Ok(size));
            return self.poll(now);
        }
        let heard = *self.heard.get_or_insert(now);
        let gives_up = heard + self.options.patience;
        if now >= gives_up {
            let seconds = self.options.patience / S;
            self.close(Err(FtpError::Silent { seconds }));
            return self.poll(now);
        }
        let is_free = self.bursts.is_empty() || self.options.is_left;
        if self.is_pausing && (is_free || self.is_silent(now)) {
            self.close(Err(FtpError::Paused));
            return self.poll(now);
        }
        let suspicious_at = self.suspicious_at();
        let is_silent = suspicious_at.is_some_and(|at| now >= at);
        let mut wake = gives_up.min(self.reads.expire(now, self.caller.timeout(), is_silent));
        if let Some(at) = suspicious_at.filter(|_| !is_silent) {
            wake = wake.min(at);
        }
        if self.is_pausing {
            return Step::Wait(wake);
        }
        if !is_silent
            && self.wants_burst()
            && let Some(offset) = self.burst_start()
        {
            let length = self.burst_length().min(size - offset);
            let cost = length + length.div_ceil(PIECE) * OVERHEAD;
            match self.allowed(now, cost) {
                Ok(()) => return Step::send(self.send_burst(now, offset)),
                Err(later) => wake = wake.min(later),
            }
        } else if self.bursts.is_empty() || is_silent {
            if let Err(later) = self.allowed(now, 0) {
                return Step::Wait(wake.min(later));
            }
            let Some(sink) = &self.sink else { return Step::Wait(wake) };
            if !is_silent && now < self.reads.not_before() {
                return Step::Wait(wake.min(self.reads.not_before() + 1));
            }
            let next = self.reads.next(now, sink.have(), size, is_silent);
            let next = next.or_else(|| {
                let waits = self.options.is_left && self.bursts.is_empty();
                if waits { self.reads.once_more() } else { None }
            });
            if let Some((start, end)) = next {
                let _ = self.allowed(now, end - start + OVERHEAD);
                return Step::send(self.send_read(start, end));
            }
        }
        Step::Wait(wake)
    }

    pub(super) fn allowed(&self, now: Micros, bytes: u64) -> Result<(), Micros> {
        self.options.budget.as_ref().map_or(Ok(()), |budget| budget.take(now, bytes))
    }

    pub(super) fn send_read(&mut self, start: u64, end: u64) -> MavMessage {
        let mut packet = Packet::request(Op::ReadFile);
        packet.size = (end - start) as u8;
        packet.offset = start as u32;
        let packet = self.caller.number(packet);
        self.tally.reads += 1;
        if self.numbers.len() >= 2 * MOST_READS {
            self.numbers.pop_front();
        }
        self.numbers.push_back((packet.sequence, start));
        self.caller.message(&packet)
    }
}
