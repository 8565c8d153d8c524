//! `updraft check`: is a show safe, whoever made it?

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use clap::Args;
use schemars::JsonSchema;
use serde::Serialize;

use super::context::Context;
use super::exit::{CommandError, Exit};
use super::words::wrap;
use crate::base::plain::Shown as _;
use crate::check::{CheckReport, causes};
use crate::vehicle::library;
use crate::workflow::check::{Subject, allowed, is_safe, known, say_findings, subjects, verdict};
use crate::workflow::clock::Stopwatch;

/// Findings of each kind that are looked through for their causes, unless all are listed.
const MANY: usize = 10_000;

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
    /// List every finding, not one line for each cause (--json always does)
    #[arg(short, long)]
    verbose: bool,
}

/// What `--json` prints.
#[derive(Serialize, JsonSchema)]
pub(super) struct CheckOutput<'a> {
    /// Format name and version: `updraft.check/1`.
    schema: &'static str,
    /// Nothing is wrong, allowed or not.
    safe: bool,
    /// Nothing is wrong that was not allowed: exit code 0.
    passed: bool,
    /// Errors that were allowed, by check.
    allowed: BTreeMap<&'static str, usize>,
    /// The shows that were checked.
    shows: Vec<ShowOutput<'a>>,
}

#[derive(Serialize, JsonSchema)]
struct ShowOutput<'a> {
    /// File or folder of the show.
    path: &'a Path,
    /// What differs between its files and its plan.
    mismatches: &'a [String],
    /// What the checks found; null: there is no plan.
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
            say_findings(context, report, &args.allow, args.verbose);
        }
        for mismatch in &subject.mismatches {
            context.insist(&format!("error: {mismatch}"));
        }
        return Ok(());
    }
    let mut text = format!("{}\n", subject.path.shown());
    if let Some(report) = report {
        let _ = if args.verbose {
            writeln!(text, "{}", report.each_finding())
        } else {
            writeln!(text, "{report}")
        };
        let merged = causes(&report.findings).len() < report.findings.len();
        if merged && !args.verbose {
            text += "(--verbose lists every finding)\n";
        }
    }
    for mismatch in &subject.mismatches {
        let _ = writeln!(text, "error: {mismatch}");
    }
    context.print(&wrap(&text, width))
}

/// How many findings of each kind are kept.
pub(super) fn few(context: &Context, verbose: bool) -> usize {
    if context.json || verbose { usize::MAX } else { MANY }
}
