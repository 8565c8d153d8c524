//! Choice of the flight to compare, and of the model.

use std::path::{Path, PathBuf};

use super::Request;
use crate::analysis::TruthSeries;
use crate::base::plain::Shown as _;
use crate::campaign::{self, CampaignError, FlightFolder};
use crate::gap::Warning;
use crate::mission::plan::Purpose;
use crate::vehicle::{Vehicle, library};
use crate::workflow::analyze::load_plan;
use crate::workflow::error::WorkflowError;
use crate::workflow::find::{Found, Work, find, find_tables, stem};
use crate::workflow::host::Host;

/// Vehicle of logs that nobody planned here: the firmware's own simulator.
const UNPLANNED_VEHICLE: &str = "arducopter-sitl";

/// The measured flight, and the others that are there.
pub(super) fn measured(
    host: &dyn Host,
    request: &Request,
) -> Result<(Found, Vec<Found>), WorkflowError> {
    let plan = request.plan.as_deref().map(load_plan).transpose()?;
    if let Some(mapping) = &request.tables {
        let mut work = Work::new(mapping);
        find_tables(mapping, &mut work)?;
        return chosen(work.flights, mapping, request.flight.as_deref());
    }
    match (&request.campaign, &request.measured) {
        (Some(campaign), _) => {
            if plan.is_some() {
                return Err(WorkflowError::Usage(
                    "a campaign has its own plan; --plan can only be used with --measured"
                        .to_owned(),
                ));
            }
            is_campaign(campaign)?;
            measured_in(host, campaign, request)
        }
        (None, Some(path)) => {
            let (mut found, others) = measured_in(host, path, request)?;
            if plan.is_some() {
                found.plan = plan;
            }
            Ok((found, others))
        }
        (None, None) => Err(WorkflowError::Usage(
            "give a campaign folder, --measured LOGS or --csv MAPPING.toml".to_owned(),
        )),
    }
}

/// That there is a campaign to compare; if not, what to do with what is there instead.
fn is_campaign(campaign: &Path) -> Result<(), WorkflowError> {
    match campaign::flights(campaign) {
        Ok(_) => Ok(()),
        Err(CampaignError::NoPlan { path }) => Err(WorkflowError::Nothing(format!(
            "{} is not a campaign folder: it has neither a plan.json nor a campaign.json (for \
             logs alone: --measured LOGS with --plan or --simulated)",
            path.shown()
        ))),
        Err(error) => Err(error.into()),
    }
}

/// The flight of a path that is compared, and the others in their order. It is the one that is named,
/// else the calibration, else the first with logs.
pub(super) fn one_flight(
    path: &Path,
    name: Option<&str>,
) -> Result<(Found, Vec<Found>), WorkflowError> {
    let mut work = Work::new(path);
    find(path, None, &mut work)?;
    chosen(work.flights, path, name)
}

/// The measured flight of a path that is compared, and the others in their order; reports which logs
/// are taken.
fn measured_in(
    host: &dyn Host,
    path: &Path,
    request: &Request,
) -> Result<(Found, Vec<Found>), WorkflowError> {
    let mut work = Work::new(path);
    work.origin = request.origin;
    find(path, None, &mut work)?;
    for used in &work.used {
        host.say(used);
    }
    chosen(work.flights, path, request.flight.as_deref())
}

/// As [`one_flight`], of flights that were found.
fn chosen(
    mut flights: Vec<Found>,
    path: &Path,
    name: Option<&str>,
) -> Result<(Found, Vec<Found>), WorkflowError> {
    let is_meant = |flight: &Found| name.is_none_or(|name| flight.name == name);
    if let Some(name) = name
        && !flights.iter().any(is_meant)
    {
        let names: Vec<&str> = flights.iter().map(|flight| flight.name.as_str()).collect();
        return Err(WorkflowError::Usage(format!(
            "there is no flight \"{name}\"; the flights are {}",
            names.join(", ")
        )));
    }
    let is_usable = |flight: &Found| is_meant(flight) && !flight.logs.is_empty();
    let calibrates = |flight: &Found| flight.purpose == Some(Purpose::Calibration);
    let place = flights
        .iter()
        .position(|flight| calibrates(flight) && is_usable(flight))
        .or_else(|| flights.iter().position(is_usable));
    let flight = place.map(|place| flights.remove(place)).ok_or_else(|| {
        WorkflowError::Nothing(format!(
            "{} holds no logs: fly it (`updraft fly`), or put the drones' .BIN files into the \
             flight's logs folder",
            path.shown()
        ))
    })?;
    Ok((flight, flights))
}

/// Whether it is a measurement flight whose true air is known (simulated ones).
pub(super) fn knows_air(flight: &Found) -> bool {
    let has_slots = || flight.plan.as_ref().is_some_and(|plan| !plan.slots.is_empty());
    let is_uniform = flight.true_updraft_mps.is_some() && has_slots();
    flight.purpose == Some(Purpose::Measurement)
        && !flight.logs.is_empty()
        && (is_uniform || !flight.truth.is_empty())
}

/// The first of these flights whose true air is known, with that air for each slot.
pub(super) fn known_air(flights: Vec<Found>) -> Option<Found> {
    let mut flight = flights.into_iter().find(knows_air)?;
    if flight.truth.is_empty()
        && let (Some(updraft_mps), Some(plan)) = (flight.true_updraft_mps, &flight.plan)
    {
        let ends = plan.groups.iter().flat_map(|group| &group.segments).map(|s| s.end_ms);
        let seconds = ends.max().unwrap_or(0) as usize / 1000 + 60;
        let same = TruthSeries { first_s: 0, updraft_mps: vec![updraft_mps; seconds] };
        flight.truth = plan.slots.iter().map(|slot| (slot.slot, same.clone())).collect();
    }
    Some(flight)
}

/// The model that is held against the logs.
pub(super) fn model_of(request: &Request, found: &Found) -> Result<Vehicle, WorkflowError> {
    if let Some(name) = &request.vehicle {
        return Ok(library::load(name)?);
    }
    if let Some(campaign) = &request.campaign {
        let flights = campaign::flights(campaign)?;
        let by_plan =
            |folder: &&FlightFolder| folder.read_plan().is_ok_and(|plan| plan.name == found.name);
        // A plan's second flight has the name of its folder.
        let by_folder = |folder: &&FlightFolder| stem(&folder.0) == found.name;
        let folder = flights.iter().find(by_plan).or_else(|| flights.iter().find(by_folder));
        if let Some(folder) = folder {
            return Ok(library::load(&folder.vehicle().to_string_lossy())?);
        }
    }
    if let Some(file) = request.plan.as_deref().and_then(vehicle_beside) {
        return Ok(library::load(&file.to_string_lossy())?);
    }
    match &found.plan {
        Some(plan) => library::load(&plan.vehicle).map_err(|error| {
            WorkflowError::Usage(format!(
                "{error} (the plan's vehicle); give its file with --vehicle"
            ))
        }),
        None => Ok(library::load(UNPLANNED_VEHICLE)?),
    }
}

/// The vehicle's file in the folder of the flight that a plan is of.
fn vehicle_beside(plan: &Path) -> Option<PathBuf> {
    let folder = if plan.is_dir() { plan } else { plan.parent()? };
    let own = FlightFolder(folder.to_owned()).vehicle();
    let of_campaign = || match campaign::flights(folder).ok()?.as_slice() {
        [flight] => Some(flight.vehicle()),
        _ => None,
    };
    Some(own).filter(|file| file.is_file()).or_else(of_campaign).filter(|file| file.is_file())
}

/// Warning about logs without a plan.
pub(super) fn unplanned(request: &Request, found: &Found, vehicle: &Vehicle) -> Option<Warning> {
    (request.vehicle.is_none() && request.tables.is_none() && found.plan.is_none())
        .then(|| Warning::VehicleGuessed { vehicle: vehicle.name.clone() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_vehicle_of_a_plan_lies_beside_it() {
        let folder = tempfile::tempdir().unwrap();
        let plan = folder.path().join("plan.json");
        std::fs::write(&plan, "{}").unwrap();
        assert_eq!(vehicle_beside(&plan), None);
        let vehicle = FlightFolder(folder.path().to_owned()).vehicle();
        std::fs::write(&vehicle, "").unwrap();
        assert_eq!(vehicle_beside(&plan), Some(vehicle.clone()), "of its file");
        assert_eq!(vehicle_beside(folder.path()), Some(vehicle), "of the flight's folder");
        assert_eq!(vehicle_beside(&folder.path().join("elsewhere/plan.json")), None);
    }
}
