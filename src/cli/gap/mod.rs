//! `updraft gap`: where simulation and measurement disagree, and which physics is missing.

mod next;

use std::path::PathBuf;

use clap::{Args, Subcommand};
use schemars::JsonSchema;
use serde::Serialize;

use super::context::Context;
use super::exit::{CommandError, Exit};
use super::origin::OriginChoice;
use super::paper_args::PaperArgs;
use super::words;
use crate::base::plain::Shown as _;
use crate::gap::{Options, Verdict};
use crate::report;
use crate::workflow::gap::{self, Compared, Request};
use crate::workflow::paper::Shown;

/// Arguments of `updraft gap`.
#[derive(Debug, Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
#[command(after_long_help = "Examples:
  updraft gap my-campaign
  updraft gap my-campaign --vehicle templates/vehicles/airsim-generic-quad.toml -o gap/
  updraft gap --measured logs/ --simulated sitl-logs/
  updraft gap --measured logs/ --plan my-campaign/calibration --vehicle pixel
  updraft gap --csv phantom4-mast.toml --vehicle phantom4 --flight hover
  updraft gap next my-campaign                    # what to fly next

The plan is flown again in the simulator (or the logs of another simulation are used), and the
drones' pulses in steady flight are compared with it. An effect is named only if a flight with
nothing missing would hardly ever show as much. Effects that this flight cannot separate are named
together, and effects that it could not have shown are listed. A quarter of the drones takes no part
in the fit: on these, the gap is computed before and after.

gap/verdict.json has all results; gap/model.toml is the vehicle with what was found, and `simulate
--vehicle gap/model.toml` flies it. Exit code 3: done, but some logs could not be used. Exit code 5:
no log has steady flight to compare.")]
pub(super) struct GapArgs {
    #[command(subcommand)]
    command: Option<GapCommand>,
    /// Campaign folder
    #[arg(conflicts_with_all = ["measured", "csv"])]
    campaign: Option<PathBuf>,
    /// Logs of the drones: a folder, or one log
    #[arg(long, value_name = "LOGS")]
    measured: Option<PathBuf>,
    /// Tables instead of logs: a mapping file says what each column is (docs/csv.md)
    #[arg(long, value_name = "MAPPING.toml", conflicts_with_all = ["measured", "simulated", "plan"])]
    csv: Option<PathBuf>,
    /// Logs of another simulator's flight of the same plan, instead of flying it again
    #[arg(long, value_name = "LOGS")]
    simulated: Option<PathBuf>,
    /// Plan that was flown, for --measured: plan.json, a flight's folder, .skyc or .skyb
    #[arg(long, value_name = "FILE")]
    plan: Option<PathBuf>,
    /// Flight of the campaign [default: its calibration]
    #[arg(long, value_name = "NAME")]
    flight: Option<String>,
    /// Which logs of a campaign to use [default: real ones if there are any]
    #[arg(long, value_name = "WHICH", value_enum, conflicts_with_all = ["measured", "csv"])]
    logs: Option<OriginChoice>,
    /// Model to compare with the logs: a vehicle's name or file [default: the planned one]
    #[arg(long, value_name = "VEHICLE")]
    vehicle: Option<String>,
    /// Folder for the verdict, the model and the page [default: CAMPAIGN/gap, else gap]
    #[arg(short, long, value_name = "FOLDER")]
    output: Option<PathBuf>,
    /// Probability that a step names something when nothing is missing
    #[arg(long, value_name = "SHARE", default_value_t = 0.005, value_parser = share)]
    alpha: f64,
    /// Simulated flights for the threshold of each step
    #[arg(long, value_name = "N", default_value_t = 60, value_parser = clap::value_parser!(u16).range(20..=5000))]
    replicates: u16,
    /// Seed for everything random
    #[arg(long, default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    paper: PaperArgs,
}

#[derive(Debug, Subcommand)]
enum GapCommand {
    /// Propose the shortest flight that would settle what the verdict left open
    Next(next::NextArgs),
}

fn share(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value <= 0.2 => Ok(value),
        _ => Err("a share above 0 and up to 0.2".to_owned()),
    }
}

/// Width of the terminal summary, columns.
const WIDTH: usize = 100;
/// Narrower terminals break lines themselves.
const MIN_WIDTH: usize = 40;

/// What `--json` prints.
#[derive(Serialize, JsonSchema)]
pub(in crate::cli) struct GapOutput<'a> {
    schema: &'static str,
    model: PathBuf,
    report: PathBuf,
    verdict: &'a Verdict,
}

pub(super) fn run(context: &Context, args: &GapArgs) -> Result<Exit, CommandError> {
    if let Some(GapCommand::Next(args)) = &args.command {
        return next::run(context, args);
    }
    let paper = args.paper.wish()?;
    let compared = gap::run(context, &args.request())?;
    let Compared { verdict, model, page } = &compared;
    if context.json {
        let (model, report) = (model.clone(), page.clone());
        context.print_json(&GapOutput { schema: "updraft.gap/1", model, report, verdict })?;
    } else {
        let width =
            context.width.map_or(report::NO_EDGE, |columns| columns.clamp(MIN_WIDTH, WIDTH));
        context.print(&report::gap_summary(verdict, width, context.color))?;
    }
    if let Some(paper) = &paper {
        paper.write(context, Shown::Verdict(verdict))?;
    }
    context.result(page)?;
    context.say(&format!(
        "{} compared -> {}",
        words::count(verdict.data.drones, "drone"),
        page.shown()
    ));
    Ok(compared.ending().into())
}

impl GapArgs {
    fn request(&self) -> Request {
        Request {
            campaign: self.campaign.clone(),
            measured: self.measured.clone(),
            tables: self.csv.clone(),
            simulated: self.simulated.clone(),
            plan: self.plan.clone(),
            flight: self.flight.clone(),
            origin: self.logs.map(Into::into),
            vehicle: self.vehicle.clone(),
            output: self.output.clone(),
            options: Options {
                alpha: self.alpha,
                replicates: usize::from(self.replicates),
                seed: self.seed,
                ..Options::default()
            },
        }
    }
}
