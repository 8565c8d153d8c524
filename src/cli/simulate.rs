//! `updraft simulate`: flies a campaign in the embedded simulator, one log per drone.

use std::path::PathBuf;

use clap::Args;
use schemars::JsonSchema;
use serde::Serialize;

use super::context::Context;
use super::exit::{CommandError, Exit};
use super::shard_args::{self, ShardArgs};
use crate::campaign;
use crate::effects;
use crate::sim::air::spec::{self, Air, AirSpec};
use crate::vehicle::library;
use crate::workflow::share::ShardDone;
use crate::workflow::simulate::{
    Flown, Simulation, check_complete, numbered, simulate, uniform_mps, would_fly,
};
use crate::workflow::slots::SlotSet;

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
    /// Air to add: KIND:KEY=VALUE,..., a TOML file or the name of one (see below); can be repeated
    #[arg(long = "air", value_name = "SPEC", value_parser = air_specs)]
    pub(super) specs: Vec<AirSpecs>,
    /// Write the true air at each drone's planned position to truth/, beside the logs
    #[arg(long)]
    pub(super) truth: bool,
    /// Seed for sensor noise, clock offsets and random air
    #[arg(long, default_value_t = 1)]
    pub(super) seed: u64,
    /// Log the firmware's whole default set of messages (about ten times larger)
    #[arg(long)]
    pub(super) full_logs: bool,
    /// Switch an effect on or off, or set one of its parameters: NAME, NAME=off,
    /// NAME.PARAMETER=NUMBER (`updraft effects` lists them)
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

impl AirSpecs {
    /// All of these together; `None`: nothing is said.
    pub(super) fn all(specs: &[Self]) -> Option<Vec<AirSpec>> {
        let all = || specs.iter().flat_map(|specs| specs.0.iter().cloned()).collect();
        (!specs.is_empty()).then(all)
    }
}

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
        "Kinds of air for --air, with their keys and [defaults]; several --air add up (`still` \
         for none):\n{}\nMean wind: that of the uniform parts, and of profiles at their reference \
         height.\nCombinations that come with the program: {}\n",
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
    /// The air of a flight with a uniform vertical speed.
    pub(super) fn air(&self, updraft_mps: f64) -> Air {
        let specs: Vec<_> = self.specs.iter().flat_map(|specs| specs.0.iter().cloned()).collect();
        Air::new(uniform_mps(self.wind, self.wind_from, updraft_mps), &specs)
    }

    /// A flight of all drones in that air, in the vehicle that was planned for.
    pub(super) fn simulation(&self, updraft_mps: f64, force: bool) -> Simulation {
        Simulation {
            truth: self.truth,
            full_logs: self.full_logs,
            effects: self.effects.clone(),
            force,
            ..Simulation::new(self.air(updraft_mps), self.seed)
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
  updraft simulate my-campaign --shard 3/10       (every tenth drone, for one of ten processes)

Existing logs that were flown with the same settings are kept, so an interrupted run can be resumed.
Logs that have changed since (truncated, damaged) are flown again.

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
    /// Say what would be flown, and what models' output (--air les:...) covers, but fly nothing
    #[arg(long)]
    dry_run: bool,
    /// Replace simulated logs that were flown with other settings
    #[arg(long, conflicts_with_all = ["shard", "no_fly"])]
    force: bool,
    #[command(flatten)]
    air: AirArgs,
    #[command(flatten)]
    sharing: ShardArgs,
}

/// Parser of sets of slots: `1-10,12`.
pub(super) fn parse_slots(text: &str) -> Result<SlotSet, String> {
    text.parse()
}

#[derive(Serialize, JsonSchema)]
pub(super) struct SimulateOutput {
    schema: &'static str,
    flights: Vec<Flown>,
}

impl SimulateArgs {
    /// Folder of the campaign, and the logs that the simulation makes.
    pub(super) fn results(&self) -> Result<(PathBuf, Vec<PathBuf>), CommandError> {
        if self.drones.is_some() {
            return Err(CommandError::Usage(
                "on a cluster all drones are shared out: leave --drones away".to_owned(),
            ));
        }
        let mut logs = Vec::new();
        for folder in campaign::flights(&self.campaign)? {
            let plan = folder.read_plan()?;
            if self.flight.as_ref().is_none_or(|name| *name == plan.name) {
                let count = plan.slots.len();
                logs.extend(plan.slots.iter().map(|slot| folder.simulated_log(slot.slot, count)));
            }
        }
        Ok((self.campaign.clone(), logs))
    }
}

pub(super) fn run(context: &Context, args: &SimulateArgs) -> Result<Exit, CommandError> {
    let folders = campaign::flights(&args.campaign)?;
    let vehicle = args.vehicle.as_deref().map(library::load).transpose()?;
    let share = args.sharing.share();
    let simulation = Simulation {
        vehicle,
        only: args.drones.clone(),
        share,
        ..args.air.simulation(args.updraft, args.force)
    };
    // Shards share the folder, on file systems that may have no locks.
    let _lock = (share.shard.is_none() && !args.dry_run)
        .then(|| context.lock(&args.campaign))
        .transpose()?;
    let mut plans = Vec::new();
    for folder in &folders {
        let plan = folder.read_plan()?;
        if args.flight.as_ref().is_none_or(|name| *name == plan.name) {
            plans.push((folder, plan));
        }
    }
    if plans.is_empty() {
        let name = args.flight.as_deref().unwrap_or_default();
        return Err(CommandError::Usage(format!("the campaign has no flight \"{name}\"")));
    }
    let plans = numbered(plans, &simulation);
    if args.dry_run {
        for (_, plan, simulation) in &plans {
            would_fly(context, plan, simulation)?;
        }
        return Ok(Exit::Done);
    }
    if share.gather_only {
        check_complete(&plans)?;
    }
    let mut flights = Vec::new();
    for (folder, plan, simulation) in &plans {
        flights.push(simulate(context, folder, plan, simulation)?);
    }
    let failed = flights.iter().any(|flight| !flight.failed.is_empty());
    if let Some(shard) = share.shard {
        let sum = |of: fn(&Flown) -> usize| flights.iter().map(of).sum::<usize>();
        let (logs, there) = (sum(|flight| flight.logs), sum(|flight| flight.kept));
        let lost: Vec<String> =
            flights.iter().flat_map(|flight| flight.failed.iter().cloned()).collect();
        let done = ShardDone { shard, items: logs + lost.len(), there, lost };
        return shard_args::report(context, &done, "log");
    }
    if context.json {
        context.print_json(&SimulateOutput { schema: "updraft.simulate/1", flights })?;
    }
    Ok(if failed { Exit::Losses } else { Exit::Done })
}
