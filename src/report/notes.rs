//! Doubts about drones, with equal remarks merged.

use std::collections::{BTreeMap, BTreeSet};

use crate::analysis::Cause;
use crate::analysis::result::{FlightAnalysis, PartlyUsedLog};
use crate::analysis::together::{Remark, together};

use super::compare::{flags, flags_without_losses};
use super::text::{clean, count};

/// Drones without a law or a value of the map, and why: without a usable log, or with one that gave
/// none.
pub(super) fn without_result_lines(flight: &FlightAnalysis) -> Vec<String> {
    let missing = flight.missing.iter().map(|one| (Some(one.slot), "", &one.reason));
    let unmeasured = flight.unmeasured.iter().map(|one| (one.slot, &*one.name, &one.reason));
    let mut all: Vec<(Option<u16>, &str, &Cause)> = missing.chain(unmeasured).collect();
    all.sort_by_key(|(slot, ..)| slot.unwrap_or(u16::MAX));
    grouped(
        all.into_iter().map(|(slot, name, reason)| (who(slot, name), clean(&reason.to_string()))),
    )
}

/// Logs that are not used, and why.
pub(super) fn unused_lines(flight: &FlightAnalysis) -> Vec<String> {
    let remarks = flight.unused.iter().map(|log| Remark {
        slot: None,
        // A reason that names the log by itself.
        name: if log.is_named() { String::new() } else { log.source.clone() },
        said: log.reason.sentence(),
    });
    together(remarks).iter().map(|line| clean(line)).collect()
}

/// Logs that are used in part, and what is lost of them.
pub(super) fn partly_used_lines(flight: &FlightAnalysis) -> Vec<String> {
    let remark = |log: &PartlyUsedLog| Remark {
        slot: log.slot,
        name: log.source.clone(),
        said: log.reason.sentence(),
    };
    together(flight.partly_used.iter().map(remark)).iter().map(|line| clean(line)).collect()
}

/// `43 of 48 logs used`.
pub(super) fn logs_used(flight: &FlightAnalysis) -> String {
    let used = flight.logs.saturating_sub(flight.unused.len());
    format!("{used} of {} used", count(flight.logs, "log"))
}

/// Everything doubtful about the drones that is not told with their logs.
pub(super) fn note_lines(flight: &FlightAnalysis) -> Vec<String> {
    grouped(flight.drones.iter().flat_map(|drone| {
        let of = who(drone.slot, &drone.name);
        let told = flight.partly_used.iter().any(|log| log.source == drone.source);
        let new = if told { flags_without_losses(drone) } else { flags(drone) };
        new.into_iter().map(move |flag| (of.clone(), flag))
    }))
}

/// A remark on so many drones or more is told once below their table, not in each row.
const SHARED_BY: usize = 4;

/// The remarks that so many drones share.
pub(super) fn shared_flags(flight: &FlightAnalysis) -> BTreeSet<String> {
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    for flag in flight.drones.iter().flat_map(flags) {
        *counts.entry(flag).or_default() += 1;
    }
    counts.into_iter().filter(|(_, n)| *n >= SHARED_BY).map(|(flag, _)| flag).collect()
}

/// The remarks on many drones, each once with its drones.
pub(super) fn shared_notes(flight: &FlightAnalysis) -> Vec<String> {
    let shared = shared_flags(flight);
    grouped(flight.drones.iter().flat_map(|drone| {
        let of = who(drone.slot, &drone.name);
        let told = flags(drone).into_iter().filter(|flag| shared.contains(flag));
        told.map(move |flag| (of.clone(), flag)).collect::<Vec<_>>()
    }))
}

/// A drone in a list: by its slot, else by its name.
#[derive(Clone)]
enum Who {
    Slot(u16),
    Name(String),
}

fn who(slot: Option<u16>, name: &str) -> Who {
    slot.map_or_else(|| Who::Name(clean(name)), Who::Slot)
}

fn grouped(remarks: impl Iterator<Item = (Who, String)>) -> Vec<String> {
    let mut groups: Vec<(String, Vec<Who>)> = Vec::new();
    for (of, remark) in remarks {
        match groups.iter_mut().find(|(known, _)| *known == remark) {
            Some((_, of_all)) => of_all.push(of),
            None => groups.push((remark, vec![of])),
        }
    }
    groups.into_iter().map(|(remark, of)| format!("{}: {remark}", list(&of))).collect()
}

/// `slots 1-4, 7`, then names.
fn list(of: &[Who]) -> String {
    let mut runs: Vec<(u16, u16)> = Vec::new();
    let mut parts = Vec::new();
    for one in of {
        match (one, runs.last_mut()) {
            (Who::Slot(slot), Some((_, last))) if last.checked_add(1) == Some(*slot) => {
                *last = *slot;
            }
            (Who::Slot(slot), _) => runs.push((*slot, *slot)),
            (Who::Name(name), _) => parts.push(name.clone()),
        }
    }
    let slots: Vec<String> = runs
        .iter()
        .map(|(from, to)| if from == to { from.to_string() } else { format!("{from}-{to}") })
        .collect();
    if !slots.is_empty() {
        let many = runs.len() > 1 || runs.iter().any(|(from, to)| from != to);
        parts.insert(0, format!("slot{} {}", if many { "s" } else { "" }, slots.join(", ")));
    }
    parts.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_remarks_are_told_once() {
        let remarks = [(1, "a"), (2, "a"), (2, "b"), (3, "a"), (7, "a")]
            .map(|(slot, text)| (Who::Slot(slot), text.to_owned()));
        let named = [(Who::Name("07".to_owned()), "a".to_owned())];
        let lines = grouped(remarks.into_iter().chain(named));
        assert_eq!(lines, ["slots 1-3, 7, 07: a", "slot 2: b"]);
    }
}
