//! `logs/start.json`: the identity of the flight whose logs lie, or will lie, beside it.
//!
//! It is written when a start is authorized, so that a log that comes later, from a drone, a server or
//! a card, can be held against it: a log belongs to the flight that was flown, not to a folder.
//! The record of the start before it moves to that start's own folder, `logs/flight-K/`, and so do its
//! logs when they would stand in the way.

use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{CampaignError, FlightFolder, read_json, to_json};
use crate::base::file::{FileError, create_folder, write_whole};
use crate::base::plain::plain;
use crate::base::time::GpsTime;

/// Name and version of the format.
pub const START_SCHEMA: &str = "updraft.start/2";
/// The version before: only flights by streaming had a record, and of those only the time.
const FIRST_SCHEMA: &str = "updraft.start/1";
/// Name of the start record's file in a folder of logs.
pub const START_FILE: &str = "start.json";
/// Beginning of the names of folders with the logs of earlier starts.
const EARLIER: &str = "flight-";

/// How a flight was flown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Flying {
    /// By the show firmware, from a file on each drone.
    Show,
    /// By targets that the station streamed; stock firmware logs no show time.
    #[default]
    Guided,
    /// By the show firmware, started through Skybrush Server.
    SkybrushServer,
}

/// A drone of a start.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StartedDrone {
    /// Its slot of the plan.
    pub slot: u16,
    /// The drone: system id, network:system, or Skybrush Server's name of it.
    pub drone: String,
    /// Checksum of the show that it was given, as ArduPilot computes it; absent: it has no file, or one
    /// that Skybrush Server made of our show, with bytes of its own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub show_crc32: Option<u32>,
    /// When it was switched on, by its own clock; absent: it has not said so.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub booted: Option<GpsTime>,
}

/// The latest authorized start of a flight.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StartRecord {
    /// Format name and version: `updraft.start/2`.
    pub schema: String,
    /// Program and version.
    pub made_by: String,
    /// GPS time of show time 0 of the latest flight, by the drones' clocks.
    pub start: GpsTime,
    /// Which start of this folder it is: 1, 2, ...
    #[serde(default = "first")]
    pub number: u32,
    /// When it was authorized, Unix seconds; 0: not known.
    #[serde(default)]
    pub authorized_unix_s: u64,
    /// How it was flown.
    #[serde(default)]
    pub flying: Flying,
    /// The drones, in slot order.
    #[serde(default)]
    pub drones: Vec<StartedDrone>,
}

fn first() -> u32 {
    1
}

impl StartRecord {
    /// The record of a start; its number is given when it is written.
    pub fn new(
        made_by: String,
        start: GpsTime,
        authorized_unix_s: u64,
        flying: Flying,
        mut drones: Vec<StartedDrone>,
    ) -> Self {
        drones.sort_by_key(|drone| drone.slot);
        let schema = START_SCHEMA.to_owned();
        Self { schema, made_by, start, number: first(), authorized_unix_s, flying, drones }
    }

    /// Path of the start record of a flight, in its folder of logs.
    pub fn path(folder: &FlightFolder) -> PathBuf {
        folder.logs().join(START_FILE)
    }

    /// Drone that flew a slot in this start, if one did.
    pub fn drone(&self, slot: u16) -> Option<&StartedDrone> {
        self.drones.iter().find(|drone| drone.slot == slot)
    }

    /// Makes this the flight's latest start: gives it the next number, puts the record of the start
    /// before it into that one's folder, and writes it.
    ///
    /// # Errors
    /// When the folder cannot be read or written, or the record there cannot be read.
    pub fn begin(mut self, folder: &FlightFolder) -> Result<Self, CampaignError> {
        let logs = folder.logs();
        create_folder(&logs)?;
        let before = Self::read(folder)?;
        let taken = before.as_ref().map_or(0, |before| before.number).max(last_number(&logs)?);
        self.number = taken.saturating_add(1);
        if let Some(before) = before {
            let earlier = earlier_folder(&logs, before.number);
            create_folder(&earlier)?;
            let kept = free_name(&earlier, "start", "json");
            fs::rename(Self::path(folder), &kept)
                .map_err(|error| FileError::new("move aside", &Self::path(folder), error))?;
        }
        let path = Self::path(folder);
        let json = to_json(&self).map_err(|error| FileError::new("write", &path, error))?;
        write_whole(&path, &json)?;
        Ok(self)
    }

    /// Withdraws this start, as nobody took off; the start before it is the latest again.
    ///
    /// # Errors
    /// When the folder cannot be read or written.
    pub fn withdraw(&self, folder: &FlightFolder) -> Result<(), CampaignError> {
        let path = Self::path(folder);
        if Self::read(folder)?.as_ref() != Some(self) {
            return Ok(());
        }
        let before = earlier_starts(&folder.logs())?.into_iter().next_back();
        match before {
            Some((_, before)) => fs::rename(&before, &path),
            None => fs::remove_file(&path),
        }
        .map_err(|error| FileError::new("take back", &path, error).into())
    }

    /// Reads the start record of a flight's folder; `None` if there is none.
    ///
    /// # Errors
    /// When it cannot be read, or is none of this version.
    pub fn read(folder: &FlightFolder) -> Result<Option<Self>, CampaignError> {
        Self::read_from(&Self::path(folder))
    }

    /// Reads the start record of a folder of logs; `None` if there is none.
    ///
    /// # Errors
    /// When it cannot be read, or is none of this version.
    pub fn read_in(logs: &Path) -> Result<Option<Self>, CampaignError> {
        Self::read_from(&logs.join(START_FILE))
    }

    fn read_from(path: &Path) -> Result<Option<Self>, CampaignError> {
        if !path.exists() {
            return Ok(None);
        }
        let record: Self = read_json(path).map_err(|error: CampaignError| {
            error.with_remedy(
                "repair it, or move it away; without it the start of this flight is \
                              unknown",
            )
        })?;
        if ![START_SCHEMA, FIRST_SCHEMA].contains(&record.schema.as_str()) {
            let reason =
                format!("this program reads \"{START_SCHEMA}\", not \"{}\"", record.schema);
            return Err(CampaignError::Json { path: path.to_owned(), reason });
        }
        Ok(Some(record))
    }
}

/// Recorded starts of a campaign's other flights, including earlier ones: name of the flight and
/// GPS time of show time 0. Unreadable records are left out.
pub fn other_starts(folder: &FlightFolder) -> Vec<(String, GpsTime)> {
    let siblings = folder.0.parent().filter(|parent| super::index_path(parent).is_file());
    let flights = siblings.and_then(|parent| super::flights(parent).ok()).unwrap_or_default();
    let mut found = Vec::new();
    for flight in flights.iter().filter(|flight| flight.0 != folder.0) {
        let name = flight.0.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let logs = flight.logs();
        let earlier = earlier_folders(&logs).unwrap_or_default().into_iter();
        for logs in earlier.map(|(_, folder)| folder).chain([logs]) {
            if let Ok(Some(record)) = StartRecord::read_in(&logs) {
                found.push((plain(&name).into_owned(), record.start));
            }
        }
    }
    found
}

/// Path of the folder that holds the logs of start `number` once a later start exists.
pub fn earlier_folder(logs: &Path, number: u32) -> PathBuf {
    logs.join(format!("{EARLIER}{number}"))
}

/// Folders of earlier starts below a folder of logs, in the order of their numbers.
///
/// # Errors
/// When the folder cannot be read; one that is not there has none.
pub fn earlier_folders(logs: &Path) -> Result<Vec<(u32, PathBuf)>, FileError> {
    let fail = |error| FileError::new("read", logs, error);
    let entries = match fs::read_dir(logs) {
        Ok(entries) => entries,
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(Vec::new()),
        Err(error) => return Err(fail(error)),
    };
    let mut found = Vec::new();
    for entry in entries {
        let entry = entry.map_err(fail)?;
        let name = entry.file_name();
        let number = name.to_str().and_then(|name| name.strip_prefix(EARLIER)?.parse().ok());
        if let Some(number) = number.filter(|_| entry.path().is_dir()) {
            found.push((number, entry.path()));
        }
    }
    found.sort();
    Ok(found)
}

fn last_number(logs: &Path) -> Result<u32, FileError> {
    Ok(earlier_folders(logs)?.last().map_or(0, |(number, _)| *number))
}

/// The records of earlier starts, in the order of their numbers.
fn earlier_starts(logs: &Path) -> Result<Vec<(u32, PathBuf)>, FileError> {
    let folders = earlier_folders(logs)?.into_iter();
    let starts = folders.map(|(number, folder)| (number, folder.join(START_FILE)));
    Ok(starts.filter(|(_, path)| path.is_file()).collect())
}

/// First free path of `stem.extension`, `stem-2.extension` and so on in a folder.
pub fn free_name(folder: &Path, stem: &str, extension: &str) -> PathBuf {
    let name = |number: u32| match number {
        1 => folder.join(format!("{stem}.{extension}")),
        number => folder.join(format!("{stem}-{number}.{extension}")),
    };
    let mut number = 1;
    while name(number).symlink_metadata().is_ok() && number < u32::MAX {
        number += 1;
    }
    name(number)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder() -> (tempfile::TempDir, FlightFolder) {
        let temporary = tempfile::tempdir().unwrap();
        let folder = FlightFolder(temporary.path().to_owned());
        (temporary, folder)
    }

    fn record(tow_ms: u32) -> StartRecord {
        let start = GpsTime { week: 2445, tow_ms };
        let drone =
            StartedDrone { slot: 1, drone: "1".to_owned(), show_crc32: Some(7), booted: None };
        StartRecord::new("updraft".to_owned(), start, 1_795_000_000, Flying::Show, vec![drone])
    }

    #[test]
    fn a_start_is_found_again_and_one_of_another_version_is_refused() {
        let (_temporary, folder) = folder();
        assert_eq!(StartRecord::read(&folder).unwrap(), None);
        let written = record(100_000).begin(&folder).unwrap();
        assert_eq!(written.number, 1);
        assert_eq!(StartRecord::read(&folder).unwrap(), Some(written.clone()));
        let newer = StartRecord { schema: "updraft.start/3".to_owned(), ..written };
        fs::write(StartRecord::path(&folder), to_json(&newer).unwrap()).unwrap();
        let error = StartRecord::read(&folder).unwrap_err().to_string();
        let wanted = "this program reads \"updraft.start/2\", not \"updraft.start/3\"";
        assert!(error.ends_with(wanted), "{error}");
    }

    #[test]
    fn the_record_of_the_version_before_is_still_read() {
        let (_temporary, folder) = folder();
        let text = r#"{"schema": "updraft.start/1", "made_by": "updraft 0.1.0",
            "start": {"week": 2445, "tow_ms": 100000}}"#;
        create_folder(&folder.logs()).unwrap();
        fs::write(StartRecord::path(&folder), text).unwrap();
        let read = StartRecord::read(&folder).unwrap().unwrap();
        assert_eq!((read.number, read.flying), (1, Flying::Guided));
        // It counts as the first.
        assert_eq!(record(200_000).begin(&folder).unwrap().number, 2);
        assert!(folder.logs().join("flight-1/start.json").is_file());
    }

    #[test]
    fn every_start_has_a_number_of_its_own_and_one_that_is_taken_back_leaves_the_one_before() {
        let (_temporary, folder) = folder();
        let first = record(100_000).begin(&folder).unwrap();
        let second = record(200_000).begin(&folder).unwrap();
        let third = record(300_000).begin(&folder).unwrap();
        assert_eq!([first.number, second.number, third.number], [1, 2, 3]);
        // A record that is not the latest any more is not taken back.
        second.withdraw(&folder).unwrap();
        assert_eq!(StartRecord::read(&folder).unwrap(), Some(third.clone()));
        third.withdraw(&folder).unwrap();
        assert_eq!(StartRecord::read(&folder).unwrap(), Some(second.clone()));
        second.withdraw(&folder).unwrap();
        assert_eq!(StartRecord::read(&folder).unwrap(), Some(first.clone()));
        first.withdraw(&folder).unwrap();
        assert_eq!(StartRecord::read(&folder).unwrap(), None);
        assert_eq!(record(400_000).begin(&folder).unwrap().number, 3, "folders keep their numbers");
    }

    #[test]
    fn a_name_that_is_taken_is_never_given_again() {
        let (_temporary, folder) = folder();
        let at = &folder.0;
        assert_eq!(free_name(at, "07", "BIN"), at.join("07.BIN"));
        fs::write(at.join("07.BIN"), "x").unwrap();
        assert_eq!(free_name(at, "07", "BIN"), at.join("07-2.BIN"));
    }
}
