//! Writing a mission as a campaign folder.

use std::path::Path;

use super::error::WorkflowError;
use super::host::Host;
use super::words;
use crate::base::file::read_whole;
use crate::base::plain::Shown as _;
use crate::campaign::write::{FlightFiles, folders, write_index};
use crate::campaign::{self, CampaignError, FlightFolder};
use crate::mission::resolve::Mission;
use crate::show::Show;

/// The flights and the fleet in words: `calibration and hover for 49 drones`.
pub fn what_for_whom(mission: &Mission) -> String {
    let names: Vec<_> = mission.flights.iter().map(|flight| flight.plan.name.as_str()).collect();
    let drones = mission.flights.first().map_or(0, |flight| flight.plan.slots.len());
    format!("{} for {}", words::list(&names), words::count(drones, "drone"))
}

/// Writes the campaign folder, unless it holds something else. `shows` are those of the mission's
/// flights, in their order. With `force` another plan is replaced, but never logs.
///
/// # Errors
///
/// If the folder holds something else, or files cannot be written.
pub fn write(
    host: &dyn Host,
    mission: &Mission,
    shows: &[Show],
    root: &Path,
    force: bool,
) -> Result<(), WorkflowError> {
    let folders = folders(root, mission);
    let mut files = Vec::with_capacity(folders.len());
    for ((flight, folder), show) in mission.flights.iter().zip(&folders).zip(shows) {
        host.check_stop()?;
        let made = FlightFiles::of(flight, show)?;
        refuse_occupied(root, folder, made.plan(), force)?;
        files.push(made);
    }
    for (files, folder) in files.iter().zip(&folders) {
        host.check_stop()?;
        files.write(folder)?;
    }
    Ok(write_index(root, mission)?)
}

/// Refuses to replace another plan that has logs, or any other plan without `--force`. The plan that is
/// there may be written again.
fn refuse_occupied(
    root: &Path,
    folder: &FlightFolder,
    plan: &[u8],
    force: bool,
) -> Result<(), WorkflowError> {
    let occupied = |what: &str| {
        Err(CampaignError::Occupied { path: folder.0.clone(), what: what.to_owned() }.into())
    };
    if folder.0.as_path() != root && FlightFolder(root.to_owned()).plan().exists() {
        return occupied("a plan of one flight");
    }
    if folder.0.as_path() == root && campaign::index_path(root).exists() {
        return occupied("a campaign of several flights");
    }
    // One more is another plan already.
    let existing = match read_whole(&folder.plan(), plan.len() as u64) {
        Ok(existing) => Some(existing),
        Err(error) => match error.source.kind() {
            std::io::ErrorKind::NotFound => return Ok(()),
            std::io::ErrorKind::FileTooLarge => None,
            _ => return Err(error.into()),
        },
    };
    if existing.is_some_and(|existing| existing == plan) {
        return Ok(());
    }
    if folder.simulated().is_dir() || folder.logs().is_dir() {
        return Err(WorkflowError::Usage(format!(
            "{} holds the logs of another plan, which are never overwritten; choose another folder, \
             or move its folders logs and simulated away and give --force",
            folder.0.shown()
        )));
    }
    if force { Ok(()) } else { occupied("another plan") }
}

/// Shows of a mission's flights, in their order.
pub fn shows(mission: &Mission) -> Vec<Show> {
    mission.flights.iter().map(|flight| flight.plan.to_show()).collect()
}
