//! Merging of equal remarks on many drones or logs into one line with a list of their names.
//!
//! Two remarks are the same when they differ at most in measured numbers (with decimals) and in names of
//! logs: 49 logs that end in the air between 1.0 and 1.3 m above the ground are one cause.

use std::fmt::Write as _;

/// Names that a line lists.
const NAMED: usize = 6;

/// A remark on a drone or a log.
#[derive(Clone, Debug, PartialEq)]
pub struct Remark {
    /// Slot of the drone that the remark is about, if it has one.
    pub slot: Option<u16>,
    /// Name of the drone or log, as the remark has it when it stands alone.
    pub name: String,
    /// Text of the remark.
    pub text: String,
}

/// Lines of remarks, in the order in which their causes came first.
pub fn together(remarks: impl IntoIterator<Item = Remark>) -> Vec<String> {
    let mut groups: Vec<(String, Vec<Remark>)> = Vec::new();
    for remark in remarks {
        let cause = cause(&remark.text);
        match groups.iter_mut().find(|(known, _)| *known == cause) {
            Some((_, same)) => same.push(remark),
            None => groups.push((cause, vec![remark])),
        }
    }
    groups.into_iter().map(|(_, same)| line(&same)).collect()
}

fn line(same: &[Remark]) -> String {
    match same {
        [one] => format!("{}: {}", one.name, one.text),
        _ => format!("{}: {}", whose(same), spanned(same)),
    }
}

/// The words of a text without what may differ.
fn cause(text: &str) -> String {
    text.split(' ').map(|word| if variable(word).is_some() { "\0" } else { word }).fold(
        String::new(),
        |mut cause, word| {
            cause.push_str(word);
            cause.push(' ');
            cause
        },
    )
}

/// What of a word may differ between remarks on the same: a number with decimals, the name of a log.
fn variable(word: &str) -> Option<Variable> {
    let core = word.trim_matches(|c: char| matches!(c, ',' | ';' | ':' | '(' | ')'));
    let is_log = core.to_ascii_uppercase().ends_with(".BIN");
    if is_log {
        return Some(Variable::Log);
    }
    core.contains('.').then(|| core.parse::<f64>().ok()).flatten().map(Variable::Number)
}

#[derive(Clone, Copy)]
enum Variable {
    Number(f64),
    Log,
}

/// The text of remarks that are the same, with the span of what differs.
fn spanned(same: &[Remark]) -> String {
    let texts: Vec<Vec<&str>> = same.iter().map(|one| one.text.split(' ').collect()).collect();
    let Some(first) = texts.first() else { return String::new() };
    let word = |index: usize| {
        let words = || texts.iter().filter_map(|text| text.get(index).copied());
        let mut sorted: Vec<(f64, &str)> = words()
            .map(|word| match variable(word) {
                Some(Variable::Number(value)) => (value, word),
                _ => (0.0, word),
            })
            .collect();
        // Stable: names keep their order.
        sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
        match (sorted.first(), sorted.last()) {
            (Some((_, least)), Some((_, most))) if least != most => {
                let bare = |word: &str| word.trim_end_matches([',', ';', ':', ')']).to_owned();
                format!("{}..{}", bare(least), most.trim_start_matches('('))
            }
            _ => first.get(index).copied().unwrap_or_default().to_owned(),
        }
    };
    (0..first.len()).map(word).collect::<Vec<_>>().join(" ")
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

    fn remark(slot: Option<u16>, name: &str, text: &str) -> Remark {
        Remark { slot, name: name.to_owned(), text: text.to_owned() }
    }

    #[test]
    fn one_cause_is_one_line() {
        let ends = |slot: u16, height: &str| {
            let text = format!("the log ends in the air, {height} m above the ground");
            remark(Some(slot), &format!("logs/{slot:02}.BIN"), &text)
        };
        let lines = together([
            ends(1, "1.2"),
            remark(Some(9), "slot 9", "its log is not used: logs/09.BIN: no flight"),
            ends(2, "1.0"),
            ends(4, "12.3"),
            remark(Some(12), "slot 12", "its log is not used: logs/12.BIN: no flight"),
        ]);
        assert_eq!(
            lines,
            [
                "slots 1-2, 4: the log ends in the air, 1.0..12.3 m above the ground",
                "slots 9, 12: its log is not used: logs/09.BIN..logs/12.BIN: no flight"
            ]
        );
    }

    #[test]
    fn what_differs_in_more_than_a_measure_stays_apart() {
        let text = |slot: u16| format!("2 slots claim it: slot {slot}");
        let lines = together([
            remark(None, "a.BIN", &text(1)),
            remark(None, "b.BIN", &text(2)),
            remark(None, "c.BIN", "empty"),
            remark(None, "d.BIN", "empty"),
        ]);
        let wanted = ["a.BIN: 2 slots claim it: slot 1", "b.BIN: 2 slots claim it: slot 2"];
        assert_eq!(lines[..2], wanted);
        assert_eq!(lines[2..], ["c.BIN, d.BIN: empty"]);
        let many = (0..49).map(|n| remark(None, &format!("{n}.BIN"), "empty"));
        let [line] = &together(many)[..] else { panic!("several lines") };
        assert_eq!(line, "0.BIN, 1.BIN, 2.BIN, 3.BIN, 4.BIN, 5.BIN and 43 more: empty");
    }
}
