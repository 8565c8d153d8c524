//! Meaning of the vehicle's packets for a download: data, the end of a burst, refusals.

use super::{BUSY_PAUSE, Burst, Get, MOST_LIES, PIECE, TELLING, USUAL_BURST};
use crate::ftp::{FtpError, NUMBERS_PER_BURST};
use crate::link::clock::Micros;
use crate::protocol::ftp::{NakReason, Op, Packet};
use crate::sink::Sink;

impl<S: Sink> Get<S> {
    pub(super) fn on_packet(&mut self, now: Micros, packet: &Packet) {
        if packet.session != self.caller.session() {
            return;
        }
        match (packet.op, packet.request) {
            (Op::Ack, Op::BurstReadFile | Op::ReadFile) => self.on_data(now, packet),
            (Op::Nak, Op::BurstReadFile) => self.on_burst_refused(now, packet),
            (Op::Nak, Op::ReadFile) => self.on_read_refused(now, packet),
            _ => {}
        }
    }

    pub(super) fn on_data(&mut self, now: Micros, packet: &Packet) {
        let (Some(sink), Some(size)) = (&mut self.sink, self.size) else { return };
        let offset = u64::from(packet.offset);
        let length = (packet.data.len() as u64).min(size.saturating_sub(offset));
        if packet.data.is_empty() {
            return;
        }
        self.heard = Some(now);
        match sink.put(now, offset, &packet.data[..length as usize]) {
            Ok(new) => {
                self.tally.new_bytes += new;
                self.tally.again_bytes += packet.data.len() as u64 - new;
            }
            Err(reason) => return self.close(Err(FtpError::Sink(reason))),
        }
        self.failures = 0;
        if packet.request == Op::ReadFile {
            self.on_read_answered(now, offset);
        } else {
            self.on_burst_packet(now, packet, offset + packet.data.len() as u64 >= size);
        }
    }

    /// The vehicle serves one request after another: with the answer to a read that was asked
    /// after a burst had fallen silent, the burst is over, or never was.
    pub(super) fn on_read_answered(&mut self, now: Micros, offset: u64) {
        let Some(took) = self.reads.answered(now, offset) else { return };
        self.caller.add_rtt(took);
        if let Some(Burst { heard: Some((_, number)), .. }) = self.bursts.front()
            && self.burst_packets.is_none()
            && (USUAL_BURST * 9 / 10..USUAL_BURST).contains(number)
        {
            self.burst_packets = Some(USUAL_BURST);
        }
        if let Some(burst) = self.bursts.front() {
            self.learn(burst.first, burst.heard);
        }
        self.bursts.clear();
    }

    /// How fast a burst came.
    fn learn(&mut self, first: Option<(Micros, u64)>, last: Option<(Micros, u64)>) {
        if let Some(((began, from), (ended, to))) = first.zip(last)
            && to >= from + TELLING - 1
        {
            let spacing = ended.saturating_sub(began) as f64 / (to - from) as f64;
            self.spacing = Some(spacing);
            self.reads.pace(spacing);
            self.tally.burst_bytes_per_s = PIECE as f64 * 1e6 / spacing.max(1.0);
        }
    }

    pub(super) fn on_burst_packet(&mut self, now: Micros, packet: &Packet, at_end: bool) {
        let number = |burst: &Burst| u64::from(packet.sequence.wrapping_sub(burst.sequence)) - 1;
        let is_of = |burst: &Burst| {
            let number = packet.sequence.wrapping_sub(burst.sequence);
            number != 0 && number <= NUMBERS_PER_BURST
        };
        let Some(index) = self.bursts.iter().position(is_of) else { return };
        // The vehicle serves one after another: those before it are over.
        let over = self.bursts.drain(..index).next_back();
        if let Some(over) = over {
            self.learn(over.first, over.heard);
        }
        let Some(burst) = self.bursts.front_mut() else { return };
        let number = number(burst);
        if let Some((at, highest)) = &mut burst.heard {
            let steps = number.saturating_sub(*highest);
            if steps > 0 {
                let each = now.saturating_sub(*at) as f64 / steps as f64;
                let weight = if burst.spacing == 0.0 { 1.0 } else { 0.1 };
                burst.spacing += (each - burst.spacing) * weight;
                (*at, *highest) = (now, number);
            }
        } else {
            if number == 0 && burst.is_first {
                self.caller.add_rtt(now.saturating_sub(burst.since));
            }
            burst.first = Some((now, number));
            burst.heard = Some((now, number));
        }
        if packet.burst_complete {
            self.burst_packets = Some(number + 1);
        }
        if packet.burst_complete || at_end {
            self.end_burst(now);
        }
    }

    pub(super) fn on_burst_refused(&mut self, now: Micros, packet: &Packet) {
        let is_of = |burst: &Burst| {
            let number = packet.sequence.wrapping_sub(burst.sequence);
            number != 0 && number <= NUMBERS_PER_BURST
        };
        // A refusal that comes twice or late is of a burst that is over.
        let Some(index) = self.bursts.iter().position(is_of) else { return };
        self.heard = Some(now);
        match packet.refusal() {
            Some(NakReason::EndOfFile) => {
                self.bursts.drain(..index);
                let was_mute = self.bursts.front().is_some_and(|burst| burst.heard.is_none());
                if was_mute {
                    // Nothing where there should be something; single reads find out.
                    self.no_bursts = true;
                }
                self.end_burst(now);
            }
            Some(NakReason::UnknownCommand) => {
                self.bursts.clear();
                self.no_bursts = true;
            }
            _ => self.reopen_limited(now, packet),
        }
    }

    pub(super) fn on_read_refused(&mut self, now: Micros, packet: &Packet) {
        let number = packet.sequence.wrapping_sub(1);
        let Some(index) = self.numbers.iter().position(|(of, _)| *of == number) else { return };
        let Some((_, offset)) = self.numbers.remove(index) else { return };
        self.heard = Some(now);
        self.on_read_answered(now, offset);
        match (packet.refusal(), self.size) {
            (Some(NakReason::EndOfFile), Some(said)) if offset < said => {
                self.lies += 1;
                if self.lies >= MOST_LIES {
                    self.close(Err(FtpError::SizeLies { said, ends: offset }));
                } else {
                    self.reopen(now + BUSY_PAUSE);
                }
            }
            _ => self.reopen_limited(now, packet),
        }
    }

    pub(super) fn reopen_limited(&mut self, now: Micros, packet: &Packet) {
        self.failures += 1;
        match packet.refusal() {
            Some(refusal) if self.failures > 10 => {
                self.close(Err(FtpError::Refused { what: "reading", refusal }));
            }
            // The session is not the vehicle's: it booted.
            Some(NakReason::FileNotFound) => self.reopen(now),
            _ => self.reopen(now + BUSY_PAUSE),
        }
    }

    pub(super) fn end_burst(&mut self, now: Micros) {
        if let Some(burst) = self.bursts.pop_front() {
            self.learn(burst.first, burst.heard);
        }
        if let Some(next) = self.bursts.front_mut() {
            next.since = now;
        }
    }
}
