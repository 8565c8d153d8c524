//! Merging of equal remarks on many drones or logs into one line with a list of their names.
//!
//! Two remarks are the same when they differ at most in measured numbers (with decimals) and in names of
//! logs: 49 logs that end in the air between 1.0 and 1.3 m above the ground are one cause.

use std::fmt::Write as _;

use crate::base::sentence::Sentence;

/// Names that a line lists.
const NAMED: usize = 6;

/// A remark on a drone or a log.
#[derive(Clone, Debug, PartialEq)]
pub struct Remark {
    /// Slot of the drone that the remark is about, if it has one.
    pub slot: Option<u16>,
    /// Name of the drone or log, for a line about it alone; empty if the text of the remark names
    /// it.
    pub name: String,
    /// Text of the remark.
    pub said: Sentence,
}

/// Merges remarks into lines, in the order in which their causes came first.
pub fn together(remarks: impl IntoIterator<Item = Remark>) -> Vec<String> {
    let mut groups: Vec<Vec<Remark>> = Vec::new();
    for remark in remarks {
        let same = |group: &&mut Vec<Remark>| {
            group.first().is_some_and(|first| first.said.says_the_same(&remark.said))
        };
        match groups.iter_mut().find(same) {
            Some(group) => group.push(remark),
            None => groups.push(vec![remark]),
        }
    }
    groups.iter().map(|same| line(same)).collect()
}

fn line(same: &[Remark]) -> String {
    match same {
        [one] if one.name.is_empty() => one.said.to_string(),
        [one] => format!("{}: {}", one.name, one.said),
        _ => {
            let said: Vec<&Sentence> = same.iter().map(|one| &one.said).collect();
            let said = Sentence::together(&said);
            // Where what is said names the logs, there is nothing to put before it.
            if same.iter().all(|one| one.name.is_empty() && one.slot.is_none()) {
                return said;
            }
            format!("{}: {said}", whose(same))
        }
    }
}

/// `slots 1-4, 7`, else the first names and how many more.
fn whose(same: &[Remark]) -> String {
    let mut slots: Vec<u16> = same.iter().filter_map(|one| one.slot).collect();
    if slots.len() < same.len() {
        let named: Vec<&str> = same.iter().take(NAMED).map(|one| one.name.as_str()).collect();
        let mut text = named.join(", ");
        if same.len() > NAMED {
            let _ = write!(text, " and {} more", same.len() - NAMED);
        }
        return text;
    }
    slots.sort_unstable();
    let mut runs: Vec<(u16, u16)> = Vec::new();
    for slot in slots {
        match runs.last_mut() {
            Some((_, last)) if *last == slot => {}
            Some((_, last)) if last.checked_add(1) == Some(slot) => *last = slot,
            _ => runs.push((slot, slot)),
        }
    }
    let runs: Vec<String> = runs
        .iter()
        .map(|(from, to)| if from == to { from.to_string() } else { format!("{from}-{to}") })
        .collect();
    format!("slots {}", runs.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::Cause;
    use crate::flight::Loss;

    fn remark(slot: Option<u16>, name: &str, said: Sentence) -> Remark {
        Remark { slot, name: name.to_owned(), said }
    }

    #[test]
    fn one_cause_is_one_line() {
        let ends = |slot: u16, height_m: f64| {
            let said = Loss::CutOff { height_m }.sentence();
            remark(Some(slot), &format!("logs/{slot:02}.BIN"), said)
        };
        let unused = |slot: u16| {
            let log = (format!("logs/{slot:02}.BIN"), Cause::NoFreeSlot);
            remark(Some(slot), "a slot", Cause::LogsNotUsed(vec![log]).sentence())
        };
        let lines = together([
            ends(1, 1.2),
            unused(9),
            ends(2, 1.0),
            ends(4, 12.3),
            unused(12),
            remark(Some(5), "slot 5", Cause::NoWindows.sentence()),
        ]);
        assert_eq!(
            lines[0],
            "slots 1-2, 4: the log ends in the air, 1.0..12.3 m above the ground; what it holds is \
             analysed"
        );
        let start =
            "slots 9, 12: its log is not used: logs/09.BIN..logs/12.BIN: the log fits no free";
        assert!(lines[1].starts_with(start), "{}", lines[1]);
        assert!(lines[2].starts_with("slot 5: the plan has no"), "{}", lines[2]);
    }

    #[test]
    fn what_differs_in_more_than_a_measure_stays_apart() {
        let taken = |slot: u16| Cause::SlotTaken { slot, first: "x.BIN".to_owned() }.sentence();
        let lines = together([
            remark(None, "a.BIN", taken(1)),
            remark(None, "b.BIN", taken(2)),
            remark(None, "c.BIN", "empty".into()),
            remark(None, "d.BIN", "empty".into()),
        ]);
        let wanted =
            ["a.BIN: slot 1 has a log already (x.BIN)", "b.BIN: slot 2 has a log already (x.BIN)"];
        assert_eq!(lines[..2], wanted);
        assert_eq!(lines[2..], ["c.BIN, d.BIN: empty"]);
        let many = (0..49).map(|n| remark(None, &format!("{n}.BIN"), "empty".into()));
        let [line] = &together(many)[..] else { panic!("several lines") };
        assert_eq!(line, "0.BIN, 1.BIN, 2.BIN, 3.BIN, 4.BIN, 5.BIN and 43 more: empty");
    }
}
