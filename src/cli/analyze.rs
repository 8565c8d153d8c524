//! `updraft analyze`: logs become laws, a map of the air, and a report.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use rayon::prelude::*;
use serde::Serialize;

use super::clock::Stopwatch;
use super::context::Context;
use super::exit::{CommandError, Exit};
use super::leaning::leaning;
use super::load::{has_extension, load_shows};
use super::progress::Progress;
use super::simulate::{made_by, sha256};
use super::words;
use crate::analysis::calibrate::{Location, Weights};
use crate::analysis::density::Density;
use crate::analysis::result::{Analysis, FlightAnalysis, Yield};
use crate::analysis::wind::Leaning;
use crate::analysis::windows::Tilt;
use crate::analysis::{AnalysisOptions, FlightInput, LogInput, MapLaw, TruthSeries, analyze};
use crate::base::file::{FileError, read_whole, write_whole};
use crate::base::time::GpsTime;
use crate::campaign::{self, CampaignIndex, FlightFolder, FlightRecord, to_json};
use crate::mission::Plan;
use crate::mission::plan::Purpose;
use crate::report::{self, InputFile, Provenance, terminal_summary};
use crate::sim::air::truth::{self, TrueUpdraft};
use crate::vehicle::{Vehicle, library};

/// Largest log that is hashed, bytes.
const MAX_LOG_BYTES: u64 = 4 << 30;
/// Exponent of density for electric rotors with a real thrust curve.
const REAL_ROTOR_EXPONENT: f64 = 0.4;
/// Width of the terminal summary, columns.
const WIDTH: usize = 100;

/// Arguments of `updraft analyze`.
#[derive(Debug, Args)]
#[command(after_long_help = "Examples:
  updraft analyze my-campaign
  updraft analyze logs/ --plan my-campaign/calibration
  updraft analyze flight.BIN
  updraft analyze windy --hold still/analysis.json

A campaign's results go into its folder, others into --output. Without a plan, windows are found in
the log's own desired velocity. Exit code 3: done, but some drones gave no law or no value of the
map; they are named, with the reason. Exit code 5: no law and no map at all.")]
pub(super) struct AnalyzeArgs {
    /// Campaign folders, folders of logs, or logs
    #[arg(required = true)]
    paths: Vec<PathBuf>,
    /// Plan that the logs were flown from: plan.json, a flight's folder, .skyc or .skyb
    #[arg(long, value_name = "FILE")]
    plan: Option<PathBuf>,
    /// Take A and u0 from this analysis.json and fit only W
    #[arg(long, value_name = "FILE")]
    hold: Option<PathBuf>,
    /// Unix time of show time 0, s: aligns logs without SHOW rows by their GPS time
    #[arg(long, value_name = "UNIX_S")]
    start: Option<i64>,
    /// Folder for analysis.json and report/ [default: the campaign, or NAME-analysis]
    #[arg(short, long, value_name = "FOLDER")]
    output: Option<PathBuf>,
    /// Print the results, write nothing
    #[arg(long)]
    no_report: bool,
    #[command(flatten)]
    options: AnalyzeOptions,
}

/// How to analyse.
#[derive(Clone, Debug, Default, Args)]
#[command(next_help_heading = "Analysis")]
pub(super) struct AnalyzeOptions {
    /// Law for the map of the air
    #[arg(long, value_enum, default_value_t = LawChoice::Auto)]
    law: LawChoice,
    /// Which part of the pulse the tilt correction multiplies (in windows and laws; the map of
    /// simulated flights of known drag has its own, see --no-wind)
    #[arg(long, value_enum, default_value_t = TiltChoice::Paper)]
    tilt: TiltChoice,
    /// Do not correct the map for air density at different heights
    #[arg(long)]
    no_density: bool,
    /// Do not correct the map for wind on leaning drones (simulated flights of known drag)
    #[arg(long)]
    no_wind: bool,
    /// Windows as in the paper: medians, weighted by the samples' standard deviation
    #[arg(long)]
    paper: bool,
}

/// Law for the map of the air.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum LawChoice {
    /// The one that fits the calibration better
    #[default]
    Auto,
    /// u = A' V + u0
    Linear,
    /// u = A f(V - W) + u0
    SignedQuadratic,
}

/// Form of the tilt correction.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum TiltChoice {
    /// u cos(phi), as in the paper
    #[default]
    Paper,
    /// (u - 1000) cos(phi) + 1000: only the part that makes thrust
    Excess,
}

impl AnalyzeOptions {
    fn resolve(&self) -> AnalysisOptions {
        let mut options = AnalysisOptions::default();
        options.windows.tilt = match self.tilt {
            TiltChoice::Paper => Tilt::Paper,
            TiltChoice::Excess => Tilt::Excess,
        };
        options.map_law = match self.law {
            LawChoice::Auto => None,
            LawChoice::Linear => Some(MapLaw::Linear),
            LawChoice::SignedQuadratic => Some(MapLaw::SignedQuadratic),
        };
        if self.paper {
            options.fit.location = Location::Median;
            options.fit.weights = Weights::WindowSd;
        }
        options
    }
}

/// One flight found behind a path.
struct Found {
    name: String,
    plan: Option<Plan>,
    purpose: Option<Purpose>,
    logs: Vec<LogInput>,
    true_updraft_mps: Option<f64>,
    truth: BTreeMap<u16, TruthSeries>,
    seed: Option<u64>,
    start: Option<GpsTime>,
    density: Option<Density>,
    leaning: Option<Leaning>,
}

/// What was asked to be analysed.
struct Work {
    title: String,
    /// Paths in the report are shown relative to this.
    root: PathBuf,
    flights: Vec<Found>,
}

/// What `--json` prints.
#[derive(Serialize)]
struct AnalyzeOutput<'a> {
    schema: &'static str,
    report: Option<PathBuf>,
    analysis: &'a Analysis,
}

pub(super) fn run(context: &Context, args: &AnalyzeArgs) -> Result<Exit, CommandError> {
    let plan = args.plan.as_deref().map(load_plan).transpose()?;
    let mut work = Work { title: String::new(), root: PathBuf::from("."), flights: Vec::new() };
    for path in &args.paths {
        find(path, plan.as_ref(), &mut work)?;
    }
    name_apart(&mut work.flights, &args.paths);
    let first = &args.paths[0];
    if args.paths.len() == 1 {
        work.root = if first.is_dir() {
            first.clone()
        } else {
            first.parent().unwrap_or(Path::new(".")).to_owned()
        };
    }
    if work.title.is_empty() {
        work.title = stem(first);
    }
    let output = (!args.no_report).then(|| match &args.output {
        Some(folder) => folder.clone(),
        None if args.paths.len() == 1 && campaign::is_campaign(first) => first.clone(),
        None => PathBuf::from(format!("{}-analysis", stem(first))),
    });
    if let Some(unix_s) = args.start {
        let start = unix_s.checked_mul(1000).and_then(GpsTime::from_unix_ms).ok_or_else(|| {
            CommandError::Usage(format!("--start {unix_s} is not a time since 1980"))
        })?;
        work.flights.iter_mut().for_each(|flight| flight.start = Some(start));
    }
    finish(context, &work, &args.options, args.hold.as_deref(), output.as_deref())
}

/// Analyses a campaign into its own folder; the last step of `updraft run`.
pub(super) fn analyze_campaign(
    context: &Context,
    root: &Path,
    options: &AnalyzeOptions,
) -> Result<Exit, CommandError> {
    let mut work = Work { title: String::new(), root: root.to_owned(), flights: Vec::new() };
    find(root, None, &mut work)?;
    finish(context, &work, options, None, Some(root))
}

fn finish(
    context: &Context,
    work: &Work,
    options: &AnalyzeOptions,
    hold: Option<&Path>,
    output: Option<&Path>,
) -> Result<Exit, CommandError> {
    let watch = Stopwatch::start();
    let reference = hold.map(read_reference).transpose()?;
    let inputs: Vec<_> = work
        .flights
        .iter()
        .map(|flight| FlightInput {
            name: &flight.name,
            plan: flight.plan.as_ref(),
            purpose: flight.purpose,
            logs: &flight.logs,
            start: flight.start,
            true_updraft_mps: flight.true_updraft_mps,
            truth: (!flight.truth.is_empty()).then_some(&flight.truth),
            density: flight.density.filter(|_| !options.no_density),
            leaning: flight.leaning.filter(|_| !options.no_wind),
            folder: Some(&work.root),
        })
        .collect();
    let total: usize = inputs.iter().map(|input| input.logs.len()).sum();
    let progress = Progress::new(context, "analysing", total as u64);
    let analysis =
        analyze(&work.title, &inputs, &options.resolve(), reference.as_ref(), &|_, _| {
            progress.advance();
        })
        .map_err(|error| CommandError::Nothing(error.to_string()))?;
    progress.finish();
    context.check_stop()?;
    if !context.json {
        context.print(&terminal_summary(&analysis, WIDTH, context.color))?;
    }
    let mut page = None;
    if let Some(folder) = output {
        let json = to_json(&analysis)
            .map_err(|error| CommandError::Failed(format!("failed to make JSON: {error}")))?;
        let provenance = provenance(work);
        let made = report::render(&analysis, &provenance)?;
        let report_folder = folder.join("report");
        report::write(&made, &report_folder)?;
        write_whole(&folder.join("analysis.json"), &json)?;
        page = Some(report_folder.join(report::PAGE_FILE));
    }
    if context.json {
        context.print_json(&AnalyzeOutput {
            schema: "updraft.analyze/1",
            report: page.clone(),
            analysis: &analysis,
        })?;
    }
    let place = page.map_or(String::new(), |page| format!(" -> {}", page.display()));
    context.say(&format!("Analysed {} in {watch}{place}", words::count(total, "log")));
    let lost = analysis.flights.len() < work.flights.len();
    Ok(match analysis.what_was_found() {
        Yield::Nothing => Exit::Nothing,
        Yield::Whole if !lost => Exit::Done,
        Yield::Whole | Yield::Partial => Exit::Losses,
    })
}

/// Adds what a path holds to the work.
fn find(path: &Path, plan: Option<&Plan>, work: &mut Work) -> Result<(), CommandError> {
    if path.is_dir() && campaign::is_campaign(path) {
        let index = campaign::index_path(path);
        if index.is_file() && work.title.is_empty() {
            work.title = campaign::read_json::<CampaignIndex>(&index)?.title;
        }
        for folder in campaign::flights(path)? {
            let flight = found_flight(&folder)?;
            if work.title.is_empty() {
                work.title =
                    flight.plan.as_ref().map_or_else(String::new, |plan| plan.title.clone());
            }
            work.flights.push(flight);
        }
        return Ok(());
    }
    let logs = if path.is_dir() { logs_in(path)? } else { vec![path.to_owned()] };
    if logs.is_empty() {
        return Err(CommandError::Nothing(format!("{} holds no .BIN logs", path.display())));
    }
    work.flights.push(Found {
        name: stem(path),
        plan: plan.cloned(),
        purpose: None,
        logs: logs.into_iter().map(|path| LogInput { slot: None, path }).collect(),
        true_updraft_mps: None,
        truth: BTreeMap::new(),
        seed: None,
        start: None,
        density: plan.map(|plan| density(plan, None)),
        leaning: None,
    });
    Ok(())
}

fn found_flight(folder: &FlightFolder) -> Result<Found, CommandError> {
    let plan = folder.read_plan()?;
    let record = folder.read_record()?.filter(|record| record_holds(folder, record));
    let logs = match &record {
        // A record says which log is whose.
        Some(record) => record
            .logs
            .iter()
            .map(|log| LogInput { slot: Some(log.slot), path: folder.logs().join(&log.file) })
            .collect(),
        None if folder.logs().is_dir() => {
            logs_in(&folder.logs())?.into_iter().map(|path| LogInput { slot: None, path }).collect()
        }
        None => Vec::new(),
    };
    let vehicle = library::load(&folder.vehicle().display().to_string()).ok();
    let truth = if record.is_some() { true_air(folder, &plan)? } else { BTreeMap::new() };
    let flown = record.as_ref().zip(vehicle.as_ref());
    Ok(Found {
        leaning: flown.and_then(|(record, vehicle)| leaning(&plan, record, vehicle)),
        density: Some(density(&plan, vehicle.as_ref())),
        name: plan.name.clone(),
        purpose: Some(plan.purpose),
        plan: Some(plan),
        logs,
        true_updraft_mps: record
            .as_ref()
            .filter(|record| record.air.is_empty())
            .map(|record| record.air_mps[2]),
        truth,
        start: record.as_ref().map(|record| record.start),
        seed: record.map(|record| record.seed),
    })
}

/// Whether the logs are still those that the record speaks of: somebody may have put the logs of real
/// drones in their place.
fn record_holds(folder: &FlightFolder, record: &FlightRecord) -> bool {
    record.logs.iter().all(|log| {
        let size = std::fs::metadata(folder.logs().join(&log.file)).map(|file| file.len());
        // A log that is gone is a loss, not another flight.
        size.map_or(true, |bytes| bytes == log.bytes)
    })
}

/// The true air beside a simulated flight's logs, for the slots that have it.
fn true_air(
    folder: &FlightFolder,
    plan: &Plan,
) -> Result<BTreeMap<u16, TruthSeries>, CommandError> {
    let mut found = BTreeMap::new();
    for slot in &plan.slots {
        let path = folder.truth(slot.slot, plan.slots.len());
        if path.is_file() {
            let TrueUpdraft { first_s, updraft_mps } =
                truth::read(&path).map_err(|error| CommandError::Failed(error.to_string()))?;
            found.insert(slot.slot, TruthSeries { first_s, updraft_mps });
        }
    }
    Ok(found)
}

/// How the map is corrected for air density: by the thrust curve that the vehicle's autopilot is set
/// for (none: linear thrust).
fn density(plan: &Plan, vehicle: Option<&Vehicle>) -> Density {
    let linear = vehicle.is_some_and(|vehicle| vehicle.autopilot.mot_thst_expo == 0.0);
    Density {
        ground_amsl_m: plan.site.ground_amsl_m,
        exponent: if linear { 1.0 } else { REAL_ROTOR_EXPONENT },
    }
}

/// Whether a path is a finished log: what an interrupted run or copy left is not.
fn is_log(path: &Path) -> bool {
    let hidden = path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'));
    has_extension(path, "bin") && !hidden
}

/// The logs in a folder and in its direct subfolders (one per drone, as SD cards are often copied).
fn logs_in(folder: &Path) -> Result<Vec<PathBuf>, CommandError> {
    let mut logs = Vec::new();
    let list = |folder: &Path| -> Result<Vec<PathBuf>, FileError> {
        let fail = |source| FileError::new("read", folder, source);
        let entries = std::fs::read_dir(folder).map_err(fail)?;
        let mut paths =
            entries.map(|entry| Ok(entry.map_err(fail)?.path())).collect::<Result<Vec<_>, _>>()?;
        paths.sort();
        Ok(paths)
    };
    for path in list(folder)? {
        if path.is_dir() {
            logs.extend(list(&path)?.into_iter().filter(|path| is_log(path)));
        } else if is_log(&path) {
            logs.push(path);
        }
    }
    Ok(logs)
}

fn load_plan(path: &Path) -> Result<Plan, CommandError> {
    if has_extension(path, "json") {
        return Ok(campaign::read_plan(path)?);
    }
    let vehicle = library::builtin("airsim-generic-quad")?;
    let mut loaded = load_shows(path, &vehicle)?;
    if loaded.len() != 1 {
        return Err(CommandError::Usage(format!(
            "{} holds {} flights; give the folder of one of them",
            path.display(),
            loaded.len()
        )));
    }
    Ok(loaded.remove(0).plan)
}

/// The calibration whose A and u0 are held.
fn read_reference(path: &Path) -> Result<FlightAnalysis, CommandError> {
    let analysis: Analysis = campaign::read_json(path)?;
    analysis
        .flights
        .into_iter()
        .find(|flight| flight.purpose == Purpose::Calibration && flight.flock.is_some())
        .ok_or_else(|| {
            CommandError::Usage(format!("{} has no calibration to hold", path.display()))
        })
}

fn stem(path: &Path) -> String {
    let name = path.file_stem().or(path.file_name());
    let text = name.map_or_else(String::new, |name| name.to_string_lossy().into_owned());
    if text.is_empty() { "logs".to_owned() } else { text }
}

/// Flights of several campaigns may have the same name: the folder's name tells them apart.
fn name_apart(flights: &mut [Found], paths: &[PathBuf]) {
    if paths.len() < 2 || flights.len() != paths.len() {
        return;
    }
    for (flight, path) in flights.iter_mut().zip(paths) {
        flight.name = stem(path);
    }
}

fn provenance(work: &Work) -> Provenance {
    let paths: Vec<&Path> =
        work.flights.iter().flat_map(|flight| &flight.logs).map(|log| log.path.as_path()).collect();
    let inputs = paths
        .par_iter()
        .map(|path| {
            // A log that cannot be read is already named as missing by the analysis.
            let sha256 = read_whole(path, MAX_LOG_BYTES)
                .map_or_else(|error| format!("not read: {error}"), |bytes| sha256(&bytes));
            let shown = path.strip_prefix(&work.root).unwrap_or(path);
            InputFile { path: shown.display().to_string(), sha256 }
        })
        .collect();
    let shown: Vec<_> = std::env::args()
        .skip(1)
        .map(|word| if word.contains(' ') { format!("'{word}'") } else { word })
        .collect();
    Provenance {
        program: made_by(),
        command: format!("updraft {}", shown.join(" ")),
        seed: work.flights.iter().find_map(|flight| flight.seed),
        made_at: String::new(),
        inputs,
    }
}
