//! A whole campaign in the simulator: planned, checked, flown, with the simulation study beside it.
//! [`analyze_campaign`](super::analyze::analyze_campaign) is what comes next.

use std::path::{Path, PathBuf};

use super::check::{Origin, checked, is_safe, say_findings};
use super::clock::Stopwatch;
use super::ending::Ending;
use super::error::{WorkflowError, with_reasons};
use super::fleet::fly_virtual;
use super::fleet::hangar::MOST_DRONES;
use super::host::Host;
use super::plan::{what_for_whom, write};
use super::simulate::{Simulation, simulate, uniform_mps};
use super::slots::SlotSet;
use super::study::fly_built_in;
use crate::base::plain::Shown as _;
use crate::base::rng::{Purpose as Chance, stream};
use crate::campaign;
use crate::campaign::lock::FolderLock;
use crate::mission::Plan;
use crate::mission::plan::Purpose;
use crate::mission::resolve::Mission;
use crate::sim::air::spec::{self, Air, AirSpec};

/// The air of the paper's field flights.
const FIELD_DAY: &str = "field-day";

/// Request for a campaign in the simulator.
#[derive(Clone, Debug)]
pub struct Run {
    /// Mission to fly.
    pub mission: Mission,
    /// Folder of the campaign.
    pub root: PathBuf,
    /// Whether another plan, and logs that were simulated with other settings, are replaced.
    pub force: bool,
    /// Settings of each flight's simulation, except its air.
    pub simulation: Simulation,
    /// Air of the flights.
    pub airs: Airs,
    /// Number of logs of each flight that are lost, chosen by the seed.
    pub lose: u16,
    /// Whether the drones fly without MAVLink in between.
    pub direct: bool,
    /// Whether the simulation study is flown as well.
    pub study: bool,
}

/// Air of a campaign's flights. By default they fly on a field day.
#[derive(Clone, Debug, Default)]
pub struct Airs {
    /// Uniform wind in measurement flights, m/s.
    pub wind_mps: f64,
    /// Direction that all wind comes from, degrees clockwise from north.
    pub wind_from_deg: f64,
    /// Uniform vertical speed in measurement flights, m/s, up positive; `None`: 1 in otherwise
    /// still air, 0 in moving air.
    pub updraft_mps: Option<f64>,
    /// Air that is added in all flights; empty: still air, `None`: that of the default.
    pub added: Option<Vec<AirSpec>>,
    /// Uniform wind in calibrations, m/s.
    pub calibration_wind_mps: f64,
    /// Uniform vertical speed in calibrations, m/s, up positive.
    pub calibration_updraft_mps: f64,
    /// Air that is added in calibrations instead, if it differs.
    pub calibration_added: Option<Vec<AirSpec>>,
}

impl Airs {
    /// Whether nothing was said about the air.
    fn is_field_day(&self) -> bool {
        let uniform = self.wind_mps != 0.0
            || self.updraft_mps.is_some()
            || self.calibration_updraft_mps != 0.0
            || self.calibration_wind_mps != 0.0;
        self.added.is_none() && self.calibration_added.is_none() && !uniform
    }

    /// The air of a flight, and whether it moves in other ways than uniformly.
    fn of(&self, purpose: Purpose) -> Result<(Air, bool), WorkflowError> {
        let common = if self.is_field_day() {
            spec::load(FIELD_DAY).map_err(|error| WorkflowError::Usage(with_reasons(&error)))?
        } else {
            self.added.clone().unwrap_or_default()
        };
        let (wind_mps, updraft_mps, added) = match purpose {
            Purpose::Calibration => {
                let added = self.calibration_added.clone().unwrap_or(common);
                (self.calibration_wind_mps, self.calibration_updraft_mps, added)
            }
            Purpose::Measurement => {
                let unsaid = if common.is_empty() { 1.0 } else { 0.0 };
                (self.wind_mps, self.updraft_mps.unwrap_or(unsaid), common)
            }
        };
        let uniform_mps = uniform_mps(wind_mps, self.wind_from_deg, updraft_mps);
        Ok((Air::new(uniform_mps, &added), !added.is_empty()))
    }
}

/// Checks, plans and flies a campaign. `findings_per_check` limits the findings of each kind that
/// are reported. [`Ending::NoGo`] means that the show is not safe, and that nothing was written.
///
/// # Errors
/// When the folder holds something else, files cannot be written, no drone of a flight could be flown,
/// or the work is stopped.
pub fn fly_campaign(
    host: &dyn Host,
    run: &Run,
    findings_per_check: usize,
) -> Result<Flown, WorkflowError> {
    let watch = Stopwatch::start(host);
    let mut shows = Vec::new();
    for flight in &run.mission.flights {
        let show = flight.plan.to_show();
        let report =
            checked(&show, &flight.plan, &flight.vehicle, &Origin::Plan, findings_per_check);
        say_findings(host, &report, &[], false);
        if !is_safe(&report, &[]) {
            host.insist("Nothing was flown: the show is not safe as it is");
            return Ok(Flown { ending: Ending::NoGo, lock: None });
        }
        shows.push(show);
    }
    let lock = host.lock(&run.root)?;
    keep_off_the_field(&run.root)?;
    write(host, &run.mission, &shows, &run.root, run.force)?;
    host.say(&format!(
        "Planned {} in {watch} -> {}",
        what_for_whom(&run.mission),
        run.root.shown()
    ));
    let lost = fly_all(host, run)?;
    if run.study {
        fly_built_in(host, &campaign::study_folder(&run.root), run.simulation.seed)?;
    }
    Ok(Flown { ending: Ending::of_losses(lost), lock: Some(lock) })
}

/// A campaign that was flown; its folder is locked as long as this lives.
#[derive(Debug)]
#[must_use]
pub struct Flown {
    /// Ending of the flights.
    pub ending: Ending,
    /// Lock on the folder, so that no other process writes there.
    pub lock: Option<FolderLock>,
}

/// Flies all flights; whether a drone was lost.
fn fly_all(host: &dyn Host, run: &Run) -> Result<bool, WorkflowError> {
    let mut lost = false;
    for (folder, flight) in campaign::flights(&run.root)?.iter().zip(&run.mission.flights) {
        let simulation = run.simulation_of(&flight.plan)?;
        let crowd = flight.plan.slots.len() > MOST_DRONES;
        let flown = if run.direct || crowd {
            simulate(host, folder, &flight.plan, &simulation)?
        } else {
            fly_virtual(host, folder, &flight.plan, &simulation)?
        };
        if flown.logs == 0 {
            return Err(WorkflowError::Failed(format!(
                "{}: no drone could be flown, so there is nothing to analyse; the reasons are above",
                flown.flight
            )));
        }
        lost |= !flown.failed.is_empty();
    }
    Ok(lost)
}

/// The page of a campaign is that of its drones' logs: it is not replaced by one of simulated flights.
fn keep_off_the_field(root: &Path) -> Result<(), WorkflowError> {
    if !campaign::is_campaign(root) {
        return Ok(());
    }
    match campaign::flights(root)?.iter().find(|folder| folder.has_real_logs()) {
        None => Ok(()),
        Some(folder) => Err(WorkflowError::Usage(format!(
            "{} holds logs of real drones, and this would put the report of a simulation in the place \
             of theirs: choose another folder (-o), or practise there with `updraft fly --connect sim` \
             or `updraft simulate`",
            folder.logs().shown()
        ))),
    }
}

impl Run {
    /// How one flight is simulated.
    fn simulation_of(&self, plan: &Plan) -> Result<Simulation, WorkflowError> {
        let (air, moves) = self.airs.of(plan.purpose)?;
        let mut simulation = Simulation { air, ..self.simulation.clone() };
        simulation.truth |= moves;
        if self.lose > 0 {
            simulation.only = Some(self.kept(plan)?);
        }
        Ok(simulation)
    }

    /// The slots whose logs are not lost.
    fn kept(&self, plan: &Plan) -> Result<SlotSet, WorkflowError> {
        kept(plan, self.simulation.seed, usize::from(self.lose)).ok_or_else(|| {
            WorkflowError::Usage(format!(
                "--lose {} leaves no log of the {} drones of {}",
                self.lose,
                plan.slots.len(),
                plan.name
            ))
        })
    }
}

/// Slots of a flight whose logs are not lost, chosen by the seed; `None` if none is left.
pub(super) fn kept(plan: &Plan, seed: u64, lost: usize) -> Option<SlotSet> {
    let slots: Vec<u16> = plan.slots.iter().map(|slot| slot.slot).collect();
    if lost >= slots.len() {
        return None;
    }
    let mut rng = stream(seed, plan.purpose as u64, Chance::Losses);
    let gone = rand::seq::index::sample(&mut rng, slots.len(), lost);
    let kept = slots.into_iter().enumerate().filter(|(index, _)| !gone.iter().any(|i| i == *index));
    Some(kept.map(|(_, slot)| slot).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn airs(airs: &Airs) -> [(Air, bool); 2] {
        [Purpose::Calibration, Purpose::Measurement].map(|purpose| airs.of(purpose).unwrap())
    }

    #[test]
    fn air_of_which_nothing_is_said_is_a_field_day_and_still_air_rises_by_one() {
        let [(_, calibration_moves), (_, measurement_moves)] = airs(&Airs::default());
        assert!(calibration_moves && measurement_moves);
        let still = Airs { added: Some(Vec::new()), ..Airs::default() };
        let [(calibration, moves), (measurement, _)] = airs(&still);
        assert!(!moves, "still air does not move by itself");
        assert_eq!(calibration.uniform_mps, [0.0; 3]);
        assert_eq!(measurement.uniform_mps, [0.0, 0.0, 1.0]);
        let windy = Airs { wind_mps: 3.0, wind_from_deg: 270.0, ..Airs::default() };
        let [(calibration, moves), (measurement, _)] = airs(&windy);
        assert!(!moves, "a wind that is asked for is all there is");
        assert_eq!(calibration.uniform_mps[0], 0.0, "it is the measurement's");
        assert!((measurement.uniform_mps[0] - 3.0).abs() < 1e-12, "from the west it blows east");
    }
}
