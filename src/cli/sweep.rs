//! `updraft sweep`: a study flown, evaluated and reported.

use std::path::PathBuf;

use clap::Args;
use serde::Serialize;

use super::context::Context;
use super::exit::{CommandError, Exit};
use super::shard_args::{self, ShardArgs};
use crate::base::plain::Shown as _;
use crate::report;
use crate::study::result::StudyResult;
use crate::study::{Cell, Settings, StudyPlan, Work, cells_folder};
use crate::workflow::clock::Stopwatch;
use crate::workflow::study::{BUILT_IN, evaluated, fly, join, refuse_campaign, shard_done, write};

/// Width of the terminal summary, columns: at most, and at least.
const WIDTH: usize = 100;
const MIN_WIDTH: usize = 60;

/// Arguments of `updraft sweep`.
#[derive(Debug, Args)]
#[command(after_long_help = "Examples:
  updraft sweep templates/study.toml
  updraft sweep my-study.toml -o my-study --seed 7
  updraft sweep --keep-logs
  updraft sweep large.toml -o large --shard 3/10

Flies the ladder in every wind and updraft of the study, fits the updraft of each flight with A and
u0 held fixed at those of still air, and writes study.json and report/index.html. Finished flights
are kept in cells/: running the same command again resumes an interrupted study, and after a change
to the study only what changed is flown. The grammar is in docs/study.md. Exit code 3: done, but some flights were lost.")]
pub(super) struct SweepArgs {
    /// Study: a file or the built-in name
    #[arg(default_value = BUILT_IN)]
    study: String,
    /// Folder for the study's flights and results
    #[arg(short, long, value_name = "FOLDER", default_value = "study")]
    output: PathBuf,
    /// Seed for sensor noise and clock offsets; each flight derives its own
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Flights at the same time [default: one per core]
    #[arg(short, long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
    /// Keep the log of every flight in logs/
    #[arg(long)]
    keep_logs: bool,
    /// Fly finished flights again
    #[arg(long, conflicts_with_all = ["shard", "no_fly"])]
    force: bool,
    #[command(flatten)]
    sharing: ShardArgs,
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

impl SweepArgs {
    /// Folder of the study, and the files of its flights.
    pub(super) fn results(&self) -> Result<(PathBuf, Vec<PathBuf>), CommandError> {
        let study = StudyPlan::load(&self.study)?;
        let folder = cells_folder(&self.output);
        let file = |cell: &Cell| folder.join(format!("{}.json", cell.name()));
        Ok((self.output.clone(), study.cells().iter().map(file).collect()))
    }
}

pub(super) fn run(context: &Context, args: &SweepArgs) -> Result<Exit, CommandError> {
    let watch = Stopwatch::start(context);
    let study = StudyPlan::load(&args.study)?;
    refuse_campaign(&args.output)?;
    let share = args.sharing.share();
    // Shards share the folder, on file systems that may have no locks.
    let _lock = share.shard.is_none().then(|| context.lock(&args.output)).transpose()?;
    let settings =
        Settings { seed: args.seed, keep_logs: args.keep_logs, force: args.force, share };
    let work = Work::open(&study, &args.output, settings)?;
    join(context, &args.output, &work, share)?;
    let (total, open) = (work.total(), work.open_flights());
    if open < total {
        context.say(&format!("{} of {total} flights are there already", total - open));
    }
    let flown = fly(context, work, "flying", args.jobs)?;
    if let Some(shard) = share.shard {
        let done = shard_done(context, shard, total, &flown);
        return shard_args::report(context, &done, "flight");
    }
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

/// The command line that gives these results.
fn command(args: &SweepArgs) -> String {
    format!("updraft sweep {} --seed {} -o {}", args.study, args.seed, args.output.shown())
}
