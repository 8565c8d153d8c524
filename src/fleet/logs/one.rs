//! Retrieval of one drone's logs: list, download, compare, rename.

mod bring;
mod choose;
mod flight;
mod home;
mod options;
mod prove;
mod settle;
mod ways;

use std::cell::RefCell;
use std::rc::Rc;

use self::flight::Retired;
use self::home::Begun;
pub use self::options::{Failure, OneDone, OneOptions, Which};
use self::ways::{Trial, Ways};
use super::manifest::{AtHome, LogFlight, Shelf};
use super::part::{PartFile, Sample, Sums};
use crate::fleet::budget::Budget;
use crate::fleet::ftp::Caller;
use crate::fleet::ftp::get::{Get, Tally};
use crate::fleet::ftp::list::List;
use crate::fleet::ftp::sum::Sum;
use crate::fleet::load::LinkLoad;
use crate::fleet::log_protocol::end_message;
use crate::fleet::log_protocol::get::LogGet;
use crate::fleet::log_protocol::list::LogList;
use crate::link::clock::{Micros, S};
use crate::link::conversation::{Conversation, Progress, Step};
use crate::link::frame::{MavMessage, dialect};
use crate::link::id::DroneId;

/// MAVFTP is given up for the log messages when a drone that is heard does not answer for so
/// long.
const FTP_PATIENCE: Micros = 12 * S;
/// A drone whose last heartbeat is older is not heard.
const HEARD: Micros = 4 * S;
/// A checksum that differs is asked for again so often, at the size that the log has then.
const MOST_ROUNDS: u32 = 3;
/// A log that turns out to be another is begun anew so often.
const MOST_RESTARTS: u32 = 3;
/// Pieces that are compared when there is no checksum, and the bytes of each.
const SAMPLES: u64 = 8;
const SAMPLE_BYTES: u64 = 90;

/// One log to bring.
#[derive(Clone, Debug)]
struct Target {
    file: String,
    /// Number of the log: of the file's name, or the id.
    number: u32,
    /// Its path, or `log N`.
    source: String,
    size: u64,
}

/// Sans-IO state machine that brings one drone's logs home.
#[derive(Debug)]
pub struct PullOne {
    drone: DroneId,
    slot: u16,
    /// The slot's file name.
    file: String,
    options: OneOptions,
    budget: Option<Budget>,
    shelf: Rc<RefCell<Shelf>>,
    caller: Caller,
    stage: Stage,
    folder: usize,
    targets: Vec<Target>,
    target: Option<Target>,
    size: u64,
    /// Since when the log on the drone has this size, as far as is known.
    sized: Micros,
    /// When it was found growing first.
    grows: Option<Micros>,
    /// Reason why only the beginning of the log comes.
    incomplete: Option<String>,
    /// The flight whose log is wanted, if a start was written down.
    flight: Option<LogFlight>,
    /// State of the slot's file at home, before the download.
    home: AtHome,
    /// Log at home that is of an earlier flight.
    retired: Option<Retired>,
    /// Reason why a log that came is not the wanted one.
    not_it: Option<String>,
    /// The drone has more of it.
    is_outgrown: bool,
    /// Beginning of the target's download.
    begun: Begun,
    rounds: u32,
    restarts: u32,
    attempts: u32,
    /// Reason why MAVFTP is not used.
    reason: Option<String>,
    heartbeat: Option<Micros>,
    started: Option<Micros>,
    now: Micros,
    tally: Tally,
    done: OneDone,
    held: u64,
    /// Numbers of the oldest and of the newest file on the drone.
    oldest: Option<u32>,
    newest: Option<u32>,
    /// The two ways to the target's bytes.
    ways: Ways,
    /// Other drones use the link as well.
    is_shared: bool,
    /// Load of the link that all downloads share.
    load: Option<LinkLoad>,
    /// The drone is freed of a log that it sends, so often yet.
    frees: u8,
}

#[derive(Debug)]
enum Stage {
    Start,
    List(List),
    /// A part of an earlier run: is it of the same file?
    Probe(Box<Get<Sample>>, PartFile),
    Get(Box<Get<PartFile>>),
    /// The log's end, by MAVFTP, to see how fast that is; its number for the log messages.
    Try(Box<Trial>),
    /// Its number, if that comes later.
    Number(LogList, PartFile),
    /// Whether what has that number ends as the file does.
    IsIt(Box<LogGet<Sample>>, PartFile),
    /// All bytes came: will its size stay?
    Settle(PartFile),
    Relist(List, PartFile),
    LogRelist(LogList, PartFile),
    Sum(Sum, PartFile, Sums),
    Sample(Box<Get<Sample>>, PartFile, Sums),
    LogList(LogList),
    LogProbe(Box<LogGet<Sample>>, PartFile),
    LogGet(Box<LogGet<PartFile>>),
    LogSample(Box<LogGet<Sample>>, PartFile, Sums),
    Over,
}

/// Result of a stage: a step of the link, or the end of the stage and the next one.
enum Next {
    Step(Step<OneDone>),
    Go(Box<Stage>),
}

impl PullOne {
    /// Prepares to bring logs of `drone` into the shelf's file `file`.
    pub fn new(
        drone: DroneId,
        slot: u16,
        file: &str,
        shelf: Rc<RefCell<Shelf>>,
        options: OneOptions,
        budget: Option<Budget>,
    ) -> Self {
        let number = options.start_number ^ (u32::from(drone.system) << 20);
        Self {
            drone,
            slot,
            file: file.to_owned(),
            budget,
            shelf,
            caller: Caller::new(drone, number),
            stage: Stage::Start,
            folder: 0,
            targets: Vec::new(),
            target: None,
            size: 0,
            sized: 0,
            grows: None,
            incomplete: None,
            flight: None,
            home: AtHome::Nothing,
            retired: None,
            not_it: None,
            is_outgrown: false,
            begun: Begun::Empty,
            rounds: 0,
            restarts: 0,
            attempts: 0,
            reason: None,
            heartbeat: None,
            started: None,
            now: 0,
            tally: Tally::default(),
            done: OneDone::default(),
            held: 0,
            oldest: None,
            newest: None,
            ways: Ways::default(),
            is_shared: false,
            load: None,
            frees: 0,
            options,
        }
    }

    /// Restricts the retrieval to the log of this flight.
    #[must_use]
    pub fn of_flight(self, flight: Option<LogFlight>) -> Self {
        Self { flight, ..self }
    }

    /// Tells the retrieval the load of its link.
    #[must_use]
    pub fn on_link(self, load: &LinkLoad) -> Self {
        Self { load: Some(load.clone()), ..self }
    }

    /// Number of new bytes so far.
    pub fn new_bytes(&self) -> u64 {
        let now = match &self.stage {
            Stage::Get(get) => get.tally().new_bytes,
            Stage::LogGet(get) => get.tally().new_bytes,
            Stage::Try(trial) => trial.get.tally().new_bytes,
            _ => 0,
        };
        self.tally.new_bytes + now
    }

    /// Logs that are home count as well.
    fn with_finished(&self, of_target: Progress) -> Progress {
        let finished: u64 = self.done.pulled.iter().map(|entry| entry.size_bytes).sum();
        let Progress { done, total } = of_target;
        Progress { done: done + finished, total: total + finished }
    }

    /// Time at which the drone last sent anything of use, us.
    pub fn heard(&self) -> Option<Micros> {
        let now = match &self.stage {
            Stage::Get(get) => get.heard(),
            Stage::LogGet(get) => get.heard(),
            Stage::Try(trial) => trial.get.heard(),
            _ => None,
        };
        now.max(self.heartbeat)
    }

    /// Whether it only waits, and needs nothing of its link.
    pub fn is_idle(&self) -> bool {
        matches!(self.stage, Stage::Settle(_))
    }

    /// Sets whether other drones use the link as well.
    pub fn share(&mut self, is_shared: bool) {
        self.is_shared = is_shared;
    }

    /// Message that ends a log transfer in the drone, if one may be running: a drone that sends a
    /// log does not arm.
    pub fn farewell(&self) -> Option<MavMessage> {
        let sends = matches!(
            self.stage,
            Stage::LogGet(_)
                | Stage::IsIt(..)
                | Stage::Try(_)
                | Stage::LogProbe(..)
                | Stage::LogSample(..)
                | Stage::Number(..)
                | Stage::LogList(_)
                | Stage::LogRelist(..)
        );
        sends.then(|| end_message(self.drone))
    }

    fn fail(&mut self, reason: String, advice: &'static str) -> Stage {
        if self.is_excused() {
            self.leave(self.file.clone(), Some(reason));
            return Stage::Over;
        }
        self.fail_for_sure(reason, advice)
    }

    fn fail_for_sure(&mut self, reason: String, advice: &'static str) -> Stage {
        let kept_bytes = self.held;
        self.done.failure.get_or_insert(Failure { reason, advice, kept_bytes });
        Stage::Over
    }

    fn fail_silent(&mut self, reason: String) -> Stage {
        self.fail(
            reason,
            "switch it on and bring it within reach, then run again; or import its card",
        )
    }

    /// Whether its heartbeats come.
    fn is_heard(&self) -> bool {
        self.heartbeat.is_some_and(|at| self.now < at + HEARD)
    }

    fn list(&self, patience: Micros) -> Option<List> {
        let folder = self.options.folders.get(self.folder)?;
        Some(List::new(self.caller.another(), folder, patience))
    }

    /// By the log messages instead.
    fn fall_back(&mut self, reason: String) -> Stage {
        if self.reason.is_some() {
            return self.fail(reason, "run again; or import its card");
        }
        self.reason = Some(reason);
        self.targets.clear();
        self.target = None;
        Stage::LogList(LogList::new(self.drone, self.options.patience))
    }

    fn start(&mut self) -> Stage {
        self.home = self.shelf.borrow().at_home(&self.file);
        if let Err(reason) = self.make_room() {
            return self
                .fail_for_sure(reason, "make the folder writable, or make room, and run again");
        }
        if self.home == AtHome::Foreign && !self.options.again {
            return self.fail(
                format!("{} exists, but is not in the manifest", self.file),
                "move the file away, or replace it by downloading the log again (--again)",
            );
        }
        match self.list(FTP_PATIENCE) {
            Some(list) => Stage::List(list),
            None => self.fall_back("no folder to look into".to_owned()),
        }
    }

    fn advance(&mut self, now: Micros, stage: Stage) -> (Stage, Next) {
        macro_rules! advance {
            ($step:ident, $done:pat => $next:expr, $stage:expr) => {
                match $step.poll(now) {
                    Step::Send(message) => ($stage, Next::Step(Step::Send(message))),
                    Step::Wait(until) => ($stage, Next::Step(Step::Wait(until))),
                    Step::Done($done) => (Stage::Over, Next::Go(Box::new($next))),
                }
            };
        }
        match stage {
            Stage::Start => (Stage::Over, Next::Go(Box::new(self.start()))),
            Stage::List(mut list) => {
                advance!(list, done => self.on_list(done), Stage::List(list))
            }
            Stage::Probe(mut get, part) => {
                advance!(get, got => self.on_probed(part, &got.sink, got.result), Stage::Probe(get, part))
            }
            Stage::Get(mut get) => advance!(get, got => self.on_got(got), Stage::Get(get)),
            Stage::Try(mut trial) => {
                advance!(trial, (got, listed) => self.on_tried(got, listed), Stage::Try(trial))
            }
            Stage::Number(mut list, part) => {
                advance!(list, done => self.on_numbered(part, done), Stage::Number(list, part))
            }
            Stage::IsIt(mut get, part) => {
                advance!(get, got => self.on_is_it(part, &got), Stage::IsIt(get, part))
            }
            Stage::Settle(part) => match self.settles() {
                Some(until) => (Stage::Settle(part), Next::Step(Step::Wait(until))),
                None => (Stage::Over, Next::Go(Box::new(self.relist(part)))),
            },
            Stage::LogRelist(mut list, part) => {
                advance!(list, done => self.on_log_relisted(part, done), Stage::LogRelist(list, part))
            }
            Stage::Relist(mut list, part) => {
                advance!(list, done => self.on_relisted(part, done), Stage::Relist(list, part))
            }
            Stage::Sum(mut sum, part, sums) => {
                advance!(sum, done => self.on_summed(part, sums, done), Stage::Sum(sum, part, sums))
            }
            Stage::Sample(mut get, part, sums) => advance!(
                get,
                got => match got.result {
                    Ok(_) => self.on_sampled(part, sums, got.sink.differs),
                    Err(error) => self.on_ftp_failed(part, error),
                },
                Stage::Sample(get, part, sums)
            ),
            Stage::LogList(mut list) => {
                advance!(list, done => self.on_log_list(done), Stage::LogList(list))
            }
            Stage::LogProbe(mut get, part) => advance!(
                get,
                got => match got.result {
                    _ if got.sink.differs => self.on_another(part),
                    Ok(_) => self.begin(part, false),
                    Err(error) => self.on_log_failed(part, &error),
                },
                Stage::LogProbe(get, part)
            ),
            Stage::LogGet(mut get) => {
                advance!(get, got => self.on_log_got(got), Stage::LogGet(get))
            }
            Stage::LogSample(mut get, part, sums) => advance!(
                get,
                got => match got.result {
                    Ok(_) => self.on_sampled(part, sums, got.sink.differs),
                    Err(error) => self.on_log_failed(part, &error),
                },
                Stage::LogSample(get, part, sums)
            ),
            Stage::Over => (Stage::Over, Next::Step(Step::Done(std::mem::take(&mut self.done)))),
        }
    }
}

impl Conversation for PullOne {
    type Done = OneDone;

    fn on_message(&mut self, now: Micros, message: &MavMessage) {
        if let MavMessage::HEARTBEAT(beat) = message {
            self.heartbeat = Some(now);
            let armed = dialect::MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED;
            if beat.base_mode.contains(armed) && !matches!(self.stage, Stage::Over) {
                // A link is not loaded while anything flies on it.
                // The open log grows, and its checksum is right for a moment only.
                self.frees = if self.farewell().is_some() { 2 } else { 0 };
                self.stage = self.fail_for_sure(
                    "the drone is armed and gives no logs until it has landed".to_owned(),
                    "then run again",
                );
            }
            return;
        }
        match &mut self.stage {
            Stage::List(conversation) | Stage::Relist(conversation, _) => {
                conversation.on_message(now, message);
            }
            Stage::Probe(conversation, _) | Stage::Sample(conversation, ..) => {
                conversation.on_message(now, message);
            }
            Stage::Get(conversation) => conversation.on_message(now, message),
            Stage::Try(conversation) => conversation.on_message(now, message),
            Stage::Number(conversation, _) => conversation.on_message(now, message),
            Stage::IsIt(conversation, _) => conversation.on_message(now, message),
            Stage::Sum(conversation, ..) => conversation.on_message(now, message),
            Stage::LogList(conversation) | Stage::LogRelist(conversation, _) => {
                conversation.on_message(now, message);
            }
            Stage::LogProbe(conversation, _) | Stage::LogSample(conversation, ..) => {
                conversation.on_message(now, message);
            }
            Stage::LogGet(conversation) => conversation.on_message(now, message),
            Stage::Start | Stage::Settle(_) | Stage::Over => {}
        }
    }

    fn poll(&mut self, now: Micros) -> Step<Self::Done> {
        self.started.get_or_insert(now);
        self.now = now;
        if self.frees > 0 {
            self.frees -= 1;
            return Step::send(end_message(self.drone));
        }
        self.watch_ways(now);
        loop {
            let stage = std::mem::replace(&mut self.stage, Stage::Over);
            let (stage, next) = self.advance(now, stage);
            match next {
                Next::Step(step) => {
                    self.stage = stage;
                    return step;
                }
                Next::Go(stage) => self.stage = *stage,
            }
        }
    }

    fn progress(&self) -> Progress {
        match &self.stage {
            Stage::Get(get) => self.with_finished(get.progress()),
            Stage::LogGet(get) => self.with_finished(get.progress()),
            Stage::Try(trial) => {
                let done = self.held + trial.get.tally().new_bytes;
                self.with_finished(Progress { done, total: self.size })
            }
            _ => self.with_finished(Progress { done: self.held, total: self.size }),
        }
    }
}
