//! Choice of a flight's logs: those of real drones in `logs/`, or those of a simulation in
//! `simulated/`.
//!
//! They never share a folder, so that practice cannot stand in the field's place, nor the other way
//! round. Campaigns of older versions kept simulated logs in `logs/`, with their record: they are
//! still found there.

use std::fs;
use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{CampaignError, FlightFolder, FlightRecord, read_json};

/// Name of a simulation's record in a folder of logs.
const RECORD_FILE: &str = "flight.json";

/// Where logs come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LogOrigin {
    /// From drones in the field.
    Real,
    /// From the simulator, by itself or behind virtual drones of one program.
    Simulated,
}

impl LogOrigin {
    /// Name of the origin for the sentence `Using the <words>`.
    pub fn words(self) -> &'static str {
        match self {
            Self::Real => "logs in logs/",
            Self::Simulated => "simulated logs (simulated/)",
        }
    }
}

/// Logs of a flight: their folder and their origin.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LogsAt {
    /// Folder of the logs, which need not exist yet.
    pub folder: PathBuf,
    /// Source of the logs: real drones, or a simulation.
    pub origin: LogOrigin,
}

impl LogsAt {
    /// Path of the log of a slot, among `count` slots.
    pub fn log(&self, slot: u16, count: usize) -> PathBuf {
        self.folder.join(super::numbered(slot, count, "BIN"))
    }

    /// Path of the record of how simulated logs were made.
    pub fn record(&self) -> PathBuf {
        self.folder.join(RECORD_FILE)
    }

    /// Reads the record of how simulated logs were made, if there is one.
    ///
    /// # Errors
    /// When the record cannot be read.
    pub fn read_record(&self) -> Result<Option<FlightRecord>, CampaignError> {
        let path = self.record();
        if path.exists() { read_json(&path).map(Some) } else { Ok(None) }
    }
}

impl FlightFolder {
    /// Path of the folder of simulated logs.
    pub fn simulated(&self) -> PathBuf {
        self.0.join("simulated")
    }

    /// Path of the simulated log of a slot, among `count` slots.
    pub fn simulated_log(&self, slot: u16, count: usize) -> PathBuf {
        self.simulated().join(super::numbered(slot, count, "BIN"))
    }

    /// Path of the record of how the flight's simulated logs were made.
    pub fn record(&self) -> PathBuf {
        self.simulated().join(RECORD_FILE)
    }

    /// Reads the record of how the flight's simulated logs were made, if there is one.
    ///
    /// # Errors
    /// When the record cannot be read.
    pub fn read_record(&self) -> Result<Option<FlightRecord>, CampaignError> {
        self.simulated_at().read_record()
    }

    /// Logs that a simulation writes.
    pub fn simulated_at(&self) -> LogsAt {
        LogsAt { folder: self.simulated(), origin: LogOrigin::Simulated }
    }

    /// Logs of one origin.
    pub fn logs_of(&self, origin: LogOrigin) -> LogsAt {
        let old = LogsAt { folder: self.logs(), origin };
        match origin {
            LogOrigin::Real => old,
            LogOrigin::Simulated if self.simulated().is_dir() => self.simulated_at(),
            LogOrigin::Simulated if self.holds_simulated() => old,
            LogOrigin::Simulated => self.simulated_at(),
        }
    }

    /// Whether there are logs of real drones.
    pub fn has_real_logs(&self) -> bool {
        has_logs(&self.logs()) && !self.holds_simulated()
    }

    /// Whether there are simulated logs.
    pub fn has_simulated_logs(&self) -> bool {
        has_logs(&self.simulated()) || self.holds_simulated()
    }

    /// Whether `logs/` holds what an older version simulated: most of the logs are as large as their
    /// record says. A record that was left behind beside the logs of real drones does not count.
    fn holds_simulated(&self) -> bool {
        let old = LogsAt { folder: self.logs(), origin: LogOrigin::Simulated };
        let Ok(Some(record)) = old.read_record() else { return false };
        let logs = logs_in(&old.folder);
        let size = |path: &Path| fs::metadata(path).map(|about| about.len()).ok();
        let held = record.logs.iter().filter(|log| {
            let path = old.folder.join(&log.file);
            size(&path) == Some(log.bytes)
        });
        2 * held.count() >= logs.len().max(1)
    }
}

/// Logs that are meant where the user does not choose: those of real drones, if any flight has
/// some. A practice flight never stands in for a flight in the field.
pub fn default_of(flights: &[FlightFolder]) -> LogOrigin {
    let is_real = flights.iter().any(FlightFolder::has_real_logs);
    let is_simulated = flights.iter().any(FlightFolder::has_simulated_logs);
    if is_simulated && !is_real { LogOrigin::Simulated } else { LogOrigin::Real }
}

/// Whether a folder in a folder of logs holds what is not of this flight, by its name.
pub fn is_set_aside(name: &str) -> bool {
    name == "older" || name.starts_with("flight-")
}

fn has_logs(folder: &Path) -> bool {
    let Ok(entries) = fs::read_dir(folder) else { return false };
    let mut entries = entries.flatten().map(|entry| entry.path());
    entries.any(|path| {
        let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        is_log(&path) || (path.is_dir() && !is_set_aside(name) && !logs_in(&path).is_empty())
    })
}

/// Paths of the logs in a folder, without those in its subfolders; empty if it cannot be read.
pub fn logs_in(folder: &Path) -> Vec<PathBuf> {
    let Ok(entries) = fs::read_dir(folder) else { return Vec::new() };
    entries.flatten().map(|entry| entry.path()).filter(|path| is_log(path)).collect()
}

fn is_log(path: &Path) -> bool {
    let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
    let is_bin = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("bin"));
    is_bin && !name.starts_with('.') && path.is_file()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::time::GpsTime;
    use crate::campaign::{FLIGHT_SCHEMA, LogRecord, to_json};

    fn flight(temporary: &tempfile::TempDir, name: &str) -> FlightFolder {
        FlightFolder(temporary.path().join(name))
    }

    fn put(path: &Path, bytes: &[u8]) {
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, bytes).unwrap();
    }

    fn old_record(folder: &FlightFolder, bytes: u64) {
        let log = LogRecord { slot: 1, file: "01.BIN".to_owned(), bytes, crc32: None };
        let record = FlightRecord {
            schema: FLIGHT_SCHEMA.to_owned(),
            made_by: "updraft".to_owned(),
            source: "simulator".to_owned(),
            seed: 1,
            vehicle: "pixel".to_owned(),
            vehicle_sha256: String::new(),
            air_mps: [0.0; 3],
            air_files: Vec::new(),
            start: GpsTime { week: 2445, tow_ms: 0 },
            air: Vec::new(),
            full_logs: false,
            plan_sha256: String::new(),
            logs: vec![log],
        };
        put(&folder.logs().join(RECORD_FILE), &to_json(&record).unwrap());
    }

    #[test]
    fn practice_never_fills_in_for_the_field() {
        let temporary = tempfile::tempdir().unwrap();
        let (first, second) = (flight(&temporary, "calibration"), flight(&temporary, "hover"));
        let flights = [first.clone(), second.clone()];
        assert_eq!(default_of(&flights), LogOrigin::Real, "nothing was flown");
        put(&first.simulated_log(1, 4), b"x");
        put(&second.simulated_log(1, 4), b"x");
        assert_eq!(default_of(&flights), LogOrigin::Simulated);
        put(&first.log(1, 4), b"x");
        assert_eq!(default_of(&flights), LogOrigin::Real, "one flight of the field is enough");
        assert_eq!(second.logs_of(LogOrigin::Real).folder, second.logs());
    }

    #[test]
    fn logs_that_were_set_aside_are_no_flight() {
        let temporary = tempfile::tempdir().unwrap();
        let folder = flight(&temporary, "hover");
        put(&folder.logs().join("flight-1/01.BIN"), b"x");
        put(&folder.logs().join("older/01-damaged-1.BIN"), b"x");
        assert!(!folder.has_real_logs());
        put(&folder.logs().join("drone 7/01.BIN"), b"x");
        assert!(folder.has_real_logs(), "a folder for each drone, as cards are copied");
    }

    #[test]
    fn simulated_logs_of_older_versions_are_found_and_a_record_left_behind_is_not_believed() {
        let temporary = tempfile::tempdir().unwrap();
        let folder = flight(&temporary, "hover");
        put(&folder.log(1, 4), b"four");
        old_record(&folder, 4);
        assert!(folder.has_simulated_logs() && !folder.has_real_logs());
        assert_eq!(folder.logs_of(LogOrigin::Simulated).folder, folder.logs());
        // A real drone's log lies in its place.
        put(&folder.log(1, 4), b"a log of the field");
        assert!(folder.has_real_logs() && !folder.has_simulated_logs());
        assert_eq!(folder.logs_of(LogOrigin::Simulated).folder, folder.simulated());
    }
}
