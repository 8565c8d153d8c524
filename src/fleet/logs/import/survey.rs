//! Survey of the cards: each log is read once.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use super::cards::{Cards, find};
use super::place::slot_of;
use super::{CardLog, Flown, ImportFlight, Survey};
use crate::base::file::FileError;
use crate::flight::{Belongs, Flight, FlightOptions, Identity, identify, share_flown};
use crate::log::{Log, LogError};
use crate::mission::plan::Segment;

/// Flights of one log that are held against plans, at most: a log of a day of flying has fewer.
const MOST_FLOWN: usize = 16;
/// Logs are compared in pieces of this size.
const PIECE_BYTES: usize = 1 << 20;

/// Reads all logs on the cards. `progress` is called after each, with the number of logs.
///
/// # Errors
/// When a card is not there.
pub fn survey(
    cards: &[PathBuf],
    flights: &[ImportFlight],
    progress: &(dyn Fn(usize) + Sync),
) -> Result<Survey, FileError> {
    let Cards { files, mut unreadable, empty } = find(cards)?;
    let count = files.len();
    let read: Vec<Result<CardLog, (PathBuf, String)>> = (files.into_par_iter())
        .map(|path| {
            let read = match Log::open(&path) {
                Ok(log) => Ok(read(path, &log, flights)),
                Err(LogError::NotALog { reason, .. }) => Err((path, format!("no log: {reason}"))),
                Err(LogError::Open { source, .. }) => {
                    Err((path, format!("cannot be read: {source}")))
                }
                Err(error) => Err((path, format!("cannot be read: {error}"))),
            };
            progress(count);
            read
        })
        .collect();
    let mut logs = Vec::new();
    for one in read {
        match one {
            Ok(log) => logs.push(log),
            Err(error) => unreadable.push(error),
        }
    }
    compare(&mut logs);
    tell_apart(&mut logs, flights);
    unreadable.sort();
    Ok(Survey { logs, unreadable, empty })
}

fn read(path: PathBuf, log: &Log, flights: &[ImportFlight]) -> CardLog {
    let identity = identify(log);
    let flown = flown(&path, log, &identity, flights);
    CardLog {
        path,
        size_bytes: log.size_bytes(),
        identity,
        flown,
        copy_of: None,
        beginning_of: None,
    }
}

/// The flights in a log, held against the plans of those whose start is not known.
fn flown(path: &Path, log: &Log, identity: &Identity, flights: &[ImportFlight]) -> Vec<Flown> {
    let is_known = |flight: &ImportFlight| {
        flight.start.is_some_and(|start| identity.belongs_to(start) == Belongs::Yes)
    };
    let is_open = |flight: &ImportFlight| flight.start.is_none();
    if !identity.flew || !flights.iter().any(is_open) {
        return Vec::new();
    }
    let segments = |flight: &ImportFlight, start| -> Option<Vec<Segment>> {
        let slot = slot_of(identity, flight, start).ok()?;
        Some(flight.plan.segments(flight.plan.slot(slot)?).to_vec())
    };
    let shows: Vec<_> = identity
        .shows()
        .filter(|show| show.flown)
        .map(|show| show.start)
        .take(MOST_FLOWN)
        .collect();
    let mut flown = Vec::new();
    for start in &shows {
        // The show's clock says where the plan lies, whichever plan it is.
        let options = FlightOptions { start: Some(*start), ..FlightOptions::default() };
        let Ok(read) = Flight::from_log(log, path, options) else { continue };
        let share = |flight: &ImportFlight| {
            let own = segments(flight, Some(*start)).filter(|_| is_open(flight));
            own.map_or(0.0, |segments| share_flown(&read, &segments))
        };
        flown.push(Flown { start: Some(*start), shares: flights.iter().map(share).collect() });
    }
    if shows.is_empty() && !flights.iter().any(is_known) {
        for (index, flight) in flights.iter().enumerate().filter(|(_, flight)| is_open(flight)) {
            let Some(segments) = segments(flight, None) else { continue };
            let options = FlightOptions { segments: Some(&segments), ..FlightOptions::default() };
            let Ok(read) = Flight::from_log(log, path, options) else { continue };
            let mut shares = vec![0.0; flights.len()];
            shares[index] = share_flown(&read, &segments);
            flown.push(Flown { start: read.clock.start, shares });
        }
    }
    flown
}

/// Holds logs against the plan of a flight whose start is known where several are of that start and slot:
/// simulated flights of one campaign all begin at the same time.
fn tell_apart(logs: &mut [CardLog], flights: &[ImportFlight]) {
    for (number, flight) in flights.iter().enumerate() {
        let Some(start) = flight.start else { continue };
        let mut of_slot: BTreeMap<u16, Vec<usize>> = BTreeMap::new();
        for (index, log) in logs.iter().enumerate() {
            let is_own = log.copy_of.is_none() && log.beginning_of.is_none();
            if is_own
                && log.identity.belongs_to(start) == Belongs::Yes
                && let Ok(slot) = slot_of(&log.identity, flight, Some(start))
            {
                of_slot.entry(slot).or_default().push(index);
            }
        }
        for (slot, several) in of_slot.into_iter().filter(|(_, logs)| logs.len() > 1) {
            let Some(slot) = flight.plan.slot(slot) else { continue };
            for index in several {
                let Some(log) = logs.get_mut(index) else { continue };
                let options = FlightOptions { start: Some(start), ..FlightOptions::default() };
                let read = Flight::open(&log.path, options);
                let share = read.map_or(0.0, |read| share_flown(&read, flight.plan.segments(slot)));
                let mut shares = vec![0.0; flights.len()];
                shares[number] = share;
                log.flown.push(Flown { start: Some(start), shares });
            }
        }
    }
}

/// Finds logs that are copies, or only beginnings, of others.
fn compare(logs: &mut [CardLog]) {
    let key = |log: &CardLog| {
        let boot = log.identity.boots.first();
        // Of one boot of one drone; logs without a time are compared with each other.
        (log.identity.system_id, boot.and_then(|boot| boot.span).map(|(first, _)| first.total_ms()))
    };
    for index in 0..logs.len() {
        let (earlier, rest) = logs.split_at_mut(index);
        let Some(log) = rest.first_mut() else { continue };
        let same = earlier.iter().position(|other| {
            other.size_bytes == log.size_bytes
                && other.copy_of.is_none()
                && key(other) == key(log)
                && begins_with(&other.path, &log.path, log.size_bytes).unwrap_or(false)
        });
        log.copy_of = same;
    }
    for index in 0..logs.len() {
        let Some(log) = logs.get(index).filter(|log| log.copy_of.is_none()) else { continue };
        let longer = (logs.iter().enumerate())
            .filter(|(_, other)| other.size_bytes > log.size_bytes && key(other) == key(log))
            .filter(|(_, other)| other.copy_of.is_none())
            .filter(|(_, other)| {
                begins_with(&other.path, &log.path, log.size_bytes).unwrap_or(false)
            })
            .max_by_key(|(_, other)| other.size_bytes)
            .map(|(other, _)| other);
        logs[index].beginning_of = longer;
    }
}

/// Whether the first `size` bytes of two files are the same.
pub(super) fn begins_with(whole: &Path, beginning: &Path, size: u64) -> io::Result<bool> {
    let (mut one, mut other) = (File::open(whole)?.take(size), File::open(beginning)?.take(size));
    let mut pieces = (vec![0; PIECE_BYTES], vec![0; PIECE_BYTES]);
    let mut compared = 0;
    while compared < size {
        let wanted = usize::try_from(size - compared).unwrap_or(PIECE_BYTES).min(PIECE_BYTES);
        let (left, right) = (&mut pieces.0[..wanted], &mut pieces.1[..wanted]);
        one.read_exact(left)?;
        other.read_exact(right)?;
        if left != right {
            return Ok(false);
        }
        compared += wanted as u64;
    }
    Ok(true)
}
