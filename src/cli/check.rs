//! `updraft check`: is a show safe, whoever made it?

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use clap::Args;
use serde::Serialize;

use super::context::Context;
use super::exit::{CommandError, Exit};
use super::words::wrap;
use crate::base::plain::Shown as _;
use crate::check::CheckReport;
use crate::vehicle::library;
use crate::workflow::check::{Subject, allowed, is_safe, known, say_findings, subjects, verdict};
use crate::workflow::clock::Stopwatch;

/// Findings of each kind that are listed unless all are asked for.
const FEW: usize = 5;

/// Arguments of `updraft check`.
#[derive(Debug, Args)]
#[command(after_long_help = "Examples:
  updraft check my-campaign
  updraft check show.skyc --vehicle airsim-generic-quad
  updraft check 01.skyb
  updraft check my-campaign --allow endurance

A campaign is checked against its plan's limits and fence, and its files against the plan: each
file that is missing, damaged, different or belongs to no slot is named. A file inside a campaign is
checked against the plan beside it. Other people's shows are checked against their own limits and,
where they have none, the vehicle's. For distance, altitude and speeds the stricter limit applies:
only a plan, or --allow, loosens those. Every polygon of a show's fence counts (inside all inclusion
zones, outside all exclusion zones); a show without a fence is checked against none.
Exit code 4: not safe.")]
pub(super) struct CheckArgs {
    /// Campaign folder, .skyc, .skyb, zipped CSV, or a folder of .skyb files
    path: PathBuf,
    /// Vehicle whose limits apply where the show has none or has looser ones
    #[arg(long, value_name = "NAME", default_value = "airsim-generic-quad")]
    vehicle: String,
    /// Pass even if this check (given by name) fails; can be repeated
    #[arg(long, value_name = "CHECK")]
    allow: Vec<String>,
    /// List every finding, not only the first few of each kind (--json always does)
    #[arg(short, long)]
    verbose: bool,
}

/// What `--json` prints.
#[derive(Serialize)]
struct CheckOutput<'a> {
    schema: &'static str,
    /// Nothing is wrong, allowed or not.
    safe: bool,
    /// Nothing is wrong that was not allowed: exit code 0.
    passed: bool,
    /// Errors that were allowed, by check.
    allowed: BTreeMap<&'static str, usize>,
    shows: Vec<ShowOutput<'a>>,
}

#[derive(Serialize)]
struct ShowOutput<'a> {
    path: &'a Path,
    mismatches: &'a [String],
    report: Option<&'a CheckReport>,
}

pub(super) fn run(context: &Context, args: &CheckArgs) -> Result<Exit, CommandError> {
    let watch = Stopwatch::start(context);
    known(&args.allow)?;
    let vehicle = library::load(&args.vehicle)?;
    let subjects = subjects(&args.path, &vehicle)?;
    let few = few(context, args.verbose);
    let mut reports = Vec::new();
    for subject in &subjects {
        context.check_stop()?;
        reports.push(subject.check(few));
    }
    let mut passed = true;
    for (subject, report) in subjects.iter().zip(&reports) {
        let sound = report.as_ref().is_some_and(|report| is_safe(report, &args.allow));
        passed &= sound && subject.mismatches.is_empty();
        if !context.json {
            show_report(context, subject, report.as_ref(), args)?;
        }
    }
    let allowed = allowed(reports.iter().flatten(), &args.allow);
    if context.json {
        context.print_json(&CheckOutput {
            schema: "updraft.check/1",
            safe: passed && allowed.is_empty(),
            passed,
            allowed: allowed.clone(),
            shows: subjects
                .iter()
                .zip(&reports)
                .map(|(subject, report)| ShowOutput {
                    path: &subject.path,
                    mismatches: &subject.mismatches,
                    report: report.as_ref(),
                })
                .collect(),
        })?;
    }
    context.say(&format!("{}: checked in {watch}", verdict(passed, &allowed)));
    Ok(if passed { Exit::Done } else { Exit::Unsafe })
}

/// The report on a show: the whole of it, or with `--quiet` what is wrong.
fn show_report(
    context: &Context,
    subject: &Subject,
    report: Option<&CheckReport>,
    args: &CheckArgs,
) -> Result<(), CommandError> {
    let width = context.width;
    if context.quiet {
        if let Some(report) = report {
            say_findings(context, report, &args.allow);
        }
        for mismatch in &subject.mismatches {
            context.insist(&format!("error: {mismatch}"));
        }
        return Ok(());
    }
    let mut text = format!("{}\n", subject.path.shown());
    if let Some(report) = report {
        let _ = writeln!(text, "{report}");
        if report.counts.values().any(|count| count.omitted > 0) && !args.verbose {
            text += "(--verbose lists every finding)\n";
        }
    }
    for mismatch in &subject.mismatches {
        let _ = writeln!(text, "error: {mismatch}");
    }
    context.print(&wrap(&text, width))
}

/// How many findings of each kind are listed.
pub(super) fn few(context: &Context, verbose: bool) -> usize {
    if context.json || verbose { usize::MAX } else { FEW }
}
