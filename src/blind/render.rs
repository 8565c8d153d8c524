//! Table of blind flights as text for a terminal and as Markdown.

use std::fmt::Write as _;

use super::table::{Demand, Group, Metric, Table};
use super::worlds::Worlds;

/// Form in which a table is printed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style {
    /// Columns aligned by spaces.
    Text,
    /// A Markdown table.
    Markdown,
}

/// Renders the whole table, with a note in its head, such as date and commit.
pub fn render(table: &Table, style: Style, note: Option<&str>) -> String {
    let mut text = String::new();
    let settings = &table.settings;
    let heading = if settings.tuning {
        "Blind benchmark: TUNING seeds, not a score"
    } else {
        "Blind benchmark"
    };
    title(&mut text, style, 2, heading);
    let flights = table.groups.first().map_or(0, |group| group.flights);
    let _ = write!(text, "{}, seed {}, {flights} flights", table.made_by, settings.seed);
    if table.lost > 0 {
        let _ = write!(text, ", {} without a verdict", table.lost);
    }
    if let Some(note) = note {
        let _ = write!(text, ", {note}");
    }
    text.push_str(".\n");
    if let Some(rows) = beside(table) {
        title(&mut text, style, 3, "home and foreign worlds");
        grid(&mut text, style, &rows);
    }
    for group in &table.groups {
        let heading = format!("{} ({} flights)", group.label, group.flights);
        title(&mut text, style, 3, &heading);
        grid(&mut text, style, &metric_rows(group));
        let power = power_rows(group);
        if power.len() > 1 {
            text.push('\n');
            grid(&mut text, style, &power);
        }
    }
    if !table.effects.is_empty() {
        title(&mut text, style, 3, "by what was hidden");
        grid(&mut text, style, &effect_rows(table));
    }
    text
}

/// Metrics of home and foreign worlds side by side, if both were flown.
fn beside(table: &Table) -> Option<Vec<Vec<String>>> {
    let of = |worlds: Worlds| table.groups.iter().find(|group| group.label == worlds.name());
    let (home, foreign) = (of(Worlds::Home)?, of(Worlds::Foreign)?);
    let told = |metric: &Metric| match (metric.value, metric.interval) {
        (Some(value), Some(_)) => {
            format!("{} ({} of {})", percent(value), metric.counts.0, metric.counts.1)
        }
        (Some(value), None) => format!("{} (of {})", percent(value), metric.counts.1),
        (None, _) => String::new(),
    };
    let mut rows = vec![row(["metric", "home", "foreign", "acceptance"])];
    for (left, right) in home.metrics.iter().zip(&foreign.metrics) {
        if left.value.is_some() || right.value.is_some() {
            let wanted = demand(right, &right.acceptance);
            rows.push(vec![left.name.clone(), told(left), told(right), wanted]);
        }
    }
    Some(rows)
}

fn title(text: &mut String, style: Style, level: usize, words: &str) {
    let marks = if style == Style::Markdown { "#".repeat(level) + " " } else { String::new() };
    let gap = if text.is_empty() { "" } else { "\n" };
    let after = if style == Style::Markdown { "\n" } else { "" };
    let _ = writeln!(text, "{gap}{marks}{words}{after}");
}

fn metric_rows(group: &Group) -> Vec<Vec<String>> {
    let mut rows = vec![row(["metric", "value", "95 %", "of", "acceptance", "moonshot"])];
    let measured = group.metrics.iter().filter(|metric| metric.value.is_some());
    rows.extend(measured.map(|metric| {
        vec![
            metric.name.clone(),
            metric.value.map_or_else(String::new, percent),
            metric.interval.map_or_else(String::new, |(low, high)| {
                format!("{} to {}", percent(low), percent(high))
            }),
            match metric.interval {
                Some(_) => format!("{} of {}", metric.counts.0, metric.counts.1),
                None => metric.counts.1.to_string(),
            },
            demand(metric, &metric.acceptance),
            demand(metric, &metric.moonshot),
        ]
    }));
    rows
}

fn demand(metric: &Metric, demand: &Demand) -> String {
    let words = match *demand {
        Demand::AtLeast { bound: 0.0 } => return String::new(),
        Demand::AtLeast { bound } => format!(">= {}", percent(bound)),
        Demand::AtMost { bound } | Demand::UpperAtMost { bound } => {
            format!("<= {}", percent(bound))
        }
        Demand::Within { low, high } => format!("{} to {}", percent(low), percent(high)),
    };
    let met = match demand.missed_by(metric) {
        Some(0.0) => "met".to_owned(),
        Some(by) => {
            let chance = if demand.may_be_chance(metric) { ", may be chance" } else { "" };
            format!("missed by {:.1}{chance}", 100.0 * by)
        }
        None => String::new(),
    };
    format!("{words} {met}")
}

fn power_rows(group: &Group) -> Vec<Vec<String>> {
    let mut rows = vec![row(["Fisher z", "named or in class", "95 %", "of", "Phi(z - 4)"])];
    for bin in group.power.iter().filter(|bin| bin.count > 0) {
        let (low, high) = bin.interval;
        rows.push(vec![
            match bin.to {
                Some(to) => format!("{} to {to}", bin.from),
                None => format!("{} and more", bin.from),
            },
            percent(bin.named as f64 / bin.count as f64),
            format!("{} to {}", percent(low), percent(high)),
            format!("{} of {}", bin.named, bin.count),
            bin.best.map_or_else(String::new, percent),
        ]);
    }
    rows
}

fn effect_rows(table: &Table) -> Vec<Vec<String>> {
    let names =
        ["protocol", "hidden", "flights", "named", "in class", "unknown", "silent", "error"];
    let mut rows = vec![row(names)];
    rows.extend(table.effects.iter().map(|effect| {
        vec![
            effect.protocol.clone(),
            effect.kind.clone(),
            effect.count.to_string(),
            effect.named.to_string(),
            effect.in_class.to_string(),
            effect.unknown.to_string(),
            effect.silent.to_string(),
            effect.error.map_or_else(String::new, percent),
        ]
    }));
    rows
}

fn row<const N: usize>(words: [&str; N]) -> Vec<String> {
    words.map(str::to_owned).to_vec()
}

fn percent(value: f64) -> String {
    format!("{:.1} %", 100.0 * value)
}

fn grid(text: &mut String, style: Style, rows: &[Vec<String>]) {
    let columns = rows.first().map_or(0, Vec::len);
    let widths: Vec<usize> = (0..columns)
        .map(|column| {
            rows.iter().filter_map(|row| row.get(column)).map(String::len).max().unwrap_or(0)
        })
        .collect();
    for (index, row) in rows.iter().enumerate() {
        match style {
            Style::Markdown => {
                let _ = writeln!(text, "| {} |", row.join(" | "));
                if index == 0 {
                    let _ = writeln!(text, "|{}", "---|".repeat(columns));
                }
            }
            Style::Text => {
                let cells = row.iter().zip(&widths).map(|(cell, width)| format!("{cell:<width$}"));
                let line = cells.collect::<Vec<_>>().join("  ");
                let _ = writeln!(text, "{}", line.trim_end());
            }
        }
    }
}
