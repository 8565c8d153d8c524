//! What is doubtful about drones, with equal remarks told once.

use crate::analysis::result::FlightAnalysis;

use super::compare::flags;
use super::text::clean;

/// Drones without a value of the map, and why.
pub(super) fn unmeasured_lines(flight: &FlightAnalysis) -> Vec<String> {
    grouped(flight.unmeasured.iter().map(|one| (who(one.slot, &one.name), clean(&one.reason))))
}

/// Everything doubtful about the drones.
pub(super) fn note_lines(flight: &FlightAnalysis) -> Vec<String> {
    grouped(flight.drones.iter().flat_map(|drone| {
        let of = who(drone.slot, &drone.name);
        flags(drone).into_iter().map(move |flag| (of.clone(), flag))
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
