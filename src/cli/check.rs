//! `updraft check`: is a show safe, whoever made it?

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use clap::Args;
use serde::Serialize;

use super::campaign_files;
use super::clock::Stopwatch;
use super::context::Context;
use super::exit::{CommandError, Exit};
use super::load::{Loaded, load_shows};
use super::words::wrap;
use crate::base::plain::Shown as _;
use crate::campaign::{self, FlightFolder};
use crate::check::{CheckInput, CheckReport, NAMES, Options, Severity, check};
use crate::mission::Plan;
use crate::mission::measurable;
use crate::show::Show;
use crate::vehicle::{Vehicle, library};

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
that is missing, damaged, different or of no slot is named. A file that lies in a campaign is
checked against the plan beside it. Shows made by others are checked against their own limits and,
where they have none, the vehicle's. Of distance, altitude and speeds the stricter one counts: only a
plan loosens those, or --allow. Every polygon of a show's fence counts (inside all that
include, outside all that exclude); without a fence of its own a show is checked against none.
Exit code 4: not safe.")]
pub(super) struct CheckArgs {
    /// Campaign folder, .skyc, .skyb, zipped CSV, or a folder of .skyb files
    path: PathBuf,
    /// Vehicle whose limits apply where the show has none, or looser ones
    #[arg(long, value_name = "NAME", default_value = "airsim-generic-quad")]
    vehicle: String,
    /// Pass although this check fails (by its name; may be repeated)
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

/// A show and what it is checked against.
struct Subject {
    path: PathBuf,
    show: Show,
    /// None: its folder has no plan that can be read.
    plan: Option<Plan>,
    vehicle: Vehicle,
    origin: Origin,
    mismatches: Vec<String>,
}

/// Where the limits and the fence come from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Origin {
    /// The plan that the show was made from.
    Plan,
    /// The plan beside the file.
    Beside(PathBuf),
    /// The show itself and, where it says nothing, the vehicle.
    Show,
}

pub(super) fn run(context: &Context, args: &CheckArgs) -> Result<Exit, CommandError> {
    let watch = Stopwatch::start();
    known(&args.allow)?;
    let vehicle = library::load(&args.vehicle)?;
    let subjects = subjects(&args.path, &vehicle)?;
    let few = few(context, args.verbose);
    let mut reports = Vec::new();
    for subject in &subjects {
        context.check_stop()?;
        reports.push(
            subject
                .plan
                .as_ref()
                .map(|plan| checked(&subject.show, plan, &subject.vehicle, &subject.origin, few)),
        );
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

/// `Safe`, `Not safe`, `Safe apart from 196 allowed findings (velocity-step: 196)`.
pub(super) fn verdict(passed: bool, allowed: &BTreeMap<&'static str, usize>) -> String {
    if !passed {
        return "Not safe".to_owned();
    }
    let total: usize = allowed.values().sum();
    if total == 0 {
        return "Safe".to_owned();
    }
    let each: Vec<_> = allowed.iter().map(|(check, count)| format!("{check}: {count}")).collect();
    let plural = if total == 1 { "" } else { "s" };
    format!("Safe apart from {total} allowed finding{plural} ({})", each.join(", "))
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

/// The shows behind a path, each with the plan it is checked against.
fn subjects(path: &Path, vehicle: &Vehicle) -> Result<Vec<Subject>, CommandError> {
    if path.is_dir() && campaign::is_campaign(path) {
        return Ok(campaign::flights(path)?.iter().map(|folder| flight(folder, vehicle)).collect());
    }
    let beside = plan_beside(path);
    let foreign = |Loaded { path, show, plan, vehicle, mismatches }: Loaded| {
        let (plan, vehicle, origin) = match &beside {
            Some((planned, by, file)) => {
                (planned.clone(), by.clone(), Origin::Beside(file.clone()))
            }
            None => (plan, vehicle, Origin::Show),
        };
        Subject { path, show, plan: Some(plan), vehicle, origin, mismatches }
    };
    Ok(load_shows(path, vehicle)?.into_iter().map(foreign).collect())
}

fn flight(folder: &FlightFolder, vehicle: &Vehicle) -> Subject {
    let files = campaign_files::open(folder);
    Subject {
        path: folder.0.clone(),
        show: files.show,
        plan: files.plan,
        vehicle: files.vehicle.unwrap_or_else(|| vehicle.clone()),
        origin: Origin::Plan,
        mismatches: files.problems,
    }
}

/// The plan, and its vehicle, of the flight whose file (or folder of binary shows) this is.
fn plan_beside(path: &Path) -> Option<(Plan, Vehicle, PathBuf)> {
    let parent = path.parent()?;
    let folders = [Some(parent), parent.parent()];
    folders.into_iter().flatten().map(|folder| FlightFolder(folder.to_owned())).find_map(|folder| {
        let own = [folder.skyc(), folder.csv(), folder.skyb_folder()];
        if !own.iter().any(|file| file == path || Some(file.as_path()) == path.parent()) {
            return None;
        }
        let vehicle = library::load(&folder.vehicle().to_string_lossy()).ok()?;
        Some((folder.read_plan().ok()?, vehicle, folder.plan()))
    })
}

/// How many findings of each kind are listed.
pub(super) fn few(context: &Context, verbose: bool) -> usize {
    if context.json || verbose { usize::MAX } else { FEW }
}

/// Refuses names of checks that there are not.
pub(super) fn known(allow: &[String]) -> Result<(), CommandError> {
    let mut names: Vec<&str> = NAMES.iter().chain(&measurable::NAMES).copied().collect();
    names.sort_unstable();
    match allow.iter().find(|name| !names.contains(&name.as_str())) {
        Some(unknown) => Err(CommandError::Usage(format!(
            "there is no check \"{unknown}\"; there are {}",
            names.join(", ")
        ))),
        None => Ok(()),
    }
}

/// Checks a show against a plan's limits and fence, for the autopilot of a vehicle.
pub(super) fn checked(
    show: &Show,
    plan: &Plan,
    vehicle: &Vehicle,
    origin: &Origin,
    findings_per_check: usize,
) -> CheckReport {
    let fence = (plan.fence.polygon_m.len() >= 3).then_some(&plan.fence);
    let options = Options { findings_per_check, ..Options::default() };
    let input = CheckInput { options, ..CheckInput::new(show, &plan.limits) }
        .with_speed_up(vehicle.autopilot.wpnav_speed_up_mps)
        .with_stock(&vehicle.limits);
    let mut report = check(&match origin {
        Origin::Plan => input.with_fence(fence).with_rule(plan),
        Origin::Beside(_) => input.with_fence(fence),
        Origin::Show if show.fence_altitude_m.is_some() => input.with_fence(fence),
        Origin::Show => input.with_polygon(fence),
    });
    if let Origin::Beside(file) = origin {
        report.notes.push(format!("limits and fence are those of {}", file.shown()));
    }
    report
}

/// Whether only allowed checks failed.
pub(super) fn is_safe(report: &CheckReport, allow: &[String]) -> bool {
    report
        .counts
        .iter()
        .all(|(check, count)| count.errors == 0 || allow.iter().any(|name| name == check))
}

/// Errors that were allowed, by check.
pub(super) fn allowed<'a>(
    reports: impl Iterator<Item = &'a CheckReport>,
    allow: &[String],
) -> BTreeMap<&'static str, usize> {
    let mut found = BTreeMap::new();
    for (check, count) in reports.flat_map(|report| &report.counts) {
        if count.errors > 0 && allow.iter().any(|name| name == check) {
            *found.entry(*check).or_default() += count.errors;
        }
    }
    found
}

/// Says what was found, errors before warnings; a finding begins with its level.
pub(super) fn say_findings(context: &Context, report: &CheckReport, allow: &[String]) {
    for finding in &report.findings {
        let allowed = allow.iter().any(|name| name == finding.check);
        if finding.severity == Severity::Error && allowed {
            context.insist(&format!("allowed: {finding}"));
        } else {
            context.insist(&finding.to_string());
        }
    }
    for (check, count) in report.counts.iter().filter(|(_, count)| count.omitted > 0) {
        context.insist(&format!("{check}: and {} more", count.omitted));
    }
}
