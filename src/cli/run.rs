//! `updraft run`: plan, check, fly, collect, analyse, report.

use std::path::{Path, PathBuf};

use clap::Args;

use super::analyze::{AnalyzeOptions, analyze_campaign};
use super::check::few;
use super::context::Context;
use super::exit::{CommandError, Exit};
use super::fleet::sim::MOST_DRONES;
use super::fly::fly_virtual;
use super::hidden::{self, HideArgs};
use super::mission_args::MissionArgs;
use super::simulate::{AirArgs, AirSpecs, air_help, air_specs, speed, updraft};
use crate::base::plain::Shown as _;
use crate::base::rng::{Purpose as Chance, stream};
use crate::campaign;
use crate::mission::Plan;
use crate::mission::plan::Purpose;
use crate::workflow::check::{Origin, checked, is_safe, say_findings};
use crate::workflow::clock::Stopwatch;
use crate::workflow::plan::{what_for_whom, write};
use crate::workflow::simulate::{Simulation, simulate};
use crate::workflow::slots::SlotSet;
use crate::workflow::study::fly_built_in;

/// The template that is the paper's campaign.
const CAMPAIGN: &str = "campaign";
/// The vehicle of the paper's field flights.
const SHOW_DRONE: &str = "pixel";
/// The air of the paper's field flights.
const FIELD_DAY: &str = "field-day";

/// Arguments of `updraft run`.
#[derive(Debug, Args)]
#[command(after_long_help = format!("Examples:
  updraft run                                       # a field-like day: the show drone, moving air
  updraft run --lose 7 --seed 3 -o another-day      # 7 logs of each flight are lost
  updraft run --vehicle airsim-generic-quad --air still -o study-day
  updraft run --grid 3x3 --duration 120 --air still --updraft -0.8 -o small
  updraft run calibration-counterphase -o counterphase
  updraft run --hide 7 -o hidden                    # an effect is hidden, named, and then revealed

Without a choice of vehicle the paper's campaign (`campaign`) is flown by the show drone (`pixel`), any
other template by the vehicle that it names (the built-in ones: airsim-generic-quad). Without a choice
of air it is a field day: turbulent air, light wind, gusts. --air says another air for both flights (`still`: none);
--calibration-air, --calibration-wind and --calibration-updraft say one for the calibration. --wind and
--updraft are uniform and of the measurement. What the air truly did is kept beside the logs and
compared with. The paper's simulation study is flown into study/, for Fig. 2 and Table I.
The same command goes on where an interrupted one stopped.

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
    /// Lose the logs of so many drones of each flight, chosen by the seed (in the paper 7 and 6 of 49)
    #[arg(long, value_name = "N", default_value_t = 0)]
    lose: u16,
    /// Leave out the simulation study (Fig. 2 and Table I)
    #[arg(long)]
    no_study: bool,
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
    hide: HideArgs,
    #[command(flatten)]
    air: AirArgs,
    #[command(flatten)]
    mission: MissionArgs,
}

pub(super) fn run(context: &Context, args: &RunArgs) -> Result<Exit, CommandError> {
    if let Some(seed) = args.hide.seed() {
        return hidden::run(context, &args.output, args.force, args.hide, &args.mission, seed);
    }
    let watch = Stopwatch::start(context);
    let is_field_day = args.is_field_day();
    let mission = args.mission_args().resolve(&args.template)?;
    let mut shows = Vec::new();
    for flight in &mission.flights {
        let show = flight.plan.to_show();
        let report =
            checked(&show, &flight.plan, &flight.vehicle, &Origin::Plan, few(context, false));
        say_findings(context, &report, &[]);
        if !is_safe(&report, &[]) {
            context.insist("Nothing was flown: the show is not safe as it is");
            return Ok(Exit::Unsafe);
        }
        shows.push(show);
    }
    let _lock = context.lock(&args.output)?;
    keep_off_the_field(&args.output)?;
    write(context, &mission, &shows, &args.output, args.force)?;
    context.say(&format!(
        "Planned {} in {watch} -> {}",
        what_for_whom(&mission),
        args.output.shown()
    ));
    let mut lost = false;
    for (folder, flight) in campaign::flights(&args.output)?.iter().zip(&mission.flights) {
        let simulation = args.simulation(&flight.plan, is_field_day)?;
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
    if !args.no_study {
        fly_built_in(context, &campaign::study_folder(&args.output), args.air.seed)?;
    }
    let exit = analyze_campaign(context, &args.output, &AnalyzeOptions::default())?;
    context.say(&format!("Done in {watch}"));
    Ok(if lost { Exit::Losses } else { exit })
}

/// The page of a campaign is that of its drones' logs: it is not replaced by one of simulated flights.
fn keep_off_the_field(output: &Path) -> Result<(), CommandError> {
    if !campaign::is_campaign(output) {
        return Ok(());
    }
    match campaign::flights(output)?.iter().find(|folder| folder.has_real_logs()) {
        None => Ok(()),
        Some(folder) => Err(CommandError::Usage(format!(
            "{} holds logs of real drones, and this would put the report of a simulation in the place \
             of theirs: choose another folder (-o), or practise there with `updraft fly --connect sim` \
             or `updraft simulate`",
            folder.logs().shown()
        ))),
    }
}

impl RunArgs {
    /// Whether nothing was said about the air: then both flights are flown on a field day.
    fn is_field_day(&self) -> bool {
        let uniform = self.air.wind != 0.0
            || self.updraft.is_some()
            || self.calibration_updraft != 0.0
            || self.calibration_wind != 0.0;
        self.air.specs.is_empty() && self.calibration_air.is_empty() && !uniform
    }

    /// The options of the mission, with the show drone for the paper's campaign.
    fn mission_args(&self) -> MissionArgs {
        let mut mission = self.mission.clone();
        if self.template == CAMPAIGN && mission.vehicle.is_none() {
            mission.vehicle = Some(SHOW_DRONE.to_owned());
        }
        mission
    }

    /// How one flight is simulated.
    fn simulation(&self, plan: &Plan, is_field_day: bool) -> Result<Simulation, CommandError> {
        let mut air = self.air.clone();
        if is_field_day {
            air.specs = vec![air_specs(FIELD_DAY).map_err(CommandError::Usage)?];
        }
        let updraft_mps = match plan.purpose {
            Purpose::Calibration => {
                air.wind = self.calibration_wind;
                if !self.calibration_air.is_empty() {
                    air.specs.clone_from(&self.calibration_air);
                }
                self.calibration_updraft
            }
            Purpose::Measurement => self.updraft.unwrap_or(if air.moves() { 0.0 } else { 1.0 }),
        };
        air.truth |= air.moves();
        let mut simulation = air.simulation(updraft_mps, self.force);
        if self.lose > 0 {
            simulation.only = Some(self.kept(plan)?);
        }
        Ok(simulation)
    }

    /// The slots whose logs are not lost.
    fn kept(&self, plan: &Plan) -> Result<SlotSet, CommandError> {
        let slots: Vec<u16> = plan.slots.iter().map(|slot| slot.slot).collect();
        let lost = usize::from(self.lose);
        if lost >= slots.len() {
            return Err(CommandError::Usage(format!(
                "--lose {lost} leaves no log of the {} drones of {}",
                slots.len(),
                plan.name
            )));
        }
        let flight = plan.purpose as u64;
        let mut rng = stream(self.air.seed, flight, Chance::Losses);
        let gone = rand::seq::index::sample(&mut rng, slots.len(), lost);
        let kept =
            slots.into_iter().enumerate().filter(|(index, _)| !gone.iter().any(|i| i == *index));
        Ok(kept.map(|(_, slot)| slot).collect())
    }
}
