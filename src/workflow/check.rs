//! Check whether a show is safe: its limits, the findings, and those that were allowed.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::error::WorkflowError;
use super::host::Host;
use super::shows::campaign_files;
use super::shows::load::{Loaded, load_shows};
use crate::base::plain::Shown as _;
use crate::campaign::{self, FlightFolder};
use crate::check::{CheckInput, CheckReport, Finding, NAMES, Options, Severity, causes, check};
use crate::mission::Plan;
use crate::mission::measurable;
use crate::show::Show;
use crate::vehicle::{Vehicle, library};

/// A show with the limits and the fence that it is checked against.
#[derive(Clone, Debug)]
pub struct Subject {
    /// Path that the show was read from.
    pub path: PathBuf,
    /// Show to check.
    pub show: Show,
    /// Plan whose limits and fence apply; `None` if its folder has no readable plan.
    pub plan: Option<Plan>,
    /// Vehicle that is to fly the show.
    pub vehicle: Vehicle,
    /// Source of the limits and the fence.
    pub origin: Origin,
    /// Differences between the files of the show's folder and the plan, one sentence each.
    pub mismatches: Vec<String>,
}

impl Subject {
    /// Checks the show; `None` if it has no plan.
    pub fn check(&self, findings_per_check: usize) -> Option<CheckReport> {
        let plan = self.plan.as_ref()?;
        Some(checked(&self.show, plan, &self.vehicle, &self.origin, findings_per_check))
    }
}

/// Source of the limits and the fence that a show is checked against.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Origin {
    /// The plan that the show was made from.
    Plan,
    /// The plan beside the file, at this path.
    Beside(PathBuf),
    /// The show itself and, where it states nothing, the vehicle.
    Show,
}

/// Finds the shows behind a path, each with the plan it is checked against. `vehicle` gives limits
/// to shows that have none.
///
/// # Errors
///
/// If there is no show, or a file cannot be read.
pub fn subjects(path: &Path, vehicle: &Vehicle) -> Result<Vec<Subject>, WorkflowError> {
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

/// Refuses names of checks that do not exist.
///
/// # Errors
///
/// At the first such name.
pub fn known(allow: &[String]) -> Result<(), WorkflowError> {
    let mut names: Vec<&str> = NAMES.iter().chain(&measurable::NAMES).copied().collect();
    names.sort_unstable();
    match allow.iter().find(|name| !names.contains(&name.as_str())) {
        Some(unknown) => Err(WorkflowError::Usage(format!(
            "there is no check \"{unknown}\"; the checks are {}",
            names.join(", ")
        ))),
        None => Ok(()),
    }
}

/// Checks a show against a plan's limits and fence, for the autopilot of a vehicle.
pub fn checked(
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

/// Whether all checks that failed were allowed to.
pub fn is_safe(report: &CheckReport, allow: &[String]) -> bool {
    report
        .counts
        .iter()
        .all(|(check, count)| count.errors == 0 || allow.iter().any(|name| name == check))
}

/// Number of errors that were allowed, by check.
pub fn allowed<'a>(
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

/// Reports the findings to the host, errors before warnings, one line for each cause, or for `each` finding;
/// each begins with its level.
pub fn say_findings(host: &dyn Host, report: &CheckReport, allow: &[String], each: bool) {
    let say = |finding: &Finding, text: String| {
        let allowed = allow.iter().any(|name| name == finding.check);
        if finding.severity == Severity::Error && allowed {
            host.insist(&format!("allowed: {text}"));
        } else {
            host.insist(&text);
        }
    };
    if each {
        report.findings.iter().for_each(|finding| say(finding, finding.to_string()));
    } else {
        for cause in causes(&report.findings) {
            if let Some(first) = cause.first() {
                say(first, cause.to_string());
            }
        }
    }
    for (check, count) in report.counts.iter().filter(|(_, count)| count.omitted > 0) {
        host.insist(&format!("{check}: and {} more", count.omitted));
    }
}

/// Causes of errors that were not allowed, one line each.
pub fn refusals(report: &CheckReport, allow: &[String]) -> Vec<String> {
    let counts = |finding: &Finding| {
        finding.severity == Severity::Error && !allow.iter().any(|name| name == finding.check)
    };
    let causes = causes(&report.findings);
    let refused = causes.iter().filter(|cause| cause.first().is_some_and(counts));
    refused.map(ToString::to_string).collect()
}

/// Verdict in words: `Safe`, `Not safe`, `Safe apart from 196 allowed findings (velocity-step:
/// 196)`.
pub fn verdict(passed: bool, allowed: &BTreeMap<&'static str, usize>) -> String {
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
