//! Check of laws held from another analysis (`--hold`): whether they belong to these drones.
//!
//! A law is a drone's own: its mass, rotors and controllers are in it. Laws of another fleet give a
//! map as well, which is wrong by as much as the fleets differ. Nothing refuses them (a drone may
//! stand for its like), but what speaks against them is said.

use std::path::Path;

use crate::analysis::result::{Analysis, FlightAnalysis, LawsFrom};
use crate::base::plain::Shown as _;
use crate::campaign::origin::LogOrigin;
use crate::campaign::{self, FlightFolder};
use crate::flight::Indicator;
use crate::mission::Plan;
use crate::mission::plan::Purpose;
use crate::workflow::analysis_file::AnalysisFile;
use crate::workflow::error::WorkflowError;
use crate::workflow::find::{Found, Work};

/// Homes of one slot further apart are of two grids, m.
const SAME_HOME_M: f64 = 0.5;
/// Grounds whose heights differ by more have other air: 1 % of its density, m.
const SAME_GROUND_M: f64 = 100.0;

/// The calibration whose laws are held, and where it is from.
///
/// # Errors
///
/// If the analysis cannot be read, or has no calibration, or its laws are of another indicator.
pub(super) fn read(
    path: &Path,
    indicator: Indicator,
) -> Result<(FlightAnalysis, LawsFrom), WorkflowError> {
    let AnalysisFile { path: file, sha256, analysis } = AnalysisFile::read(path)?;
    let Analysis { title, flights, .. } = analysis;
    let calibration = flights
        .into_iter()
        .find(|flight| flight.purpose == Purpose::Calibration && flight.flock.is_some())
        .ok_or_else(|| {
            WorkflowError::Usage(format!("{} has no calibration to hold", path.shown()))
        })?;
    if calibration.indicator != indicator {
        return Err(WorkflowError::Usage(format!(
            "the laws of {} are of the {}, and here the {} is analysed; name the same indicator for both with \
             --indicator",
            path.shown(),
            calibration.indicator.words(),
            indicator.words()
        )));
    }
    let (start, drones) = (calibration.start(), calibration.results());
    let path = file.shown().to_string();
    Ok((calibration, LawsFrom { path, sha256, title, drones, start }))
}

/// What speaks against the laws of `reference`, read from `path`: one sentence, or nothing.
pub(in crate::workflow) fn doubts_of_held(
    path: &Path,
    reference: &FlightAnalysis,
    indicator: Indicator,
    work: &Work,
) -> Option<String> {
    let calibrated = calibrated_in(path);
    let mut reasons: Vec<String> = Vec::new();
    if reference.indicator != indicator {
        reasons.push(format!(
            "its laws are of the {}, and here the {} is analysed",
            reference.indicator.words(),
            indicator.words()
        ));
    }
    let measures = |one: &&Found| one.purpose != Some(Purpose::Calibration);
    let is_ladder = |one: &&Found| !measures(one) && !one.logs.is_empty();
    // Laws measure the air of the other flights, and where there are none, that of a ladder.
    let with_map = work.flights.iter().any(|one| measures(&one));
    let judged = |one: &&Found| if with_map { measures(one) } else { is_ladder(one) };
    for flight in work.flights.iter().filter(judged) {
        let Some(plan) = &flight.plan else { continue };
        reasons.extend(other_slots(reference, plan));
        if let Some((planned, seed)) = &calibrated {
            reasons.extend(other_campaign(planned, *seed, plan, flight));
        }
    }
    of_others(&path.shown().to_string(), with_map, reasons)
}

/// What speaks against the laws of a calibration that was flown in another campaign than the flights that it measures: one
/// sentence, or nothing.
pub(super) fn doubts_of_another_campaign(work: &Work) -> Option<String> {
    let calibrates = |one: &&Found| one.purpose == Some(Purpose::Calibration);
    let mut calibrations =
        work.flights.iter().filter(calibrates).filter(|one| !one.logs.is_empty());
    let calibration = calibrations.next()?;
    let calibrated = calibration.plan.as_ref()?;
    let has_own = |flight: &Found| {
        work.flights.iter().filter(calibrates).any(|one| one.campaign == flight.campaign)
    };
    let mut reasons = Vec::new();
    for flight in work.flights.iter().filter(|one| !calibrates(one) && !has_own(one)) {
        let Some(plan) = &flight.plan else { continue };
        reasons.extend(other_campaign(calibrated, calibration.seed, plan, flight));
    }
    of_others(&calibration.name, true, reasons)
}

/// That laws seem to be those of other drones, for these reasons.
fn of_others(laws: &str, with_map: bool, mut reasons: Vec<String>) -> Option<String> {
    reasons.dedup();
    (!reasons.is_empty()).then(|| {
        let what = if with_map { "the map" } else { "the updraft" };
        format!(
            "the laws of {laws} seem to be those of other drones: {}. Each drone has its own law; with \
             another fleet's laws {what} is wrong by as much as the fleets differ, which the \
             stated errors do not include. Use the laws of a calibration of these drones",
            reasons.join("; ")
        )
    })
}

/// The plan and the seed of the calibration in the campaign that an analysis lies in.
fn calibrated_in(path: &Path) -> Option<(Plan, Option<u64>)> {
    let root = if path.is_dir() { path } else { path.parent()? };
    let folders = campaign::is_campaign(root).then(|| campaign::flights(root).ok())??;
    let of_folder = |folder: &FlightFolder| {
        let plan = folder.read_plan().ok()?;
        let simulated = folder.logs_of(LogOrigin::Simulated);
        let seed = simulated.read_record().ok().flatten().map(|record| record.seed);
        (plan.purpose == Purpose::Calibration).then_some((plan, seed))
    };
    folders.iter().find_map(of_folder)
}

/// That the laws' drones have other slots or stood elsewhere.
fn other_slots(reference: &FlightAnalysis, plan: &Plan) -> Vec<String> {
    let home_of = |slot: u16| {
        let drone = reference.drones.iter().find(|drone| drone.slot == Some(slot));
        drone.and_then(|drone| drone.home_m)
    };
    let known = reference.drones.iter().any(|drone| drone.slot.is_some());
    let apart = |slot: &&crate::mission::plan::Slot| {
        home_of(slot.slot).is_some_and(|home| {
            (home[0] - slot.home_m[0]).hypot(home[1] - slot.home_m[1]) > SAME_HOME_M
        })
    };
    let moved = plan.slots.iter().filter(apart).count();
    let fleet = reference.drones.len() + reference.missing.len();
    let mut reasons = Vec::new();
    if known && fleet != plan.slots.len() {
        reasons.push(format!(
            "they are {}, and {} has {}",
            if fleet == 1 { "of 1 drone".to_owned() } else { format!("{fleet} drones") },
            plan.name,
            plan.slots.len()
        ));
    }
    if moved > 0 {
        reasons.push(format!("{moved} of the slots of {} have other homes there", plan.name));
    }
    reasons
}

/// That the campaign of the laws was of another vehicle, place or simulated fleet.
fn other_campaign(planned: &Plan, seed: Option<u64>, plan: &Plan, flight: &Found) -> Vec<String> {
    let mut reasons = Vec::new();
    if planned.vehicle != plan.vehicle {
        reasons.push(format!(
            "they flew {}, and {} flew {}",
            planned.vehicle, plan.name, plan.vehicle
        ));
    }
    if let (Some(there), Some(here)) = (seed, flight.seed)
        && there != here
    {
        reasons.push(format!(
            "they were simulated with seed {there}, and {} with seed {here}: other drones",
            plan.name
        ));
    }
    let higher_m = plan.site.ground_amsl_m - planned.site.ground_amsl_m;
    if higher_m.abs() > SAME_GROUND_M {
        let word = if higher_m > 0.0 { "higher" } else { "lower" };
        reasons.push(format!(
            "the ground of {} is {:.0} m {word}, and its air has another density",
            plan.name,
            higher_m.abs()
        ));
    }
    reasons
}
