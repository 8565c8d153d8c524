//! `updraft plan`: a mission template becomes a campaign folder, if it is safe.

use std::path::{Path, PathBuf};

use clap::Args;
use schemars::JsonSchema;
use serde::Serialize;

use super::check::few;
use super::context::Context;
use super::exit::{BECAUSE, CommandError, Exit, is_end_of_pipe};
use super::expected_words::expected_words;
use super::mission_args::MissionArgs;
use super::{timetable, words};
use crate::analysis::expected::{AssumedAir, ExpectedErrors, expected_errors};
use crate::base::plain::Shown as _;
use crate::check::CheckReport;
use crate::mission::Plan;
use crate::mission::plan::Purpose;
use crate::mission::resolve::builtin_names;
use crate::mission::too_fast::too_fast;
use crate::workflow::check::{
    Origin, allowed, checked, is_safe, known, refusals, say_findings, verdict,
};
use crate::workflow::clock::Stopwatch;
use crate::workflow::plan::{legs_buy, what_for_whom, write};

/// Arguments of `updraft plan`.
#[derive(Debug, Args)]
#[command(after_long_help = format!("Examples:
  updraft plan templates/calibration.toml --grid 7x7 --spacing 7 --origin 47.4733,19.0621 -o my-campaign
  updraft plan hover --drones 12 --set height_m=60 -o hover-60
  updraft plan calibration-counterphase --dry-run

Templates are files or built-in names: {}.
The grammar is in docs/templates.md.", builtin_names().join(", ")))]
pub(super) struct PlanArgs {
    /// Template: a file or a built-in name
    template: String,
    /// Campaign folder [default: the template's name]
    #[arg(short, long, value_name = "FOLDER")]
    output: Option<PathBuf>,
    /// Replace another plan in the folder
    ///
    /// Overwrites template.toml, vehicle.toml, plan.json, show.skyc, show.csv.zip and skyb/NN.skyb
    /// (in a campaign also campaign.toml and campaign.json), and deletes skyb/NN.skyb of slots that
    /// the new plan does not have. Everything else stays as it is. A folder with logs of another plan
    /// is refused: logs are never deleted or overwritten.
    #[arg(long)]
    force: bool,
    /// Plan and check, but write nothing
    #[arg(long)]
    dry_run: bool,
    /// List every finding, not one line for each cause (--json always does)
    #[arg(short, long)]
    verbose: bool,
    /// Write the show even if this check (given by name) fails; can be repeated
    #[arg(long, value_name = "CHECK")]
    allow: Vec<String>,
    #[command(flatten)]
    assumed: AssumedArgs,
    #[command(flatten)]
    mission: MissionArgs,
}

/// Air that is assumed for the errors which a measurement will have.
#[derive(Clone, Copy, Debug, Args)]
#[command(next_help_heading = "Expected errors")]
struct AssumedArgs {
    /// Integral time of the vertical air speed over a drone that hovers, s [default: that of convective air at the flight's
    /// height in a wind of 3 m/s]
    #[arg(long, value_name = "S", value_parser = integral_scale, allow_negative_numbers = true)]
    integral_scale: Option<f64>,
    /// Standard deviation of the vertical air speed, m/s [default: that of convective air at the flight's height]
    #[arg(long, value_name = "MPS", value_parser = air_sd, allow_negative_numbers = true)]
    air_sd: Option<f64>,
}

/// Parser of integral times.
fn integral_scale(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if (0.1..=3_600.0).contains(&value) => Ok(value),
        _ => Err("an integral time between 0.1 and 3600 s".to_owned()),
    }
}

/// Parser of standard deviations.
fn air_sd(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if (0.01..=10.0).contains(&value) => Ok(value),
        _ => Err("a standard deviation between 0.01 and 10 m/s".to_owned()),
    }
}

/// What `--json` prints.
#[derive(Serialize, JsonSchema)]
pub(super) struct PlanOutput<'a> {
    /// Format name and version: `updraft.plan-output/1`.
    schema: &'static str,
    /// Folder that was written; null: none was, as asked for.
    folder: Option<&'a Path>,
    /// Flights in their order.
    flights: Vec<FlightOutput<'a>>,
}

#[derive(Serialize, JsonSchema)]
struct FlightOutput<'a> {
    /// The plan.
    plan: &'a Plan,
    /// What the checks found.
    check: &'a CheckReport,
    /// Errors that a measurement will have in the air that is assumed; null for other flights.
    expected: Option<ExpectedErrors>,
}

pub(super) fn run(context: &Context, args: &PlanArgs) -> Result<Exit, CommandError> {
    let watch = Stopwatch::start(context);
    known(&args.allow)?;
    let few = few(context, args.verbose);
    let mission = args.mission.resolve(&args.template)?;
    let folder = args.output.clone().unwrap_or_else(|| PathBuf::from(&mission.name));
    let (mut shows, mut reports, mut expected) = (Vec::new(), Vec::new(), Vec::new());
    let assumed =
        AssumedAir { integral_s: args.assumed.integral_scale, sd_mps: args.assumed.air_sd };
    let calibration =
        mission.flights.iter().map(|one| &one.plan).find(|one| one.purpose == Purpose::Calibration);
    let mut safe = true;
    // Who reads only the beginning of the timetable gets the whole campaign.
    let mut read = Ok(());
    for flight in &mission.flights {
        let show = flight.plan.to_show();
        let report = checked(&show, &flight.plan, &flight.vehicle, &Origin::Plan, few);
        let errors = expected_errors(&flight.plan, calibration, assumed);
        if !context.json && read.is_ok() {
            let is_example = args.mission.is_example(&flight.plan.site)?;
            let mut told = timetable::describe(&flight.plan, context.width, is_example);
            if let Some(bought) = legs_buy(&flight.plan, &flight.vehicle) {
                told = format!("{told}\n{bought}");
            }
            if let Some(errors) = &errors {
                told = format!("{told}\n{}", expected_words(errors, flight.plan.slots.len()));
            }
            read = context.print(&format!("{}\n", words::wrap(&told, context.width)));
            if matches!(&read, Err(CommandError::Output(error)) if !is_end_of_pipe(error)) {
                return read.map(|()| Exit::Done);
            }
        }
        say_findings(context, &report, &args.allow, args.verbose);
        safe &= is_safe(&report, &args.allow);
        shows.push(show);
        reports.push(report);
        expected.push(errors);
    }
    let written = safe && !args.dry_run;
    if written {
        let _lock = context.lock(&folder)?;
        write(context, &mission, &shows, &folder, args.force)?;
    }
    read?;
    if !safe {
        for wrong in mission.flights.iter().filter_map(too_fast) {
            context.insist(&wrong.to_string());
        }
        if context.json {
            let refused = reports.iter().flat_map(|report| refusals(report, &args.allow));
            let why: Vec<String> = refused.map(|cause| format!("{BECAUSE}{cause}")).collect();
            let why = why.concat();
            return Err(CommandError::Unsafe(format!(
                "nothing was written: the show is not safe as it is{why}"
            )));
        }
        context.insist("Nothing was written: the show is not safe as it is");
        return Ok(Exit::Unsafe);
    }
    if context.json {
        context.print_json(&PlanOutput {
            schema: "updraft.plan-output/1",
            folder: written.then_some(folder.as_path()),
            flights: mission
                .flights
                .iter()
                .zip(&reports)
                .zip(expected)
                .map(|((flight, check), expected)| FlightOutput {
                    plan: &flight.plan,
                    check,
                    expected,
                })
                .collect(),
        })?;
    }
    let allowed = allowed(reports.iter(), &args.allow);
    if !allowed.is_empty() {
        context.insist(&format!("{}: written as asked for", verdict(true, &allowed)));
    }
    if args.dry_run {
        context.say(&format!("Would write {}", folder.shown()));
    } else {
        context.result(&folder)?;
        context.say(&format!(
            "Planned {} in {watch} -> {}",
            what_for_whom(&mission),
            folder.shown()
        ));
    }
    Ok(Exit::Done)
}
