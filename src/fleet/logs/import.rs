//! Logs from cards: each log itself says which drone and which flight it is of.
//!
//! A card holds the logs of a day: both flights, what was aborted, last week's. [`survey`] reads what is
//! there, [`decide`] says which log is taken for which slot of which flight, and what is left and why,
//! and [`carry_out`] copies. Where two logs fit equally, or a log contradicts itself, nothing is chosen:
//! that is a [`Doubt`] for a person.

mod cards;
mod carry;
mod decide;
mod place;
mod survey;

use std::collections::BTreeMap;
use std::path::PathBuf;

use crate::base::time::GpsTime;
use crate::campaign::start::StartRecord;
use crate::flight::Identity;
use crate::mission::Plan;

pub use carry::{Carried, CarriedOut, Carry, carry_out};
pub use decide::decide;
pub use survey::survey;

/// A flight of the campaign, which logs may be of.
#[derive(Clone, Debug)]
pub struct ImportFlight {
    /// Short name of the flight.
    pub name: String,
    /// Plan of the flight.
    pub plan: Plan,
    /// Folder of the flight's logs.
    pub logs: PathBuf,
    /// Slot of each system id; if empty, the system id is the slot's number.
    pub slots: BTreeMap<u8, u16>,
    /// File name of each slot's log.
    pub files: BTreeMap<u16, String>,
    /// GPS time of show time 0, if it is known.
    pub start: Option<GpsTime>,
    /// Record that was written when the start was authorized, if there is one.
    pub record: Option<StartRecord>,
    /// Whether the flight's logs are imported; otherwise they are only recognised.
    pub is_wanted: bool,
}

/// A log on a card.
#[derive(Clone, Debug)]
pub struct CardLog {
    /// Path of the file.
    pub path: PathBuf,
    /// Size of the file, bytes.
    pub size_bytes: u64,
    /// Identity of the log: its drone, its boots and their shows.
    pub identity: Identity,
    /// Shows in the log that were flown, compared with the plans of flights without a known start.
    pub flown: Vec<Flown>,
    /// First of the logs with exactly the same bytes, by index, if this is a copy.
    pub copy_of: Option<usize>,
    /// A longer log that begins with this one, by index.
    pub beginning_of: Option<usize>,
}

/// A flight in a log.
#[derive(Clone, Debug, PartialEq)]
pub struct Flown {
    /// GPS time of show time 0; `None` if the log does not have it.
    pub start: Option<GpsTime>,
    /// Share of each flight's plan that was flown, 0 to 1; 0 where the slot is not known.
    pub shares: Vec<f64>,
}

/// Logs found on the cards, and everything else there.
#[derive(Clone, Debug, Default)]
pub struct Survey {
    /// Logs on the cards, by path.
    pub logs: Vec<CardLog>,
    /// Files that are not logs or cannot be read, each with the reason.
    pub unreadable: Vec<(PathBuf, String)>,
    /// Cards without a log, by path.
    pub empty: Vec<PathBuf>,
}

/// Answers of a person to the doubts.
#[derive(Clone, Debug, Default)]
pub struct Answers {
    /// GPS time of show time 0, by index of the flight.
    pub starts: BTreeMap<usize, GpsTime>,
    /// Index of the log of a slot, by indices of flight and slot; `None`: none of the logs.
    pub logs: BTreeMap<(usize, u16), Option<usize>>,
}

/// Source from which the start of a flight is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StartFrom {
    /// The start was recorded, or given, or answered.
    Known,
    /// This many drones flew the plan then, by their logs.
    Agreed(usize),
}

/// A log that is taken, with its flight and slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Take {
    /// Index of the flight.
    pub flight: usize,
    /// Number of the slot.
    pub slot: u16,
    /// Index of the log.
    pub log: usize,
}

/// Question that only a person can decide.
#[derive(Clone, Debug, PartialEq)]
pub enum Doubt {
    /// The plan was flown at several times, by equally many drones each.
    Start {
        /// Index of the flight.
        flight: usize,
        /// Possible starts, earliest first, each with the number of drones that flew it.
        starts: Vec<(GpsTime, usize)>,
    },
    /// Several logs fit a slot equally, or it is not known whether the only one does.
    Log {
        /// Index of the flight.
        flight: usize,
        /// Number of the slot.
        slot: u16,
        /// Indices of the logs.
        logs: Vec<usize>,
        /// Reason why none is taken, as a clause.
        why: String,
    },
    /// A log of the flight whose slot is not known.
    Slot {
        /// Index of the flight.
        flight: usize,
        /// Index of the log.
        log: usize,
        /// Reason why its slot is not known, as a clause.
        why: String,
    },
    /// A log that fits several flights equally.
    Flight {
        /// Index of the log.
        log: usize,
        /// Indices of the flights.
        flights: Vec<usize>,
    },
}

impl Doubt {
    /// Whether the question is about this flight.
    pub fn is_of(&self, number: usize) -> bool {
        match self {
            Self::Start { flight, .. } | Self::Log { flight, .. } | Self::Slot { flight, .. } => {
                *flight == number
            }
            Self::Flight { flights, .. } => flights.contains(&number),
        }
    }
}

/// Decision about the logs found: which are taken, which are left, and which need a person.
#[derive(Clone, Debug, Default)]
pub struct Decision {
    /// GPS time of show time 0 of each flight, and its source; `None`: no log on the cards flew it.
    pub starts: Vec<Option<(GpsTime, StartFrom)>>,
    /// Logs to take, by flight and slot.
    pub take: Vec<Take>,
    /// Logs to leave, by index, each with the reason.
    pub left: Vec<(usize, String)>,
    /// Questions that a person must decide.
    pub doubts: Vec<Doubt>,
}
