//! `updraft simulate`: flies a campaign in the embedded simulator, one log per drone.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

use clap::Args;
use rayon::prelude::*;
use serde::Serialize;
use sha2::{Digest, Sha256};

use super::clock::Stopwatch;
use super::context::Context;
use super::exit::{CommandError, Exit};
use super::flown::{changed_logs, prepare, taken_down, write_record};
use super::progress::Progress;
use super::words;
use crate::base::plain::Shown as _;
use crate::campaign::{self, FlightFolder, FlightRecord};
use crate::effects;
use crate::mission::Plan;
use crate::mission::plan::Slot;
use crate::show::ShowDrone;
use crate::show::quantise::as_flown;
use crate::sim::air::spec::{self, Air, AirSpec};
use crate::sim::air::truth;
use crate::sim::{FlightSetup, FlightSummary, Hooks, SimError, fly_to_file};
use crate::vehicle::{Vehicle, library};

/// Drones that are named in one warning.
const MOST_NAMED: usize = 10;

/// Motion of the air and seed of a simulated flight, shared by `simulate` and `run`.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Simulation")]
pub(super) struct AirArgs {
    /// Horizontal wind speed, m/s
    #[arg(long, value_name = "MPS", default_value_t = 0.0, value_parser = speed, allow_negative_numbers = true)]
    pub(super) wind: f64,
    /// Where the wind comes from, degrees clockwise from north
    #[arg(long, value_name = "DEG", default_value_t = 270.0, allow_hyphen_values = true)]
    pub(super) wind_from: f64,
    /// Air to add, repeatable: KIND:KEY=VALUE,... or a TOML file or its name (see below)
    #[arg(long = "air", value_name = "SPEC", value_parser = air_specs)]
    pub(super) specs: Vec<AirSpecs>,
    /// Write the true air at each drone's planned place to truth/, beside the logs
    #[arg(long)]
    pub(super) truth: bool,
    /// Seed of sensor noise, clock offsets and random air
    #[arg(long, default_value_t = 1)]
    pub(super) seed: u64,
    /// Log the firmware's whole default set of messages (about ten times larger)
    #[arg(long)]
    pub(super) full_logs: bool,
    /// Switch a piece of physics on or off, or set a parameter: NAME, NAME=off, NAME.PARAMETER=NUMBER
    /// (`updraft effects` lists them)
    #[arg(long = "effect", value_name = "NAME[=off]", value_parser = effect)]
    pub(super) effects: Vec<String>,
}

/// Checks a choice of effect without its vehicle's own bounds.
fn effect(text: &str) -> Result<String, String> {
    let name = text.split(['=', '.']).next().unwrap_or_default().trim();
    effects::select::known(name).map_err(|error| error.to_string())?;
    Ok(text.to_owned())
}

/// `--air still`: nothing is added.
const STILL: &str = "still";

/// What one `--air` asks for.
#[derive(Clone, Debug, Default)]
pub(super) struct AirSpecs(Vec<AirSpec>);

/// Parser of `--air`.
pub(super) fn air_specs(text: &str) -> Result<AirSpecs, String> {
    if text == STILL {
        return Ok(AirSpecs::default());
    }
    spec::load(text).map(AirSpecs).map_err(|error| super::exit::with_reasons(&error))
}

/// The part of the long help that lists the kinds of air.
pub(super) fn air_help() -> String {
    let files: Vec<_> = spec::builtin_names().collect();
    format!(
        "Kinds of air for --air, with their keys and [defaults]; several --air add up (`still`: \
         none):\n{}\n\
         Mean wind: that of the uniform parts, and of profiles at their reference height.\n\
         Files of several that come with the program: {}\n",
        spec::help_text(),
        files.join(", ")
    )
}

/// Parser of wind speeds.
pub(super) fn speed(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if (0.0..=30.0).contains(&value) => Ok(value),
        _ => Err("a wind speed between 0 and 30 m/s".to_owned()),
    }
}

/// Parser of vertical air speeds.
pub(super) fn updraft(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if (-20.0..=20.0).contains(&value) => Ok(value),
        _ => Err("a vertical air speed between -20 and 20 m/s, up positive".to_owned()),
    }
}

impl AirArgs {
    /// Whether anything but a uniform wind is asked for.
    pub(super) fn moves(&self) -> bool {
        self.specs.iter().any(|specs| !specs.0.is_empty())
    }

    /// The air of a flight with a uniform vertical speed.
    pub(super) fn air(&self, updraft_mps: f64) -> Air {
        let (sin, cos) = self.wind_from.to_radians().sin_cos();
        // Adding zero turns -0 into 0, which reads better in files.
        let uniform_mps = [-self.wind * sin + 0.0, -self.wind * cos + 0.0, updraft_mps];
        let specs: Vec<_> = self.specs.iter().flat_map(|specs| specs.0.iter().cloned()).collect();
        Air::new(uniform_mps, &specs)
    }

    /// A flight of all drones in that air, in the vehicle that was planned for.
    pub(super) fn simulation(&self, updraft_mps: f64, force: bool) -> Simulation {
        Simulation {
            air: self.air(updraft_mps),
            truth: self.truth,
            seed: self.seed,
            full_logs: self.full_logs,
            effects: self.effects.clone(),
            vehicle: None,
            only: None,
            force,
        }
    }
}

/// Arguments of `updraft simulate`.
#[derive(Debug, Args)]
#[command(after_long_help = format!("Examples:
  updraft simulate my-campaign
  updraft simulate my-campaign --flight hover --updraft 1.5 --wind 5
  updraft simulate my-campaign --flight hover --air field:sd=0.5,lambda=145 --truth
  updraft simulate my-campaign --drones 1-10,12 --full-logs

Logs that are there and were flown with the same settings are kept: an interrupted run goes on where
it stopped. Logs that are not as they were flown (cut short, damaged) are flown again.

{}", air_help()))]
pub(super) struct SimulateArgs {
    /// Campaign folder
    campaign: PathBuf,
    /// Only this flight of the campaign
    #[arg(long, value_name = "NAME")]
    flight: Option<String>,
    /// Only these slots: 1-10,12 (a slot named twice is flown once)
    #[arg(long, value_name = "SLOTS", value_parser = parse_slots, allow_hyphen_values = true)]
    drones: Option<SlotSet>,
    /// Vertical air speed, m/s, up positive
    #[arg(long, value_name = "MPS", default_value_t = 0.0, value_parser = updraft, allow_hyphen_values = true)]
    updraft: f64,
    /// Vehicle to fly instead of the planned one
    #[arg(long, value_name = "NAME")]
    vehicle: Option<String>,
    /// Replace simulated logs that were flown with other settings
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    air: AirArgs,
}

/// A set of slots.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct SlotSet(BTreeSet<u16>);

/// Parser of sets of slots: `1-10,12`.
pub(super) fn parse_slots(text: &str) -> Result<SlotSet, String> {
    let bad = || "write slots as 1-10,12,20-29".to_owned();
    let mut slots = BTreeSet::new();
    for part in text.split(',') {
        let (first, last) = part.split_once('-').unwrap_or((part, part));
        let first: u16 = first.trim().parse().map_err(|_| bad())?;
        let last: u16 = last.trim().parse().map_err(|_| bad())?;
        if first == 0 || last < first {
            return Err(bad());
        }
        slots.extend(first..=last);
    }
    Ok(SlotSet(slots))
}

impl FromIterator<u16> for SlotSet {
    fn from_iter<I: IntoIterator<Item = u16>>(slots: I) -> Self {
        Self(slots.into_iter().collect())
    }
}

impl SlotSet {
    /// The first of them that a plan does not have.
    pub(super) fn stray(&self, plan: &Plan) -> Option<u16> {
        self.0.iter().copied().find(|slot| plan.slot(*slot).is_none())
    }

    /// Whether a slot is one of them.
    pub(super) fn contains(&self, slot: u16) -> bool {
        self.0.contains(&slot)
    }
}

/// How one flight is to be simulated.
#[derive(Clone, Debug)]
pub(super) struct Simulation {
    pub(super) air: Air,
    pub(super) truth: bool,
    pub(super) seed: u64,
    pub(super) full_logs: bool,
    /// Choices of effects, over the vehicle's own.
    pub(super) effects: Vec<String>,
    pub(super) vehicle: Option<Vehicle>,
    pub(super) only: Option<SlotSet>,
    pub(super) force: bool,
}

/// What became of one flight.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Flown {
    pub(super) flight: String,
    pub(super) logs: usize,
    pub(super) kept: usize,
    pub(super) bytes: u64,
    pub(super) failed: Vec<String>,
    pub(super) saturated: Vec<u16>,
    pub(super) flat: Vec<u16>,
}

#[derive(Serialize)]
struct SimulateOutput {
    schema: &'static str,
    flights: Vec<Flown>,
}

pub(super) fn run(context: &Context, args: &SimulateArgs) -> Result<Exit, CommandError> {
    let folders = campaign::flights(&args.campaign)?;
    let vehicle = args.vehicle.as_deref().map(library::load).transpose()?;
    let simulation = Simulation {
        vehicle,
        only: args.drones.clone(),
        ..args.air.simulation(args.updraft, args.force)
    };
    let _lock = context.lock(&args.campaign)?;
    let mut flights = Vec::new();
    for folder in &folders {
        let plan = folder.read_plan()?;
        if args.flight.as_ref().is_some_and(|name| *name != plan.name) {
            continue;
        }
        flights.push(simulate(context, folder, &plan, &simulation)?);
    }
    if flights.is_empty() {
        let name = args.flight.as_deref().unwrap_or_default();
        return Err(CommandError::Usage(format!("the campaign has no flight \"{name}\"")));
    }
    let failed = flights.iter().any(|flight| !flight.failed.is_empty());
    if context.json {
        context.print_json(&SimulateOutput { schema: "updraft.simulate/1", flights })?;
    }
    Ok(if failed { Exit::Losses } else { Exit::Done })
}

/// The vehicle of a flight (another, if given), with the effects that were chosen.
pub(super) fn resolved_vehicle(
    folder: &FlightFolder,
    other: Option<&Vehicle>,
    choices: &[String],
) -> Result<Vehicle, CommandError> {
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
pub(super) struct Ready<'a> {
    pub(super) vehicle: Vehicle,
    pub(super) record: FlightRecord,
    /// The slots asked for.
    pub(super) wanted: Vec<&'a Slot>,
    /// Those of them that have no log yet.
    pub(super) open: Vec<&'a Slot>,
    pub(super) air: crate::sim::air::Sum,
}

/// Resolves a flight's vehicle and air, and finds what is still to be flown. Logs that are there and
/// fit are kept.
pub(super) fn make_ready<'a>(
    context: &Context,
    folder: &FlightFolder,
    plan: &'a Plan,
    simulation: &Simulation,
) -> Result<Ready<'a>, CommandError> {
    let vehicle = resolved_vehicle(folder, simulation.vehicle.as_ref(), &simulation.effects)?;
    if let Some(stray) = simulation.only.as_ref().and_then(|set| set.stray(plan)) {
        return Err(CommandError::Usage(format!(
            "{} has no slot {stray}; slots are 1 to {}",
            plan.name,
            plan.slots.len()
        )));
    }
    let mut record = prepare(folder, plan, simulation, &vehicle)?;
    let count = plan.slots.len();
    let wanted: Vec<_> = plan
        .slots
        .iter()
        .filter(|slot| simulation.only.as_ref().is_none_or(|set| set.contains(slot.slot)))
        .collect();
    let changed = changed_logs(folder, &record, &wanted, count)?;
    for (slot, how) in &changed {
        let path = folder.simulated_log(*slot, count);
        context.warn(&format!("{} is not as it was flown ({how}): flown again", path.shown()));
    }
    record.logs.retain(|log| !changed.contains_key(&log.slot));
    let is_open = |slot: &&Slot| {
        changed.contains_key(&slot.slot) || !folder.simulated_log(slot.slot, count).exists()
    };
    let open: Vec<_> = wanted.iter().copied().filter(is_open).collect();
    let frame = plan.site.frame();
    let air = spec::build(&simulation.air, &frame, simulation.seed, &plan.name);
    if simulation.truth {
        wanted.par_iter().try_for_each(|slot| {
            let path = folder.truth(slot.slot, count);
            truth::write(&path, &air, &plan.trajectory(slot), slot.slot, &frame)
        })?;
    }
    Ok(Ready { vehicle, record, wanted, open, air })
}

/// Flies one flight; logs that are there and fit are kept.
pub(super) fn simulate(
    context: &Context,
    folder: &FlightFolder,
    plan: &Plan,
    simulation: &Simulation,
) -> Result<Flown, CommandError> {
    let watch = Stopwatch::start();
    let ready = make_ready(context, folder, plan, simulation)?;
    let Ready { vehicle, record, open, air, .. } = &ready;
    let (start, frame, count) = (record.start, plan.site.frame(), plan.slots.len());
    let show = plan.to_show();
    let drones: BTreeMap<u16, &ShowDrone> =
        plan.slots.iter().zip(&show.drones).map(|(slot, drone)| (slot.slot, drone)).collect();
    let progress = Progress::new(context, "flying", open.len() as u64);
    let results: Vec<Result<FlightSummary, CommandError>> = open
        .par_iter()
        .map(|slot| {
            context.check_stop()?;
            // What is uploaded to a drone, so that simulated and virtual fleets log the same.
            let drone =
                drones.get(&slot.slot).copied().map_or_else(|| Ok(ShowDrone::default()), as_flown);
            let drone = drone.map_err(|error| {
                CommandError::Failed(format!("slot {} has no .skyb file: {error}", slot.slot))
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
                hooks: Hooks { progress: None, stop: Some(context.stop_flag()) },
            };
            let result = fly_to_file(&setup, &folder.simulated_log(slot.slot, count));
            progress.advance();
            result.map_err(|error| match error {
                SimError::Stopped { .. } => CommandError::Interrupted,
                other => other.into(),
            })
        })
        .collect();
    progress.finish();
    let mut saturated = Vec::new();
    let mut failed = Vec::new();
    let mut stopped = false;
    let mut flat = Vec::new();
    for (slot, result) in open.iter().zip(results) {
        if matches!(&result, Ok(summary) if summary.flat_s.is_some()) {
            flat.push(slot.slot);
        }
        match result {
            Ok(summary) if summary.saturated_share > 0.0 => saturated.push(slot.slot),
            Ok(_) => {}
            Err(CommandError::Interrupted) => stopped = true,
            Err(error) => failed.push(super::exit::with_reasons(&error)),
        }
    }
    if !flat.is_empty() {
        let named: Vec<_> = flat.iter().take(MOST_NAMED).map(u16::to_string).collect();
        let more = if flat.len() > MOST_NAMED { ", ..." } else { "" };
        context.warn(&format!(
            "{}: the battery of {} ran flat in flight (slots {}{more}); the simulation flies on at its empty \
             voltage, a real drone would not",
            plan.name,
            words::count(flat.len(), "drone"),
            named.join(", ")
        ));
    }
    let flown = settle(context, folder, plan, ready, failed, watch)?;
    if stopped {
        return Err(CommandError::Interrupted);
    }
    Ok(Flown { saturated, flat, ..flown })
}

/// Takes down what was flown, and says so.
pub(super) fn settle(
    context: &Context,
    folder: &FlightFolder,
    plan: &Plan,
    ready: Ready<'_>,
    failed: Vec<String>,
    watch: Stopwatch,
) -> Result<Flown, CommandError> {
    let Ready { mut record, wanted, open, .. } = ready;
    record.logs = taken_down(folder, plan, &record, &open)?;
    write_record(folder, &record)?;
    context.check_stop()?;
    let kept = wanted.len() - open.len();
    let bytes = record.logs.iter().map(|log| log.bytes).sum();
    for error in &failed {
        context.warn(error);
    }
    let word = if kept == wanted.len() { "Found" } else { "Flew" };
    context.say(&format!(
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
    })
}

/// Program and version, for records.
pub(super) fn made_by() -> String {
    concat!("updraft ", env!("CARGO_PKG_VERSION")).to_owned()
}

/// SHA-256 in hexadecimal.
pub(super) fn sha256(bytes: &[u8]) -> String {
    use std::fmt::Write as _;
    Sha256::digest(bytes).iter().fold(String::new(), |mut text, byte| {
        let _ = write!(text, "{byte:02x}");
        text
    })
}
