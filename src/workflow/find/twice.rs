//! Refusal of logs that are given twice, with which a fleet would count as two.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::{Found, Work};
use crate::base::plain::Shown as _;
use crate::workflow::error::WorkflowError;

/// `Err` if two of the paths are the same, or two flights of one plan (or of none) have a log in
/// common: the same file, or a copy.
///
/// Copies inside of one flight are named by the analysis, which uses one of them.
pub(crate) fn refuse(paths: &[PathBuf], work: &Work) -> Result<(), WorkflowError> {
    let real = |path: &Path| path.canonicalize().unwrap_or_else(|_| path.to_owned());
    let mut seen: BTreeMap<PathBuf, &PathBuf> = BTreeMap::new();
    for path in paths {
        if let Some(before) = seen.insert(real(path), path) {
            return Err(WorkflowError::Usage(format!(
                "{} and {} are the same: give it once",
                before.shown(),
                path.shown()
            )));
        }
    }
    let flights = &work.flights;
    // Logs of one size may be copies: only these are read.
    let mut sized: BTreeMap<u64, Vec<(&Found, &Path)>> = BTreeMap::new();
    let mut known: BTreeMap<PathBuf, Vec<(&Found, &Path)>> = BTreeMap::new();
    for flight in flights {
        for log in flight.logs.iter().filter(|log| log.table.is_none()) {
            let length = std::fs::metadata(&log.path).map_or(0, |data| data.len());
            sized.entry(length).or_default().push((flight, &log.path));
            known.entry(real(&log.path)).or_default().push((flight, &log.path));
        }
    }
    let same_file = known.values().find_map(|logs| repeated(logs));
    if let Some((one, other)) = same_file {
        return Err(same_log(one, other, "are the same file"));
    }
    for (length, logs) in sized {
        // Empty files say why themselves.
        if length == 0 || repeated(&logs).is_none() {
            continue;
        }
        let mut hashed: BTreeMap<String, Vec<(&Found, &Path)>> = BTreeMap::new();
        for (flight, path) in logs {
            // The analysis says why a log cannot be read.
            let Ok(hash) = work.hashes.sha256(path) else { continue };
            hashed.entry(hash).or_default().push((flight, path));
        }
        let copies = hashed.values().find_map(|logs| repeated(logs));
        if let Some((one, other)) = copies {
            return Err(same_log(one, other, "hold the same bytes"));
        }
    }
    Ok(())
}

/// The first two logs that would give one flight twice. A log may hold several flights: of two plans
/// it gives two.
fn repeated<'a>(logs: &[(&Found, &'a Path)]) -> Option<(&'a Path, &'a Path)> {
    let (first, path) = logs.first()?;
    let again = |(flight, _): &&(&Found, &Path)| {
        let two_plans = first.plan.is_some() && flight.plan.is_some() && first.plan != flight.plan;
        !std::ptr::eq(*first, *flight) && !two_plans
    };
    let (_, other) = logs.iter().find(again)?;
    Some((path, other))
}

fn same_log(one: &Path, other: &Path, how: &str) -> WorkflowError {
    if one == other {
        return WorkflowError::Usage(format!(
            "{} is in two of the folders and logs that were given: give it once",
            one.shown()
        ));
    }
    WorkflowError::Usage(format!(
        "{} and {} {how}: a log counts once; give each flight once, or take the copy away",
        one.shown(),
        other.shown()
    ))
}
