//! Refusal of logs of another start, by name: the flight whose start was recorded is analysed,
//! whatever else lies in its folder.

use std::path::{Path, PathBuf};

use rayon::prelude::*;

use crate::analysis::LogInput;
use crate::base::plain::Shown as _;
use crate::base::time::GpsTime;
use crate::campaign::start::{START_FILE, StartRecord, earlier_folders};
use crate::fleet::logs::manifest::Shelf;
use crate::flight::{Belongs, Identity};
use crate::workflow::error::WorkflowError;
use crate::workflow::shows::load::has_extension;
use crate::workflow::words;

/// When the flight began whose logs lie in a folder, and where that is written.
fn written_start(logs: &Path) -> Result<Option<(GpsTime, &'static str)>, WorkflowError> {
    if let Some(record) = StartRecord::read_in(logs)? {
        return Ok(Some((record.start, START_FILE)));
    }
    // The record may have been left behind where logs were copied; each log's entry says it too.
    let Ok(shelf) = Shelf::open(logs, "") else { return Ok(None) };
    let flights = shelf.manifest.logs.iter().filter_map(|entry| entry.flight.as_ref());
    let latest = flights.max_by_key(|flight| flight.number);
    Ok(latest.and_then(|flight| Some((flight.authorized_start?, "manifest.json"))))
}

/// Where the logs of a flight are, and what brings the right ones.
pub(super) struct FlightLogs<'a> {
    /// The folder of logs.
    pub(super) logs: &'a Path,
    /// The campaign and the flight's name in it; `None`: a folder of logs alone, or simulated ones.
    pub(super) campaign: Option<(&'a Path, &'a str)>,
}

/// Marks the logs that are of another start than the one that is written down. Returns that start, and
/// what is doubtful of the others.
pub(super) fn refuse(
    flight: &FlightLogs<'_>,
    logs: &mut [LogInput],
) -> Result<(Option<GpsTime>, Vec<String>), WorkflowError> {
    let written = match flight.campaign {
        Some(_) => written_start(flight.logs)?,
        // In a folder that is no campaign's, files of these names may be anything.
        None => written_start(flight.logs).ok().flatten(),
    };
    let Some((start, written)) = written else {
        return Ok((None, Vec::new()));
    };
    let belongs: Vec<Option<Belongs>> = (logs.par_iter())
        // What cannot be read is told by the analysis.
        .map(|log| Some(Identity::open(&log.path).ok()?.belongs_to(start)))
        .collect();
    let mut notes = Vec::new();
    for (log, belongs) in logs.iter_mut().zip(belongs) {
        match belongs {
            Some(Belongs::No(why)) => {
                log.refused = Some(format!(
                    "{why} ({written}): it belongs to another flight; {}",
                    where_the_right_one_is(flight, start, &log.path)
                ));
            }
            Some(Belongs::Unknown(why)) => notes.push(format!(
                "{}: it is not known to belong to the flight that began {start}: {why}",
                log.path.shown()
            )),
            Some(Belongs::Yes) | None => {}
        }
    }
    Ok((Some(start), notes))
}

fn where_the_right_one_is(flight: &FlightLogs<'_>, start: GpsTime, path: &Path) -> String {
    if let Some(kept) = kept(flight.logs, start, path) {
        return format!("this flight's log is {}: put it in its place", kept.shown());
    }
    let Some((campaign, name)) = flight.campaign else {
        return "put this flight's log in its place".to_owned();
    };
    let campaign = words::shell(&campaign.shown().to_string());
    let name = words::shell(name);
    let slots = match number(path) {
        Some(slot) => format!(" --slots {slot}"),
        None => String::new(),
    };
    format!(
        "download this flight's from the drone with `updraft logs pull {campaign} --flight \
         {name}{slots}`, or import it from its card with `updraft logs import {campaign} --flight \
         {name} CARD`"
    )
}

/// A log of the start that was set aside: of the same slot, in the folder of another start or of older
/// logs.
fn kept(logs: &Path, start: GpsTime, path: &Path) -> Option<PathBuf> {
    let mut folders: Vec<PathBuf> =
        earlier_folders(logs).ok()?.into_iter().map(|(_, folder)| folder).collect();
    folders.push(logs.join("older"));
    let slot = number(path)?;
    let entries = folders.iter().filter_map(|folder| std::fs::read_dir(folder).ok()).flatten();
    let mut found: Vec<PathBuf> = entries
        .flatten()
        .map(|entry| entry.path())
        .filter(|path| has_extension(path, "bin") && number(path) == Some(slot))
        .collect();
    found.sort();
    found.into_iter().find(|path| {
        Identity::open(path).is_ok_and(|identity| identity.belongs_to(start) == Belongs::Yes)
    })
}

/// The slot in the name of a log at home: `07.BIN`, `07-damaged-1.BIN`.
fn number(path: &Path) -> Option<u16> {
    let stem = path.file_stem()?.to_str()?;
    stem.split('-').next()?.parse().ok()
}
