//! `updraft analyze --each`: many campaigns, each by itself.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::Serialize;

use super::analyze::AnalyzeArgs;
use super::context::Context;
use super::exit::{CommandError, Exit, with_reasons};
use super::shard_args;
use super::words;
use crate::base::plain::Shown as _;
use crate::report;
use crate::workflow::analyze::each::{EachDone, each, ending, ending_of_shard};
use crate::workflow::clock::Stopwatch;
use crate::workflow::share::ShardDone;

/// What `--json` prints.
#[derive(Serialize, JsonSchema)]
pub(super) struct EachOutput {
    /// Format name and version: `updraft.analyze-each/1`.
    schema: &'static str,
    /// Campaigns, in the order in which they were given.
    campaigns: Vec<OneOutput>,
}

/// One campaign.
#[derive(Serialize, JsonSchema)]
struct OneOutput {
    /// Path as it was given.
    path: PathBuf,
    /// Page of the report; null: the analysis failed or found nothing.
    report: Option<PathBuf>,
    /// Number of logs.
    logs: usize,
    /// Number of logs that gave a drone's results.
    used: usize,
    /// Losses, one sentence each; for a failed analysis, the reason.
    problems: Vec<String>,
    /// Whether it was analysed before.
    was_there: bool,
}

impl OneOutput {
    fn of(done: &EachDone) -> Self {
        let (path, was_there) = (done.path.clone(), done.was_there);
        match &done.result {
            Ok(record) => {
                let page = done.folder.join("report").join(report::PAGE_FILE);
                Self {
                    path,
                    report: (!record.is_nothing).then_some(page),
                    logs: record.logs,
                    used: record.used,
                    problems: record.problems.clone(),
                    was_there,
                }
            }
            Err(error) => {
                let problems = vec![with_reasons(error)];
                Self { path, report: None, logs: 0, used: 0, problems, was_there }
            }
        }
    }

    fn line(&self) -> String {
        let place =
            self.report.as_ref().map_or_else(String::new, |page| format!(" -> {}", page.shown()));
        let losses = match self.problems.len() {
            0 => String::new(),
            count => format!(", {}", words::count(count, "loss")),
        };
        let used = words::count(self.logs, "log");
        format!("{}: {} of {used} used{losses}{place}\n", self.path.shown(), self.used)
    }
}

pub(super) fn run(context: &Context, args: &AnalyzeArgs) -> Result<Exit, CommandError> {
    let watch = Stopwatch::start(context);
    let (settings, hold, share) = args.common();
    let all = each(context, &args.requests(), &settings, hold, share)?;
    let exit = Exit::from(ending(&all));
    let there = all.iter().filter(|done| done.was_there).count();
    if let Some(shard) = share.shard {
        let failed = all.iter().filter_map(|done| done.result.as_ref().err());
        let lost = failed.map(with_reasons_of).collect();
        shard_args::report(
            context,
            &ShardDone { shard, items: all.len(), there, lost },
            "analysis",
        )?;
        return Ok(ending_of_shard(&all).into());
    }
    let campaigns: Vec<OneOutput> = all.iter().map(OneOutput::of).collect();
    for one in &campaigns {
        if !context.json {
            context.print(&one.line())?;
        }
        if let Some(page) = &one.report {
            context.result(page)?;
        }
    }
    if context.json {
        context.print_json(&EachOutput { schema: "updraft.analyze-each/1", campaigns })?;
    }
    context.say(&format!(
        "Analysed {} in {watch}, {there} of them before",
        words::count(all.len(), "campaign")
    ));
    Ok(exit)
}

fn with_reasons_of(error: &CommandError) -> String {
    with_reasons(error)
}
