//! `updraft sweep`: a study flown, evaluated and reported.

use std::path::{Path, PathBuf};

use clap::Args;
use schemars::JsonSchema;
use serde::Serialize;

use super::context::Context;
use super::exit::{CommandError, Exit};
use super::sensitivity::{self, Asked};
use super::shard_args::{self, ShardArgs};
use crate::base::plain::Shown as _;
use crate::report;
use crate::study::result::StudyResult;
use crate::study::sensitivity::items_folder;
use crate::study::{AnyStudy, Cell, Settings, StudyPlan, Work, cells_folder};
use crate::workflow::clock::Stopwatch;
use crate::workflow::cluster::{Items, Results};
use crate::workflow::sensitivity::{self as campaigns, Settings as CampaignSettings};
use crate::workflow::share::needs_folder;
use crate::workflow::study::{
    BUILT_IN, RESULT_FILE, evaluated, fly, join, record, refuse_campaign, shard_done, write,
};

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
  updraft sweep sensitivity -o what-decides           # whole campaigns: what decides the map's error

Flies the ladder in every wind and updraft of the study, fits the updraft of each flight with A and
u0 held fixed at those of still air, and writes study.json and report/index.html. Finished flights
are kept in cells/: running the same command again resumes an interrupted study, and after a change
to the study only what changed is flown. A sensitivity study (schema updraft.sensitivity/1, built in
as `sensitivity`) flies whole campaigns that differ in some factors, keeps their outcomes in items/, and
writes results.parquet, results.csv, sensitivity.json and the report. The grammar is in docs/study.md. Exit code 3: done, but some flights were lost.")]
pub(super) struct SweepArgs {
    /// Study: a file, or a built-in name (study, sensitivity)
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
    /// Keep the log of every flight in logs/ (of a sensitivity study: every campaign's folder in work/)
    #[arg(long)]
    keep_logs: bool,
    /// Fly finished flights again
    #[arg(long, conflicts_with_all = ["shard", "no_fly"])]
    force: bool,
    /// Folder in which the campaigns of a sensitivity study are flown, best on a disk of this machine
    /// alone [default: work/ in the study's folder]
    #[arg(long, value_name = "FOLDER")]
    scratch: Option<PathBuf>,
    #[command(flatten)]
    sharing: ShardArgs,
}

/// What `--json` prints.
#[derive(Serialize, JsonSchema)]
pub(super) struct SweepOutput<'a> {
    schema: &'static str,
    report: PathBuf,
    flown: usize,
    kept: usize,
    study: &'a StudyResult,
}

impl SweepArgs {
    /// Items of the study, as a cluster makes them.
    pub(super) fn items(&self, cwd: &Path) -> Result<Items, CommandError> {
        let folder = self.output.clone();
        Ok(match AnyStudy::load(&self.study)? {
            AnyStudy::Ladder(study) => {
                let cells = cwd.join(cells_folder(&folder));
                let file = |cell: &Cell| cells.join(format!("{}.json", cell.name()));
                Items {
                    name: "flight",
                    results: Results::Named { files: study.cells().iter().map(file).collect() },
                    product: Some(folder.join(RESULT_FILE)),
                    record: Some(record(&study, self.seed, command(self))?),
                    has_scratch: false,
                    folder,
                }
            }
            AnyStudy::Sensitivity(study) => Items {
                name: "campaign",
                results: Results::Numbered {
                    folder: cwd.join(items_folder(&folder)),
                    digits: 6,
                    suffix: ".json".to_owned(),
                    count: study.drawn(self.seed).len(),
                    per_folder: Some(1000),
                },
                product: Some(folder.join(campaigns::RESULT_FILE)),
                record: Some(campaigns::record(&study, self.seed, command(self))?),
                has_scratch: self.scratch.is_none(),
                folder,
            },
        })
    }
}

pub(super) fn run(context: &Context, args: &SweepArgs) -> Result<Exit, CommandError> {
    let study = AnyStudy::load(&args.study)?;
    refuse_campaign(&args.output)?;
    let share = args.sharing.share();
    needs_folder(&args.output, share)?;
    // Shards share the folder, on file systems that may have no locks.
    let _lock = share.shard.is_none().then(|| context.lock(&args.output)).transpose()?;
    match study {
        AnyStudy::Ladder(study) => ladder(context, args, &study),
        AnyStudy::Sensitivity(study) => {
            let (keep, jobs, scratch) = (args.keep_logs, args.jobs, args.scratch.clone());
            let settings = CampaignSettings { seed: args.seed, keep, jobs, scratch };
            let (output, force) = (args.output.clone(), args.force);
            let asked = Asked { output, force, settings, command: command(args), share };
            sensitivity::run(context, &study, &asked, width(context))
        }
    }
}

/// Columns of the terminal summary.
fn width(context: &Context) -> usize {
    context.width.map_or(report::NO_EDGE, |columns| columns.clamp(MIN_WIDTH, WIDTH))
}

fn ladder(context: &Context, args: &SweepArgs, study: &StudyPlan) -> Result<Exit, CommandError> {
    let watch = Stopwatch::start(context);
    let share = args.sharing.share();
    let settings =
        Settings { seed: args.seed, keep_logs: args.keep_logs, force: args.force, share };
    let work = Work::open(study, &args.output, settings)?;
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
    let result = evaluated(context, study, args.seed, &flown)?;
    if !context.json {
        context.print(&report::study_summary(&result, width(context), context.color))?;
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
