//! `updraft run`: plan, check, fly, collect, analyse, report.

use std::path::PathBuf;

use clap::Args;

use super::analyze::{AnalyzeOptions, analyze_campaign};
use super::check::{Origin, checked, few, is_safe, say_findings};
use super::clock::Stopwatch;
use super::context::Context;
use super::exit::{CommandError, Exit};
use super::fleet::sim::MOST_DRONES;
use super::fly::fly_virtual;
use super::mission_args::MissionArgs;
use super::plan::{what_for_whom, write};
use super::simulate::{AirArgs, AirSpecs, air_help, air_specs, simulate, speed, updraft};
use crate::campaign;
use crate::mission::plan::Purpose;
use crate::show::Show;

/// Arguments of `updraft run`.
#[derive(Debug, Args)]
#[command(after_long_help = format!("Examples:
  updraft run
  updraft run --grid 3x3 --duration 120 --updraft -0.8 -o small
  updraft run calibration-counterphase -o counterphase
  updraft run --air field-day --truth -o field-day

The calibration is flown in still air unless --calibration-updraft, --calibration-wind or
--calibration-air say otherwise; the measurement in the air that --updraft, --wind and --air say.
The same command goes on where an interrupted one stopped.

{}", air_help()))]
pub(super) struct RunArgs {
    /// Template: a file or a built-in name
    #[arg(default_value = "campaign")]
    template: String,
    /// Campaign folder
    #[arg(short, long, value_name = "FOLDER", default_value = "my-campaign")]
    output: PathBuf,
    /// Replace another plan in the folder (see `plan --force`), and logs simulated with other
    /// settings; logs of real drones and of another plan are never touched
    #[arg(long)]
    force: bool,
    /// Vertical air speed in measurement flights, m/s, up positive [default: 1, or 0 with --air]
    #[arg(long, value_name = "MPS", value_parser = updraft, allow_hyphen_values = true)]
    updraft: Option<f64>,
    /// Fly in the simulator without MAVLink in between: the same logs, sooner (fleets of more than
    /// 800 drones always)
    #[arg(long)]
    direct: bool,
    /// Vertical air speed in calibration flights, m/s, up positive
    #[arg(long, value_name = "MPS", default_value_t = 0.0, value_parser = updraft, allow_hyphen_values = true)]
    calibration_updraft: f64,
    /// Horizontal wind speed in calibration flights, m/s
    #[arg(long, value_name = "MPS", default_value_t = 0.0, value_parser = speed, allow_negative_numbers = true)]
    calibration_wind: f64,
    /// Air to add in calibration flights, repeatable; as --air
    #[arg(long, value_name = "SPEC", value_parser = air_specs)]
    calibration_air: Vec<AirSpecs>,
    #[command(flatten)]
    air: AirArgs,
    #[command(flatten)]
    mission: MissionArgs,
}

pub(super) fn run(context: &Context, args: &RunArgs) -> Result<Exit, CommandError> {
    let watch = Stopwatch::start();
    let mission = args.mission.resolve(&args.template)?;
    let mut shows = Vec::new();
    for flight in &mission.flights {
        let show = Show::of_plan(&flight.plan);
        let report =
            checked(&show, &flight.plan, &flight.vehicle, &Origin::Plan, few(context, false));
        say_findings(context, &report, &[]);
        if !is_safe(&report, &[]) {
            context.insist("Nothing was flown: the show is not safe as it is");
            return Ok(Exit::Unsafe);
        }
        shows.push((show, report));
    }
    let _lock = context.lock(&args.output)?;
    write(context, &mission, &shows, &args.output, args.force)?;
    context.say(&format!(
        "Planned {} in {watch} -> {}",
        what_for_whom(&mission),
        args.output.display()
    ));
    let mut lost = false;
    for (folder, flight) in campaign::flights(&args.output)?.iter().zip(&mission.flights) {
        let mut air = args.air.clone();
        let updraft_mps = match flight.plan.purpose {
            Purpose::Calibration => {
                air.wind = args.calibration_wind;
                air.specs.clone_from(&args.calibration_air);
                args.calibration_updraft
            }
            Purpose::Measurement if air.specs.is_empty() => args.updraft.unwrap_or(1.0),
            Purpose::Measurement => args.updraft.unwrap_or(0.0),
        };
        let simulation = air.simulation(updraft_mps, args.force);
        let crowd = flight.plan.slots.len() > MOST_DRONES;
        let flown = if args.direct || crowd {
            simulate(context, folder, &flight.plan, &simulation)?
        } else {
            fly_virtual(context, folder, &flight.plan, &simulation)?
        };
        if flown.logs == 0 {
            return Err(CommandError::Failed(format!(
                "{}: no drone could be flown, so there is nothing to analyse; the reasons are above",
                flown.flight
            )));
        }
        lost |= !flown.failed.is_empty();
    }
    let exit = analyze_campaign(context, &args.output, &AnalyzeOptions::default())?;
    context.say(&format!("Done in {watch}"));
    Ok(if lost { Exit::Losses } else { exit })
}
