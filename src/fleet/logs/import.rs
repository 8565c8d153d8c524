//! Logs from cards: whose they are and which flight they are of, they say themselves.
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

/// A flight of the campaign.
#[derive(Clone, Debug)]
pub struct ImportFlight {
    /// Short name.
    pub name: String,
    /// What was to be flown.
    pub plan: Plan,
    /// Its folder of logs.
    pub logs: PathBuf,
    /// Slot of each system id; empty: the slot's number is the system id.
    pub slots: BTreeMap<u8, u16>,
    /// File name of each slot's log.
    pub files: BTreeMap<u16, String>,
    /// When it began, if that is known.
    pub start: Option<GpsTime>,
    /// What was written down when its start was authorized.
    pub record: Option<StartRecord>,
    /// Whether its logs are imported; those of others are only recognized.
    pub is_wanted: bool,
}

/// A log on a card.
#[derive(Clone, Debug)]
pub struct CardLog {
    /// The file.
    pub path: PathBuf,
    /// Its size, bytes.
    pub size_bytes: u64,
    /// What it says of itself.
    pub identity: Identity,
    /// The shows in it that were flown, held against the plans of flights without a known start.
    pub flown: Vec<Flown>,
    /// The first of the logs that has the very same bytes.
    pub copy_of: Option<usize>,
    /// A longer log that begins with it.
    pub beginning_of: Option<usize>,
}

/// A flight in a log.
#[derive(Clone, Debug, PartialEq)]
pub struct Flown {
    /// GPS time of show time 0; `None`: the log does not say.
    pub start: Option<GpsTime>,
    /// For each flight of the campaign, the share of its plan that was flown, 0..1; 0 where its slot is
    /// not known.
    pub shares: Vec<f64>,
}

/// What was found on the cards.
#[derive(Clone, Debug, Default)]
pub struct Survey {
    /// The logs, by path.
    pub logs: Vec<CardLog>,
    /// Files that are no logs or cannot be read, and why.
    pub unreadable: Vec<(PathBuf, String)>,
    /// Cards without a log.
    pub empty: Vec<PathBuf>,
}

/// What a person has answered to doubts.
#[derive(Clone, Debug, Default)]
pub struct Answers {
    /// By flight: when it began.
    pub starts: BTreeMap<usize, GpsTime>,
    /// By flight and slot: which log; `None`: none of them.
    pub logs: BTreeMap<(usize, u16), Option<usize>>,
}

/// How the start of a flight is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StartFrom {
    /// It was written down, or given, or answered.
    Known,
    /// So many drones flew the plan then, by their logs.
    Agreed(usize),
}

/// A log that is taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Take {
    /// The flight.
    pub flight: usize,
    /// The slot.
    pub slot: u16,
    /// The log.
    pub log: usize,
}

/// What cannot be decided without a person.
#[derive(Clone, Debug, PartialEq)]
pub enum Doubt {
    /// The plan was flown at several times, by equally many drones.
    Start {
        /// The flight.
        flight: usize,
        /// The starts, earliest first, each with the number of drones that flew it.
        starts: Vec<(GpsTime, usize)>,
    },
    /// Several logs fit one slot equally, or of the only one it is not known.
    Log {
        /// The flight.
        flight: usize,
        /// The slot.
        slot: u16,
        /// The logs.
        logs: Vec<usize>,
        /// Why none is taken, one clause.
        why: String,
    },
    /// A log of the flight whose slot is not known.
    Slot {
        /// The flight.
        flight: usize,
        /// The log.
        log: usize,
        /// Why, one clause.
        why: String,
    },
    /// A log that fits several flights equally.
    Flight {
        /// The log.
        log: usize,
        /// The flights.
        flights: Vec<usize>,
    },
}

impl Doubt {
    /// Whether it is about this flight.
    pub fn is_of(&self, number: usize) -> bool {
        match self {
            Self::Start { flight, .. } | Self::Log { flight, .. } | Self::Slot { flight, .. } => {
                *flight == number
            }
            Self::Flight { flights, .. } => flights.contains(&number),
        }
    }
}

/// What is to be done.
#[derive(Clone, Debug, Default)]
pub struct Decision {
    /// By flight: when it began, and how that is known; `None`: no log on the cards flew it.
    pub starts: Vec<Option<(GpsTime, StartFrom)>>,
    /// What is taken, by flight and slot.
    pub take: Vec<Take>,
    /// What is left, and why.
    pub left: Vec<(usize, String)>,
    /// What a person must decide.
    pub doubts: Vec<Doubt>,
}
