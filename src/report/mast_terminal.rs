//! A comparison with a mast as text for a terminal.

use std::fmt::Write as _;

use crate::base::layout;
use crate::mast::result::MastComparison;

use super::mast_words as words;
use super::table::{Align, Column, column, lines};
use super::text::clean;

/// Of more drones, the nearest are shown; all are on the page.
const DRONE_LIMIT: usize = 12;

/// More means of a slow mast are on the page alone.
const PERIOD_LIMIT: usize = 20;

/// Renders a comparison with a mast for a terminal of `width` characters.
pub fn mast_summary(of: &MastComparison, width: usize) -> String {
    let mut text = format!("{}\n", words::title(of));
    let wrapped = |text: &mut String, indent: &str, content: &str| {
        let options = layout::options(width).initial_indent(indent).subsequent_indent("  ");
        for line in layout::wrapped(content, options) {
            let _ = writeln!(text, "{line}");
        }
    };
    for flight in &of.flights {
        let _ = writeln!(text, "\n{}: {}", clean(&flight.flight), words::when(flight));
        for sentence in words::sentences(flight) {
            wrapped(&mut text, "  ", &sentence);
        }
        let drones = flight.drones.iter().take(DRONE_LIMIT).map(words::drone).collect::<Vec<_>>();
        let mut tables = vec![
            (columns(&words::AVERAGE_HEADS), words::averages(flight)),
            (columns(&words::DRONE_HEADS), drones),
        ];
        if !flight.periods.is_empty() && flight.periods.len() <= PERIOD_LIMIT {
            tables.insert(0, (columns(&words::PERIOD_HEADS), words::periods(flight)));
        }
        for (heads, rows) in tables {
            let _ = writeln!(text);
            for line in lines(&heads, &rows, width.saturating_sub(2)) {
                let _ = writeln!(text, "  {line}");
            }
        }
    }
    if !of.notes.is_empty() {
        let _ = writeln!(text, "\nNotes ({})", of.notes.len());
        for note in &of.notes {
            wrapped(&mut text, "  - ", &clean(note));
        }
    }
    text
}

/// Columns with these heads; the later go first where there is no room.
fn columns(heads: &[&'static str]) -> Vec<Column> {
    heads
        .iter()
        .zip(0u8..)
        .map(|(head, at)| {
            let align = if at == 0 { Align::Left } else { Align::Right };
            column(head, align, at.saturating_sub(3))
        })
        .collect()
}
