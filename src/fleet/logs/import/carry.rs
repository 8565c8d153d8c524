//! Copying of the logs that were decided on. Nothing at home is overwritten: logs of another start
//! go to `flight-K/`, replaced ones to `older/`.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use super::survey::begins_with;
use super::{CardLog, Decision, ImportFlight, Survey, Take};
use crate::base::file::{FileError, create_folder, write_with};
use crate::base::plain::Shown as _;
use crate::base::time::GpsTime;
use crate::campaign::CampaignError;
use crate::campaign::start::{StartRecord, earlier_folders};
use crate::fleet::logs::manifest::{AtHome, LogFlight, ManifestEntry, Method, Shelf, Verified};
use crate::fleet::logs::part::{Sums, sums};
use crate::flight::{Belongs, Identity};

/// Options for carrying logs home.
#[derive(Clone, Debug)]
pub struct Carry {
    /// Whether logs replace those of the same start that are already at home.
    pub again: bool,
    /// Program and version, for the manifest.
    pub made_by: String,
    /// Time of the import for the manifest, Unix, s.
    pub unix_s: u64,
}

/// Outcome for a log that was to be taken.
#[derive(Clone, Debug, PartialEq)]
pub enum Carried {
    /// The log is home now, with the new place of a log of another start that lay there before.
    Taken(Box<ManifestEntry>, Option<PathBuf>),
    /// The log was home before, with a reason to think that it does not hold all of its flight.
    There(Option<String>),
    /// The log is not home, for this reason.
    Left(String),
}

/// Outcome of carrying out a decision.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CarriedOut {
    /// Outcome of each log that was to be taken.
    pub outcomes: Vec<(Take, Carried)>,
    /// Slots that have no log now, by flight.
    pub missing: Vec<BTreeSet<u16>>,
}

/// Copies the logs of a decision into the flights' folders.
///
/// # Errors
/// When a folder's manifest cannot be read or written. What a card does not give up is an outcome.
pub fn carry_out(
    decision: &Decision,
    survey: &Survey,
    flights: &[ImportFlight],
    how: &Carry,
) -> Result<CarriedOut, CampaignError> {
    let mut outcomes = Vec::new();
    let mut missing = Vec::new();
    for (index, flight) in flights.iter().enumerate() {
        if !flight.is_wanted {
            missing.push(BTreeSet::new());
            continue;
        }
        let takes: Vec<&Take> = decision.take.iter().filter(|take| take.flight == index).collect();
        if !takes.is_empty() {
            create_folder(&flight.logs)?;
        }
        let mut shelf = Shelf::open(&flight.logs, &how.made_by)?;
        let start = decision.starts.get(index).copied().flatten().map(|(start, _)| start);
        let earlier = earlier_starts(&flight.logs)?;
        let mut home = Home { shelf: &mut shelf, flight, start, earlier, how };
        for take in takes {
            let Some(log) = survey.logs.get(take.log) else { continue };
            outcomes.push((*take, home.bring(take.slot, log)?));
        }
        shelf.settle();
        let has = |slot: u16| {
            let path = flight.files.get(&slot).map(|file| flight.logs.join(file));
            path.is_some_and(|path| path.exists())
        };
        let slots = flight.plan.slots.iter().map(|slot| slot.slot);
        missing.push(slots.filter(|slot| !has(*slot)).collect());
    }
    Ok(CarriedOut { outcomes, missing })
}

/// The starts before the latest one, by their numbers.
fn earlier_starts(logs: &Path) -> Result<Vec<(u32, GpsTime)>, CampaignError> {
    let mut starts = Vec::new();
    for (number, folder) in earlier_folders(logs)? {
        if let Some(record) = StartRecord::read_in(&folder)? {
            starts.push((number, record.start));
        }
    }
    Ok(starts)
}

struct Home<'a> {
    shelf: &'a mut Shelf,
    flight: &'a ImportFlight,
    start: Option<GpsTime>,
    earlier: Vec<(u32, GpsTime)>,
    how: &'a Carry,
}

impl Home<'_> {
    fn bring(&mut self, slot: u16, log: &CardLog) -> Result<Carried, CampaignError> {
        let Some(file) = self.flight.files.get(&slot).cloned() else {
            return Ok(Carried::Left(format!("the plan has no slot {slot}")));
        };
        let moved = match self.make_room(&file, log)? {
            Room::Free(moved) => moved,
            Room::There => return Ok(Carried::There(log.identity.incomplete())),
            Room::Kept(why) => return Ok(Carried::Left(why)),
        };
        let sums = match copy(&log.path, &self.shelf.path(&file)) {
            Ok(sums) => sums,
            Err(error) => return Ok(Carried::Left(format!("{error}: {}", error.source))),
        };
        let entry = ManifestEntry {
            file,
            slot,
            drone: None,
            boot: number(&log.path),
            source: log.path.shown().to_string(),
            size_bytes: sums.size,
            sha256: sums.sha256,
            method: Method::Import,
            method_reason: None,
            verified: Verified::Copy,
            incomplete: log.identity.incomplete(),
            attempts: 1,
            at_unix_s: self.how.unix_s,
            flight: self.flight_of(slot, log),
        };
        self.shelf.add(entry.clone())?;
        Ok(Carried::Taken(Box::new(entry), moved))
    }

    /// The flight that a log is of, for the manifest.
    fn flight_of(&self, slot: u16, log: &CardLog) -> Option<LogFlight> {
        let start = self.start?;
        let record = self.flight.record.as_ref().filter(|record| record.start == start);
        Some(LogFlight {
            number: record.map_or(0, |record| record.number),
            authorized_start: record.map(|record| record.start),
            gps_start: log.identity.show_of(start).map(|show| show.start),
            booted: log.identity.boot_of(start).and_then(|boot| boot.booted),
            show_crc32: record.and_then(|record| record.drone(slot)?.show_crc32),
        })
    }

    /// What lies where a log is to lie makes room, unless it is the log.
    fn make_room(&mut self, file: &str, log: &CardLog) -> Result<Room, CampaignError> {
        let path = self.shelf.path(file);
        let at_home = self.shelf.at_home(file);
        match &at_home {
            AtHome::Nothing | AtHome::Gone(_) => return Ok(Room::Free(None)),
            AtHome::Damaged(_) => {
                self.shelf.set_aside(file, "damaged")?;
                return Ok(Room::Free(None));
            }
            AtHome::Foreign | AtHome::Intact(_) => {}
        }
        let size = fs::metadata(&path).map(|about| about.len());
        let size = size.map_err(|error| FileError::new("read", &path, error))?;
        let shorter = size.min(log.size_bytes);
        let is_same = begins_with(&log.path, &path, shorter).unwrap_or(false);
        if is_same && size >= log.size_bytes {
            return Ok(Room::There);
        }
        let Ok(identity) = Identity::open(&path) else {
            self.shelf.set_aside(file, "damaged")?;
            return Ok(Room::Free(None));
        };
        let belongs = self.start.map(|start| identity.belongs_to(start));
        match belongs {
            Some(Belongs::No(_)) => {
                let number = self.number_of(&identity, at_home.entry());
                Ok(Room::Free(self.shelf.retire(file, number)?))
            }
            _ if is_same => {
                self.shelf.set_aside(file, "shorter")?;
                Ok(Room::Free(None))
            }
            _ if self.how.again => {
                self.shelf.set_aside(file, "replaced")?;
                Ok(Room::Free(None))
            }
            Some(Belongs::Yes) => Ok(Room::Kept(format!(
                "{file} of the same start is already here (--again replaces it)"
            ))),
            Some(Belongs::Unknown(why)) => {
                Ok(Room::Kept(format!("{file} is already here: {why} (--again replaces it)")))
            }
            None => Ok(Room::Kept(format!("{file} is already here (--again replaces it)"))),
        }
    }

    /// The number of the start that a log at home is of; 0: none that was written down.
    fn number_of(&self, identity: &Identity, entry: Option<&ManifestEntry>) -> u32 {
        let latest = self.flight.record.as_ref().map(|record| record.number);
        let written = entry.and_then(|entry| entry.flight.as_ref()).map(|flight| flight.number);
        let is_of = |(_, start): &&(u32, GpsTime)| identity.belongs_to(*start) == Belongs::Yes;
        let found = self.earlier.iter().find(is_of).map(|(number, _)| *number);
        written.filter(|number| Some(*number) != latest).or(found).unwrap_or(0)
    }
}

enum Room {
    Free(Option<PathBuf>),
    There,
    Kept(String),
}

/// The number of a log in the name that the firmware gave it: `00000012.BIN`.
fn number(path: &Path) -> Option<u32> {
    let stem = path.file_stem()?.to_str()?;
    let is_number = stem.len() == 8 && stem.bytes().all(|byte| byte.is_ascii_digit());
    if is_number { stem.parse().ok() } else { None }
}

fn copy(from: &Path, to: &Path) -> Result<Sums, FileError> {
    let mut source = File::open(from).map_err(|error| FileError::new("open", from, error))?;
    write_with(to, |out| io::copy(&mut source, out).map(drop))?;
    let (right, found) = (sums(from)?, sums(to)?);
    if right == found {
        Ok(found)
    } else {
        let error = io::Error::other("the copy differs from the card: read the card again");
        Err(FileError::new("copy", from, error))
    }
}
