//! `updraft run`: plan, check, fly, collect, analyse, report.

use std::path::PathBuf;

use clap::Args;

use super::analyze::{AnalyzeOptions, analyze_campaign};
use super::basemap_args::BasemapArgs;
use super::check::few;
use super::context::Context;
use super::exit::{CommandError, Exit};
use super::files_args::FilesArgs;
use super::hidden::{self, HideArgs};
use super::mission_args::MissionArgs;
use super::paper_args::PaperArgs;
use super::simulate::{AirArgs, AirSpecs, air_help, air_specs, speed, updraft};
use crate::workflow::basemap::shows_a_plan;
use crate::workflow::clock::Stopwatch;
use crate::workflow::ending::Ending;
use crate::workflow::run::{Airs, Run, fly_campaign};

/// The template that is the paper's campaign.
const CAMPAIGN: &str = "campaign";
/// The vehicle of the paper's field flights.
const SHOW_DRONE: &str = "pixel";
/// Arguments of `updraft run`.
#[derive(Debug, Args)]
#[command(after_long_help = format!("Examples:
  updraft run                                       # a field day: the show drone, moving air
  updraft run --lose 7 --seed 3 -o another-day      # 7 logs of each flight are lost
  updraft run --vehicle airsim-generic-quad --air still -o study-day
  updraft run --grid 3x3 --duration 120 --air still --updraft -0.8 -o small
  updraft run calibration-counterphase -o counterphase
  updraft run --hide 7 -o hidden                    # an effect is hidden, searched for, and revealed

Without --vehicle, the paper's campaign (`campaign`) is flown by the show drone (`pixel`), and any
other template by the vehicle it names (airsim-generic-quad in the built-in ones). Where nothing is said
about the air it is a field day: turbulent air, light wind, gusts. --air sets the air of both flights
(`still` for none, `field-day` for the field day); --calibration-air, --calibration-wind and
--calibration-updraft set that of the calibration. --wind and --updraft are uniform and apply to the
measurement; with one of them and without --air the air is still otherwise. The true air is kept beside the logs
and compared with the results. The paper's simulation study is flown into study/, for Fig. 2 and
Table I. Running the same command again resumes an interrupted run.

{}", air_help()))]
pub(super) struct RunArgs {
    /// Template: a file or a built-in name
    #[arg(default_value = CAMPAIGN)]
    template: String,
    /// Campaign folder
    #[arg(short, long, value_name = "FOLDER", default_value = "my-campaign")]
    output: PathBuf,
    /// Replace another plan in the folder (see `plan --force`), and logs simulated with other
    /// settings; logs of real drones and of another plan are never touched
    #[arg(long)]
    force: bool,
    /// Vertical air speed in measurement flights, m/s, up positive [default: 1 in still air, else 0]
    #[arg(long, value_name = "MPS", value_parser = updraft, allow_hyphen_values = true)]
    updraft: Option<f64>,
    /// Lose the logs of this many drones in each flight, chosen by the seed (in the paper, 7 and 6 of
    /// 49)
    #[arg(long, value_name = "N", default_value_t = 0)]
    lose: u16,
    /// Leave out the simulation study (Fig. 2 and Table I)
    #[arg(long)]
    no_study: bool,
    /// Fly in the simulator without MAVLink: the same logs, sooner (always so for fleets of more than
    /// 800 drones)
    #[arg(long)]
    direct: bool,
    /// Vertical air speed in calibration flights, m/s, up positive
    #[arg(long, value_name = "MPS", default_value_t = 0.0, value_parser = updraft, allow_hyphen_values = true)]
    calibration_updraft: f64,
    /// Horizontal wind speed in calibration flights, m/s
    #[arg(long, value_name = "MPS", default_value_t = 0.0, value_parser = speed, allow_negative_numbers = true)]
    calibration_wind: f64,
    /// Air to add in calibration flights, as with --air; can be repeated
    #[arg(long, value_name = "SPEC", value_parser = air_specs)]
    calibration_air: Vec<AirSpecs>,
    #[command(flatten)]
    estimate: EstimateArgs,
    #[command(flatten)]
    basemap: BasemapArgs,
    #[command(flatten)]
    paper: PaperArgs,
    #[command(flatten)]
    files: FilesArgs,
    #[command(flatten)]
    hide: HideArgs,
    #[command(flatten)]
    air: AirArgs,
    #[command(flatten)]
    mission: MissionArgs,
}

/// Which estimate is made of what was flown.
#[derive(Clone, Copy, Debug, Args)]
struct EstimateArgs {
    /// Analyse with the paper's own estimate, for comparison (see `analyze --plain`)
    #[arg(long)]
    plain: bool,
}

pub(super) fn run(context: &Context, args: &RunArgs) -> Result<Exit, CommandError> {
    if let Some(seed) = args.hide.seed() {
        return hidden::run(context, &args.output, args.force, args.hide, &args.mission, seed);
    }
    let watch = Stopwatch::start(context);
    let run = args.campaign()?;
    let paper = args.paper.wish()?;
    let basemap = args.basemap.read()?;
    if let Some((path, basemap)) = args.basemap.basemap.as_ref().zip(basemap.as_ref()) {
        shows_a_plan(path, basemap, run.mission.flights.iter().map(|flight| &flight.plan))?;
    }
    let flown = fly_campaign(context, &run, few(context, false))?;
    if flown.ending == Ending::NoGo {
        return Ok(Exit::Unsafe);
    }
    let settings = args.files.of(AnalyzeOptions::of_run(args.estimate.plain).settings());
    let exit = analyze_campaign(context, &args.output, &settings, (basemap, paper))?;
    context.say(&format!("Done in {watch}"));
    Ok(if flown.ending == Ending::Losses { Exit::Losses } else { exit })
}

impl RunArgs {
    /// What is to be flown, and how.
    fn campaign(&self) -> Result<Run, CommandError> {
        let airs = Airs {
            wind_mps: self.air.wind,
            wind_from_deg: self.air.wind_from,
            updraft_mps: self.updraft,
            added: AirSpecs::all(&self.air.specs),
            calibration_wind_mps: self.calibration_wind,
            calibration_updraft_mps: self.calibration_updraft,
            calibration_added: AirSpecs::all(&self.calibration_air),
        };
        Ok(Run {
            mission: self.mission_args().resolve(&self.template)?,
            root: self.output.clone(),
            force: self.force,
            simulation: self.air.simulation(0.0, self.force),
            airs,
            lose: self.lose,
            direct: self.direct,
            study: !self.no_study,
        })
    }

    /// The options of the mission, with the show drone for the paper's campaign.
    fn mission_args(&self) -> MissionArgs {
        let mut mission = self.mission.clone();
        if self.template == CAMPAIGN && mission.vehicle.is_none() {
            mission.vehicle = Some(SHOW_DRONE.to_owned());
        }
        mission
    }
}
