//! `updraft analyze`: logs become laws, a map of the air, and a report.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use serde::Serialize;

use super::clock::Stopwatch;
use super::context::Context;
use super::exit::{CommandError, Exit};
use super::fields::{read_study, write_fields};
use super::found::{Found, OriginChoice, Work, find, find_tables, stem};
use super::load::{has_extension, load_shows};
use super::outcome::{nothing_found, problems};
use super::progress::Progress;
use super::provenance::provenance;
use super::{held, twice, words};
use crate::analysis::battery::Sag;
use crate::analysis::result::{Analysis, FlightAnalysis, Yield};
use crate::analysis::windows::Tilt;
use crate::analysis::{AnalysisOptions, FlightInput, MapLaw, OffsetRule, analyze};
use crate::base::file::write_with;
use crate::base::json::write_json;
use crate::base::plain::Shown as _;
use crate::base::time::GpsTime;
use crate::campaign;
use crate::campaign::origin::LogOrigin;
use crate::flight::Indicator;
use crate::flight::identity::{SAME_START_S, later_s};
use crate::mission::Plan;
use crate::mission::plan::Purpose;
use crate::report::{self, Provenance, terminal_summary};
use crate::study::result::StudyResult;
use crate::vehicle::library;

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
the log's own desired velocity. Whose a log is, it says itself: by its home position, else by its
file name (07.BIN), else by its system id. Exit code 3: done, but logs are missing, unusable,
copies, damaged, from another place or end in the air, or drones gave no law, one of a part of the
ladder, or no value of the map; each is named with its reason. Exit code 5: no law and no map at all.")]
pub(super) struct AnalyzeArgs {
    /// Campaign folders, folders of logs, or logs
    #[arg(required_unless_present = "csv")]
    paths: Vec<PathBuf>,
    /// Analyse tables: a mapping file says which columns are what (docs/csv.md)
    #[arg(long, value_name = "MAPPING.toml", conflicts_with_all = ["paths", "plan", "start", "indicator"])]
    csv: Option<PathBuf>,
    /// Plan that the logs were flown from: plan.json, a flight's folder, .skyc or .skyb
    #[arg(long, value_name = "FILE")]
    plan: Option<PathBuf>,
    /// Take A and u0 from this analysis.json and fit only W
    #[arg(long, value_name = "FILE")]
    hold: Option<PathBuf>,
    /// Unix time of show time 0, s: aligns logs without SHOW rows by their GPS time
    #[arg(long, value_name = "UNIX_S")]
    start: Option<i64>,
    /// Which logs of a campaign: real or simulated [default: real where there are any]
    #[arg(long, value_name = "WHICH", value_enum, conflicts_with = "csv")]
    logs: Option<OriginChoice>,
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
    /// What stands for rotor effort
    #[arg(long, value_enum, default_value_t = IndicatorChoice::Pulse)]
    indicator: IndicatorChoice,
    /// How it is corrected for tilt (in windows and laws; the map of simulated flights of known drag
    /// has its own, see --no-wind)
    #[arg(long, value_enum, default_value_t = TiltChoice::Thrust)]
    tilt: TiltChoice,
    #[command(flatten)]
    without: Uncorrected,
    /// Subtract the pulse's slow offset over time and height (the paper's eq. 5) before laws are
    /// fitted
    #[arg(long, value_enum, default_value_t = OffsetChoice::Field)]
    offset: OffsetChoice,
    /// As in the paper: windows by their medians (means where the offset is subtracted), weighted by
    /// the samples' standard deviation, tilt as --tilt paper; the map from those laws alone
    #[arg(long)]
    paper: bool,
}

/// What the map is not corrected for.
#[derive(Clone, Debug, Default, Args)]
#[command(next_help_heading = "Analysis")]
struct Uncorrected {
    /// Do not correct the map for air density at different heights
    #[arg(long)]
    no_density: bool,
    /// Do not correct the map for the battery's voltage: what it may have done is then in its error
    #[arg(long)]
    no_battery: bool,
    /// Do not correct the map for wind on leaning drones (vehicles of known drag)
    #[arg(long)]
    no_wind: bool,
}

/// Law for the map of the air.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum LawChoice {
    /// A line that may bend, unless the calibration's windows make the signed quadratic clearly more
    /// probable (with --paper: the law of lower chi2)
    #[default]
    Auto,
    /// u = A' V + u0
    Linear,
    /// u = A f(V - W) + u0
    SignedQuadratic,
}

/// What stands for rotor effort.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum IndicatorChoice {
    /// Rotor control pulse width (RCOU)
    #[default]
    Pulse,
    /// Rotor speed from the speed controllers' telemetry (ESC)
    Rpm,
    /// Electrical power (BAT: voltage times current)
    Power,
}

impl From<Indicator> for IndicatorChoice {
    fn from(indicator: Indicator) -> Self {
        match indicator {
            Indicator::Pulse => Self::Pulse,
            Indicator::RotorSpeed => Self::Rpm,
            Indicator::Power => Self::Power,
        }
    }
}

/// Form of the tilt correction.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum TiltChoice {
    /// What the vertical part of the thrust takes
    #[default]
    Thrust,
    /// u cos(phi), as in the paper
    Paper,
}

/// When the slow offset is subtracted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum OffsetChoice {
    /// As the paper: in the field, not in simulations of uniform air
    #[default]
    Field,
    /// In all calibrations
    Always,
    /// In none
    Never,
}

impl AnalyzeOptions {
    fn resolve(&self) -> AnalysisOptions {
        let mut options = AnalysisOptions::default();
        options.windows.tilt = match self.tilt {
            TiltChoice::Paper => Tilt::Paper,
            TiltChoice::Thrust => Tilt::Thrust,
        };
        options.indicator = match self.indicator {
            IndicatorChoice::Pulse => Indicator::Pulse,
            IndicatorChoice::Rpm => Indicator::RotorSpeed,
            IndicatorChoice::Power => Indicator::Power,
        };
        options.map_law = match self.law {
            LawChoice::Auto => None,
            LawChoice::Linear => Some(MapLaw::Linear),
            LawChoice::SignedQuadratic => Some(MapLaw::SignedQuadratic),
        };
        options.offset = match self.offset {
            OffsetChoice::Field => OffsetRule::Field,
            OffsetChoice::Always => OffsetRule::Always,
            OffsetChoice::Never => OffsetRule::Never,
        };
        options.paper_windows = self.paper;
        options.air_aware = !self.paper;
        options
    }
}

impl AnalyzeOptions {
    /// How it was analysed, for the report: (what, how).
    fn words(&self) -> Vec<(&'static str, String)> {
        fn name(value: &impl ValueEnum) -> String {
            let value = value.to_possible_value();
            value.map_or_else(String::new, |value| value.get_name().to_owned())
        }
        let corrected = |off: bool| if off { "not corrected" } else { "corrected" }.to_owned();
        let windows = if self.paper {
            "medians, weighted by the samples' standard deviation (the paper's way)"
        } else {
            "trimmed means, weighted by their standard errors"
        };
        vec![
            ("law of the map", name(&self.law)),
            ("tilt correction", name(&self.tilt)),
            ("rotor effort", name(&self.indicator)),
            ("offset over time and height", name(&self.offset)),
            ("windows", windows.to_owned()),
            ("air density at height, in the map", corrected(self.without.no_density)),
            ("battery voltage, in the map", corrected(self.without.no_battery)),
            (
                "wind on leaning drones, in the map, where their drag is known",
                corrected(self.without.no_wind),
            ),
        ]
    }
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
    let mut work = Work::new(Path::new("."));
    work.origin = args.logs.map(Into::into);
    for path in &args.paths {
        find(path, plan.as_ref(), &mut work)?;
    }
    twice::refuse(&args.paths, &work)?;
    name_apart(&mut work.flights, &args.paths);
    let mut options = args.options.clone();
    if let Some(mapping) = &args.csv {
        options.indicator = find_tables(mapping, &mut work)?.into();
    }
    let Some(first) = args.csv.as_ref().or(args.paths.first()) else {
        return Err(CommandError::Usage("give a campaign, logs or --csv".to_owned()));
    };
    if args.paths.len() < 2 {
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
        for flight in &mut work.flights {
            // Whoever names another start than the one that was written down means its logs.
            let is_other = |known: GpsTime| later_s(start, known).abs() > SAME_START_S;
            if flight.start.replace(start).is_some_and(is_other) {
                flight.logs.iter_mut().for_each(|log| log.refused = None);
            }
        }
    }
    let _lock = output.as_deref().map(|folder| context.lock(folder)).transpose()?;
    finish(context, &work, &options, args.hold.as_deref(), output.as_deref())
}

/// Analyses a campaign into its own folder; the last step of `updraft run`.
pub(super) fn analyze_campaign(
    context: &Context,
    root: &Path,
    options: &AnalyzeOptions,
) -> Result<Exit, CommandError> {
    let mut work = Work::new(root);
    // What was just flown here.
    work.origin = Some(LogOrigin::Simulated);
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
    for used in &work.used {
        context.say(used);
    }
    let reference = hold.map(read_reference).transpose()?;
    for note in work.flights.iter().flat_map(|flight| &flight.notes) {
        context.warn(note);
    }
    let resolved = options.resolve();
    let doubts = hold
        .zip(reference.as_ref())
        .and_then(|(path, reference)| held::doubts(path, reference, resolved.indicator, work));
    // Tables and quiet runs say it with the other warnings.
    if let Some(doubts) = doubts.as_ref().filter(|_| context.json && !context.quiet) {
        context.warn(doubts);
    }
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
            density: flight.density.filter(|_| !options.without.no_density),
            leaning: flight.leaning.filter(|_| !options.without.no_wind),
            thrust_exponent: flight.thrust_exponent,
            sag: flight
                .sag
                .map(|sag| if options.without.no_battery { Sag::UNCORRECTED } else { sag }),
            true_air: flight.true_air.as_ref(),
            lean_table: flight.lean_table.as_ref().filter(|_| !options.without.no_wind),
            folder: Some(&work.root),
        })
        .collect();
    let total: usize = inputs.iter().map(|input| input.logs.len()).sum();
    let progress = Progress::new(context, "analysing", total as u64);
    // Hashing fills the pauses in which the analysis keeps one processor busy.
    let (analysis, provenance) = rayon::join(
        || {
            analyze(&work.title, &inputs, &resolved, reference.as_ref(), &|_, _| {
                progress.advance();
            })
        },
        || output.map(|_| provenance(work, options.words())),
    );
    let mut analysis = analysis.map_err(|error| CommandError::Nothing(error.to_string()))?;
    progress.finish();
    analysis.warnings.extend(work.absent.iter().cloned());
    analysis.warnings.extend(doubts);
    context.check_stop()?;
    if !context.json {
        context.print(&terminal_summary(&analysis, WIDTH, context.color))?;
    }
    let nothing = analysis.what_was_found() == Yield::Nothing;
    let mut page = None;
    if let (Some(folder), Some(provenance)) = (output, &provenance) {
        let study = read_study(context, &work.root);
        let report_folder = folder.join("report");
        let (page_made, numbers_made) = rayon::join(
            || write_report(&analysis, study.as_ref(), provenance, &report_folder),
            || write_numbers(&analysis, folder),
        );
        page_made.and(numbers_made)?;
        // A page that says that nothing was found is written, but there is nothing to point at.
        page = (!nothing).then(|| report_folder.join(report::PAGE_FILE));
    }
    if context.json && !nothing {
        context.print_json(&AnalyzeOutput {
            schema: "updraft.analyze/1",
            report: page.clone(),
            analysis: &analysis,
        })?;
    }
    // Where no tables are printed, what is lost would go unsaid.
    if (context.quiet || context.json) && !nothing {
        for problem in problems(&analysis, false) {
            context.warn(&problem);
        }
    }
    if let Some(page) = &page {
        context.result(page)?;
    }
    let place = match page {
        _ if nothing => ": nothing found".to_owned(),
        Some(page) => format!(" -> {}", page.shown()),
        None => String::new(),
    };
    let used: usize = analysis.flights.iter().map(|flight| flight.drones.len()).sum();
    let share = if used < total { format!("{used} of ") } else { String::new() };
    context.say(&format!("Analysed {share}{} in {watch}{place}", words::count(total, "log")));
    let lossy = |flight: &FlightAnalysis| {
        !(flight.missing.is_empty() && flight.unused.is_empty() && flight.partly_used.is_empty())
    };
    let lost = used < total
        || !work.absent.is_empty()
        || analysis.flights.iter().any(lossy)
        || analysis.flights.len() < work.flights.len();
    Ok(match analysis.what_was_found() {
        Yield::Nothing => {
            return Err(nothing_found(&analysis, context.quiet || context.json));
        }
        Yield::Whole if !lost => Exit::Done,
        Yield::Whole | Yield::Partial => Exit::Losses,
    })
}

/// The page with its figures.
fn write_report(
    analysis: &Analysis,
    study: Option<&StudyResult>,
    provenance: &Provenance,
    folder: &Path,
) -> Result<(), CommandError> {
    let made = match study {
        Some(study) => report::render_with_study(analysis, study, provenance)?,
        None => report::render(analysis, provenance)?,
    };
    Ok(report::write(&made, folder)?)
}

/// All numbers, and the field of the map as tables.
fn write_numbers(analysis: &Analysis, folder: &Path) -> Result<(), CommandError> {
    // Streamed: that of a thousand drones has a hundred megabytes.
    write_with(&folder.join("analysis.json"), |out| write_json(out, analysis))?;
    write_fields(analysis, folder)
}

pub(super) fn load_plan(path: &Path) -> Result<Plan, CommandError> {
    if has_extension(path, "json") {
        return Ok(campaign::read_plan(path)?);
    }
    let several = |count: usize| {
        CommandError::Usage(format!(
            "{} holds {count} flights; give the folder of one of them",
            path.shown()
        ))
    };
    // The plan is what counts, whatever else of the flight is there.
    if path.is_dir() && campaign::is_campaign(path) {
        return match campaign::flights(path)?.as_slice() {
            [flight] => Ok(flight.read_plan()?),
            flights => Err(several(flights.len())),
        };
    }
    let vehicle = library::builtin("airsim-generic-quad")?;
    let mut loaded = load_shows(path, &vehicle)?;
    if loaded.len() != 1 {
        return Err(several(loaded.len()));
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
        .ok_or_else(|| CommandError::Usage(format!("{} has no calibration to hold", path.shown())))
}

/// Flights of several campaigns may have the same name: the folder's name tells them apart.
fn name_apart(flights: &mut [Found], paths: &[PathBuf]) {
    if paths.len() < 2 || flights.len() != paths.len() {
        return;
    }
    let mut names: Vec<String> = paths.iter().map(|path| stem(path)).collect();
    let mut distinct = names.clone();
    distinct.sort();
    distinct.dedup();
    // `calibration/logs` and `hover/logs`: the flight's folder has the name.
    if distinct.len() < names.len() {
        let above = |path: &PathBuf| path.parent().map_or_else(|| stem(path), stem);
        names = paths.iter().map(above).collect();
    }
    for (flight, name) in flights.iter_mut().zip(names) {
        flight.name = name;
    }
}
