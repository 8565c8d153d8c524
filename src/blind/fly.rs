//! Flight of a blind scenario into a folder that looks like any other flight's.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use rayon::prelude::*;

use super::air::{AirScales, BlindAir};
use super::error::BlindError;
use super::foreign;
use super::scenario::{SPACING_M, Scenario};
use super::vehicles::true_vehicle;
use super::worlds;
use crate::base::file::{create_folder, sweep_partial, write_whole};
use crate::base::time::GpsTime;
use crate::campaign::{FlightFolder, to_json};
use crate::effects::Extra;
use crate::mission::Plan;
use crate::mission::resolve::{Override, ResolvedFlight, resolve};
use crate::show::ShowDrone;
use crate::show::quantise::as_flown;
use crate::sim::{Beyond, FlightSetup, Hooks, SimError, fly_beyond_to_file};
use crate::vehicle::Vehicle;

/// Number of plant steps in one control step: 1.25 ms each, where the simulator that the search
/// uses has 2.5 ms.
pub const PLANT_STEPS: u16 = 2;
/// When blind flights start: 2026-06-01 12:00 UTC. Fixed, so that the same seed gives the same bytes.
pub(super) const START: GpsTime = GpsTime { week: 2421, tow_ms: 129_618_000 };

/// Logs of a blind flight, and the drones that it lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Flown {
    /// Number of logs that were written.
    pub logs: usize,
    /// Total size of the logs, bytes.
    pub bytes: u64,
    /// Number of drones that were lost in flight.
    pub lost: usize,
}

/// Plan of a blind flight.
///
/// # Errors
/// When the template cannot be resolved.
pub fn planned(scenario: &Scenario) -> Result<ResolvedFlight, BlindError> {
    let cell = &scenario.cell;
    let overrides = [
        Override::new("vehicle", cell.base.vehicle_name()),
        Override::new("grid.rows", i64::from(cell.side)),
        Override::new("grid.columns", i64::from(cell.columns())),
        Override::new("grid.spacing_m", SPACING_M),
    ];
    let mut mission = resolve(cell.protocol.template(), &overrides)?;
    if mission.flights.is_empty() {
        let (what, reason) = ("the plan", "the template has no flight".to_owned());
        return Err(BlindError::Text { what, reason });
    }
    Ok(mission.flights.swap_remove(0))
}

/// Flies a blind flight: `folder` gets template, the *known* vehicle, plan and the logs that are not
/// lost, and nothing of the truth. Bytes do not depend on the number of threads. A drone that does
/// not come home has no log, as in the field.
///
/// # Errors
/// When nothing can be drawn, planned or written, or `stop` is raised.
pub fn fly(
    scenario: &Scenario,
    folder: &Path,
    stop: Option<&AtomicBool>,
) -> Result<Flown, BlindError> {
    if let Some(world) = &scenario.world {
        return worlds::fly::fly(scenario, world, folder, stop);
    }
    let flight = planned(scenario)?;
    let known = scenario.cell.base.known()?;
    let setting = Setting {
        plan: &flight.plan,
        template_text: &flight.template_text,
        known: &known,
        air: &scenario.nuisance.air,
        seed: scenario.seed,
        extra: &extra(scenario),
        missing: &scenario.nuisance.missing,
    };
    fly_into(folder, &setting, &|slot| true_vehicle(scenario, slot), stop)
}

/// What a flight is flown with, beside its drones.
#[derive(Clone, Copy)]
pub(super) struct Setting<'a> {
    pub(super) plan: &'a Plan,
    pub(super) template_text: &'a str,
    /// The vehicle that is handed over.
    pub(super) known: &'a Vehicle,
    pub(super) air: &'a AirScales,
    pub(super) seed: u64,
    pub(super) extra: &'a [Extra],
    /// Slots without a log.
    pub(super) missing: &'a [u16],
}

/// Flies a plan with a vehicle of its own for each slot.
pub(super) fn fly_into(
    folder: &Path,
    setting: &Setting<'_>,
    vehicle_of: &(dyn Fn(u16) -> Result<Vehicle, BlindError> + Sync),
    stop: Option<&AtomicBool>,
) -> Result<Flown, BlindError> {
    let folder = FlightFolder(folder.to_owned());
    let &Setting { plan, seed, missing, .. } = setting;
    let show = plan.to_show();
    create_folder(&folder.logs())?;
    sweep_partial(&folder.logs())?;
    let text = |what, reason: String| BlindError::Text { what, reason };
    let known =
        toml::to_string(setting.known).map_err(|error| text("the vehicle", error.to_string()))?;
    write_whole(&folder.template(), setting.template_text.as_bytes())?;
    write_whole(&folder.vehicle(), known.as_bytes())?;
    let air = BlindAir::new(setting.air, seed);
    let count = plan.slots.len();
    let flown: Vec<Option<u64>> = plan
        .slots
        .par_iter()
        .zip(&show.drones)
        .filter(|(slot, _)| !missing.contains(&slot.slot))
        .map(|(slot, drone)| {
            let path = folder.log(slot.slot, count);
            let drone: ShowDrone =
                as_flown(drone).map_err(|source| BlindError::Skyb { slot: slot.slot, source })?;
            let vehicle = vehicle_of(slot.slot)?;
            let setup = FlightSetup {
                vehicle: &vehicle,
                trajectory: &drone.trajectory,
                home_m: slot.home_m.into(),
                frame: plan.site.frame(),
                atmosphere: &air,
                seed,
                drone: slot.slot,
                start: START,
                lights: &drone.lights,
                full_logs: false,
                hooks: Hooks { progress: None, stop },
            };
            let beyond = Beyond { effects: setting.extra, plant_steps: PLANT_STEPS };
            match fly_beyond_to_file(&setup, beyond, &path) {
                Ok(_) => Ok(std::fs::metadata(&path).ok().map(|found| found.len())),
                Err(SimError::Stopped { .. }) => Err(BlindError::Stopped),
                Err(
                    SimError::NotLanded { .. }
                    | SimError::NeverBegun { .. }
                    | SimError::Diverged { .. },
                ) => Ok(None),
                Err(error) => Err(error.into()),
            }
        })
        .collect::<Result<_, BlindError>>()?;
    // The plan last: a folder with a plan is whole.
    let json = to_json(plan).map_err(|error| text("the plan", error.to_string()))?;
    write_whole(&folder.plan(), &json)?;
    Ok(Flown {
        logs: flown.iter().flatten().count(),
        bytes: flown.iter().flatten().sum(),
        lost: flown.iter().filter(|log| log.is_none()).count(),
    })
}

/// Hidden effects that no library lists, with their values.
pub fn extra(scenario: &Scenario) -> Vec<Extra> {
    let hidden = scenario.hidden.iter().filter(|hidden| hidden.foreign);
    hidden
        .filter_map(|hidden| {
            let effect = foreign::find(&hidden.effect)?.effect;
            let of = |name: &str| hidden.parameters.get(name).copied();
            Some((effect, foreign::values(effect.definition(), of)))
        })
        .collect()
}
