//! Two ways to a log's bytes: MAVFTP, whose checksum proves a log, and the log messages, which most
//! firmware sends far faster. Which one is faster here is measured: the log's last packets come by
//! MAVFTP, then the log messages go on, and whichever is slower than the other was gives way.
//!
//! Numbers of files and of the log messages differ: these count from the oldest log on the drone.
//! So a number is taken for the file's only if its size fits and if the file's end, which MAVFTP
//! has brought, is its end; the checksum over the whole then has the last word.

use super::{PullOne, SAMPLE_BYTES, Stage};
use crate::fleet::ftp::FtpError;
use crate::fleet::ftp::get::{Get, GetOptions, Got, Tally};
use crate::fleet::intervals::Intervals;
use crate::fleet::log_protocol::LogProtocolError;
use crate::fleet::log_protocol::get::{LogGet, LogGot};
use crate::fleet::log_protocol::list::{Entry, LogList};
use crate::fleet::logs::part::{PartFile, Sample};
use crate::fleet::sink::Sink;
use crate::link::clock::{MS, Micros, S};
use crate::link::conversation::{Conversation, Step};
use crate::link::frame::MavMessage;
use crate::protocol::ftp::MOST_DATA;

/// Less is brought by MAVFTP before the choice is made.
const WORTH_A_CHOICE: u64 = 32 << 10;
/// The end of the log that MAVFTP brings to show its speed, bytes.
const TRIAL: u64 = 12 * 239;
/// It takes no longer than this, if anything has come.
const MOST_TRIAL: Micros = 500 * MS;
/// So much of the speed that it shows is counted on: so few packets do not tell what is lost, and
/// arrive unevenly.
const TRUSTED: f64 = 0.75;
/// A log that is still written may have grown by so much from one list to the other, bytes.
const MAY_GROW: u64 = 4 << 20;
/// One way must be slower than the other by this much to give way.
const WORTH_A_SWITCH: f64 = 0.8;
/// A way is looked at over so long.
const LOOK: Micros = 1_500 * MS;
/// Not in its beginning, when what is asked for grows.
const WARMS: Micros = 2 * S;
/// And goes on for so long at least; each change doubles it.
const LEAST_LEG: Micros = 1_500 * MS;
const MOST_LEG: Micros = 60 * S;
/// A drone that sends nothing by the log messages for so long is asked by MAVFTP.
pub(super) const MUTE: Micros = 6 * S;

/// What is known of the two ways.
#[derive(Debug)]
pub(super) struct Ways {
    /// MAVFTP has shown its speed, or the log is too short.
    is_tried: bool,
    /// Number of the target for the log messages, once its end has shown that it is.
    pub(super) id: Option<u16>,
    candidate: Option<u16>,
    /// All numbers were asked for.
    has_all: bool,
    /// Bytes per second of data.
    ftp_per_s: f64,
    logs_per_s: f64,
    /// Since when the present way is used.
    leg_since: Option<Micros>,
    /// When it was looked at last, and the bytes then.
    looked: Option<(Micros, u64)>,
    least_leg: Micros,
    /// The log messages brought some of it.
    pub(super) is_mixed: bool,
}

impl Default for Ways {
    fn default() -> Self {
        Self {
            is_tried: false,
            id: None,
            candidate: None,
            has_all: false,
            ftp_per_s: 0.0,
            logs_per_s: 0.0,
            leg_since: None,
            looked: None,
            least_leg: LEAST_LEG,
            is_mixed: false,
        }
    }
}

impl Ways {
    fn begin_leg(&mut self, now: Micros) {
        self.leg_since = Some(now);
        self.looked = None;
    }

    /// Bytes per second since the last look, if it is time for one.
    fn look(&mut self, now: Micros, bytes: u64) -> Option<f64> {
        if now < self.leg_since? + WARMS {
            return None;
        }
        let (since, before) = *self.looked.get_or_insert((now, bytes));
        if now < since + LOOK {
            return None;
        }
        self.looked = Some((now, bytes));
        Some(bytes.saturating_sub(before) as f64 / ((now - since) as f64 / 1e6))
    }

    fn may_change(&self, now: Micros) -> bool {
        self.leg_since.is_some_and(|since| now >= since + self.least_leg)
    }

    fn changed(&mut self) {
        self.least_leg = (2 * self.least_leg).min(MOST_LEG);
        self.leg_since = None;
    }
}

/// The end of a log, as if the rest were there.
#[derive(Debug)]
pub(super) struct Tail {
    part: PartFile,
    have: Intervals,
}

impl Tail {
    fn new(part: PartFile, from: u64) -> Self {
        let mut have = part.have().clone();
        have.insert(0, from);
        Self { part, have }
    }
}

impl Sink for Tail {
    fn have(&self) -> &Intervals {
        &self.have
    }

    fn put(&mut self, now: Micros, offset: u64, data: &[u8]) -> Result<u64, String> {
        self.have.insert(offset, offset + data.len() as u64);
        self.part.put(now, offset, data)
    }
}

/// What both ways are asked for at the same time, to choose between them.
#[derive(Debug)]
pub(super) struct Trial {
    /// The log's end by MAVFTP.
    pub(super) get: Get<Tail>,
    /// Its number for the log messages.
    list: LogList,
    listed: Option<Result<Vec<Entry>, LogProtocolError>>,
    since: Option<Micros>,
}

impl Trial {
    /// Ends when the speed is known; where too much is lost to tell it, with a piece of the end.
    fn judge(&mut self, now: Micros) {
        let tally = self.get.tally();
        let is_enough = now >= *self.since.get_or_insert(now) + MOST_TRIAL;
        if tally.burst_bytes_per_s > 0.0 || (is_enough && tally.new_bytes > 0) {
            self.get.pause();
        }
    }
}

impl Conversation for Trial {
    /// The list, if that is not over.
    type Done = (Got<Tail>, Result<Result<Vec<Entry>, LogProtocolError>, LogList>);

    fn on_message(&mut self, now: Micros, message: &MavMessage) {
        self.get.on_message(now, message);
        self.list.on_message(now, message);
    }

    fn poll(&mut self, now: Micros) -> Step<Self::Done> {
        let mut wake = Micros::MAX;
        if self.listed.is_none() {
            match self.list.poll(now) {
                Step::Send(message) => return Step::Send(message),
                Step::Wait(until) => wake = until,
                Step::Done(listed) => self.listed = Some(listed),
            }
        }
        match self.get.poll(now) {
            Step::Send(message) => Step::Send(message),
            Step::Wait(until) => Step::Wait(until.min(wake)),
            Step::Done(got) => {
                Step::Done((got, self.listed.take().ok_or_else(|| self.list.clone())))
            }
        }
    }
}

impl PullOne {
    /// Brings what the part lacks in the way that is faster as far as is known.
    pub(super) fn bring(&mut self, part: PartFile) -> Stage {
        let Some(target) = self.target.clone() else { return Stage::Over };
        if self.reason.is_some() {
            return Stage::LogGet(Box::new(self.log_get(part)));
        }
        let lacks = self.size.saturating_sub(part.have().total());
        if !self.ways.is_tried && lacks >= WORTH_A_CHOICE && target.number > 0 {
            self.ways.is_tried = true;
            // Where others use the link as well a speed would tell nothing; a piece is needed.
            let trial = if self.is_shared { MOST_DATA as u64 } else { TRIAL };
            let tail = Tail::new(part, self.size - trial);
            let options = GetOptions { is_left: true, ..self.get_sample() };
            let get = Get::new(self.caller.another(), &target.source, tail, options);
            // As firmware counts: from the oldest that is there.
            let id = (target.number + 1).saturating_sub(self.oldest.unwrap_or(target.number));
            let id = u16::try_from(id).unwrap_or(u16::MAX);
            self.ways.candidate = Some(id);
            let list = LogList::only(self.drone, id, MUTE).with_rtt(self.caller.rtt());
            return Stage::Try(Box::new(Trial { get, list, listed: None, since: None }));
        }
        if self.ways.id.is_some() && self.ways.logs_per_s >= self.ways.ftp_per_s {
            self.ways.is_mixed = true;
            return Stage::LogGet(Box::new(self.log_get(part)));
        }
        let get = Get::new(self.caller.another(), &target.source, part, self.get());
        Stage::Get(Box::new(get))
    }

    /// How fast bursts come by MAVFTP, for the next download.
    fn learn(&mut self, tally: &Tally) {
        self.tally.new_bytes += tally.new_bytes;
        if tally.burst_bytes_per_s > 0.0 {
            self.ways.ftp_per_s = tally.burst_bytes_per_s;
        }
    }

    /// Time between two packets by MAVFTP, us.
    pub(super) fn spacing(&self) -> Option<f64> {
        (self.ways.ftp_per_s > 0.0).then(|| 239e6 / self.ways.ftp_per_s)
    }

    pub(super) fn on_tried(
        &mut self,
        got: Got<Tail>,
        listed: Result<Result<Vec<Entry>, LogProtocolError>, LogList>,
    ) -> Stage {
        self.learn(&got.tally);
        self.ways.ftp_per_s *= TRUSTED;
        let part = got.sink.part;
        match got.result {
            Ok(_) | Err(FtpError::Paused) => match listed {
                Ok(listed) => self.on_numbered(part, listed),
                Err(list) => Stage::Number(list, part),
            },
            Err(error) => self.on_ftp_failed(part, error),
        }
    }

    /// Whether an entry can be the target.
    fn fits(&self, entry: &Entry) -> bool {
        let is_newest = self.newest == self.target.as_ref().map(|target| target.number);
        let may_grow = if is_newest { MAY_GROW } else { 0 };
        (self.size..=self.size + may_grow).contains(&entry.size)
    }

    pub(super) fn on_numbered(
        &mut self,
        mut part: PartFile,
        outcome: Result<Vec<Entry>, LogProtocolError>,
    ) -> Stage {
        let Ok(entries) = outcome else { return self.bring(part) };
        let fitting: Vec<u16> =
            entries.iter().filter(|entry| self.fits(entry)).map(|entry| entry.id).collect();
        let id = match fitting.as_slice() {
            [id] => *id,
            [] if !self.ways.has_all => {
                self.ways.has_all = true;
                return Stage::Number(LogList::new(self.drone, MUTE), part);
            }
            _ => return self.bring(part),
        };
        self.ways.candidate = Some(id);
        let (start, end) = part.have().iter().last().unwrap_or_default();
        let end = (end.saturating_sub(SAMPLE_BYTES).max(start), end);
        let sample = part.flush().and_then(|()| Sample::new(part.path(), self.size, &[end]));
        match sample {
            Err(error) => self.fail(error.to_string(), "run again"),
            Ok(sample) => {
                let get = LogGet::new(self.drone, id, self.size, sample, MUTE);
                let get = get.with_budget(self.budget.clone()).with_rtt(self.caller.rtt());
                let get = get.on_link(self.load.as_ref()).followed();
                Stage::IsIt(Box::new(get), part)
            }
        }
    }

    pub(super) fn on_is_it(&mut self, part: PartFile, got: &LogGot<Sample>) -> Stage {
        if got.result.is_ok() && !got.sink.differs {
            self.ways.id = self.ways.candidate;
            // Unknown as yet: it is tried.
            self.ways.logs_per_s = f64::MAX;
        }
        self.bring(part)
    }

    /// The log messages are no way to this log any more.
    pub(super) fn close_log_messages(&mut self) {
        self.ways.id = None;
    }

    /// Looks at how fast the present way is.
    pub(super) fn watch_ways(&mut self, now: Micros) {
        let bytes = self.new_bytes();
        let is_shared = self.is_shared;
        let by_logs = match &mut self.stage {
            // Its speed is all that was wanted.
            Stage::Try(trial) => return trial.judge(now),
            Stage::LogGet(_) if self.reason.is_some() => return,
            Stage::LogGet(_) => true,
            Stage::Get(_) if self.ways.id.is_some() => false,
            _ => return,
        };
        if self.ways.leg_since.is_none() {
            return self.ways.begin_leg(now);
        }
        let Some(rate) = self.ways.look(now, bytes) else { return };
        let (own, other) = if by_logs {
            (&mut self.ways.logs_per_s, self.ways.ftp_per_s)
        } else {
            (&mut self.ways.ftp_per_s, self.ways.logs_per_s)
        };
        // One look may fall into a pause.
        *own = if *own == f64::MAX { rate } else { f64::midpoint(*own, rate) };
        let rate = *own;
        // Where other drones share the link each way has but its share of that, and what a way was
        // when the link was empty says nothing.
        if !is_shared && rate < WORTH_A_SWITCH * other && self.ways.may_change(now) {
            self.ways.changed();
            match &mut self.stage {
                Stage::Get(get) => get.pause(),
                Stage::LogGet(get) => get.pause(),
                _ => {}
            }
        }
    }
}
