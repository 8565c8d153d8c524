//! The flight of a plan in a foreign world, into a folder that looks like any other flight's.

use std::cell::RefCell;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use foreign_worlds::air::{Air, AirSettings};
use foreign_worlds::flight::{Site, span_s};
use foreign_worlds::{Drone, Target, World};
use rayon::prelude::*;

use super::known;
use crate::base::file::{FileError, create_folder, sweep_partial, write_whole};
use crate::blind::error::BlindError;
use crate::blind::fly::{Flown, START, planned};
use crate::blind::scenario::{SPACING_M, Scenario};
use crate::campaign::{FlightFolder, to_json};
use crate::mission::Plan;
use crate::mission::plan::Slot;
use crate::show::quantise::as_flown;
use crate::show::trajectory::{Cursor, Trajectory};

/// A drone that was farther than this from its target did not fly the plan and has no log, m.
const LOST_M: f64 = 30.0;
/// A drone has left the ground when its target is this high, m.
const OFF_GROUND_M: f64 = 0.01;
/// Distance of the moments at which it is looked for, s.
const LOOK_S: f64 = 0.05;

/// Flies a scenario in its world: `folder` gets template, known vehicle, plan and the logs that are not lost.
///
/// # Errors
/// When nothing can be planned, identified or written, or `stop` is raised.
pub fn fly(
    scenario: &Scenario,
    world: &World,
    folder: &Path,
    stop: Option<&AtomicBool>,
) -> Result<Flown, BlindError> {
    let flight = planned(scenario)?;
    let plan = &flight.plan;
    let folder = FlightFolder(folder.to_owned());
    create_folder(&folder.logs())?;
    sweep_partial(&folder.logs())?;
    let text = |what, reason: String| BlindError::Text { what, reason };
    let known = known::vehicle(world, &scenario.cell)?.vehicle;
    let known = toml::to_string(&known).map_err(|error| text("the vehicle", error.to_string()))?;
    write_whole(&folder.template(), flight.template_text.as_bytes())?;
    write_whole(&folder.vehicle(), known.as_bytes())?;
    let settings = Settings {
        world,
        air_seed: world.seed,
        charges: &scenario.nuisance.charges,
        missing: &scenario.nuisance.missing,
        stop,
    };
    let flown = fly_plan(plan, &settings, &folder)?;
    // The plan last: a folder with a plan is whole.
    let json = to_json(plan).map_err(|error| text("the plan", error.to_string()))?;
    write_whole(&folder.plan(), &json)?;
    Ok(flown)
}

/// How a plan is flown.
#[derive(Clone, Copy)]
pub struct Settings<'a> {
    /// World that is flown in: plant, air, battery, noise and what is hidden.
    pub world: &'a World,
    /// Seed of the air's motion: flights of one fleet meet different air.
    pub air_seed: u64,
    /// Charge of each slot's battery, 0 to 1; full where there is none.
    pub charges: &'a [f64],
    /// Slots without a log.
    pub missing: &'a [u16],
    /// Ends the flight when raised.
    pub stop: Option<&'a AtomicBool>,
}

/// The air that [`fly_plan`] flies a plan in.
///
/// # Errors
/// When a drone's show cannot be flown.
pub fn air_of(plan: &Plan, settings: &AirSettings, seed: u64) -> Result<Air, BlindError> {
    let spans: Vec<[f64; 2]> = trajectories(plan)?.iter().map(flown_s).collect();
    Ok(Air::new(settings, span_of(&spans), seed))
}

/// What the drones of a plan fly.
fn trajectories(plan: &Plan) -> Result<Vec<Trajectory>, BlindError> {
    let show = plan.to_show();
    let each = plan.slots.iter().zip(&show.drones).map(|(slot, drone)| {
        let flown = as_flown(drone);
        let slot = slot.slot;
        flown.map(|flown| flown.trajectory).map_err(|source| BlindError::Skyb { slot, source })
    });
    each.collect()
}

/// Span of show time that the air must cover, s.
fn span_of(flown_s: &[[f64; 2]]) -> [f64; 2] {
    let from_s = flown_s.iter().map(|span| span[0]).fold(f64::INFINITY, f64::min);
    let to_s = flown_s.iter().map(|span| span[1]).fold(0.0, f64::max);
    span_s(from_s, to_s)
}

/// Flies a plan: `folder` gets the logs that are not lost.
///
/// # Errors
/// When nothing can be written, or the flight is stopped.
pub fn fly_plan(
    plan: &Plan,
    settings: &Settings<'_>,
    folder: &FlightFolder,
) -> Result<Flown, BlindError> {
    let trajectories = trajectories(plan)?;
    let spans: Vec<[f64; 2]> = trajectories.iter().map(flown_s).collect();
    let air = Air::new(&settings.world.air, span_of(&spans), settings.air_seed);
    let Settings { world, missing, stop, .. } = *settings;
    let count = plan.slots.len();
    let flown: Vec<Option<u64>> = plan
        .slots
        .par_iter()
        .zip(trajectories.par_iter().zip(&spans))
        .filter(|(slot, _)| !missing.contains(&slot.slot))
        .map(|(slot, (trajectory, span))| {
            if stop.is_some_and(|stop| stop.load(Ordering::Relaxed)) {
                return Err(BlindError::Stopped);
            }
            let path = folder.log(slot.slot, count);
            let cursor = RefCell::new(Cursor::new(trajectory));
            let target = |time_s: f64| {
                let state = cursor.borrow_mut().state_at(time_s);
                Target {
                    position_m: state.position_m.into(),
                    velocity_mps: state.velocity_mps.into(),
                }
            };
            let index = usize::from(slot.slot.saturating_sub(1));
            let drone = Drone {
                slot: slot.slot,
                home_m: slot.home_m,
                has_left: has_left(plan, slot),
                charge: settings.charges.get(index).copied().unwrap_or(1.0),
                target: &target,
                takeoff_s: span[0],
                end_s: span[1],
                site: Site {
                    lat_deg: plan.site.origin_lat_deg,
                    lon_deg: plan.site.origin_lon_deg,
                    amsl_m: plan.site.ground_amsl_m,
                    orientation_deg: plan.site.orientation_deg,
                },
                start: (i64::from(START.week), i64::from(START.tow_ms)),
            };
            let mut bytes = Vec::new();
            let flown = foreign_worlds::fly(world, &air, &drone, &mut bytes)
                .map_err(|error| FileError::new("write", &path, error))?;
            if flown.farthest_m > LOST_M {
                return Ok(None);
            }
            write_whole(&path, &bytes)?;
            Ok(Some(bytes.len() as u64))
        })
        .collect::<Result<_, BlindError>>()?;
    Ok(Flown {
        logs: flown.iter().flatten().count(),
        bytes: flown.iter().flatten().sum(),
        lost: flown.iter().filter(|log| log.is_none()).count(),
    })
}

/// When a trajectory leaves the ground and when it ends, show time, s.
fn flown_s(trajectory: &Trajectory) -> [f64; 2] {
    let end_s = trajectory.duration_ms() as f64 / 1000.0;
    let ground_m = trajectory.start_m.z;
    let mut cursor = Cursor::new(trajectory);
    let mut time_s = 0.0;
    while time_s < end_s && cursor.state_at(time_s).position_m.z < ground_m + OFF_GROUND_M {
        time_s += LOOK_S;
    }
    [(time_s - LOOK_S).max(0.0), end_s]
}

/// Whether another drone flies next to a slot on its left, along show y.
fn has_left(plan: &Plan, slot: &Slot) -> bool {
    let near_m = 1.5 * SPACING_M;
    plan.slots.iter().any(|other| {
        let [x, y] = [0, 1].map(|axis| other.home_m[axis] - slot.home_m[axis]);
        x.abs() < 0.1 * SPACING_M && y > 0.1 * SPACING_M && y < near_m
    })
}
