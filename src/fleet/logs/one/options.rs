//! Options for bringing a drone's logs home, and the outcome.

use std::path::PathBuf;

use crate::base::time::GpsTime;
use crate::fleet::logs::manifest::ManifestEntry;
use crate::link::clock::{Micros, S};

/// Choice among a drone's logs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Which {
    /// The log of the flight: of its start, if one was recorded; otherwise the newest, unless an
    /// older one is home.
    Flight,
    /// The newest log, of whatever flight.
    Newest,
    /// The log of this number on the drone.
    Number(u32),
    /// All logs; the newest becomes the slot's log, older ones go to `older/`.
    All,
}

/// Options for bringing the logs of a drone home.
#[derive(Clone, Debug)]
pub struct OneOptions {
    /// Choice among the drone's logs.
    pub which: Which,
    /// Time without an answer after which a drone is given up, us.
    pub patience: Micros,
    /// Time after which a drone that was never heard is given up, us.
    pub wait: Micros,
    /// Size above which a log is refused, bytes.
    pub most_size: u64,
    /// Folders of logs, as autopilots name them; the first that exists is used.
    pub folders: Vec<String>,
    /// Whether a log that is at home is brought again.
    pub again: bool,
    /// Whether to wait for the disk, so that a power loss loses little; needless for logs that can
    /// be downloaded again at any time.
    pub is_durable: bool,
    /// First number of the requests, which differs from run to run.
    pub start_number: u32,
    /// Time of the run for the manifest, Unix, s.
    pub unix_s: u64,
    /// Starts of the campaign's other flights (name and GPS time of show time 0): if no start of
    /// this flight was recorded, a log of one of them is not this flight's.
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

/// Reason why a drone's log is not home.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Failure {
    /// Description of the problem.
    pub reason: String,
    /// Remedy, for the crew.
    pub advice: &'static str,
    /// Number of bytes that came and are kept for the next run.
    pub kept_bytes: u64,
}

/// Outcome of bringing a drone's logs home.
#[derive(Clone, Debug, Default)]
pub struct OneDone {
    /// Logs brought home now.
    pub pulled: Vec<ManifestEntry>,
    /// Names of the logs that were already there.
    pub there: Vec<String>,
    /// Reason why the logs there could not be compared with what the drone has now, if they could
    /// not.
    pub unchecked: Option<String>,
    /// Logs of earlier flights that were at home, each with its new path.
    pub moved: Vec<PathBuf>,
    /// Number of the drone's newest log, if it is newer than the one of this flight.
    pub newer: Option<u32>,
    /// Reason why logs are missing, if they are.
    pub failure: Option<Failure>,
}
