//! Retrieval of one drone's logs: listed, downloaded, listed again.

use std::path::PathBuf;

use super::Puller;
use crate::fleet::logs::manifest::{AtHome, LogFlight};
use crate::skybrush_server::refusal::Refusal;
use crate::skybrush_server::{
    Job, LogEntry, Outcome, fetch_log, list_logs, log_bytes, log_entries,
};

/// How often a log is asked for: it may still grow, and a drone may miss a word.
const TRIES: u32 = 3;

/// A log that is to come.
pub(super) struct Target {
    pub(super) file: String,
    pub(super) log: LogEntry,
    pub(super) tries: u32,
}

/// What the answer that is waited for tells.
enum Stage {
    /// What logs there are.
    Listing,
    /// The bytes of a log.
    Fetching,
    /// What size the log has that came.
    Checking(Vec<u8>),
}

/// A drone's logs.
pub(super) struct One {
    pub(super) slot: u16,
    /// Name of the flight's log's file.
    pub(super) file: String,
    /// The flight whose log is wanted, if a start was written down.
    pub(super) flight: Option<LogFlight>,
    /// What is at home of that file.
    pub(super) home: AtHome,
    stage: Stage,
    /// How often a list was asked for in vain.
    lists: u32,
    /// What is to come, the next last.
    pub(super) targets: Vec<Target>,
    pub(super) pulled: usize,
    pub(super) bytes: u64,
    /// Its newest log grew as long as it was waited for.
    pub(super) grows: bool,
    /// Number of the drone's newest log, where that is newer than the one of the flight.
    pub(super) newer: Option<u32>,
    /// Logs of earlier flights that were at home, where they lie now.
    pub(super) moved: Vec<PathBuf>,
    /// Why what is at home could not be compared with what the drone has.
    pub(super) unchecked: Option<String>,
    /// Why a log that came is not the one that is wanted.
    pub(super) not_it: Option<String>,
    pub(super) failure: Option<String>,
    pub(super) over: bool,
}

impl One {
    pub(super) fn new(slot: u16, file: String, flight: Option<LogFlight>) -> Self {
        Self {
            slot,
            file,
            flight,
            home: AtHome::Nothing,
            stage: Stage::Listing,
            lists: 0,
            targets: Vec::new(),
            pulled: 0,
            bytes: 0,
            grows: false,
            newer: None,
            moved: Vec::new(),
            unchecked: None,
            not_it: None,
            failure: None,
            over: false,
        }
    }

    pub(super) fn fail(&mut self, reason: impl Into<String>) -> Option<Job> {
        self.failure.get_or_insert(reason.into());
        self.over = true;
        None
    }

    /// Asks for the next log, if there is one to come.
    pub(super) fn next(&mut self, drone: &str) -> Option<Job> {
        let Some(target) = self.targets.pop() else {
            let reason = self.not_it.take()?;
            return self.fail(format!(
                "{reason}; it may be on its card: `updraft logs import`; or download another by \
                 its number (--log)"
            ));
        };
        Some(self.fetch(drone, target))
    }

    fn fetch(&mut self, drone: &str, mut target: Target) -> Job {
        target.tries += 1;
        let job = fetch_log(drone, &target.log.id);
        self.targets.push(target);
        self.stage = Stage::Fetching;
        job
    }

    fn check(&mut self, drone: &str, bytes: Vec<u8>) -> Job {
        self.stage = Stage::Checking(bytes);
        list_logs(drone)
    }
}

impl Puller<'_> {
    /// What to ask a drone next, after an answer.
    pub(super) fn after(&mut self, drone: &str, one: &mut One, outcome: Outcome) -> Option<Job> {
        match std::mem::replace(&mut one.stage, Stage::Listing) {
            Stage::Listing => match outcome.and_then(|value| log_entries(&value)) {
                Ok(logs) => {
                    one.lists = 0;
                    self.choose(drone, one, logs)
                }
                Err(reason) => {
                    one.lists += 1;
                    // A drone may have missed a word.
                    if one.lists < TRIES && !is_final(&reason) {
                        return Some(list_logs(drone));
                    }
                    self.not_listed(one, &advised(&reason))
                }
            },
            Stage::Fetching => {
                let target = one.targets.pop()?;
                match outcome.and_then(|value| log_bytes(&value)) {
                    Ok(bytes) => {
                        one.targets.push(target);
                        Some(one.check(drone, bytes))
                    }
                    Err(reason) if target.tries < TRIES && !is_final(&reason) => {
                        Some(one.fetch(drone, target))
                    }
                    Err(reason) => one.fail(advised(&reason)),
                }
            }
            Stage::Checking(bytes) => self.checked(drone, one, bytes, outcome),
        }
    }

    /// A log came, and was listed once more.
    fn checked(
        &mut self,
        drone: &str,
        one: &mut One,
        bytes: Vec<u8>,
        outcome: Outcome,
    ) -> Option<Job> {
        let mut target = one.targets.pop()?;
        let came = bytes.len() as u64;
        let logs = match outcome.and_then(|value| log_entries(&value)) {
            Ok(logs) => logs,
            Err(reason) => {
                one.lists += 1;
                if one.lists < TRIES && !is_final(&reason) {
                    one.targets.push(target);
                    return Some(one.check(drone, bytes));
                }
                let why = format!(
                    "its size could not be requested after the download: {}",
                    advised(&reason)
                );
                return self.keep_beginning(drone, one, &target, &bytes, &why);
            }
        };
        one.lists = 0;
        let Some(log) = logs.into_iter().find(|log| log.id == target.log.id) else {
            return one.fail(format!("the drone no longer has log {}", target.log.id));
        };
        target.log = log;
        if target.log.size == came && one.grows {
            let why = "it is still being written";
            return self.keep_beginning(drone, one, &target, &bytes, why);
        }
        if target.log.size == came {
            return self.accept(drone, one, &target, &bytes);
        }
        if target.tries < TRIES {
            return Some(one.fetch(drone, target));
        }
        let why = format!(
            "it was listed with {} bytes after {came} had arrived: it is still being written",
            target.log.size
        );
        self.keep_beginning(drone, one, &target, &bytes, &why)
    }
}

pub(super) fn number(log: &LogEntry) -> u32 {
    log.id.parse().unwrap_or(0)
}

/// Whether it is of no use to ask once more.
fn is_final(reason: &str) -> bool {
    matches!(Refusal::of(reason), Refusal::NoSuchDrone | Refusal::OtherDownload)
}

/// The server's words, with what to do where that is known.
fn advised(reason: &str) -> String {
    match Refusal::of(reason) {
        Refusal::OtherDownload => format!(
            "{reason} (by Skybrush Live, or a program that was killed): try again when it is over"
        ),
        Refusal::TimedOut => format!("{reason}: is it switched on and disarmed?"),
        Refusal::NoSuchDrone | Refusal::Other => reason.to_owned(),
    }
}
