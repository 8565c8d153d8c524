//! Flight that a log is of, by its own account of time, compared with the start that was
//! authorized. An intact log is not therefore the right one.

use std::path::{Path, PathBuf};

use super::home::Begun;
use super::{PullOne, Stage, Which};
use crate::base::time::GpsTime;
use crate::campaign::start::StartRecord;
use crate::fleet::logs::manifest::{AtHome, LogFlight, ManifestEntry};
use crate::fleet::logs::part::PartFile;
use crate::flight::identity::{Belongs, Identity};

/// What a log is to the flight that is wanted.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Found {
    /// Of this flight, or nobody asks.
    Ours,
    /// Of another one: why, and whether it began after the flight that is wanted.
    Others { why: String, is_later: bool },
    /// It does not say.
    Unknown(String),
}

/// A log that was at home and is of an earlier flight.
#[derive(Clone, Debug)]
pub(super) struct Retired {
    /// Where it lies now.
    pub(super) path: PathBuf,
    pub(super) entry: ManifestEntry,
}

impl PullOne {
    /// Holds a log file against the flight that is wanted; with what the manifest says of it.
    pub(super) fn judge(&self, path: &Path) -> (Found, Option<LogFlight>) {
        let wanted = self.flight.as_ref();
        let identity = match Identity::open(path) {
            Ok(identity) => identity,
            Err(error) => {
                let found = match wanted.and_then(|wanted| wanted.authorized_start) {
                    Some(_) => Found::Unknown(error.to_string()),
                    None => Found::Ours,
                };
                return (found, None);
            }
        };
        let Some((wanted, start)) = wanted.and_then(|of| Some((of, of.authorized_start?))) else {
            let of_none = LogFlight { number: 0, ..LogFlight::of(&identity, None) };
            let found = match identity.of_any(&self.options.other_starts) {
                // The one before it may be of this flight.
                Some(name) => Found::Others { why: format!("that of {name}"), is_later: true },
                None => Found::Ours,
            };
            return (found, Some(of_none));
        };
        let said = LogFlight::of(&identity, Some(start));
        match identity.belongs_to(start) {
            Belongs::Yes => {
                let (number, authorized_start) = (wanted.number, Some(start));
                let show_crc32 = wanted.show_crc32;
                (Found::Ours, Some(LogFlight { number, authorized_start, show_crc32, ..said }))
            }
            Belongs::No(why) => {
                let is_later = identity.span().is_some_and(|(first, _)| first > start);
                (Found::Others { why, is_later }, Some(LogFlight { number: 0, ..said }))
            }
            Belongs::Unknown(why) => (Found::Unknown(why), Some(LogFlight { number: 0, ..said })),
        }
    }

    /// What is at home of another flight than the one that is wanted moves to that one's folder.
    ///
    /// # Errors
    /// In words, when it cannot be moved.
    pub(super) fn make_room(&mut self) -> Result<(), String> {
        let Some(wanted) = self.flight.clone().filter(|of| of.authorized_start.is_some()) else {
            return Ok(());
        };
        let path = self.shelf.borrow().path(&self.file);
        let (number, entry) = match &self.home {
            AtHome::Nothing | AtHome::Gone(_) => return Ok(()),
            AtHome::Intact(entry) if entry.flight.as_ref().is_some_and(|of| of.is(&wanted)) => {
                return Ok(());
            }
            home => {
                let (found, _) = self.judge(&path);
                let is_foreign = matches!(home, AtHome::Foreign);
                match found {
                    // It came before anybody wrote down of which flight it is.
                    Found::Ours => return Ok(()),
                    Found::Unknown(_) if !is_foreign => return Ok(()),
                    Found::Others { .. } | Found::Unknown(_) => {
                        let entry = home.entry().cloned();
                        let flight = entry.as_ref().and_then(|entry| entry.flight.as_ref());
                        let number = flight.map_or(0, |flight| flight.number);
                        // Of this very number by its entry, and of another start by its content.
                        (if number == wanted.number { 0 } else { number }, entry)
                    }
                }
            }
        };
        self.retire(number, entry)
    }

    /// Moves the log at home into the folder of its flight.
    pub(super) fn retire(
        &mut self,
        number: u32,
        entry: Option<ManifestEntry>,
    ) -> Result<(), String> {
        let moved = self.shelf.borrow_mut().retire(&self.file, number);
        let moved = moved.map_err(|error| crate::base::causes::with_causes(&error, ": "))?;
        if let Some(path) = moved {
            self.retired = entry.map(|entry| Retired { path: path.clone(), entry });
            self.done.moved.push(path);
        }
        self.home = AtHome::Nothing;
        Ok(())
    }

    /// The retired log, if a log of the drone may be its continuation: flights of one boot can be
    /// appended to one log.
    pub(super) fn beginning_of(&self, source: &str, size: u64) -> Option<PathBuf> {
        let Retired { path, entry } = self.retired.as_ref()?;
        (entry.source == source && entry.size_bytes <= size).then(|| path.clone())
    }

    /// Before a log gets its name: another one that has it, and is not its beginning, moves to the
    /// folder of its flight.
    ///
    /// # Errors
    /// In words, when it cannot be moved.
    pub(super) fn clear_place(&mut self, entry: &ManifestEntry) -> Result<(), String> {
        if self.begun != Begun::Empty || entry.file != self.file {
            return Ok(());
        }
        let there = self.shelf.borrow().entry(&entry.file).cloned();
        if there.as_ref().is_some_and(|there| there.sha256 == entry.sha256) {
            return Ok(());
        }
        let number = there.as_ref().and_then(|there| there.flight.as_ref());
        self.retire(number.map_or(0, |flight| flight.number), there)
    }

    /// A log came whole that is of another flight: it is kept among the older ones, and the one
    /// before it is looked at if that can be of the flight.
    pub(super) fn put_by(
        &mut self,
        part: PartFile,
        entry: ManifestEntry,
        why: &str,
        is_later: bool,
    ) -> Stage {
        let number = entry.boot.unwrap_or(0);
        let stem = self.file.trim_end_matches(".BIN");
        let file = format!("older/{stem}-{number:08}.BIN");
        let result = self.shelf.borrow_mut().finish_as(part, ManifestEntry { file, ..entry });
        if let Err(error) = result {
            let reason = format!("{error}: {}", error.source);
            return self.fail_for_sure(reason, "make room and run again");
        }
        if !is_later {
            // Logs before it ended even earlier.
            self.targets.clear();
        }
        self.not_it = Some(format!("log {number} of the drone belongs to another flight: {why}"));
        self.next_target()
    }

    /// All logs that may be of the flight were looked at.
    pub(super) fn ends_without(&mut self, reason: String) -> Stage {
        self.fail_for_sure(
            reason,
            "its log may be on its card: `updraft logs import`; or download another by its \
             number (--log)",
        )
    }

    /// Whether only a log of the flight will do.
    pub(super) fn wants_flight(&self) -> bool {
        let is_known = self.flight.as_ref().is_some_and(|of| of.authorized_start.is_some())
            || !self.options.other_starts.is_empty();
        is_known && self.options.which == Which::Flight
    }
}

impl LogFlight {
    /// Flight that the log of a slot must be of, for a start.
    pub fn wanted(start: &StartRecord, slot: u16) -> Self {
        let drone = start.drone(slot);
        Self {
            number: start.number,
            authorized_start: Some(start.start),
            gps_start: None,
            booted: drone.and_then(|drone| drone.booted),
            show_crc32: drone.and_then(|drone| drone.show_crc32),
        }
    }

    /// Flight that a log is of: the one that began at `start`, otherwise its last one.
    pub fn of(identity: &Identity, start: Option<GpsTime>) -> Self {
        let of_start = start.and_then(|start| identity.show_of(start));
        let show = of_start.or_else(|| identity.shows().last());
        let boot = identity.boots.iter().rev().find(|boot| {
            show.is_none_or(|show| boot.shows.contains(show)) && boot.booted.is_some()
        });
        Self {
            number: 0,
            authorized_start: None,
            gps_start: show.map(|show| show.start),
            booted: boot.and_then(|boot| boot.booted),
            show_crc32: None,
        }
    }

    /// Whether this is the wanted flight: the same start of the same folder.
    pub fn is(&self, wanted: &Self) -> bool {
        self.number == wanted.number && self.authorized_start == wanted.authorized_start
    }
}
