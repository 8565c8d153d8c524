//! Flight of a log that came, and its place at home; a log in its place makes room.

use super::Puller;
use super::choose::older;
use super::one::{One, Target, number};
use crate::base::file::{create_folder, read_whole, write_whole};
use crate::fleet::logs::manifest::{AtHome, LogFlight, ManifestEntry, Method, Verified};
use crate::fleet::logs::one::Which;
use crate::fleet::logs::part::{Sums, sums_of};
use crate::flight::identity::{Belongs, Identity, identify, later_s};
use crate::log::Log;
use crate::skybrush_server::{Job, LogEntry};
use crate::workflow::error::WorkflowError;

impl Puller<'_> {
    /// What is at home before anybody is asked. A log of another flight moves to that one's folder.
    pub(super) fn look(&mut self, one: &mut One) -> Result<(), WorkflowError> {
        one.home = self.shelf.at_home(&one.file);
        self.make_room(one)?;
        if one.home == AtHome::Foreign && !self.wish.again {
            one.fail(format!(
                "{} exists, but is not in the manifest; move the file away, or replace it by \
                 downloading the log again (--again)",
                one.file
            ));
        }
        Ok(())
    }

    fn make_room(&mut self, one: &mut One) -> Result<(), WorkflowError> {
        if self.wish.which != Which::Flight {
            return Ok(());
        }
        let Some((wanted, start)) =
            one.flight.as_ref().and_then(|of| Some((of.clone(), of.authorized_start?)))
        else {
            return Ok(());
        };
        let entry = match &one.home {
            AtHome::Nothing | AtHome::Gone(_) => return Ok(()),
            home => home.entry().cloned(),
        };
        let flight = entry.as_ref().and_then(|entry| entry.flight.clone());
        if flight.as_ref().is_some_and(|flight| flight.is(&wanted)) {
            return Ok(());
        }
        let path = self.shelf.path(&one.file);
        let belongs = Identity::open(&path).map(|identity| identity.belongs_to(start));
        match belongs {
            // It came before anybody wrote down of which flight it is.
            Ok(Belongs::Yes) => return Ok(()),
            Ok(Belongs::Unknown(_)) | Err(_) if entry.is_some() => return Ok(()),
            _ => {}
        }
        let number = flight.map_or(0, |flight| flight.number);
        // Of this very number by its entry, and of another start by its content.
        self.retire(one, if number == wanted.number { 0 } else { number })
    }

    fn retire(&mut self, one: &mut One, number: u32) -> Result<(), WorkflowError> {
        one.moved.extend(self.shelf.retire(&one.file, number)?);
        one.home = AtHome::Nothing;
        Ok(())
    }

    pub(super) fn source(&self, drone: &str, log: &LogEntry) -> String {
        format!("skybrush://{} drone {drone} log {}", self.address, log.id)
    }

    /// Whether this very log is home under this name.
    pub(super) fn is_there(&self, file: &str, drone: &str, log: &LogEntry) -> bool {
        let is_it = |entry: &ManifestEntry| {
            entry.source == self.source(drone, log)
                && entry.size_bytes == log.size
                && entry.incomplete.is_none()
        };
        matches!(self.shelf.at_home(file), AtHome::Intact(entry) if is_it(&entry))
    }

    /// Whether this log was brought before, and is of another flight.
    pub(super) fn is_known_to_be_others(&self, one: &One, drone: &str, log: &LogEntry) -> bool {
        let Some(start) = one.flight.as_ref().and_then(|of| of.authorized_start) else {
            return false;
        };
        let file = older(one, log);
        self.is_there(&file, drone, log)
            && Identity::open(&self.shelf.path(&file))
                .is_ok_and(|identity| matches!(identity.belongs_to(start), Belongs::No(_)))
    }

    /// Takes a log that came whole.
    pub(super) fn accept(
        &mut self,
        drone: &str,
        one: &mut One,
        target: &Target,
        bytes: &[u8],
    ) -> Option<Job> {
        let id = &target.log.id;
        // The server tells no checksum: a log is taken when it can be read.
        let log = Log::from_bytes(bytes.to_vec());
        if let Some(reason) = log.why_not_a_log() {
            return one.fail(format!("log {id} as received is not a DataFlash log: {reason}"));
        }
        let identity = identify(&log);
        drop(log);
        let wanted = one.flight.clone().filter(|of| of.authorized_start.is_some());
        let start = wanted.as_ref().and_then(|of| of.authorized_start);
        let said = LogFlight::of(&identity, start);
        let mut file = target.file.clone();
        let mut flight = said.clone();
        let of_other = identity.of_any(&self.other_starts).filter(|_| start.is_none());
        if let Some(name) = of_other.filter(|_| self.wish.which == Which::Flight) {
            file = older(one, &target.log);
            one.newer.get_or_insert(number(&target.log));
            one.not_it = Some(format!("log {id} of the drone belongs to another flight: {name}"));
        }
        if let (Some(wanted), Some(start)) = (wanted, start) {
            let is_wanted = self.wish.which == Which::Flight;
            match identity.belongs_to(start) {
                Belongs::Yes => {
                    let authorized_start = Some(start);
                    let (number, show_crc32) = (wanted.number, wanted.show_crc32);
                    flight = LogFlight { number, authorized_start, show_crc32, ..said };
                }
                Belongs::No(why) if is_wanted => {
                    // Kept among the older ones; the one before it may be of the flight.
                    file = older(one, &target.log);
                    let is_later =
                        identity.span().is_some_and(|(first, _)| later_s(first, start) > 0.0);
                    if is_later {
                        one.newer.get_or_insert(number(&target.log));
                    } else {
                        one.targets.clear();
                    }
                    one.not_it = Some(format!(
                        "log {id} of the drone belongs to another flight: \
                         {why}"
                    ));
                }
                Belongs::Unknown(why) if is_wanted => {
                    one.failure.get_or_insert(format!(
                        "its log does not say which flight it belongs to: {why}; look at it \
                         (`updraft inspect`): it is kept as this flight's"
                    ));
                }
                _ => {}
            }
        }
        let is_slots = file == one.file;
        if let Err(error) = self.publish(drone, one, target, file, bytes, flight, None) {
            self.error = Some(error);
            return one.fail("it could not be written");
        }
        if is_slots || self.wish.which == Which::All {
            one.pulled += 1;
            one.bytes += bytes.len() as u64;
        }
        if is_slots && self.wish.which == Which::Flight {
            one.targets.clear();
            one.not_it = None;
        }
        one.next(drone)
    }

    /// Keeps what came of a log that is not known to be whole; the next pull brings it again.
    pub(super) fn keep_beginning(
        &mut self,
        drone: &str,
        one: &mut One,
        target: &Target,
        bytes: &[u8],
        why: &str,
    ) -> Option<Job> {
        let id = &target.log.id;
        let advice = "try again when the drone is disarmed";
        let log = Log::from_bytes(bytes.to_vec());
        let is_whole = |home: &AtHome| {
            matches!(home, AtHome::Foreign)
                || matches!(home, AtHome::Intact(entry) if entry.incomplete.is_none())
        };
        if log.why_not_a_log().is_some() || is_whole(&self.shelf.at_home(&target.file)) {
            return one.fail(format!("log {id} did not arrive complete: {why}; {advice}"));
        }
        let flight = LogFlight::of(&identify(&log), None);
        drop(log);
        let file = target.file.clone();
        if let Err(error) =
            self.publish(drone, one, target, file, bytes, flight, Some(why.to_owned()))
        {
            self.error = Some(error);
            return one.fail("it could not be written");
        }
        one.fail(format!("only the beginning of log {id} was kept: {why}; {advice}"))
    }

    #[expect(clippy::too_many_arguments, reason = "each is a part of the entry")]
    fn publish(
        &mut self,
        drone: &str,
        one: &mut One,
        target: &Target,
        file: String,
        bytes: &[u8],
        flight: LogFlight,
        incomplete: Option<String>,
    ) -> Result<(), WorkflowError> {
        let path = self.shelf.path(&file);
        if let Some(folder) = path.parent() {
            create_folder(folder)?;
        }
        let sums = sums_of(bytes);
        self.clear(one, &file, bytes, &sums)?;
        // The entry is first: a file without one would be anybody's.
        self.shelf.add(ManifestEntry {
            file,
            slot: one.slot,
            drone: None,
            boot: target.log.id.parse().ok(),
            source: self.source(drone, &target.log),
            size_bytes: sums.size,
            sha256: sums.sha256,
            method: Method::SkybrushServer,
            method_reason: None,
            verified: Verified::Size,
            incomplete,
            attempts: target.tries,
            at_unix_s: self.host.clock().unix_us() / 1_000_000,
            flight: Some(flight),
        })?;
        write_whole(&path, bytes)?;
        Ok(())
    }

    /// Nothing that is home is overwritten but its own beginning.
    fn clear(
        &mut self,
        one: &mut One,
        file: &str,
        bytes: &[u8],
        sums: &Sums,
    ) -> Result<(), WorkflowError> {
        let home = self.shelf.at_home(file);
        let entry = match home {
            AtHome::Nothing | AtHome::Gone(_) => return Ok(()),
            AtHome::Damaged(_) => return Ok(self.shelf.set_aside(file, "damaged")?),
            AtHome::Foreign => None,
            AtHome::Intact(entry) if entry.sha256 == sums.sha256 => return Ok(()),
            AtHome::Intact(entry) => Some(entry),
        };
        let there = read_whole(&self.shelf.path(file), bytes.len() as u64);
        if entry.is_some() && there.is_ok_and(|there| bytes.starts_with(&there)) {
            return Ok(());
        }
        if file != one.file {
            return Ok(self.shelf.set_aside(file, "other")?);
        }
        let number = entry.and_then(|entry| entry.flight).map_or(0, |flight| flight.number);
        self.retire(one, number)
    }
}
