//! `updraft sweep` of a sensitivity study: whole campaigns flown, evaluated and reported.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::Serialize;

use super::context::Context;
use super::exit::{CommandError, Exit};
use super::shard_args;
use super::words;
use crate::base::plain::Shown as _;
use crate::base::shard::Share;
use crate::report;
use crate::study::sensitivity::{SensitivityPlan, SensitivityResult, SensitivityWork};
use crate::workflow::clock::Stopwatch;
use crate::workflow::sensitivity::{Settings, evaluated, fly, join, shard_done, write};

/// What `updraft sweep` was asked for, as far as it concerns this kind of study.
pub(super) struct Asked {
    /// Folder of the study.
    pub(super) output: PathBuf,
    /// Whether finished campaigns are flown again.
    pub(super) force: bool,
    pub(super) settings: Settings,
    /// Command line that gives these results.
    pub(super) command: String,
    /// Which campaigns are looked at.
    pub(super) share: Share,
}

/// What `--json` prints.
#[derive(Serialize, JsonSchema)]
pub(super) struct SensitivityOutput<'a> {
    schema: &'static str,
    report: PathBuf,
    flown: usize,
    kept: usize,
    study: &'a SensitivityResult,
}

/// Flies the campaigns of a share; of all of them, reports what came of them.
pub(super) fn run(
    context: &Context,
    study: &SensitivityPlan,
    asked: &Asked,
    width: usize,
) -> Result<Exit, CommandError> {
    let watch = Stopwatch::start(context);
    let Asked { output, settings, share, .. } = asked;
    let work = SensitivityWork::open(study, output, settings.seed, asked.force, *share)?;
    join(context, output, (study, settings.seed), &work, *share)?;
    let takes = |item: usize| share.takes(item);
    let total = share.count(work.total());
    let kept = total - work.open_items(&takes);
    if kept > 0 {
        context.say(&format!("{kept} of {} are there already", words::count(total, "campaign")));
    }
    let all = work.total();
    let gathered = fly(context, study, work, output, settings, &takes)?;
    if let Some(shard) = share.shard {
        let done = shard_done(context, shard, all, &gathered);
        return shard_args::report(context, &done, "campaign");
    }
    let flying = watch.to_string();
    let result = evaluated(context, study, settings.seed, &gathered);
    if !context.json {
        context.print(&report::sensitivity_summary(&result, width, context.color))?;
    }
    let page = write(output, asked.command.clone(), study, &gathered, &result)?;
    if context.json {
        context.print_json(&SensitivityOutput {
            schema: "updraft.sweep-sensitivity/1",
            report: page.clone(),
            flown: gathered.flown,
            kept,
            study: &result,
        })?;
    }
    context.result(&page)?;
    context.say(&format!(
        "Flew {} in {flying}, all done in {watch} -> {}",
        words::count(gathered.flown, "campaign"),
        page.shown()
    ));
    Ok(if result.lost == 0 { Exit::Done } else { Exit::Losses })
}
