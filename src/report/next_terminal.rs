//! Proposed flight as text for a terminal.

use super::table::{Align, column, lines};
use super::text::clean;
use crate::gap::next::Next;

/// Width of tables, columns.
const WIDTH: usize = 100;

/// Renders the open questions with the answers that the present and the proposed flight give, the
/// elements of the proposed flight, and what was verified.
pub fn text(next: &Next) -> String {
    let left = |head| column(head, Align::Left, 0);
    let right = |head| column(head, Align::Right, 0);
    let columns = [
        right("flown: z"),
        right("proposed: z"),
        right("wanted"),
        right("flights"),
        left("question"),
    ];
    let mut rows = Vec::new();
    for asked in &next.questions {
        let flights = match (asked.reached, asked.flights_needed) {
            (true, _) => "1".to_owned(),
            (false, Some(flights)) => flights.to_string(),
            (false, None) => "never".to_owned(),
        };
        rows.push(vec![
            format!("{:.1}", asked.present_z),
            format!("{:.1}", asked.proposed_z),
            format!("{:.1}", asked.wanted_z),
            flights,
            clean(&asked.question),
        ]);
        for told in asked.from.iter().filter(|told| !told.from.is_empty()) {
            rows.push(vec![
                format!("{:.1}", told.present_z),
                format!("{:.1}", told.proposed_z),
                String::new(),
                String::new(),
                format!("  from {}", clean(&told.from)),
            ]);
        }
    }
    let mut out = Vec::new();
    if !next.reaches {
        out.extend([next.title().to_owned(), String::new()]);
    }
    out.extend(lines(&columns, &rows, WIDTH));
    out.push(String::new());
    out.push(format!(
        "Flown: {:.0} s. Proposed: {:.0} s{}",
        next.present_s,
        next.proposed_s,
        next.shortfall().map_or_else(String::new, |falls| format!("; {falls}"))
    ));
    out.extend(next.why.iter().map(|why| format!("  {why}")));
    for asked in &next.questions {
        out.extend(asked.verified.iter().map(verified));
    }
    out.extend(next.notes.iter().map(|note| format!("note: {}", clean(note))));
    out.push(String::new());
    out.join("\n")
}

fn verified(one: &crate::gap::next::result::Verified) -> String {
    let found = if one.found.is_empty() { "nothing".to_owned() } else { one.found.join("; then ") };
    let reached = one.reached_z.map_or_else(String::new, |z| {
        format!(", z {:.1} predicted, {z:.1} reached", one.predicted_z)
    });
    format!(
        "simulated with {} {}: the search found {} ({}{reached})",
        one.truth,
        crate::gap::words::short(one.size),
        found,
        if one.told { "told" } else { "not told" }
    )
}
