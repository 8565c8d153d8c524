//! Conversation that lists the logs of a drone.

use std::collections::BTreeMap;

use super::{LogProtocolError, list_message, says_armed};
use crate::link::clock::{MS, Micros, S};
use crate::link::conversation::{Conversation, Progress, Step};
use crate::link::frame::MavMessage;
use crate::link::id::DroneId;
use crate::rtt::Rtt;

/// Entries that may be late are waited for so long.
const QUIET: Micros = 700 * MS;
/// Where answers come fast.
const LEAST_QUIET: Micros = 200 * MS;

/// A log in a drone's list.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Entry {
    /// Number of the log, from 1; the last is the newest.
    pub id: u16,
    /// Size when it was listed, bytes.
    pub size: u64,
    /// Time at which the log was begun, Unix, s; 0 if the vehicle did not know.
    pub time_utc_s: u32,
}

/// Conversation that lists the logs; entries that were lost are asked for again, by their numbers.
#[derive(Clone, Debug)]
pub struct LogList {
    drone: DroneId,
    patience: Micros,
    /// Number of the only log to list, if not all.
    only: Option<u16>,
    /// How many logs there are, once an entry has said so.
    count: Option<u16>,
    entries: BTreeMap<u16, Entry>,
    asked: Option<Micros>,
    quiet: Micros,
    pause: Micros,
    heard: Option<Micros>,
    armed: bool,
}

impl LogList {
    /// Lists all logs of `drone`. Gives up after `patience` without an answer, us.
    pub fn new(drone: DroneId, patience: Micros) -> Self {
        Self {
            drone,
            patience,
            only: None,
            count: None,
            entries: BTreeMap::new(),
            asked: None,
            quiet: QUIET,
            pause: QUIET,
            heard: None,
            armed: false,
        }
    }

    /// Lists only log `id` of `drone`, if it has that.
    pub fn only(drone: DroneId, id: u16, patience: Micros) -> Self {
        Self { only: Some(id), ..Self::new(drone, patience) }
    }

    /// Sets the estimate of the time to an answer, from other conversations with the vehicle.
    #[must_use]
    pub fn with_rtt(mut self, rtt: Rtt) -> Self {
        if rtt.is_known() {
            self.quiet = (2 * rtt.timeout()).clamp(LEAST_QUIET, QUIET);
            self.pause = self.quiet;
        }
        self
    }

    /// The first run of numbers without an entry.
    fn missing(&self) -> Option<(u16, u16)> {
        if let Some(id) = self.only {
            let is_there = self.count.is_none_or(|count| id <= count);
            return (is_there && !self.entries.contains_key(&id)).then_some((id, id));
        }
        let Some(count) = self.count else { return Some((0, u16::MAX)) };
        let first = (1..=count).find(|id| !self.entries.contains_key(id))?;
        let last = (first..=count).take_while(|id| !self.entries.contains_key(id)).last();
        Some((first, last.unwrap_or(first)))
    }
}

impl Conversation for LogList {
    type Done = Result<Vec<Entry>, LogProtocolError>;

    fn on_message(&mut self, now: Micros, message: &MavMessage) {
        if says_armed(message) && self.asked.is_some() {
            self.armed = true;
        }
        let MavMessage::LOG_ENTRY(entry) = message else { return };
        if self.asked.is_none() || entry.id > entry.num_logs {
            return;
        }
        self.heard = Some(now);
        self.pause = self.quiet;
        self.count = Some(entry.num_logs);
        if entry.id > 0 {
            let listed =
                Entry { id: entry.id, size: entry.size.into(), time_utc_s: entry.time_utc };
            self.entries.insert(entry.id, listed);
        }
    }

    fn poll(&mut self, now: Micros) -> Step<Self::Done> {
        if self.armed {
            return Step::Done(Err(LogProtocolError::Armed));
        }
        let Some((first, last)) = self.missing() else {
            return Step::Done(Ok(self.entries.values().copied().collect()));
        };
        let heard = *self.heard.get_or_insert(now);
        if now >= heard + self.patience {
            return Step::Done(Err(LogProtocolError::Silent { seconds: self.patience / S }));
        }
        let quiet_since = self.asked.map(|asked| asked.max(heard));
        match quiet_since {
            Some(since) if now < since + self.pause => Step::Wait(since + self.pause),
            _ => {
                if self.asked.is_some() {
                    self.pause = (self.pause * 3 / 2).min(4 * S);
                }
                self.asked = Some(now);
                Step::send(list_message(self.drone, first, last))
            }
        }
    }

    fn progress(&self) -> Progress {
        Progress {
            done: self.entries.len() as u64,
            total: u64::from(self.count.unwrap_or_default()),
        }
    }
}
