//! `updraft analyze`: logs become laws, a map of the air, and a report.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use schemars::JsonSchema;
use serde::Serialize;

use super::analyze_each;
use super::basemap_args::BasemapArgs;
use super::context::Context;
use super::exit::{CommandError, Exit};
use super::files_args::FilesArgs;
use super::origin::OriginChoice;
use super::paper_args::PaperArgs;
use super::shard_args::ShardArgs;
use super::words;
use super::zero::ZeroStretch;
use crate::analysis::result::Analysis;
use crate::analysis::windows::Tilt;
use crate::analysis::{AnalysisOptions, LawKind, OffsetRule};
use crate::base::plain::Shown as _;
use crate::base::shard::Share;
use crate::flight::Indicator;
use crate::report::{Basemap, NO_EDGE, terminal_summary};
use crate::workflow::analyze::each::record_path;
use crate::workflow::analyze::{
    Analysed, Analysing, Files, Request, Settings, Uncorrected as Without, gather, simulated,
};
use crate::workflow::basemap::shows_work;
use crate::workflow::clock::Stopwatch;
use crate::workflow::error::WorkflowError;
use crate::workflow::find::{LevelWish, Work};
use crate::workflow::paper::PaperFigures;

/// Width of the terminal summary, columns.
const WIDTH: usize = 100;
/// Depths of the mixed layer that are taken, m.
const DEPTHS_M: (f64, f64) = (10.0, 10_000.0);

/// Arguments of `updraft analyze`.
#[derive(Debug, Args)]
#[command(after_long_help = "Examples:
  updraft analyze my-campaign
  updraft analyze logs/ --plan my-campaign/calibration
  updraft analyze flight.BIN
  updraft analyze windy --hold still/analysis.json
  updraft analyze my-campaign --mixed-layer-depth 1200   (turbulence with w*)
  updraft analyze --each season/*                 (each campaign by itself)
  updraft analyze --csv phantom4-mast.toml --zero 0..150s --vehicle phantom4

A campaign's results go into its folder, others into --output. Without a plan, windows are found from
the desired velocity in the log. A log is assigned to its drone by its home position, else by its
file name (07.BIN), else by its system id. Exit code 3: done, but logs are missing, unusable,
duplicates, damaged, from another place or end in the air, or drones gave no law, a law from only
part of the ladder, or no value in the map; each is named, with its reason. Exit code 5: no law and
no map at all.")]
pub(super) struct AnalyzeArgs {
    /// Campaign folders, folders of logs, or logs
    #[arg(required_unless_present = "csv")]
    paths: Vec<PathBuf>,
    /// Analyse tables: a mapping file says what each column is (docs/csv.md)
    #[arg(long, value_name = "MAPPING.toml", conflicts_with_all = ["paths", "plan", "start", "indicator"])]
    csv: Option<PathBuf>,
    /// Vehicle whose response to climb and wind the tables are inverted with (a built-in name or a
    /// file); its level is fitted to --zero, or to the mapping's calibration
    #[arg(long, value_name = "NAME")]
    vehicle: Option<String>,
    /// Stretch of the tables' hover in which the mean of the air is taken to be zero, for example
    /// 0..150s; the rest is measured from it, and held against the mapping's truth
    #[arg(long, value_name = "FROM..TO")]
    zero: Option<ZeroStretch>,
    /// Plan that the logs were flown from: plan.json, a flight's folder, .skyc or .skyb
    #[arg(long, value_name = "FILE")]
    plan: Option<PathBuf>,
    /// Hold the law of each drone in this analysis.json, as the curve that it flew, and fit only the
    /// updraft W, with its error; beside it the paper's way, with A and u0 held
    #[arg(long, value_name = "FILE")]
    hold: Option<PathBuf>,
    /// Unix time of show time 0, s: aligns logs without SHOW rows by their GPS time
    #[arg(long, value_name = "UNIX_S")]
    start: Option<i64>,
    /// Which logs of a campaign to use [default: real ones if there are any]
    #[arg(long, value_name = "WHICH", value_enum, conflicts_with = "csv")]
    logs: Option<OriginChoice>,
    /// Folder for analysis.json and report/ [default: the campaign, or NAME-analysis]
    #[arg(short, long, value_name = "FOLDER")]
    output: Option<PathBuf>,
    /// Print the results, but write nothing
    #[arg(long)]
    no_report: bool,
    /// Analyse each campaign by itself, into its own folder; those that are done are not done again
    #[arg(long, conflicts_with_all = ["csv", "output", "no_report", "basemap", "paper_figures"])]
    each: bool,
    #[command(flatten)]
    basemap: BasemapArgs,
    #[command(flatten)]
    paper: PaperArgs,
    #[command(flatten)]
    sharing: ShardArgs,
    #[command(flatten)]
    files: FilesArgs,
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
    /// What is used as rotor effort
    #[arg(long, value_enum, default_value_t = IndicatorChoice::Pulse)]
    indicator: IndicatorChoice,
    /// How pulses are corrected for tilt (in windows and laws; the map of simulated flights with
    /// known drag has its own correction, see --no-wind)
    #[arg(long, value_enum, default_value_t = TiltChoice::Thrust)]
    tilt: TiltChoice,
    #[command(flatten)]
    without: Uncorrected,
    /// Subtract the pulse's slow offset over time and height (the paper's eq. 5) before laws are
    /// fitted
    #[arg(long, value_enum, default_value_t = OffsetChoice::Field)]
    offset: OffsetChoice,
    /// Analyse as in the paper: windows by their medians (means where the offset is subtracted),
    /// weighted by the samples' standard deviation, tilt as with --tilt paper; the map from those
    /// laws alone, as with --plain
    #[arg(long)]
    paper: bool,
    /// Depth of the mixed layer above the ground, m, by whoever knows it (a sounding, a model): turbulence then has the
    /// convective velocity scale w*
    #[arg(long, value_name = "M", value_parser = depth)]
    mixed_layer_depth: Option<f64>,
    /// Give the paper's own estimate, for comparison: its two laws alone, and the map drone by drone
    /// and second by second from them (eqs. 6 and 7). The map is still corrected for density, and for
    /// wind where it can be from drag alone; the paper did neither (--no-density --no-wind)
    #[arg(long)]
    plain: bool,
}

/// What the map is not corrected for.
#[derive(Clone, Copy, Debug, Default, Args)]
#[command(next_help_heading = "Analysis")]
struct Uncorrected {
    /// Do not correct the map for air density at different heights
    #[arg(long)]
    no_density: bool,
    /// Do not correct the map for the battery's voltage; its possible effect then widens the error
    #[arg(long)]
    no_battery: bool,
    /// Do not correct the map for wind on leaning drones (vehicles with known drag)
    #[arg(long)]
    no_wind: bool,
}

/// Law for the map of the air.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum LawChoice {
    /// A line that may bend, unless the calibration's windows make the signed quadratic clearly more
    /// probable (with --plain: the law with the lower chi2)
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
    /// The pulse width, and a map of all that the logs hold together, by the errors that the
    /// calibration shows of each
    All,
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
    /// By the vertical part of the thrust
    #[default]
    Thrust,
    /// u cos(phi), as in the paper
    Paper,
}

/// When the slow offset is subtracted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum OffsetChoice {
    /// As in the paper: in the field, not in simulations of uniform air
    #[default]
    Field,
    /// In all calibrations
    Always,
    /// In none
    Never,
}

impl AnalyzeOptions {
    /// Those of `updraft run`.
    pub(super) fn of_run(plain: bool) -> Self {
        Self { plain, ..Self::default() }
    }

    /// The same for the library.
    pub(super) fn settings(&self) -> Settings {
        let mut options = AnalysisOptions::default();
        options.windows.tilt = match self.tilt {
            TiltChoice::Paper => Tilt::Paper,
            TiltChoice::Thrust => Tilt::Thrust,
        };
        options.indicator = match self.indicator {
            IndicatorChoice::Pulse | IndicatorChoice::All => Indicator::Pulse,
            IndicatorChoice::Rpm => Indicator::RotorSpeed,
            IndicatorChoice::Power => Indicator::Power,
        };
        options.map_law = match self.law {
            LawChoice::Auto => None,
            LawChoice::Linear => Some(LawKind::Linear),
            LawChoice::SignedQuadratic => Some(LawKind::SignedQuadratic),
        };
        options.offset = match self.offset {
            OffsetChoice::Field => OffsetRule::Field,
            OffsetChoice::Always => OffsetRule::Always,
            OffsetChoice::Never => OffsetRule::Never,
        };
        options.paper_windows = self.paper;
        options.mixed_layer_depth_m = self.mixed_layer_depth;
        options.plain = self.plain || self.paper;
        let Uncorrected { no_density, no_battery, no_wind } = self.without;
        let without = Without { density: no_density, battery: no_battery, wind: no_wind };
        let combine = self.indicator == IndicatorChoice::All;
        Settings { options, without, combine, files: Files::default() }
    }
}

/// A depth of the mixed layer, m.
fn depth(text: &str) -> Result<f64, String> {
    let depth_m: f64 =
        text.trim().parse().map_err(|_| "it must be a number of metres".to_owned())?;
    if (DEPTHS_M.0..=DEPTHS_M.1).contains(&depth_m) {
        return Ok(depth_m);
    }
    Err(format!("mixed layers are {} to {} m deep", DEPTHS_M.0, DEPTHS_M.1))
}

/// What `--json` prints.
#[derive(Serialize, JsonSchema)]
pub(super) struct AnalyzeOutput<'a> {
    schema: &'static str,
    report: Option<PathBuf>,
    analysis: &'a Analysis,
}

impl AnalyzeArgs {
    /// One request for each path.
    pub(super) fn requests(&self) -> Vec<Request> {
        let one = |path: &PathBuf| Request {
            paths: vec![path.clone()],
            plan: self.plan.clone(),
            start_unix_s: self.start,
            origin: self.logs.map(Into::into),
            ..Request::default()
        };
        self.paths.iter().map(one).collect()
    }

    /// Records of the analyses of these campaigns, each by itself.
    pub(super) fn results(&self) -> Result<Vec<PathBuf>, CommandError> {
        let record = |request: &Request| Ok(record_path(&request.output()?));
        self.requests().iter().map(record).collect()
    }

    /// What all of them have in common: settings, held laws, share.
    pub(super) fn common(&self) -> (Settings, Option<&Path>, Share) {
        (self.files.of(self.options.settings()), self.hold.as_deref(), self.sharing.share())
    }

    /// The response and the level that tables are inverted with, if that was asked for.
    fn level(&self) -> Result<Option<LevelWish>, WorkflowError> {
        let asked = if self.zero.is_some() { "--zero" } else { "--vehicle" };
        if self.zero.is_none() && self.vehicle.is_none() {
            return Ok(None);
        }
        if self.csv.is_none() {
            return Err(WorkflowError::Usage(format!(
                "{asked} is for tables: give their mapping file with --csv. The zero of a campaign's \
                 logs comes from its calibration flight, and their vehicle from its folder"
            )));
        }
        if self.options.plain || self.options.paper {
            return Err(WorkflowError::Usage(format!(
                "{asked} gives a table its vehicle's response, and the paper's own estimate (--plain, --paper) knows \
                 its two laws alone: leave out one of them"
            )));
        }
        if self.options.law != LawChoice::Auto {
            return Err(WorkflowError::Usage(format!(
                "{asked} inverts a table with a response whose level is fitted, and with none of the laws that --law chooses \
                 from: leave out one of them"
            )));
        }
        let zero_s = self.zero.map(|ZeroStretch(zero_s)| zero_s);
        Ok(Some(LevelWish { vehicle: self.vehicle.clone(), zero_s }))
    }
}

pub(super) fn run(context: &Context, args: &AnalyzeArgs) -> Result<Exit, CommandError> {
    if args.each {
        return analyze_each::run(context, args);
    }
    if args.sharing.shard.is_some() || args.sharing.no_fly {
        return Err(WorkflowError::Usage(
            "--shard and --no-fly are for many campaigns, each analysed by itself: give --each"
                .to_owned(),
        ));
    }
    let request = Request {
        paths: args.paths.clone(),
        tables: args.csv.clone(),
        level: args.level()?,
        plan: args.plan.clone(),
        start_unix_s: args.start,
        origin: args.logs.map(Into::into),
    };
    let (work, indicator) = gather(&request)?;
    let mut options = args.options.clone();
    if let Some(indicator) = indicator {
        options.indicator = indicator.into();
    }
    let paper = args.paper.wish()?;
    let basemap = args.basemap.read()?;
    if let Some((path, basemap)) = args.basemap.basemap.as_ref().zip(basemap.as_ref()) {
        shows_work(path, basemap, &work)?;
    }
    let output = match &args.output {
        _ if args.no_report => None,
        Some(folder) => Some(folder.clone()),
        None => Some(request.output()?),
    };
    let _lock = output.as_deref().map(|folder| context.lock(folder)).transpose()?;
    let settings = args.files.of(options.settings());
    let wanted = Wanted { output: output.as_deref(), basemap, paper };
    finish(context, &work, &settings, args.hold.as_deref(), wanted)
}

/// Analyses a campaign into its own folder; the last step of `updraft run`.
pub(super) fn analyze_campaign(
    context: &Context,
    root: &Path,
    settings: &Settings,
    (basemap, paper): (Option<Basemap>, Option<PaperFigures>),
) -> Result<Exit, CommandError> {
    // What was just flown here.
    let wanted = Wanted { output: Some(root), basemap, paper };
    finish(context, &simulated(root)?, settings, None, wanted)
}

/// What is made of an analysis beside what is printed.
struct Wanted<'a> {
    /// Folder of numbers and report, if they are written.
    output: Option<&'a Path>,
    basemap: Option<Basemap>,
    paper: Option<PaperFigures>,
}

/// Analyses, and prints what came of it.
fn finish(
    context: &Context,
    work: &Work,
    settings: &Settings,
    hold: Option<&Path>,
    Wanted { output, basemap, paper }: Wanted<'_>,
) -> Result<Exit, CommandError> {
    let watch = Stopwatch::start(context);
    let analysing = Analysing::begin(context, work, settings, hold)?;
    // Tables and quiet runs say it with the other warnings.
    if let Some(doubts) = analysing.doubts().filter(|_| context.json && !context.quiet) {
        context.warn(doubts);
    }
    let analysed = analysing.run(output.is_some())?.on(basemap);
    let Analysed { analysis, logs, .. } = &analysed;
    if !context.json {
        let width = if context.width.is_some() { WIDTH } else { NO_EDGE };
        context.print(&terminal_summary(analysis, width, context.color))?;
    }
    let page = output.map(|folder| analysed.write(context, folder)).transpose()?.flatten();
    if let Some(paper) = &paper {
        analysed.print(context, paper)?;
    }
    let nothing = analysed.is_nothing();
    if context.json && !nothing {
        let schema = "updraft.analyze/1";
        context.print_json(&AnalyzeOutput { schema, report: page.clone(), analysis })?;
    }
    // Where no tables are printed, what is lost would go unsaid.
    if (context.quiet || context.json) && !nothing {
        for problem in analysed.problems() {
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
    let used = analysed.used();
    let share = if used < *logs { format!("{used} of ") } else { String::new() };
    context.say(&format!("Analysed {share}{} in {watch}{place}", words::count(*logs, "log")));
    Ok(analysed.ending(context.quiet || context.json)?.into())
}
