//! Brings a log by LOG_REQUEST_DATA.
//!
//! Requests of 46,080 bytes (512 packets) while large parts are missing; what was lost of them is
//! asked for in the same way, a gap at a time. An autopilot drops what it is asked while it
//! sends, so that only small requests go out side by side.

use super::{LogProtocolError, data_message, end_message};
use crate::fleet::budget::Budget;
use crate::fleet::ftp::get::Tally;
use crate::fleet::ftp::reads::Reads;
use crate::fleet::rtt::Rtt;
use crate::fleet::sink::Sink;
use crate::link::clock::{MS, Micros, S};
use crate::link::drive::{Machine, Progress, Step};
use crate::link::frame::MavMessage;
use crate::link::id::DroneId;

/// Bytes in one LOG_DATA.
const PIECE: u64 = 90;
/// Bytes of one request: 512 packets, as other stations ask.
const REQUEST: u64 = 46_080;
/// A gap that is worth a request of its own kind, bytes.
const WORTH_A_REQUEST: u64 = 32 * PIECE;
/// With more separate ranges, gaps are repaired first.
const MOST_RANGES: usize = 50_000;
/// Small requests at once, at most.
const MOST_READS: usize = 8;
/// A frame's bytes around the data.
const OVERHEAD: u64 = 19;
/// The vehicle contradicts itself about the end so often before it is not believed.
const MOST_LIES: u32 = 3;

/// What is left of a [`LogGet`].
#[derive(Debug)]
pub struct LogGot<S> {
    /// With what came, also when it failed.
    pub sink: S,
    /// Size; all of it is in the sink.
    pub result: Result<u64, LogProtocolError>,
    /// What it cost.
    pub tally: Tally,
}

/// Brings a log.
#[derive(Debug)]
pub struct LogGet<S> {
    drone: DroneId,
    id: u16,
    size: u64,
    patience: Micros,
    budget: Option<Budget>,
    sink: Option<S>,
    rtt: Rtt,
    request: Option<Request>,
    reads: Reads,
    heard: Option<Micros>,
    lies: u32,
    over: Option<Result<u64, LogProtocolError>>,
    ends_said: u32,
    tally: Tally,
}

#[derive(Debug)]
struct Request {
    start: u64,
    end: u64,
    asked: Micros,
    heard: Option<Micros>,
}

impl<S: Sink> LogGet<S> {
    /// Brings log `id` of `size` bytes (from [`super::list::LogList`]), or what the sink lacks.
    pub fn new(drone: DroneId, id: u16, size: u64, sink: S, patience: Micros) -> Self {
        Self {
            drone,
            id,
            size,
            patience,
            budget: None,
            sink: Some(sink),
            rtt: Rtt::default(),
            request: None,
            reads: Reads::new(PIECE, MOST_READS, patience),
            heard: None,
            lies: 0,
            over: None,
            ends_said: 0,
            tally: Tally::default(),
        }
    }

    /// What the link may be asked to carry.
    #[must_use]
    pub fn with_budget(mut self, budget: Option<Budget>) -> Self {
        self.budget = budget;
        self
    }

    /// What it has cost so far.
    pub fn tally(&self) -> Tally {
        self.tally
    }

    /// When the vehicle said something of use last.
    pub fn heard(&self) -> Option<Micros> {
        self.heard
    }

    fn on_data(&mut self, now: Micros, offset: u64, data: &[u8]) {
        let Some(sink) = &mut self.sink else { return };
        self.heard = Some(now);
        if data.is_empty() {
            if offset < self.size && !sink.have().contains(offset, offset + 1) {
                self.lies += 1;
                if self.lies >= MOST_LIES {
                    self.over =
                        Some(Err(LogProtocolError::SizeLies { said: self.size, ends: offset }));
                }
            }
            return;
        }
        let length = (data.len() as u64).min(self.size.saturating_sub(offset));
        match sink.put(now, offset, &data[..length as usize]) {
            Ok(new) => {
                self.tally.new_bytes += new;
                self.tally.again_bytes += data.len() as u64 - new;
            }
            Err(reason) => self.over = Some(Err(LogProtocolError::Sink(reason))),
        }
        if let Some(took) = self.reads.answered(now, offset) {
            self.rtt.add(took);
        }
        if let Some(request) = &mut self.request
            && (request.start..request.end).contains(&offset)
        {
            if request.heard.is_none() && offset == request.start {
                self.rtt.add(now.saturating_sub(request.asked));
            }
            request.heard = Some(now);
            if offset + data.len() as u64 >= request.end.min(self.size) {
                self.request = None;
            }
        }
    }

    /// The first gap that is worth a request.
    fn large_gap(&self) -> Option<(u64, u64)> {
        let have = self.sink.as_ref()?.have();
        if have.count() > MOST_RANGES {
            return None;
        }
        let mut from = 0;
        while let Some((start, end)) = have.gap(from, self.size) {
            if end - start >= WORTH_A_REQUEST {
                return Some((start, end.min(start + REQUEST)));
            }
            from = end;
        }
        None
    }

    fn allowed(&self, now: Micros, bytes: u64) -> Result<(), Micros> {
        self.budget.as_ref().map_or(Ok(()), |budget| budget.take(now, bytes))
    }

    fn ask(&self, start: u64, end: u64) -> MavMessage {
        data_message(self.drone, self.id, start as u32, (end - start) as u32)
    }

    fn next(&mut self, now: Micros, gives_up: Micros) -> Step<LogGot<S>> {
        let wake = gives_up.min(self.reads.expire(now, self.rtt.timeout(), false));
        if let Some(request) = &self.request {
            let timeout = self.rtt.timeout().max(150 * MS);
            let until = request.heard.map_or(request.asked + 2 * timeout, |at| at + timeout);
            if now < until {
                return Step::Wait(wake.min(until));
            }
            self.request = None;
        }
        if self.reads.is_empty()
            && let Some((start, end)) = self.large_gap()
        {
            let bytes = end - start;
            match self.allowed(now, bytes + bytes.div_ceil(PIECE) * OVERHEAD) {
                Ok(()) => {
                    self.request = Some(Request { start, end, asked: now, heard: None });
                    self.tally.bursts += 1;
                    return Step::send(self.ask(start, end));
                }
                Err(later) => return Step::Wait(wake.min(later)),
            }
        }
        if let Err(later) = self.allowed(now, 0) {
            return Step::Wait(wake.min(later));
        }
        let Some(sink) = &self.sink else { return Step::Wait(wake) };
        if self.large_gap().is_none()
            && let Some((start, end)) = self.reads.next(now, sink.have(), self.size, false)
        {
            let _ = self.allowed(now, end - start + OVERHEAD);
            self.tally.reads += 1;
            return Step::send(self.ask(start, end));
        }
        Step::Wait(wake)
    }
}

impl<S: Sink> Machine for LogGet<S> {
    type Done = LogGot<S>;

    fn on_message(&mut self, now: Micros, message: &MavMessage) {
        let MavMessage::LOG_DATA(data) = message else { return };
        // Another station's log, or an earlier one's.
        if data.id != self.id || usize::from(data.count) > data.data.len() || self.over.is_some() {
            return;
        }
        self.on_data(now, data.ofs.into(), &data.data[..usize::from(data.count)]);
    }

    fn poll(&mut self, now: Micros) -> Step<Self::Done> {
        let heard = *self.heard.get_or_insert(now);
        let Some(sink) = &self.sink else { return Step::Wait(Micros::MAX) };
        if self.over.is_none() {
            if sink.have().gap(0, self.size).is_none() {
                self.over = Some(Ok(self.size));
            } else if now >= heard + self.patience {
                let seconds = self.patience / S;
                self.over = Some(Err(LogProtocolError::Silent { seconds }));
            }
        }
        let Some(result) = &self.over else { return self.next(now, heard + self.patience) };
        // It has no answer, and frees the vehicle for others: said twice.
        self.ends_said += 1;
        if self.ends_said <= 2 {
            return Step::send(end_message(self.drone));
        }
        let result = result.clone();
        match self.sink.take() {
            Some(sink) => Step::Done(LogGot { sink, result, tally: self.tally }),
            None => Step::Wait(Micros::MAX),
        }
    }

    fn progress(&self) -> Progress {
        let done = self.sink.as_ref().map_or(0, |sink| sink.have().total());
        Progress { done, total: self.size }
    }
}
