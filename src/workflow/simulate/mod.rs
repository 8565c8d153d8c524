//! Simulation of a campaign's flights: one log for each drone, and a record of how they were made.

mod record;

use std::collections::BTreeMap;

use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

use self::record::{changed_logs, prepare, taken_down, write_record};
use super::air::ReadAir;
use super::clock::Stopwatch;
use super::error::{WorkflowError, with_reasons};
use super::host::Host;
use super::share::numbers;
use super::slots::SlotSet;
use super::words;
use crate::base::file::FileError;
use crate::base::names::together;
use crate::base::plain::Shown as _;
use crate::base::shard::Share;
use crate::campaign::{FlightFolder, FlightRecord};
use crate::effects;
use crate::mission::Plan;
use crate::mission::plan::Slot;
use crate::show::ShowDrone;
use crate::show::quantise::as_flown;
use crate::sim::air::{self, spec::Air};
use crate::sim::{FlightSetup, FlightSummary, Hooks, SimError, fly_to_file};
use crate::vehicle::{Vehicle, library};

/// Drones that are named in one warning.
const MOST_NAMED: usize = 10;

/// Settings of the simulation of one flight.
#[derive(Clone, Debug)]
pub struct Simulation {
    /// Motion of the air in the flight.
    pub air: Air,
    /// Whether the true air at each drone's planned place is written beside the logs.
    pub truth: bool,
    /// Seed of sensor noise, clock offsets and random air.
    pub seed: u64,
    /// Whether the firmware's whole default set of messages is logged.
    pub full_logs: bool,
    /// Choices of effects, over the vehicle's own: `NAME`, `NAME=off`, `NAME.PARAMETER=NUMBER`.
    pub effects: Vec<String>,
    /// Vehicle to fly instead of the planned one.
    pub vehicle: Option<Vehicle>,
    /// Slots to fly; `None`: all of them.
    pub only: Option<SlotSet>,
    /// Whether logs that were flown with other settings are replaced.
    pub force: bool,
    /// Which of these slots are looked at by this process.
    pub share: Share,
    /// Number of the flight's first slot among the items that are shared out: slots of all flights are
    /// counted on.
    pub first_item: usize,
}

impl Simulation {
    /// Settings for all drones with the planned vehicle in this air, and small logs.
    pub fn new(air: Air, seed: u64) -> Self {
        Self {
            air,
            truth: false,
            seed,
            full_logs: false,
            effects: Vec::new(),
            vehicle: None,
            only: None,
            force: false,
            share: Share::default(),
            first_item: 0,
        }
    }
}

/// Velocity of uniform air towards east, north and up, m/s, from a wind speed, m/s, the direction
/// it comes from, degrees clockwise from north, and a vertical speed, m/s, up positive.
pub fn uniform_mps(wind_mps: f64, from_deg: f64, updraft_mps: f64) -> [f64; 3] {
    let (sin, cos) = from_deg.to_radians().sin_cos();
    // Adding zero turns -0 into 0, which reads better in files.
    [-wind_mps * sin + 0.0, -wind_mps * cos + 0.0, updraft_mps]
}

/// Outcome of one simulated flight.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Flown {
    /// Name of the flight.
    pub flight: String,
    /// Number of logs that are there now.
    pub logs: usize,
    /// Number of logs that were there before and fit.
    pub kept: usize,
    /// Size of all logs, bytes.
    pub bytes: u64,
    /// Reasons why drones gave no log, one sentence each.
    pub failed: Vec<String>,
    /// Slots whose rotors were at their limit at some time of the flight.
    pub saturated: Vec<u16>,
    /// Slots whose battery ran flat in flight.
    pub flat: Vec<u16>,
    /// Whether a log could not be written, which says nothing of the flight.
    #[serde(skip)]
    pub unwritten: bool,
}

/// The vehicle of a flight (another, if given), with the effects that were chosen.
pub(crate) fn resolved_vehicle(
    folder: &FlightFolder,
    other: Option<&Vehicle>,
    choices: &[String],
) -> Result<Vehicle, WorkflowError> {
    let mut vehicle = match other {
        Some(vehicle) => vehicle.clone(),
        None => library::load(&folder.vehicle().to_string_lossy())?,
    };
    for choice in choices {
        effects::select::choose(&mut vehicle, choice)?;
    }
    effects::select::resolved(&vehicle)?;
    Ok(vehicle)
}

/// A flight that is about to be flown.
pub(crate) struct Ready<'a> {
    pub(crate) vehicle: Vehicle,
    pub(crate) record: FlightRecord,
    /// The slots asked for.
    pub(crate) wanted: Vec<&'a Slot>,
    /// Those of them that have no log yet.
    pub(crate) open: Vec<&'a Slot>,
    pub(crate) air: air::Sum,
    /// The part of the air that is read from files in flight.
    read: ReadAir,
    share: Share,
}

/// Resolves a flight's vehicle and air, and finds what is still to be flown. Logs that are there and
/// fit are kept.
pub(crate) fn make_ready<'a>(
    host: &dyn Host,
    folder: &FlightFolder,
    plan: &'a Plan,
    simulation: &Simulation,
) -> Result<Ready<'a>, WorkflowError> {
    let vehicle = resolved_vehicle(folder, simulation.vehicle.as_ref(), &simulation.effects)?;
    if !simulation.effects.is_empty() {
        host.say(&format!(
            "{}: flown with {}, which its vehicle.toml does not say: `updraft analyze` does not know of it, and \
             `updraft gap` looks for it",
            plan.name,
            simulation.effects.join(", ")
        ));
    }
    if let Some(stray) = simulation.only.as_ref().and_then(|set| set.stray(plan)) {
        return Err(WorkflowError::Usage(format!(
            "{} has no slot {stray}; slots are 1 to {}",
            plan.name,
            plan.slots.len()
        )));
    }
    let count = plan.slots.len();
    let wanted = wanted(plan, simulation);
    // Before anything is written: air that does not cover the flight is refused.
    let read = ReadAir::of_plan(host, &simulation.air, plan, &wanted)?;
    let mut record = prepare(folder, plan, simulation, &vehicle, read.files()?)?;
    let changed = changed_logs(folder, &record, &wanted, count)?;
    for (slot, how) in &changed {
        let path = folder.simulated_log(*slot, count);
        let then = if simulation.share.gather_only { "it is missing" } else { "flown again" };
        host.warn(&format!("{} is not as it was flown ({how}): {then}", path.shown()));
    }
    record.logs.retain(|log| !changed.contains_key(&log.slot));
    let is_open = |slot: &&Slot| {
        changed.contains_key(&slot.slot) || !folder.simulated_log(slot.slot, count).exists()
    };
    let open: Vec<_> = wanted.iter().copied().filter(is_open).collect();
    if simulation.share.gather_only && !open.is_empty() {
        let slots = open.iter().map(|slot| slot.slot.into()).collect();
        return Err(missing(&[(plan.name.clone(), slots)], wanted.len()));
    }
    let frame = plan.site.frame();
    let air = read.with_drawn(&simulation.air, &frame, simulation.seed, &plan.name);
    if simulation.truth {
        wanted.par_iter().try_for_each(|slot| {
            let path = folder.truth(slot.slot, count);
            air::truth::write(&path, &air, &plan.trajectory(slot), slot.slot, &frame)
        })?;
    }
    read.check_read()?;
    Ok(Ready { vehicle, record, wanted, open, air, read, share: simulation.share })
}

/// The slots of one flight that are asked for.
fn wanted<'a>(plan: &'a Plan, simulation: &Simulation) -> Vec<&'a Slot> {
    let is_wanted = |slot: &&Slot| {
        let is_asked_for = simulation.only.as_ref().is_none_or(|set| set.contains(slot.slot));
        let item = simulation.first_item + usize::from(slot.slot) - 1;
        is_asked_for && simulation.share.takes(item)
    };
    plan.slots.iter().filter(is_wanted).collect()
}

/// Each flight with its slots counted on from those before it.
pub fn numbered<'a>(
    flights: Vec<(&'a FlightFolder, Plan)>,
    simulation: &Simulation,
) -> Vec<(&'a FlightFolder, Plan, Simulation)> {
    let mut first_item = 0;
    let number = |(folder, plan): (&'a FlightFolder, Plan)| {
        let slots = plan.slots.len();
        let numbered = (folder, plan, Simulation { first_item, ..simulation.clone() });
        first_item += slots;
        numbered
    };
    flights.into_iter().map(number).collect()
}

/// Ends the work if a log of these flights is missing, and names all that are.
///
/// # Errors
///
/// [`WorkflowError::Missing`].
pub fn check_complete(flights: &[(&FlightFolder, Plan, Simulation)]) -> Result<(), WorkflowError> {
    let (mut absent, mut of) = (Vec::new(), 0);
    for (folder, plan, simulation) in flights {
        let wanted = wanted(plan, simulation);
        of += wanted.len();
        let is_absent = |slot: &&&Slot| !folder.simulated_log(slot.slot, plan.slots.len()).exists();
        let slots: Vec<usize> =
            wanted.iter().filter(is_absent).map(|slot| slot.slot.into()).collect();
        if !slots.is_empty() {
            absent.push((plan.name.clone(), slots));
        }
    }
    if absent.is_empty() { Ok(()) } else { Err(missing(&absent, of)) }
}

/// Error that names missing slots, flight by flight.
fn missing(absent: &[(String, Vec<usize>)], of: usize) -> WorkflowError {
    let count = absent.iter().map(|(_, slots)| slots.len()).sum();
    let words = |(flight, slots): &(String, Vec<usize>)| format!("{flight} {}", numbers(slots));
    let missing = absent.iter().map(words).collect::<Vec<_>>().join("; ");
    WorkflowError::Missing { what: "logs", count, of, missing }
}

/// Says what would be flown of a flight, and checks that air which is read covers it.
///
/// # Errors
///
/// As those of [`simulate`] before it flies.
pub fn would_fly(
    host: &dyn Host,
    plan: &Plan,
    simulation: &Simulation,
) -> Result<(), WorkflowError> {
    let wanted = wanted(plan, simulation);
    ReadAir::of_plan(host, &simulation.air, plan, &wanted)?;
    let air = simulation.air.texts();
    let air = if air.is_empty() { String::new() } else { format!(" in {}", air.join(" and ")) };
    host.say(&format!(
        "Would fly {}: {}, {:.0} s{air}",
        plan.name,
        words::count(wanted.len(), "drone"),
        plan.duration_ms as f64 / 1000.0
    ));
    Ok(())
}

/// Flies one flight in the simulator, a drone on each processor; existing logs that fit are kept.
///
/// # Errors
///
/// If the flight's files cannot be read or written, its folder holds other logs, or the work is
/// stopped. Drones that cannot be flown are in [`Flown::failed`].
pub fn simulate(
    host: &dyn Host,
    folder: &FlightFolder,
    plan: &Plan,
    simulation: &Simulation,
) -> Result<Flown, WorkflowError> {
    let watch = Stopwatch::start(host);
    let ready = make_ready(host, folder, plan, simulation)?;
    let results = fly_open(host, folder, plan, simulation, &ready);
    let mut saturated = Vec::new();
    let mut failed = Vec::new();
    let mut stopped = false;
    let mut flat = Vec::new();
    let mut unwritten = false;
    for (slot, result) in ready.open.iter().zip(results) {
        if matches!(&result, Ok(summary) if summary.flat_s.is_some()) {
            flat.push(slot.slot);
        }
        match result {
            Ok(summary) if summary.saturated_share > 0.0 => saturated.push(slot.slot),
            Ok(_) => {}
            Err(WorkflowError::Interrupted) => stopped = true,
            Err(error) => {
                unwritten |= is_of_the_disk(&error);
                failed.push(with_reasons(&error));
            }
        }
    }
    warn_of_flat_batteries(host, plan, &flat);
    let flown = settle(host, folder, plan, ready, failed, &watch)?;
    if stopped {
        return Err(WorkflowError::Interrupted);
    }
    Ok(Flown { saturated, flat, unwritten, ..flown })
}

/// Flies the drones that have no log yet.
fn fly_open(
    host: &dyn Host,
    folder: &FlightFolder,
    plan: &Plan,
    simulation: &Simulation,
    ready: &Ready<'_>,
) -> Vec<Result<FlightSummary, WorkflowError>> {
    let Ready { vehicle, record, open, air, .. } = ready;
    let (start, frame, count) = (record.start, plan.site.frame(), plan.slots.len());
    let show = plan.to_show();
    let drones: BTreeMap<u16, &ShowDrone> =
        plan.slots.iter().zip(&show.drones).map(|(slot, drone)| (slot.slot, drone)).collect();
    let progress = host.progress("flying", open.len() as u64);
    let results: Vec<Result<FlightSummary, WorkflowError>> = open
        .par_iter()
        .map(|slot| {
            host.check_stop()?;
            // What is uploaded to a drone, so that simulated and virtual fleets log the same.
            let drone =
                drones.get(&slot.slot).copied().map_or_else(|| Ok(ShowDrone::default()), as_flown);
            let drone = drone.map_err(|error| {
                WorkflowError::Failed(format!("slot {} has no .skyb file: {error}", slot.slot))
            })?;
            let setup = FlightSetup {
                vehicle,
                trajectory: &drone.trajectory,
                home_m: slot.home_m.into(),
                frame,
                atmosphere: air,
                seed: simulation.seed,
                drone: slot.slot,
                start,
                lights: &drone.lights,
                full_logs: simulation.full_logs,
                hooks: Hooks { progress: None, stop: Some(host.stop_flag()) },
            };
            let result = fly_to_file(&setup, &folder.simulated_log(slot.slot, count));
            progress.advance();
            result.map_err(|error| match error {
                SimError::Stopped { .. } => WorkflowError::Interrupted,
                other => other.into(),
            })
        })
        .collect();
    progress.finish();
    results
}

/// Whether an error is of a log's file, not of the flight.
fn is_of_the_disk(error: &WorkflowError) -> bool {
    match error {
        WorkflowError::File(_) => true,
        WorkflowError::Sim(error) => {
            matches!(**error, SimError::File { .. } | SimError::Log { .. })
        }
        _ => false,
    }
}

fn warn_of_flat_batteries(host: &dyn Host, plan: &Plan, flat: &[u16]) {
    if !flat.is_empty() {
        let named: Vec<_> = flat.iter().take(MOST_NAMED).map(u16::to_string).collect();
        let more = if flat.len() > MOST_NAMED { ", ..." } else { "" };
        host.warn(&format!(
            "{}: the battery of {} ran flat in flight (slots {}{more}); the simulation flies on at its empty \
             voltage, a real drone would not",
            plan.name,
            words::count(flat.len(), "drone"),
            named.join(", ")
        ));
    }
}

/// Takes down what was flown, and says so.
pub(crate) fn settle(
    host: &dyn Host,
    folder: &FlightFolder,
    plan: &Plan,
    ready: Ready<'_>,
    failed: Vec<String>,
    watch: &Stopwatch,
) -> Result<Flown, WorkflowError> {
    let Ready { mut record, wanted, open, read, share, .. } = ready;
    if let Err(error) = read.check_read() {
        // They flew in other air than their record says.
        for slot in &open {
            let path = folder.simulated_log(slot.slot, plan.slots.len());
            if path.exists() {
                std::fs::remove_file(&path)
                    .map_err(|error| FileError::new("remove", &path, error))?;
            }
        }
        return Err(error);
    }
    let bytes = if share.shard.is_none() {
        record.logs = taken_down(folder, plan, &record, &open)?;
        write_record(folder, &record)?;
        record.logs.iter().map(|log| log.bytes).sum()
    } else {
        // What shards leave is entered by the run that puts them together.
        let paths = wanted.iter().map(|slot| folder.simulated_log(slot.slot, plan.slots.len()));
        paths.filter_map(|path| std::fs::metadata(path).ok()).map(|found| found.len()).sum()
    };
    host.check_stop()?;
    let kept = wanted.len() - open.len();
    for error in together("drone", failed.iter().map(String::as_str)) {
        host.warn(&error);
    }
    let word = if kept == wanted.len() { "Found" } else { "Flew" };
    host.say(&format!(
        "{word} {}: {}, {:.1} MB in {watch}{}",
        plan.name,
        words::count(wanted.len() - failed.len(), "log"),
        bytes as f64 / 1e6,
        if kept > 0 && kept < wanted.len() {
            format!(" ({kept} {} there)", if kept == 1 { "was" } else { "were" })
        } else {
            String::new()
        }
    ));
    Ok(Flown {
        flight: plan.name.clone(),
        logs: wanted.len() - failed.len(),
        kept,
        bytes,
        failed,
        saturated: Vec::new(),
        flat: Vec::new(),
        unwritten: false,
    })
}
