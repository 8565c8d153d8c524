//! One campaign of a study: planned, flown, analysed and held against the truth, in a folder of its own.

use std::path::{Path, PathBuf};

use super::naming::named;
use super::silent::Silent;
use crate::base::file::{FileError, write_whole};
use crate::base::own_folder::OwnFolder;
use crate::base::plain::Shown as _;
use crate::campaign::write::{folders, write_index};
use crate::campaign::{CampaignError, FlightFolder, to_json};
use crate::mission::plan::Purpose;
use crate::mission::resolve::Mission;
use crate::study::sensitivity::{Done, Item, NotDone, Outcome, SensitivityPlan, Setup};
use crate::vehicle::Vehicle;
use crate::workflow::analyze::{Analysing, Settings, simulated};
use crate::workflow::error::{WorkflowError, with_reasons};
use crate::workflow::host::Host;
use crate::workflow::run::kept;
use crate::workflow::simulate::{Simulation, simulate};

/// Flies the campaigns of a study.
pub(super) struct Campaigns<'a> {
    host: &'a dyn Host,
    study: &'a SensitivityPlan,
    /// Folder of the campaigns that are kept.
    work: PathBuf,
    /// Folder in which they are flown.
    flying_in: PathBuf,
    keep: bool,
}

impl<'a> Campaigns<'a> {
    /// Removes what killed runs have left.
    pub(super) fn new(
        host: &'a dyn Host,
        study: &'a SensitivityPlan,
        folder: &Path,
        keep: bool,
        scratch: Option<&Path>,
    ) -> Self {
        let work = folder.join("work");
        let flying_in = scratch.map_or_else(|| work.clone(), Path::to_owned);
        OwnFolder::sweep(&work);
        OwnFolder::sweep(&flying_in);
        Self { host, study, work, flying_in, keep }
    }

    /// Flies one.
    pub(super) fn fly(&self, item: &Item) -> Result<Done, NotDone> {
        // Several processes may fly parts of a study in one folder.
        let name = format!("{:06}", item.index);
        let own = OwnFolder::make(&self.flying_in, &name).map_err(NotDone::File)?;
        let root = own.path();
        let silent = Silent::new(self.host);
        let result = self.flown(&silent, item, root);
        let is_over =
            !matches!(&result, Err(WorkflowError::Interrupted | WorkflowError::Stopped(_)));
        if self.keep && is_over {
            own.keep(&self.work.join(&name), "campaign.json").map_err(NotDone::File)?;
        }
        let result = match result {
            Ok(outcome) => Ok(outcome),
            Err(WorkflowError::Interrupted | WorkflowError::Stopped(_)) => {
                return Err(NotDone::Stopped);
            }
            Err(
                WorkflowError::File(error) | WorkflowError::Campaign(CampaignError::File(error)),
            ) => {
                return Err(NotDone::File(error));
            }
            // Where it was flown says nothing of the campaign.
            Err(error) => Err(with_reasons(&error)
                .replace(&format!("{}/", root.shown()), "")
                .replace('\n', " ")),
        };
        let place = format!("{}/", root.shown());
        let mut warnings = silent.into_heard();
        for warning in &mut warnings {
            *warning = warning.replace(&place, "");
        }
        Ok(Done { result, warnings })
    }

    fn flown(&self, host: &dyn Host, item: &Item, root: &Path) -> Result<Outcome, WorkflowError> {
        let setup = self.study.setup_of(item).map_err(WorkflowError::Usage)?;
        let mission = planned(&setup, root)?;
        let mut flown = None;
        for (flight, folder) in mission.flights.iter().zip(folders(root, &mission)) {
            let plan = &flight.plan;
            let lost = (setup.lost_share * plan.slots.len() as f64).round() as usize;
            let only = kept(plan, item.seed, lost.min(plan.slots.len().saturating_sub(1)));
            let simulation = Simulation {
                truth: plan.purpose == Purpose::Measurement,
                vehicle: setup.flown_vehicle(&flight.vehicle).map_err(WorkflowError::Usage)?,
                only,
                ..Simulation::new(
                    setup.airs.of(plan.purpose).map_err(WorkflowError::Usage)?,
                    item.seed,
                )
            };
            let logs = simulate(host, &folder, plan, &simulation)?;
            let why = logs.failed.first().cloned().unwrap_or_default();
            if logs.unwritten {
                return Err(FileError::new("write", root, std::io::Error::other(why)).into());
            }
            if logs.logs == 0 {
                return Err(WorkflowError::Nothing(format!(
                    "no drone could fly the {}: {why}",
                    plan.name
                )));
            }
            flown = flown.or(simulation.vehicle);
        }
        let work = simulated(root)?;
        let analysed = Analysing::begin(host, &work, &Settings::default(), None)?.run(false)?;
        let flights = &analysed.analysis.flights;
        let mut maps = flights
            .iter()
            .filter(|flight| flight.purpose == Purpose::Measurement)
            .filter_map(|flight| flight.map.as_ref());
        let outcome = maps
            .find_map(Outcome::of_map)
            .ok_or_else(|| WorkflowError::Nothing("the analysis gave no map".to_owned()))?;
        let naming = match (&self.study.naming, mission.flights.first()) {
            (Some(effect), Some(flight)) => {
                let model = &flight.vehicle;
                Some(named(root, effect, model, flown.as_ref().unwrap_or(model))?)
            }
            _ => None,
        };
        Ok(Outcome { naming, ..outcome })
    }
}

/// Plans a campaign, and writes what flight and analysis read of it: no shows, which nobody sees.
fn planned(setup: &Setup, root: &Path) -> Result<Mission, WorkflowError> {
    let mission = setup.mission(None)?;
    let own = mission.flights.first().map(|flight| &flight.vehicle);
    let changed = own.map(|own| setup.planned_vehicle(own)).transpose();
    let mission = match changed.map_err(WorkflowError::Usage)?.flatten() {
        None => mission,
        Some(vehicle) => {
            let path = root.join("vehicle.toml");
            write_whole(&path, text_of(&vehicle)?.as_bytes())?;
            setup.mission(Some(&path.to_string_lossy()))?
        }
    };
    for (flight, folder) in mission.flights.iter().zip(folders(root, &mission)) {
        write_flight(
            &folder,
            &flight.template_text,
            &flight.vehicle,
            &to_json(&flight.plan).map_err(|error| {
                WorkflowError::Failed(format!("failed to write the plan: {error}"))
            })?,
        )?;
    }
    write_index(root, &mission)?;
    Ok(mission)
}

fn write_flight(
    folder: &FlightFolder,
    template: &str,
    vehicle: &Vehicle,
    plan: &[u8],
) -> Result<(), WorkflowError> {
    write_whole(&folder.template(), template.as_bytes())?;
    write_whole(&folder.vehicle(), text_of(vehicle)?.as_bytes())?;
    Ok(write_whole(&folder.plan(), plan)?)
}

fn text_of(vehicle: &Vehicle) -> Result<String, WorkflowError> {
    toml::to_string(vehicle)
        .map_err(|error| WorkflowError::Failed(format!("failed to write the vehicle: {error}")))
}
