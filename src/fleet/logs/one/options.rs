//! What is wanted of a drone's logs, and what became of them.

use std::path::PathBuf;

use crate::base::time::GpsTime;
use crate::fleet::logs::manifest::ManifestEntry;
use crate::link::clock::{Micros, S};

/// Which of a drone's logs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Which {
    /// The one of the flight: of its start, if one was written down; else the newest, unless an
    /// older one is home.
    Flight,
    /// The newest, whatever it is of.
    Newest,
    /// The one of this number.
    Number(u32),
    /// All; the newest becomes the slot's log, the others go to `older/`.
    All,
}

/// How logs are brought home.
#[derive(Clone, Debug)]
pub struct OneOptions {
    /// Which of a drone's logs.
    pub which: Which,
    /// A drone is given up after so long without an answer.
    pub patience: Micros,
    /// A drone that was never heard is given up after so long.
    pub wait: Micros,
    /// Larger logs are refused, bytes.
    pub most_size: u64,
    /// Folders of logs, as autopilots name them; the first that is there is taken.
    pub folders: Vec<String>,
    /// Brings a log again that is there.
    pub again: bool,
    /// Waits for the disk, so that a power loss loses little; needless for logs that can be had
    /// again at any time.
    pub is_durable: bool,
    /// Differs from run to run.
    pub start_number: u32,
    /// For the manifest, Unix seconds.
    pub unix_s: u64,
    /// Starts of the campaign's other flights: where no start of this one was written down, a log of
    /// one of them is not this one's.
    pub other_starts: Vec<(String, GpsTime)>,
}

impl Default for OneOptions {
    fn default() -> Self {
        Self {
            which: Which::Flight,
            patience: 60 * S,
            wait: 60 * S,
            most_size: 2 << 30,
            folders: vec!["/APM/LOGS".to_owned(), "logs".to_owned()],
            again: false,
            is_durable: true,
            start_number: 0,
            unix_s: 0,
            other_starts: Vec::new(),
        }
    }
}

/// Why a drone's log is not home.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Failure {
    /// What went wrong.
    pub reason: String,
    /// What to do.
    pub advice: &'static str,
    /// Bytes that came and are kept for the next run.
    pub kept_bytes: u64,
}

/// What became of a drone's logs.
#[derive(Clone, Debug, Default)]
pub struct OneDone {
    /// Brought home now.
    pub pulled: Vec<ManifestEntry>,
    /// There already: file names.
    pub there: Vec<String>,
    /// Why what is there could not be compared with what the drone has now.
    pub unchecked: Option<String>,
    /// Logs of earlier flights that were at home, where they lie now.
    pub moved: Vec<PathBuf>,
    /// Number of the drone's newest log, where that is newer than the one of this flight.
    pub newer: Option<u32>,
    /// Why not all.
    pub failure: Option<Failure>,
}
