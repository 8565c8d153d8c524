//! One campaign of a study: planned, flown, analysed and held against the truth, in a folder of its own.

use std::fs;
use std::path::{Path, PathBuf};

use super::naming::named;
use super::silent::Silent;
use crate::base::file::{FileError, create_folder, write_whole};
use crate::base::plain::Shown as _;
use crate::campaign::lock::FolderLock;
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
    /// Folder of the campaigns' folders.
    work: PathBuf,
    keep: bool,
}

impl<'a> Campaigns<'a> {
    /// Makes room for campaigns, and removes what killed runs have left.
    pub(super) fn new(
        host: &'a dyn Host,
        study: &'a SensitivityPlan,
        folder: &Path,
        keep: bool,
    ) -> Result<Self, WorkflowError> {
        let work = folder.join("work");
        create_folder(&work)?;
        sweep(&work);
        Ok(Self { host, study, work, keep })
    }

    /// Flies one.
    pub(super) fn fly(&self, item: &Item) -> Result<Done, NotDone> {
        // Several processes may fly parts of a study in one folder.
        let name = format!("{:06}-{}", item.index, std::process::id());
        let root = self.work.join(if self.keep { format!("{:06}", item.index) } else { name });
        let silent = Silent::new(self.host);
        let result = self.flown(&silent, item, &root);
        if !self.keep {
            remove(&root)?;
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
        remove_all(root)?;
        create_folder(root)?;
        let _lock = FolderLock::take(root)?;
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

/// Removes the folders of killed runs: those that nobody has locked and that are no kept ones.
fn sweep(work: &Path) {
    let Ok(entries) = fs::read_dir(work) else { return };
    for path in entries.flatten().map(|entry| entry.path()) {
        let is_ours = path.file_name().and_then(|name| name.to_str()).is_some_and(|name| {
            let parts = name.split_once('-');
            parts.is_some_and(|(item, process)| {
                [item, process].iter().all(|part| part.bytes().all(|byte| byte.is_ascii_digit()))
            })
        });
        let left = is_ours.then(|| FolderLock::take(&path)).and_then(Result::ok);
        if left.is_some_and(|lock| lock.is_held()) {
            let _ = fs::remove_dir_all(&path);
        }
    }
}

fn remove(root: &Path) -> Result<(), NotDone> {
    remove_all(root).map_err(NotDone::File)
}

fn remove_all(root: &Path) -> Result<(), FileError> {
    match fs::remove_dir_all(root) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(FileError::new("remove", root, error))
        }
        _ => Ok(()),
    }
}
