//! `updraft check`: is a show safe, whoever made it?

use std::path::{Path, PathBuf};

use clap::Args;
use serde::Serialize;

use super::clock::Stopwatch;
use super::context::Context;
use super::exit::{CommandError, Exit};
use super::load::{Loaded, load_shows};
use crate::check::{CheckInput, CheckReport, NAMES, Severity, check};
use crate::mission::Plan;
use crate::show::Show;
use crate::vehicle::{Vehicle, library};

/// Arguments of `updraft check`.
#[derive(Debug, Args)]
#[command(after_long_help = "Examples:
  updraft check my-campaign
  updraft check show.skyc --vehicle airsim-generic-quad
  updraft check 01.skyb
  updraft check my-campaign --allow endurance

A campaign is checked against its plan's limits and fence, and its files against the plan. Shows
made by others are checked against their own limits and, where they have none, the vehicle's.
Exit code 4: not safe.")]
pub(super) struct CheckArgs {
    /// Campaign folder, .skyc, .skyb, zipped CSV, or a folder of .skyb files
    path: PathBuf,
    /// Vehicle whose limits apply where the show has none
    #[arg(long, value_name = "NAME", default_value = "airsim-generic-quad")]
    vehicle: String,
    /// Pass although this check fails (by its name; may be repeated)
    #[arg(long, value_name = "CHECK")]
    allow: Vec<String>,
}

/// What `--json` prints.
#[derive(Serialize)]
struct CheckOutput<'a> {
    schema: &'static str,
    safe: bool,
    shows: Vec<ShowOutput<'a>>,
}

#[derive(Serialize)]
struct ShowOutput<'a> {
    path: &'a Path,
    mismatches: &'a [String],
    report: &'a CheckReport,
}

pub(super) fn run(context: &Context, args: &CheckArgs) -> Result<Exit, CommandError> {
    let watch = Stopwatch::start();
    let vehicle = library::load(&args.vehicle)?;
    let loaded = load_shows(&args.path, &vehicle)?;
    let mut reports = Vec::new();
    for Loaded { show, plan, vehicle, .. } in &loaded {
        context.check_stop()?;
        reports.push(checked(show, plan, vehicle, &args.allow)?);
    }
    let mut safe = true;
    for (loaded, report) in loaded.iter().zip(&reports) {
        safe &= is_safe(report, &args.allow) && loaded.mismatches.is_empty();
        if !context.json {
            context.print(&format!("{}\n{report}\n", loaded.path.display()))?;
            for mismatch in &loaded.mismatches {
                context.print(&format!("error: {mismatch}\n"))?;
            }
        }
    }
    if context.json {
        context.print_json(&CheckOutput {
            schema: "updraft.check/1",
            safe,
            shows: loaded
                .iter()
                .zip(&reports)
                .map(|(loaded, report)| ShowOutput {
                    path: &loaded.path,
                    mismatches: &loaded.mismatches,
                    report,
                })
                .collect(),
        })?;
    }
    context
        .say(&format!("{} in {watch}", if safe { "Safe: checked" } else { "Not safe: checked" }));
    Ok(if safe { Exit::Done } else { Exit::Unsafe })
}

/// Checks a show against its plan's limits and fence, for the autopilot of a vehicle.
pub(super) fn checked(
    show: &Show,
    plan: &Plan,
    vehicle: &Vehicle,
    allow: &[String],
) -> Result<CheckReport, CommandError> {
    if let Some(unknown) = allow.iter().find(|name| !NAMES.contains(&name.as_str())) {
        return Err(CommandError::Usage(format!(
            "there is no check \"{unknown}\"; there are {}",
            NAMES.join(", ")
        )));
    }
    let fence = (plan.fence.polygon_m.len() >= 3).then_some(&plan.fence);
    Ok(check(
        &CheckInput::new(show, &plan.limits).with_fence(fence).with_autopilot(&vehicle.autopilot),
    ))
}

/// Whether only allowed checks failed.
pub(super) fn is_safe(report: &CheckReport, allow: &[String]) -> bool {
    report
        .counts
        .iter()
        .all(|(check, count)| count.errors == 0 || allow.iter().any(|name| name == check))
}

/// Says what was found, errors before warnings; a finding begins with its level.
pub(super) fn say_findings(context: &Context, report: &CheckReport, allow: &[String]) {
    for finding in &report.findings {
        let allowed = allow.iter().any(|name| name == finding.check);
        match finding.severity {
            Severity::Error if allowed => context.say(&format!("allowed: {finding}")),
            Severity::Error => context.insist(&finding.to_string()),
            Severity::Warning => context.say(&finding.to_string()),
        }
    }
    for (check, count) in report.counts.iter().filter(|(_, count)| count.omitted > 0) {
        context.say(&format!("{check}: {} more like these", count.omitted));
    }
}
