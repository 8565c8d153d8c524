//! A sensitivity study as aligned text for a terminal.

use std::fmt::Write as _;

use crate::study::sensitivity::{Influence, OutcomeResult, SensitivityResult, Uncertain};

use super::table::{Align, column, lines};
use super::text::{NONE, clean, count, fixed, shortened, signed};

const BOLD: &str = "\u{1b}[1m";
const DIM: &str = "\u{1b}[2m";
const YELLOW: &str = "\u{1b}[33m";
const RESET: &str = "\u{1b}[0m";

/// Renders a sensitivity study for a terminal of `width` characters, with ANSI colours if `color`: for each outcome, the
/// factors in the order of how much they decide.
pub fn sensitivity_summary(study: &SensitivityResult, width: usize, color: bool) -> String {
    let mut text = String::new();
    let mut line = |style: &str, content: &str| {
        let content = shortened(content, width);
        if color && !style.is_empty() {
            let _ = writeln!(text, "{style}{content}{RESET}");
        } else {
            let _ = writeln!(text, "{content}");
        }
    };
    line(BOLD, &clean(&study.title));
    line(DIM, &campaigns(study));
    for outcome in &study.outcomes {
        line("", "");
        line(BOLD, &format!("{} ({})", capital(&outcome.title), outcome.name));
        line("", &format!("  {}", spread(outcome)));
        let is_sobol = study.design == "sobol";
        let columns = if is_sobol {
            [
                column("factor", Align::Left, 0),
                column("alone (first order)", Align::Right, 2),
                column("with others (total)", Align::Right, 0),
                column("rows", Align::Right, 3),
            ]
        } else {
            [
                column("factor", Align::Left, 0),
                column("rank regression", Align::Right, 0),
                column("partial rank correlation", Align::Right, 2),
                column("campaigns", Align::Right, 3),
            ]
        };
        let rows: Vec<Vec<String>> = in_order(outcome)
            .iter()
            .map(|found| {
                let (one, two) = numbers(found, is_sobol);
                vec![clean(&found.factor), one, two, found.n.to_string()]
            })
            .collect();
        for (index, row) in lines(&columns, &rows, width.saturating_sub(2)).iter().enumerate() {
            line(if index == 0 { DIM } else { "" }, &format!("  {row}"));
        }
        if let Some(words) = explained(outcome, is_sobol) {
            line("", &format!("  {words}"));
        }
    }
    if let Some(naming) = &study.naming {
        line("", "");
        let counts: Vec<_> = naming.iter().map(|(called, n)| format!("{called} {n}")).collect();
        line("", &format!("What was hidden: {}", counts.join(", ")));
    }
    if study.lost > 0 {
        line("", "");
        line(YELLOW, &format!("Lost ({})", study.lost));
        for lost in &study.lost_reasons {
            line("", &format!("  {}: {}", count(lost.campaigns, "campaign"), clean(&lost.reason)));
        }
    }
    text
}

/// How many campaigns there are, in words.
pub(super) fn campaigns(study: &SensitivityResult) -> String {
    let open =
        if study.open > 0 { format!(", {} still to be flown", study.open) } else { String::new() };
    format!(
        "{} of {} ({}) of {}, {}{open}, seed {}",
        study.finished,
        count(study.campaigns, "campaign"),
        study.design,
        clean(&study.campaign),
        count(study.factors.len(), "factor"),
        study.seed
    )
}

/// Mean and spread of an outcome over the campaigns.
pub(super) fn spread(outcome: &OutcomeResult) -> String {
    let (Some(mean), Some(sd)) = (outcome.mean, outcome.sd) else {
        return format!("{} have it", count(outcome.n, "campaign"));
    };
    let unit = if outcome.unit.is_empty() { String::new() } else { format!(" {}", outcome.unit) };
    if sd == 0.0 {
        return format!("{mean}{unit} in every campaign: no factor decides anything");
    }
    let number = |value: f64| fixed(value, decimals(sd));
    let range = match &outcome.quantiles[..] {
        [_, low, _, median, _, high, _] => format!(
            "; median {}, 90 % between {} and {}",
            number(*median),
            number(*low),
            number(*high)
        ),
        _ => String::new(),
    };
    format!("mean {}{unit}, standard deviation {}{range}", number(mean), number(sd))
}

/// Decimals that show a spread with two digits.
pub(super) fn decimals(spread: f64) -> usize {
    if spread > 0.0 && spread.is_finite() {
        (1.0 - spread.log10().floor()).clamp(0.0, 6.0) as usize
    } else {
        3
    }
}

/// Factors in the order of how much they decide.
pub(super) fn in_order(outcome: &OutcomeResult) -> Vec<&Influence> {
    let mut order: Vec<&Influence> = outcome.influences.iter().collect();
    let size = |found: &Influence| found.main().map_or(-1.0, |main| main.value.abs());
    order.sort_by(|a, b| size(b).total_cmp(&size(a)));
    order
}

/// The two numbers of a factor in words.
pub(super) fn numbers(found: &Influence, is_sobol: bool) -> (String, String) {
    let share = |value: Option<Uncertain>| {
        value.map_or_else(
            || NONE.to_owned(),
            |of| format!("{} [{}, {}]", fixed(of.value, 2), fixed(of.low, 2), fixed(of.high, 2)),
        )
    };
    let coefficient = |value: Option<Uncertain>| {
        value.map_or_else(
            || NONE.to_owned(),
            |of| format!("{} [{}, {}]", signed(of.value, 2), signed(of.low, 2), signed(of.high, 2)),
        )
    };
    if is_sobol {
        (share(found.first), share(found.total))
    } else {
        (coefficient(found.regression), coefficient(found.partial))
    }
}

/// How much the factors explain, in words.
pub(super) fn explained(outcome: &OutcomeResult, is_sobol: bool) -> Option<String> {
    let of = outcome.explained?;
    let interval = format!("{} [{}, {}]", fixed(of.value, 2), fixed(of.low, 2), fixed(of.high, 2));
    Some(if is_sobol {
        format!(
            "Sum of the first orders {interval}; what is missing to 1 is the work of several together"
        )
    } else {
        format!("R² of the rank regression {interval}; the rest is chance, or not monotonic")
    })
}

/// With a capital first letter.
pub(super) fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}
