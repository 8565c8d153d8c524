//! `updraft sweep`: a study flown, evaluated and reported.

use std::path::{Path, PathBuf};

use clap::Args;
use serde::Serialize;

use super::clock::Stopwatch;
use super::context::Context;
use super::exit::{CommandError, Exit};
use super::progress::Progress;
use super::simulate::made_by;
use crate::base::file::write_whole;
use crate::base::plain::Shown as _;
use crate::campaign::{self, to_json};
use crate::report::{self, Provenance};
use crate::study::result::StudyResult;
use crate::study::{Flown, Settings, StudyPlan, Work, evaluate};

/// Name of the built-in study.
const BUILT_IN: &str = "study";
/// Width of the terminal summary, columns: at most, and at least.
const WIDTH: usize = 100;
const MIN_WIDTH: usize = 60;

/// Arguments of `updraft sweep`.
#[derive(Debug, Args)]
#[command(after_long_help = "Examples:
  updraft sweep templates/study.toml
  updraft sweep my-study.toml -o my-study --seed 7
  updraft sweep --keep-logs

Flies the ladder in every wind and updraft of the study, fits the updraft of each flight with A and u0
held from the one in still air, and writes study.json and report/index.html. Finished flights are kept
in cells/: the same command goes on where an interrupted one stopped, and a changed study flies only
what changed. The grammar is in docs/study.md. Exit code 3: done, but some flights were lost.")]
pub(super) struct SweepArgs {
    /// Study: a file or the built-in name
    #[arg(default_value = BUILT_IN)]
    study: String,
    /// Folder of the study's flights and results
    #[arg(short, long, value_name = "FOLDER", default_value = "study")]
    output: PathBuf,
    /// Seed of sensor noise and clock offsets; every flight has its own from it
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Flights at the same time [default: one per core]
    #[arg(short, long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
    /// Keep the log of every flight in logs/
    #[arg(long)]
    keep_logs: bool,
    /// Fly again what is finished
    #[arg(long)]
    force: bool,
}

/// What `--json` prints.
#[derive(Serialize)]
struct SweepOutput<'a> {
    schema: &'static str,
    report: PathBuf,
    flown: usize,
    kept: usize,
    study: &'a StudyResult,
}

pub(super) fn run(context: &Context, args: &SweepArgs) -> Result<Exit, CommandError> {
    let watch = Stopwatch::start();
    let study = StudyPlan::load(&args.study)?;
    refuse_campaign(&args.output)?;
    let _lock = context.lock(&args.output)?;
    let settings = Settings { seed: args.seed, keep_logs: args.keep_logs, force: args.force };
    let work = Work::open(&study, &args.output, settings)?;
    let (total, open) = (work.total(), work.open_flights());
    if open < total {
        context.say(&format!("{} of {total} flights are there already", total - open));
    }
    let flown = fly(context, work, "flying", args.jobs)?;
    let flying = watch.to_string();
    let result = evaluated(context, &study, args.seed, &flown)?;
    if !context.json {
        let width = context.width.map_or(WIDTH, |columns| columns.clamp(MIN_WIDTH, WIDTH));
        context.print(&report::study_summary(&result, width, context.color))?;
    }
    let page = write(&args.output, command(args), args.seed, &result)?;
    if context.json {
        context.print_json(&SweepOutput {
            schema: "updraft.sweep/1",
            report: page.clone(),
            flown: flown.flown,
            kept: total - flown.flown,
            study: &result,
        })?;
    }
    context.result(&page)?;
    context.say(&format!(
        "Flew {} flights in {flying}, all done in {watch} -> {}",
        flown.flown,
        page.shown()
    ));
    for lost in &result.lost {
        context.warn(&format!("{} is lost: {}", lost.name, lost.reason));
    }
    Ok(if result.lost.is_empty() { Exit::Done } else { Exit::Losses })
}

/// Flies what is open of a study, `jobs` flights at the same time.
fn fly(
    context: &Context,
    work: Work<'_>,
    doing: &'static str,
    jobs: Option<u16>,
) -> Result<Flown, CommandError> {
    let progress = Progress::new(context, doing, work.open_flights() as u64);
    let fly = || work.fly(context.stop_flag(), &|| progress.advance());
    let flown = match jobs {
        Some(jobs) => rayon::ThreadPoolBuilder::new()
            .num_threads(usize::from(jobs))
            .build()
            .map_err(|error| CommandError::Failed(format!("failed to start threads: {error}")))?
            .install(fly),
        None => fly(),
    };
    progress.finish();
    let flown = flown?;
    context.check_stop()?;
    Ok(flown)
}

/// The results of a study; flights that were lost are named.
fn evaluated(
    context: &Context,
    study: &StudyPlan,
    seed: u64,
    flown: &Flown,
) -> Result<StudyResult, CommandError> {
    let result = evaluate(study, seed, flown)?;
    for lost in &result.lost {
        context.warn(&format!("{}: {}", lost.name, lost.reason));
    }
    Ok(result)
}

/// Flies the built-in study into a folder, for the report of a campaign. Finished flights are kept.
pub(super) fn fly_study(context: &Context, folder: &Path, seed: u64) -> Result<(), CommandError> {
    let watch = Stopwatch::start();
    let study = StudyPlan::load(BUILT_IN)?;
    let work = Work::open(&study, folder, Settings { seed, keep_logs: false, force: false })?;
    let flown = fly(context, work, "flying the study", None)?;
    let result = evaluated(context, &study, seed, &flown)?;
    write(folder, format!("updraft run --seed {seed}"), seed, &result)?;
    context.say(&format!("Flew the simulation study ({} flights) in {watch}", flown.flown));
    Ok(())
}

/// A study in a campaign's folder would overwrite its report.
fn refuse_campaign(folder: &Path) -> Result<(), CommandError> {
    if campaign::is_campaign(folder) {
        return Err(CommandError::Usage(format!(
            "{} is a campaign; give the study another folder with --output",
            folder.shown()
        )));
    }
    Ok(())
}

/// Writes the results; the page last, so that where it is, all is.
fn write(
    folder: &Path,
    command: String,
    seed: u64,
    result: &StudyResult,
) -> Result<PathBuf, CommandError> {
    let json = to_json(result)
        .map_err(|error| CommandError::Failed(format!("failed to make JSON: {error}")))?;
    let provenance =
        Provenance { program: made_by(), command, seed: Some(seed), ..Provenance::default() };
    let made = report::render_study(result, &provenance)?;
    let pages = folder.join("report");
    write_whole(&folder.join("study.json"), &json)?;
    report::write(&made, &pages)?;
    Ok(pages.join(report::PAGE_FILE))
}

/// The command line that gives these results.
fn command(args: &SweepArgs) -> String {
    format!("updraft sweep {} --seed {} -o {}", args.study, args.seed, args.output.shown())
}
