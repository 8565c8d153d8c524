//! Comparison of the files of a campaign's flight with its plan: each that is missing, damaged,
//! different or not of the plan is named.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use super::load::{MAX_SHOW_BYTES, MAX_SKYB_BYTES, has_extension, read_show};
use crate::base::causes::with_causes;
use crate::base::file::read_whole;
use crate::base::plain::Shown as _;
use crate::campaign::FlightFolder;
use crate::mission::Plan;
use crate::show::csv::CsvOptions;
use crate::show::{FenceZone, Show, ShowDrone, skyb, verify_archive};
use crate::vehicle::{Vehicle, library};
use crate::workflow::error::with_reasons;

/// What `.skyc` files round to, m.
const SKYC_M: f64 = 0.001;
/// Problems of one kind that are named one by one; the rest is counted.
const MAX_NAMED: usize = 5;

/// A flight's folder as it is.
#[derive(Clone, Debug)]
pub(crate) struct FlightFiles {
    /// The plan; none if it is missing or cannot be read.
    pub(crate) plan: Option<Plan>,
    /// What the show file holds; what the plan says where that cannot be read.
    pub(crate) show: Show,
    /// The vehicle beside the plan, if it can be read.
    pub(crate) vehicle: Option<Vehicle>,
    /// What is wrong with the files, one sentence each.
    pub(crate) problems: Vec<String>,
}

/// Reads and compares everything in a flight's folder.
pub(crate) fn open(folder: &FlightFolder) -> FlightFiles {
    let mut problems = Vec::new();
    let vehicle = match library::load(&folder.vehicle().to_string_lossy()) {
        _ if !present(&folder.vehicle(), &mut problems) => None,
        Ok(vehicle) => Some(vehicle),
        Err(error) => {
            problems.push(with_causes(&error, ": "));
            None
        }
    };
    present(&folder.template(), &mut problems);
    let plan = match folder.read_plan() {
        _ if !present(&folder.plan(), &mut problems) => None,
        Ok(plan) => Some(plan),
        Err(error) => {
            problems.push(with_causes(&error, ": "));
            None
        }
    };
    let Some(plan) = plan else {
        return FlightFiles { plan: None, show: Show::default(), vehicle, problems };
    };
    let planned = plan.to_show();
    let compiled = archived(&folder.skyc(), &mut problems);
    if let Some(show) = &compiled {
        compare(&folder.skyc(), show, &planned, SKYC_M, true, &mut problems);
        if !same_fence(&show.fence, &planned.fence) {
            problems.push(format!("{}: its fence is not the plan's", folder.skyc().shown()));
        }
    }
    if let Some(show) = archived(&folder.csv(), &mut problems) {
        let tolerance_m = CsvOptions::default().tolerance_m + SKYC_M;
        compare(&folder.csv(), &show, &planned, tolerance_m, false, &mut problems);
    }
    binaries(folder, &plan, &planned, &mut problems);
    FlightFiles { show: compiled.unwrap_or(planned), plan: Some(plan), vehicle, problems }
}

fn present(path: &Path, problems: &mut Vec<String>) -> bool {
    let there = path.is_file();
    if !there {
        problems.push(format!("{} is missing", path.shown()));
    }
    there
}

/// Reads a show archive of either kind, after comparing the checksums of all its entries.
fn archived(path: &Path, problems: &mut Vec<String>) -> Option<Show> {
    if !present(path, problems) {
        return None;
    }
    let sound = read_whole(path, MAX_SHOW_BYTES)
        .map_err(|error| with_causes(&error, ": "))
        .and_then(|bytes| {
            verify_archive(&bytes)
                .map_err(|error| format!("{}: {}", path.shown(), with_causes(&error, ": ")))
        });
    if let Err(problem) = sound {
        problems.push(problem);
        return None;
    }
    read_show(path).map_err(|error| problems.push(with_reasons(&error))).ok()
}

/// Compares what a file flies with what the plan says.
fn compare(
    path: &Path,
    here: &Show,
    planned: &Show,
    tolerance_m: f64,
    homes: bool,
    problems: &mut Vec<String>,
) {
    let path = path.shown();
    if here.drones.len() != planned.drones.len() {
        let (here, there) = (here.drones.len(), planned.drones.len());
        problems.push(format!("{path} has {here} drones, the plan {there}"));
        return;
    }
    let different = |(here, there): (&ShowDrone, &ShowDrone)| {
        let home_m = here.home_m.zip(there.home_m).map(|(here, there)| (here - there).norm());
        let moved = home_m.filter(|apart_m| homes && *apart_m > 2.0 * SKYC_M);
        let how = here.trajectory.difference(&there.trajectory, tolerance_m);
        let name = &there.name;
        how.map(|how| format!("{path}: {name} does not fly the plan: {how}"))
            .or(moved.map(|apart_m| format!("{path}: the home of {name} is {apart_m:.3} m off")))
    };
    let found: Vec<_> = here.drones.iter().zip(&planned.drones).filter_map(different).collect();
    name_some(found, &format!("{path}: and"), "more drones that differ", problems);
}

fn name_some(found: Vec<String>, before: &str, after: &str, problems: &mut Vec<String>) {
    let more = found.len().saturating_sub(MAX_NAMED);
    problems.extend(found.into_iter().take(MAX_NAMED));
    if more > 0 {
        problems.push(format!("{before} {more} {after}"));
    }
}

fn same_fence(here: &[FenceZone], there: &[FenceZone]) -> bool {
    let near = |(a, b): (&[f64; 2], &[f64; 2])| {
        (a[0] - b[0]).abs() <= SKYC_M && (a[1] - b[1]).abs() <= SKYC_M
    };
    let same = |(here, there): (&FenceZone, &FenceZone)| {
        let (a, b) = (&here.corners_m, &there.corners_m);
        here.is_inclusion == there.is_inclusion && a.len() == b.len() && a.iter().zip(b).all(near)
    };
    here.len() == there.len() && here.iter().zip(there).all(same)
}

/// The binary shows: one for each slot, and no other.
fn binaries(folder: &FlightFolder, plan: &Plan, planned: &Show, problems: &mut Vec<String>) {
    let paths: Vec<PathBuf> =
        plan.slots.iter().map(|slot| folder.skyb(slot.slot, plan.slots.len())).collect();
    let checked = |(path, there): (&PathBuf, &ShowDrone)| -> Option<String> {
        if !path.is_file() {
            return Some(format!("{} is missing", path.shown()));
        }
        let contents = match read_whole(path, MAX_SKYB_BYTES) {
            Ok(bytes) => skyb::read(&bytes)
                .map_err(|error| format!("{}: {}", path.shown(), with_causes(&error, ": "))),
            Err(error) => Err(with_causes(&error, ": ")),
        };
        let contents = match contents {
            Ok(contents) => contents,
            Err(problem) => return Some(problem),
        };
        let unit_m = f64::from(contents.scale_mm) / 1000.0;
        let how = contents.drone.trajectory.difference(&there.trajectory, unit_m)?;
        Some(format!("{} does not fly the plan: {how}", path.shown()))
    };
    let found: Vec<_> = paths.par_iter().zip(&planned.drones).map(checked).collect::<Vec<_>>();
    let found: Vec<_> = found.into_iter().flatten().collect();
    let place = folder.skyb_folder();
    name_some(found, &format!("{}: and", place.shown()), "more files missing or wrong", problems);
    let wanted: BTreeSet<&PathBuf> = paths.iter().collect();
    let mut stray: Vec<_> = std::fs::read_dir(&place)
        .into_iter()
        .flatten()
        .flatten()
        .map(|entry| entry.path())
        .filter(|path| has_extension(path, "skyb") && !wanted.contains(path))
        .map(|path| {
            format!(
                "{} belongs to no slot of the plan, but would be uploaded with the others",
                path.shown()
            )
        })
        .collect();
    stray.sort();
    name_some(
        stray,
        &format!("{}: and", place.shown()),
        "more files that belong to no slot",
        problems,
    );
}
