//! Conversation that downloads a log by LOG_REQUEST_DATA.
//!
//! Two ways of asking alternate. A *window* is one request for many packets, as large as comes in
//! less than half a second, so that it suits a serial radio of 57,600 baud as well as a cable, and
//! a station that dies keeps the vehicle from arming for no longer. An autopilot drops without a
//! word what it is asked while it sends: where the way there and back is long, the next window is
//! asked for so that the request arrives when the last packet leaves; where packets are lost, twice.
//! What was lost of windows is then asked for a gap at a time, many on their way at once: each is
//! served as it is heard.

mod window;

use self::window::Windows;
use super::{LogProtocolError, data_message, end_message};
use crate::budget::Budget;
use crate::ftp::get::Tally;
use crate::ftp::reads::Reads;
use crate::link::clock::{MS, Micros, S};
use crate::link::conversation::{Conversation, Progress, Step};
use crate::link::frame::MavMessage;
use crate::link::id::DroneId;
use crate::load::{LinkLoad, Place};
use crate::rtt::Rtt;
use crate::sink::Sink;

/// Bytes in one LOG_DATA.
const PIECE: u64 = 90;
/// A gap that is worth a window.
const WORTH_A_WINDOW: u64 = 32 * PIECE;
/// With more separate ranges, gaps are repaired first.
const MOST_RANGES: usize = 50_000;
/// Small requests at once, at most.
const MOST_READS: usize = 1024;
/// A frame's bytes around the data.
const OVERHEAD: u64 = 19;
/// The vehicle contradicts itself about the end so often before it is not believed.
const MOST_LIES: u32 = 3;
/// Longest pause between repetitions.
const MOST_PAUSE: Micros = 4 * S;
/// A link is as good as empty on which nothing takes longer than this.
const IDLE: Micros = 50 * MS;
/// The end has no answer, and is said so often.
const ENDS: u32 = 2;

/// Result of a [`LogGet`].
#[derive(Debug)]
pub struct LogGot<S> {
    /// Sink with the bytes that came, also after a failure.
    pub sink: S,
    /// Size of the log, bytes; all of it is in the sink.
    pub result: Result<u64, LogProtocolError>,
    /// Statistics of the download.
    pub tally: Tally,
}

/// Conversation that downloads a log.
#[derive(Debug)]
pub struct LogGet<S> {
    drone: DroneId,
    id: u16,
    size: u64,
    patience: Micros,
    budget: Option<Budget>,
    place: Option<Place>,
    sink: Option<S>,
    rtt: Rtt,
    windows: Windows,
    /// The last window's request goes out once more.
    copy: Option<(u64, u64)>,
    reads: Reads,
    /// Where windows go on.
    cursor: u64,
    /// No gap is worth a window any more.
    only_small: bool,
    heard: Option<Micros>,
    lies: u32,
    is_pausing: bool,
    over: Option<Result<u64, LogProtocolError>>,
    ends_said: u32,
    /// It is short, and what follows waits for it.
    is_followed: bool,
    tally: Tally,
}

impl<S: Sink> LogGet<S> {
    /// Downloads log `id` of `size` bytes (from [`super::list::LogList`]), or the parts that the
    /// sink lacks.
    pub fn new(drone: DroneId, id: u16, size: u64, sink: S, patience: Micros) -> Self {
        Self {
            drone,
            id,
            size,
            patience,
            budget: None,
            place: None,
            sink: Some(sink),
            rtt: Rtt::default(),
            windows: Windows::default(),
            copy: None,
            reads: Reads::new(PIECE, MOST_READS, patience),
            cursor: 0,
            only_small: false,
            heard: None,
            lies: 0,
            is_pausing: false,
            over: None,
            ends_said: 0,
            is_followed: false,
            tally: Tally::default(),
        }
    }

    /// Limits the data rate of the link.
    #[must_use]
    pub fn with_budget(mut self, budget: Option<Budget>) -> Self {
        self.budget = budget;
        self
    }

    /// Sets the estimate of the time to an answer, from other conversations with the vehicle.
    #[must_use]
    pub fn with_rtt(mut self, rtt: Rtt) -> Self {
        self.rtt = rtt;
        self
    }

    /// Shares the link with the downloads of other drones.
    #[must_use]
    pub fn on_link(mut self, load: Option<&LinkLoad>) -> Self {
        self.place = load.map(LinkLoad::place);
        self
    }

    /// Marks a small download that the download of the rest of the log follows: the vehicle is not
    /// freed after it.
    #[must_use]
    pub fn followed(mut self) -> Self {
        self.ends_said = ENDS;
        self.is_followed = true;
        self
    }

    /// Looks at what others do on the link.
    fn look_at_link(&mut self) {
        let Some(place) = &self.place else { return };
        let share = place.share();
        self.windows.share_of_link = share;
        self.windows.delay = if share.is_some() { place.delay() } else { 0 };
        self.reads.share(share.map(|bytes| bytes / PIECE as f64));
    }

    /// Tells others what is on its way.
    fn tell_link(&self) {
        if let Some(place) = &self.place {
            place.tell(self.windows.on_way() + self.reads.count() as u64 * PIECE);
        }
    }

    /// Statistics of the download so far.
    pub fn tally(&self) -> Tally {
        self.tally
    }

    /// Time at which the vehicle last sent anything of use, us.
    pub fn heard(&self) -> Option<Micros> {
        self.heard
    }

    /// Ends the download as [`LogProtocolError::Paused`], with what has come.
    pub fn pause(&mut self) {
        self.is_pausing = true;
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
                self.windows.repeated(length - new);
                if let Some(place) = &self.place {
                    place.came(now, data.len() as u64);
                }
            }
            Err(reason) => self.over = Some(Err(LogProtocolError::Sink(reason))),
        }
        let read = self.reads.answered(now, offset);
        let window = self.windows.heard(now, offset, offset + data.len() as u64);
        for took in read.into_iter().chain(window) {
            self.rtt.add(took);
            if let Some(place) = &self.place {
                place.took(took);
            }
        }
    }

    /// The next gap that is worth a window, behind those that are on their way; once around.
    fn large_gap(&mut self) -> Option<(u64, u64)> {
        let have = self.sink.as_ref()?.have();
        if self.only_small || have.count() > MOST_RANGES {
            return None;
        }
        loop {
            let mut from = self.cursor;
            while let Some((start, end)) = have.gap(from, self.size) {
                if end - start >= WORTH_A_WINDOW {
                    return Some((start, end));
                }
                from = end;
            }
            // What is late of the last windows is not asked for again with them.
            if !self.windows.is_empty() {
                return None;
            }
            if self.cursor == 0 {
                // Gaps only shrink.
                self.only_small = true;
                self.reads.at_least(self.windows.pipe() / PIECE as f64);
                return None;
            }
            self.cursor = 0;
        }
    }

    fn allowed(&self, now: Micros, bytes: u64) -> Result<(), Micros> {
        self.budget.as_ref().map_or(Ok(()), |budget| budget.take(now, bytes))
    }

    fn ask(&self, start: u64, end: u64) -> MavMessage {
        data_message(self.drone, self.id, start as u32, (end - start) as u32)
    }

    fn pause_after(&self, silent: u32) -> Micros {
        let timeout = self.rtt.timeout();
        let most = MOST_PAUSE.min(self.patience / 12).max(timeout);
        timeout.saturating_mul(1 << (silent / 2).min(6)).min(most)
    }

    fn next(&mut self, now: Micros, gives_up: Micros) -> Step<LogGot<S>> {
        if let Some((start, end)) = self.copy.take() {
            return Step::send(self.ask(start, end));
        }
        let timeout = self.rtt.timeout();
        let mut wake = gives_up.min(self.reads.expire(now, timeout + self.windows.delay, false));
        let last = self.heard.unwrap_or(0);
        loop {
            let pause = self.pause_after(self.windows.silent());
            match self.windows.silent_at(pause, timeout, last) {
                Some(until) if now < until => {
                    wake = wake.min(until);
                    break;
                }
                Some(_) => {
                    // Nothing came of it: again.
                    if let Some(start) = self.windows.give_up_first() {
                        self.cursor = start;
                    }
                }
                None => break,
            }
        }
        if self.windows.wants_another()
            && self.reads.is_empty()
            && let Some((start, gap_end)) = self.large_gap()
        {
            let end = gap_end.min(start + self.windows.size());
            let bytes = end - start;
            return match self.allowed(now, bytes + bytes.div_ceil(PIECE) * OVERHEAD) {
                Ok(()) => {
                    self.cursor = end;
                    if self.windows.ask(now, start, end) {
                        self.copy = Some((start, end));
                    }
                    self.tally.bursts += 1;
                    Step::send(self.ask(start, end))
                }
                Err(later) => Step::Wait(wake.min(later)),
            };
        }
        if !self.windows.is_empty() || self.large_gap().is_some() {
            return Step::Wait(wake);
        }
        if let Err(later) = self.allowed(now, 0) {
            return Step::Wait(wake.min(later));
        }
        let Some(sink) = &self.sink else { return Step::Wait(wake) };
        let next = self.reads.next(now, sink.have(), self.size, false);
        // The last of them are asked for more than once where packets are lost, and nobody else
        // has a use for the link.
        let is_free = self.windows.delay < IDLE;
        let is_lossy = (self.windows.is_lossy() && is_free) || self.is_followed;
        let next = next.or_else(|| if is_lossy { self.reads.once_more() } else { None });
        if let Some((start, end)) = next {
            let _ = self.allowed(now, end - start + OVERHEAD);
            self.tally.reads += 1;
            return Step::send(self.ask(start, end));
        }
        Step::Wait(wake)
    }
}

impl<S: Sink> Conversation for LogGet<S> {
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
            } else if self.is_pausing {
                self.over = Some(Err(LogProtocolError::Paused));
            } else if now >= heard + self.patience {
                let seconds = self.patience / S;
                self.over = Some(Err(LogProtocolError::Silent { seconds }));
            }
        }
        let Some(result) = &self.over else {
            self.look_at_link();
            let step = self.next(now, heard + self.patience);
            self.tell_link();
            return step;
        };
        // It has no answer, and frees the vehicle for others: said twice.
        self.ends_said += 1;
        if self.ends_said <= ENDS {
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
