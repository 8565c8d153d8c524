//! `updraft gap`: where simulation and measurement disagree, and which physics is missing.

pub(super) mod blind;
pub(super) mod logs;
mod next;

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use serde::Serialize;

use super::analyze::load_plan;
use super::context::Context;
use super::exit::{CommandError, Exit};
use super::found::{Found, OriginChoice, Work, find, find_tables};
use super::provenance::provenance;
use super::words;
use crate::analysis::TruthSeries;
use crate::base::file::{create_folder, write_whole};
use crate::base::plain::Shown as _;
use crate::campaign::{self, CampaignError, FlightFolder, to_json};
use crate::effects::select::resolved;
use crate::flight::{Flight, Indicator};
use crate::gap::{
    Explained, Flown, Input, Measured, Options, Verdict, aloft, as_pulses, explain, lossless,
    map_gain,
};
use crate::mission::plan::Purpose;
use crate::report::{self, Provenance};
use crate::vehicle::{Vehicle, library};

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

The plan is flown again in the simulator (or the logs of another simulation are taken), and the
drones' pulses are held against it in steady flight. What is missing is named only when a flight with
nothing missing would hardly ever show as much; effects that this flight cannot tell apart are named
together, and what it could not have shown is listed. A quarter of the drones is not fitted: on these
the gap is taken before and after.

gap/verdict.json has all of it, gap/model.toml is the vehicle with what was found: `simulate
--vehicle gap/model.toml` flies it. Exit code 3: done, but logs could not be used. Exit code 5: no
log has steady flight to compare.")]
pub(super) struct GapArgs {
    #[command(subcommand)]
    command: Option<GapCommand>,
    /// Campaign folder
    #[arg(conflicts_with_all = ["measured", "csv"])]
    campaign: Option<PathBuf>,
    /// Logs of the drones: a folder, or one log
    #[arg(long, value_name = "LOGS")]
    measured: Option<PathBuf>,
    /// Tables instead of logs: a mapping file says which columns are what (docs/csv.md)
    #[arg(long, value_name = "MAPPING.toml", conflicts_with_all = ["measured", "simulated", "plan"])]
    csv: Option<PathBuf>,
    /// Logs of somebody else's simulation of the same flight, instead of flying the plan again
    #[arg(long, value_name = "LOGS")]
    simulated: Option<PathBuf>,
    /// Plan that was flown, for --measured: plan.json, a flight's folder, .skyc or .skyb
    #[arg(long, value_name = "FILE")]
    plan: Option<PathBuf>,
    /// Flight of the campaign [default: its calibration]
    #[arg(long, value_name = "NAME")]
    flight: Option<String>,
    /// Which logs of a campaign: real or simulated [default: real where there are any]
    #[arg(long, value_name = "WHICH", value_enum, conflicts_with_all = ["measured", "csv"])]
    logs: Option<OriginChoice>,
    /// Model to hold against the logs: a vehicle's name or file [default: the planned one]
    #[arg(long, value_name = "VEHICLE")]
    vehicle: Option<String>,
    /// Folder for the verdict, the model and the page [default: CAMPAIGN/gap, else gap]
    #[arg(short, long, value_name = "FOLDER")]
    output: Option<PathBuf>,
    /// Chance of naming anything in a step when nothing is missing
    #[arg(long, value_name = "SHARE", default_value_t = 0.005, value_parser = share)]
    alpha: f64,
    /// Simulated flights for the threshold of each step
    #[arg(long, value_name = "N", default_value_t = 60, value_parser = clap::value_parser!(u16).range(20..=5000))]
    replicates: u16,
    /// Seed of everything random
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

#[derive(Debug, Subcommand)]
enum GapCommand {
    /// Propose the shortest flight that would tell what the verdict left open
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

/// Vehicle of logs that nobody planned here: the firmware's own simulator.
const UNPLANNED_VEHICLE: &str = "arducopter-sitl";

/// What `--json` prints.
#[derive(Serialize)]
struct GapOutput<'a> {
    schema: &'static str,
    model: PathBuf,
    report: PathBuf,
    verdict: &'a Verdict,
}

pub(super) fn run(context: &Context, args: &GapArgs) -> Result<Exit, CommandError> {
    if let Some(GapCommand::Next(args)) = &args.command {
        return next::run(context, args);
    }
    let options = Options {
        alpha: args.alpha,
        replicates: usize::from(args.replicates),
        seed: args.seed,
        ..Options::default()
    };
    let (found, others) = measured(context, args)?;
    let vehicle = model_of(args, &found)?;
    // Before anything is flown: what is wrong with the model is the file's fault, not the flight's.
    resolved(&vehicle).map_err(|error| {
        let file = args.vehicle.as_ref().unwrap_or(&vehicle.name);
        CommandError::Usage(format!("the model {file} cannot be used: {error}"))
    })?;
    let folder = match (&args.output, &args.campaign) {
        (Some(folder), _) => folder.clone(),
        (None, Some(campaign)) => campaign.join("gap"),
        (None, None) => PathBuf::from("gap"),
    };
    if folder.exists() && !folder.is_dir() {
        return Err(CommandError::Failed(format!(
            "{} is a file: --output must name a folder",
            folder.shown()
        )));
    }
    if args.output.is_some() {
        has_room(&folder)?;
    }
    let simulated = args.simulated.as_deref().map(|path| one_flight(path, None)).transpose()?;
    let simulated = simulated.map(|(flight, _)| flight);
    let hover = args.campaign.as_ref().and_then(|_| known_air(others));
    if args.campaign.is_some() && hover.is_none() && knows_air(&found) {
        context.say(&format!(
            "the error of the map is not told: {} is the flight that is compared, and the campaign \
             has no other measurement flight whose true air is known",
            found.name
        ));
    }
    let both = Both { measured: &found, simulated: simulated.as_ref(), hover: hover.as_ref() };
    let mut explained = compare(&both, &vehicle, &options)?;
    explained.verdict.cautions.extend(unplanned(args, &found, &vehicle));
    context.check_stop()?;
    create_folder(&folder)?;
    let _lock = context.lock(&folder)?;
    let root = args.campaign.as_ref().or(args.measured.as_ref()).or(args.csv.as_ref());
    let root = root.cloned().unwrap_or_default();
    let settings = settings(args, &found, &vehicle);
    let work = Work { flights: vec![found], ..Work::new(&root) };
    let provenance = Provenance { seed: Some(args.seed), ..provenance(&work, settings) };
    let page = write(&folder, &explained, &provenance)?;
    let verdict = &explained.verdict;
    for reason in &verdict.data.left_out {
        context.warn(reason);
    }
    if context.json {
        let model = folder.join(MODEL);
        let output = GapOutput { schema: "updraft.gap/1", model, report: page.clone(), verdict };
        context.print_json(&output)?;
    } else {
        let width = context.width.map_or(WIDTH, |columns| columns.clamp(MIN_WIDTH, WIDTH));
        context.print(&report::gap_summary(verdict, width, context.color))?;
    }
    context.result(&page)?;
    context.say(&format!(
        "{} compared -> {}",
        words::count(verdict.data.drones, "drone"),
        page.shown()
    ));
    Ok(if verdict.data.left_out.is_empty() { Exit::Done } else { Exit::Losses })
}

/// File names in the folder of a comparison.
const VERDICT: &str = "verdict.json";
const MODEL: &str = "model.toml";

/// Refuses a named folder with files of somebody else's where this command's would go.
fn has_room(folder: &Path) -> Result<(), CommandError> {
    let page = Path::new("report").join(report::PAGE_FILE);
    let theirs = [Path::new(MODEL), &page].into_iter().find(|file| folder.join(file).exists());
    match theirs {
        Some(file) if !folder.join(VERDICT).exists() => Err(CommandError::Usage(format!(
            "{} is there and was not made by `updraft gap`; choose another folder with -o",
            folder.join(file).shown()
        ))),
        _ => Ok(()),
    }
}

/// What was chosen, for the page.
fn settings(args: &GapArgs, found: &Found, vehicle: &Vehicle) -> Vec<(&'static str, String)> {
    let mut settings = vec![
        ("Flight", found.name.clone()),
        ("Model", format!("{}: {}", vehicle.name, vehicle.source)),
        ("Chance of naming nothing", format!("{} in each step (--alpha)", args.alpha)),
        ("Simulated flights for a threshold", format!("{} (--replicates)", args.replicates)),
    ];
    if let Some(path) = &args.simulated {
        settings.push(("Simulated logs", path.shown().to_string()));
    }
    if let Some(seed) = found.seed {
        settings.push(("Seed of the flight", format!("{seed}: its logs are simulated")));
    }
    settings
}

/// Writes verdict, model and page; where the page is.
fn write(
    folder: &Path,
    explained: &Explained,
    provenance: &Provenance,
) -> Result<PathBuf, CommandError> {
    let json = to_json(&explained.verdict)
        .map_err(|error| CommandError::Failed(format!("failed to make JSON: {error}")))?;
    let model = toml::to_string(&explained.model)
        .map_err(|error| CommandError::Failed(format!("failed to make the model: {error}")))?;
    write_whole(&folder.join(MODEL), model.as_bytes())?;
    let made = report::render_gap(&explained.verdict, provenance)?;
    let pages = folder.join("report");
    report::write(&made, &pages)?;
    // Last: who finds a verdict finds the others as well.
    write_whole(&folder.join(VERDICT), &json)?;
    Ok(pages.join(report::PAGE_FILE))
}

/// The measured flight, and the others that are there.
fn measured(context: &Context, args: &GapArgs) -> Result<(Found, Vec<Found>), CommandError> {
    let plan = args.plan.as_deref().map(load_plan).transpose()?;
    if let Some(mapping) = &args.csv {
        let mut work = Work::new(mapping);
        find_tables(mapping, &mut work)?;
        return chosen(work.flights, mapping, args.flight.as_deref());
    }
    match (&args.campaign, &args.measured) {
        (Some(campaign), _) => {
            if plan.is_some() {
                return Err(CommandError::Usage(
                    "a campaign has its own plan; --plan goes with --measured".to_owned(),
                ));
            }
            is_campaign(campaign)?;
            measured_in(context, campaign, args)
        }
        (None, Some(path)) => {
            let (mut found, others) = measured_in(context, path, args)?;
            if plan.is_some() {
                found.plan = plan;
            }
            Ok((found, others))
        }
        (None, None) => Err(CommandError::Usage(
            "give a campaign folder, --measured LOGS or --csv MAPPING.toml".to_owned(),
        )),
    }
}

/// That there is a campaign to compare; if not, what to do with what is there instead.
fn is_campaign(campaign: &Path) -> Result<(), CommandError> {
    match campaign::flights(campaign) {
        Ok(_) => Ok(()),
        Err(CampaignError::NoPlan { path }) => Err(CommandError::Nothing(format!(
            "{} is no campaign folder: it has no plan.json and no campaign.json (for logs alone: \
             --measured LOGS with --plan or --simulated)",
            path.shown()
        ))),
        Err(error) => Err(error.into()),
    }
}

/// The flight of a path that is compared, and the others in their order. It is the one that is named,
/// else the calibration, else the first with logs.
fn one_flight(path: &Path, name: Option<&str>) -> Result<(Found, Vec<Found>), CommandError> {
    let mut work = Work::new(path);
    find(path, None, &mut work)?;
    chosen(work.flights, path, name)
}

/// The same of what was measured; says which logs are taken.
fn measured_in(
    context: &Context,
    path: &Path,
    args: &GapArgs,
) -> Result<(Found, Vec<Found>), CommandError> {
    let mut work = Work::new(path);
    work.origin = args.logs.map(Into::into);
    find(path, None, &mut work)?;
    for used in &work.used {
        context.say(used);
    }
    chosen(work.flights, path, args.flight.as_deref())
}

/// As [`one_flight`], of flights that were found.
fn chosen(
    mut flights: Vec<Found>,
    path: &Path,
    name: Option<&str>,
) -> Result<(Found, Vec<Found>), CommandError> {
    let is_meant = |flight: &Found| name.is_none_or(|name| flight.name == name);
    if let Some(name) = name
        && !flights.iter().any(is_meant)
    {
        let names: Vec<&str> = flights.iter().map(|flight| flight.name.as_str()).collect();
        return Err(CommandError::Usage(format!(
            "there is no flight \"{name}\"; flights are {}",
            names.join(", ")
        )));
    }
    let is_usable = |flight: &Found| is_meant(flight) && !flight.logs.is_empty();
    let calibrates = |flight: &Found| flight.purpose == Some(Purpose::Calibration);
    let place = flights
        .iter()
        .position(|flight| calibrates(flight) && is_usable(flight))
        .or_else(|| flights.iter().position(is_usable));
    let flight = place.map(|place| flights.remove(place)).ok_or_else(|| {
        CommandError::Nothing(format!(
            "{} holds no logs: fly it (`updraft fly`), or put the drones' .BIN files into the \
             flight's logs folder",
            path.shown()
        ))
    })?;
    Ok((flight, flights))
}

/// Whether it is a measurement flight whose true air is known (simulated ones).
fn knows_air(flight: &Found) -> bool {
    let has_slots = || flight.plan.as_ref().is_some_and(|plan| !plan.slots.is_empty());
    let is_uniform = flight.true_updraft_mps.is_some() && has_slots();
    flight.purpose == Some(Purpose::Measurement)
        && !flight.logs.is_empty()
        && (is_uniform || !flight.truth.is_empty())
}

/// The first of these flights whose true air is known, with that air for each slot.
fn known_air(flights: Vec<Found>) -> Option<Found> {
    let mut flight = flights.into_iter().find(knows_air)?;
    if flight.truth.is_empty()
        && let (Some(updraft_mps), Some(plan)) = (flight.true_updraft_mps, &flight.plan)
    {
        let ends = plan.groups.iter().flat_map(|group| &group.segments).map(|s| s.end_ms);
        let seconds = ends.max().unwrap_or(0) as usize / 1000 + 60;
        let same = TruthSeries { first_s: 0, updraft_mps: vec![updraft_mps; seconds] };
        flight.truth = plan.slots.iter().map(|slot| (slot.slot, same.clone())).collect();
    }
    Some(flight)
}

/// The flights of a comparison.
struct Both<'a> {
    measured: &'a Found,
    simulated: Option<&'a Found>,
    /// A measurement flight whose true air is known.
    hover: Option<&'a Found>,
}

/// The model that is held against the logs.
fn model_of(args: &GapArgs, found: &Found) -> Result<Vehicle, CommandError> {
    if let Some(name) = &args.vehicle {
        return Ok(library::load(name)?);
    }
    if let Some(campaign) = &args.campaign {
        let flights = campaign::flights(campaign)?;
        let of =
            |folder: &&FlightFolder| folder.read_plan().is_ok_and(|plan| plan.name == found.name);
        if let Some(folder) = flights.iter().find(of) {
            return Ok(library::load(&folder.vehicle().to_string_lossy())?);
        }
    }
    match &found.plan {
        Some(plan) => Ok(library::load(&plan.vehicle)?),
        None => Ok(library::load(UNPLANNED_VEHICLE)?),
    }
}

/// What a reader must know of logs without a plan.
fn unplanned(args: &GapArgs, found: &Found, vehicle: &Vehicle) -> Option<String> {
    (args.vehicle.is_none() && args.csv.is_none() && found.plan.is_none()).then(|| {
        format!(
            "no plan says which vehicle flew: {} is taken, and its closed forms stand for what effects do \
             (--vehicle, --plan)",
            vehicle.name
        )
    })
}

/// Reads the logs and compares.
fn compare(
    both: &Both<'_>,
    vehicle: &Vehicle,
    options: &Options,
) -> Result<Explained, CommandError> {
    let Both { measured: found, simulated, hover } = *both;
    let mut read = logs::read(found, Path::new(""));
    let mapping = found.logs.iter().find_map(|log| log.table.clone());
    let has_speeds = |(_, flight): &(u16, Flight)| flight.indicator == Indicator::RotorSpeed;
    let by_speed = read.flights.iter().any(has_speeds);
    let planned = vehicle;
    let lossless = lossless(planned);
    let vehicle = if by_speed { &lossless } else { planned };
    for (_, flight) in &mut read.flights {
        if mapping.is_some() {
            *flight = aloft(flight);
        }
        if by_speed {
            *flight = as_pulses(flight, vehicle);
        }
    }
    let others = simulated.map(|simulated| logs::read(simulated, Path::new("")));
    let flown: Vec<Flown<'_>> =
        read.flights.iter().map(|(slot, flight)| Flown { slot: *slot, flight }).collect();
    let other: Option<Vec<Flown<'_>>> = others.as_ref().map(|others| {
        others.flights.iter().map(|(slot, flight)| Flown { slot: *slot, flight }).collect()
    });
    let mut left_out = read.left_out.clone();
    left_out.extend(read.in_part.iter().map(|lost| format!("{lost} (the rest is used)")));
    left_out.extend(others.iter().flat_map(|others| others.left_out.clone()));
    let unusable = |logs: &str, reasons: &[String]| {
        CommandError::Nothing(format!(
            "none of the {logs} can be used:\n  {}",
            reasons.join("\n  ")
        ))
    };
    if flown.is_empty() {
        return Err(unusable(&words::count(found.logs.len(), "log"), &left_out));
    }
    if let (Some(simulated), Some(others)) = (simulated, &others)
        && others.flights.is_empty()
    {
        let logs = words::count(simulated.logs.len(), "simulated log");
        return Err(unusable(&logs, &others.left_out));
    }
    let input = Input {
        vehicle,
        plan: found.plan.as_ref(),
        flown: &flown,
        simulated: other.as_deref(),
        table: mapping.as_ref().map(|mapping| &mapping.steps),
        logs: found.logs.len(),
        left_out,
    };
    let mut explained = explain(&input, options)?;
    explained.model.airframe.rotor = planned.airframe.rotor;
    if let Some((hover, plan)) = hover.and_then(|hover| Some((hover, hover.plan.as_ref()?))) {
        let read = logs::read(hover, Path::new(""));
        let flown: Vec<Flown<'_>> =
            read.flights.iter().map(|(slot, flight)| Flown { slot: *slot, flight }).collect();
        let measured = Measured { name: &hover.name, plan, flown: &flown, truth: &hover.truth };
        explained.verdict.map = map_gain(&input, &explained, &measured)?;
    }
    Ok(explained)
}
