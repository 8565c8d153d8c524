//! `.skyc`: the compiled show, a ZIP of JSON files with the trajectories and lights of all drones.
//!
//! [`write()`] makes what every reader accepts: straight lines and cubic curves, `takeoffTime` 0,
//! times on whole milliseconds, three-element points. [`read`] takes everything the format allows and
//! refuses, naming entry, drone and point, what the official loader refuses or what cannot be flown.

mod documents;
mod read;
mod trajectory;
mod write;

use thiserror::Error;

pub use read::{read, read_with};
pub use write::{drone_documents, write};

/// Most drones the official loader takes.
pub use crate::MAX_DRONES;
/// Largest coordinate that is accepted, m.
pub const MAX_COORDINATE_M: f64 = 1e5;
/// Longest show that is accepted, s.
pub const MAX_TIME_S: f64 = 86_400.0;

/// Resources that a reader spends at most on a file, which may be hostile.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Entries in the archive.
    pub entries: usize,
    /// Size of one entry when unpacked, bytes.
    pub entry_bytes: u64,
    /// Size of all entries that are used, when unpacked, bytes.
    pub total_bytes: u64,
    /// Largest compression ratio of entries above 1 MiB.
    pub ratio: u64,
    /// JSON values in one entry.
    pub values: usize,
    /// Nesting of JSON arrays and objects.
    pub depth: usize,
    /// Trajectory points of all drones together.
    pub points: usize,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            entries: 65_536,
            entry_bytes: 64 << 20,
            total_bytes: 512 << 20,
            ratio: 200,
            values: 8_000_000,
            depth: 64,
            points: 10_000_000,
        }
    }
}

/// Error of writing or reading a `.skyc` file.
#[derive(Debug, Error)]
pub enum SkycError {
    /// The archive itself is unusable.
    #[error("not a usable show archive (ZIP): {problem}")]
    Archive {
        /// Description of the problem with the archive.
        problem: String,
    },
    /// An entry of the archive is unusable.
    #[error("{entry}: {problem}")]
    Entry {
        /// Name of the entry in the archive.
        entry: String,
        /// Description of the problem with the entry.
        problem: String,
    },
    /// The file would take too much memory.
    #[error("the file unpacks to more than the {limit} {unit} allowed here; it may be a ZIP bomb")]
    Bomb {
        /// The limit that was exceeded, in `unit`s.
        limit: u64,
        /// Unit of the limit, in the plural.
        unit: &'static str,
    },
    /// The show as a whole is not valid.
    #[error("{entry}: {place}: {problem}")]
    Show {
        /// Name of the entry with the problem.
        entry: String,
        /// Key or path in the JSON.
        place: String,
        /// Description of the problem at that place.
        problem: String,
    },
    /// A drone of the show is not valid.
    #[error("drone {number} ({name}), {entry}: {place}{problem}")]
    Drone {
        /// Number of the drone, from 1.
        number: usize,
        /// Label of the drone.
        name: String,
        /// Name of the entry with the problem.
        entry: String,
        /// Key or point, with a colon and a space after it; empty if the problem says it.
        place: String,
        /// Description of the problem with the drone.
        problem: String,
    },
    /// The show has no representation in the format.
    #[error("cannot write {what}: {problem}")]
    Unwritable {
        /// Subject that the format cannot hold: the show, or a drone by its label.
        what: String,
        /// Reason why it cannot be written, and the remedy.
        problem: String,
    },
}
