//! A flight with an effect hidden from the analysis, which names it before the seal is opened.

use std::path::{Path, PathBuf};

use super::ending::Ending;
use super::error::WorkflowError;
use super::game::game_path;
use super::gap::search::Written;
use super::host::Host;
use super::{made_by, words};
use crate::base::file::{create_folder, write_whole};
use crate::base::plain::Shown as _;
use crate::blind::play::{self, Act, play};
use crate::blind::told::{HiddenRun, gap_words};
use crate::blind::{Cell, Scenario, seal};
use crate::campaign::to_json;

/// File of the comparison.
const RESULT: &str = "hidden.json";

/// A flight with hidden physics after the seal was opened.
pub struct Hidden {
    /// Hidden effects, and the verdict on them.
    pub result: HiddenRun,
    /// Path of the result as JSON.
    pub path: PathBuf,
    /// Number of drones that could not be flown.
    pub lost: usize,
}

impl Hidden {
    /// Ending of the flight: with losses if drones could not be flown.
    pub fn ending(&self) -> Ending {
        Ending::of_losses(self.lost > 0)
    }
}

/// Seals, flies, explains, opens and compares. With `force` another flight with hidden physics is
/// replaced.
///
/// # Errors
/// When the folder holds something else, or the flight cannot be drawn, flown or explained.
pub fn hide(
    host: &dyn Host,
    folder: &Path,
    force: bool,
    cell: &Cell,
    seed: u64,
) -> Result<Hidden, WorkflowError> {
    let truth = Scenario::draw(seed, cell)?;
    create_folder(folder)?;
    let _lock = host.lock(folder)?;
    make_room(folder, force)?;
    let mut tell = |act: Act<'_>| tell(host, folder, cell, &truth, act);
    let played = play(&truth, folder, &Written(host), Some(host.stop_flag()), &mut tell)?;
    host.say(&format!("Seal opened: it hides {}", played.opened.truth.words()));
    let result = HiddenRun::of(&played, &made_by());
    let json = to_json(&result)
        .map_err(|error| WorkflowError::Failed(format!("failed to make JSON: {error}")))?;
    let path = folder.join(RESULT);
    write_whole(&path, &json)?;
    Ok(Hidden { result, path, lost: played.flown.lost })
}

/// Says how it goes on.
fn tell(host: &dyn Host, folder: &Path, cell: &Cell, truth: &Scenario, act: Act<'_>) {
    match act {
        Act::Sealed(hash) => host.say(&format!(
            "Sealed: an effect that {} does not have, of a usual size\n  SHA-256 {hash} -> {}",
            cell.base.vehicle_name(),
            seal::truth_path(folder).shown()
        )),
        Act::Flown(flown) => {
            let lost = truth.nuisance.missing.len() + flown.lost;
            let lost = if lost > 0 { format!(" ({lost} lost)") } else { String::new() };
            host.say(&format!(
                "Flown: {} in {} air, {}{lost} -> {}",
                cell.protocol.template(),
                cell.air.name(),
                words::count(flown.logs, "log"),
                play::flight(folder).shown()
            ));
        }
        Act::Explained(verdict) => {
            host.say(&format!("Verdict: {}", verdict.summary));
            if let Some(shrink) = verdict.gap.drones.or(verdict.gap.rungs) {
                host.say(&format!("Gap on held-out data: {}", gap_words(&shrink)));
            }
            host.say(&format!("  -> {}", play::verdict(folder).shown()));
        }
    }
}

/// A flight of another seed is not mixed with this one's.
fn make_room(folder: &Path, force: bool) -> Result<(), WorkflowError> {
    let flight = play::flight(folder);
    if game_path(folder).exists() {
        return Err(WorkflowError::Usage(format!(
            "{} holds a game of `updraft blind hide`; choose another folder with -o",
            folder.shown()
        )));
    }
    if play::is_played(folder) {
        // What was interrupted before its verdict is flown again: the same seed gives the same flight.
        if !force && play::verdict(folder).exists() {
            return Err(WorkflowError::Usage(format!(
                "{} has a flight with hidden physics; choose another folder with -o, or replace it with \
                 --force",
                folder.shown()
            )));
        }
        return Ok(play::remove(folder)?);
    }
    if crate::campaign::flights(folder).is_ok_and(|flights| !flights.is_empty()) {
        return Err(WorkflowError::Usage(format!(
            "{} is a campaign; choose another folder with -o",
            folder.shown()
        )));
    }
    if flight.exists() {
        return Err(WorkflowError::Usage(format!(
            "{} exists and was not made by `run --hide`; choose another folder with -o",
            flight.shown()
        )));
    }
    Ok(())
}
