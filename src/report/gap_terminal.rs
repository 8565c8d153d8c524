//! A verdict as text for a terminal.

use std::fmt::Write as _;

use super::table::{Align, Column, lines};
use super::text::clean;
use crate::gap::Verdict;
use crate::gap::verdict::{Finding, Shrink};
use crate::gap::words::{phrase, short};

/// Width of tables, columns.
const WIDTH: usize = 100;
/// Rivals that are shown of each step.
const RIVALS: usize = 4;

/// The verdict: in words, the steps, the gap, and what the flight could not have shown.
pub fn text(verdict: &Verdict) -> String {
    let mut text = String::new();
    let mut line = |content: &str| {
        let _ = writeln!(text, "{content}");
    };
    line(&clean(&verdict.summary));
    line("");
    line(&format!(
        "{} of {} logs in {}; {} steady bins each; {} drones held out",
        verdict.data.drones,
        verdict.data.logs,
        verdict
            .data
            .groups
            .iter()
            .map(|(name, count)| format!("{} ({count})", clean(name)))
            .collect::<Vec<_>>()
            .join(", "),
        verdict.data.bins.iter().map(usize::to_string).collect::<Vec<_>>().join(" and "),
        verdict.data.held_out.len()
    ));
    for (index, step) in verdict.steps.iter().enumerate() {
        line("");
        let what = match &step.finding {
            Finding::Name { .. } => "named",
            Finding::Class { .. } => "class",
            Finding::Unknown { .. } => "unknown",
        };
        line(&format!("Step {} ({what}): {}", index + 1, clean(&phrase(&step.finding))));
        line(&format!(
            "  gains {:.1} nats (chance makes {:.1} in {} flights of 1,000); {:.1} us",
            step.gain_nats,
            step.threshold_nats,
            short(step.alpha * 1000.0),
            step.size_us
        ));
        let rivals: Vec<String> = step
            .rivals
            .iter()
            .filter(|rival| !step.finding.effects().contains(&rival.name.as_str()))
            .take(RIVALS)
            .map(|rival| {
                let kind = if rival.generic { "a free shape in " } else { "" };
                format!("{kind}{} {:.1}", rival.name, rival.gain_nats)
            })
            .collect();
        if !rivals.is_empty() {
            line(&format!("  next best: {}", rivals.join(", ")));
        }
    }
    line("");
    line(&format!(
        "Left: {} would gain {:.1} nats ({:.1} needed); reduced chi2 {:.2}",
        if verdict.rest.candidate.is_empty() { "nothing" } else { &verdict.rest.candidate },
        verdict.rest.gain_nats,
        verdict.rest.threshold_nats,
        verdict.rest.reduced_chi2
    ));
    let shrinks = [("held-out drones", verdict.gap.drones), ("held-out rungs", verdict.gap.rungs)];
    let rows: Vec<Vec<String>> =
        shrinks.iter().filter_map(|(name, shrink)| Some(shrink_row(name, (*shrink)?))).collect();
    if !rows.is_empty() {
        line("");
        let columns = [
            column("Gap (rms)", Align::Left),
            column("before us", Align::Right),
            column("after us", Align::Right),
            column("before, no air", Align::Right),
            column("after, no air", Align::Right),
            column("floor us", Align::Right),
            column("m/s", Align::Right),
            column("shrink", Align::Right),
        ];
        for row in lines(&columns, &rows, WIDTH) {
            line(&row);
        }
    }
    let hidden: Vec<Vec<String>> = verdict
        .detectable
        .iter()
        .filter(|one| !one.would_be_seen)
        .map(|one| {
            let unit = if one.unit.is_empty() { String::new() } else { format!(" {}", one.unit) };
            vec![
                one.effect.clone(),
                one.smallest.map_or_else(
                    || "-".to_owned(),
                    |smallest| format!("{} {}{unit}", one.parameter, short(smallest)),
                ),
                if one.usual == 0.0 { "-".to_owned() } else { short(one.usual) },
                if one.usual == 0.0 { "-".to_owned() } else { format!("{:.1}", one.usual_z) },
                if one.why.is_empty() { one.like.join(", ") } else { one.why.clone() },
            ]
        })
        .collect();
    if !hidden.is_empty() {
        line("");
        line("What this flight would not have shown at its usual size:");
        let columns = [
            column("effect", Align::Left),
            column("smallest seen", Align::Left),
            column("usual", Align::Right),
            column("z", Align::Right),
            column("why, or like what", Align::Left),
        ];
        for row in lines(&columns, &hidden, WIDTH) {
            line(&row);
        }
    }
    for caution in &verdict.cautions {
        line("");
        line(&format!("Note: {}", clean(caution)));
    }
    text
}

fn column(head: &'static str, align: Align) -> Column {
    Column { head, align, drop: 0 }
}

fn shrink_row(name: &str, shrink: Shrink) -> Vec<String> {
    vec![
        name.to_owned(),
        format!("{:.1}", shrink.before_us.value),
        format!("{:.1}", shrink.after_us.value),
        format!("{:.1}", shrink.before_without_air_us),
        format!("{:.1}", shrink.after_without_air_us),
        format!("{:.1}", shrink.floor_us),
        format!("{:.2} to {:.2}", shrink.before_mps, shrink.after_mps),
        format!("{:.0} %", 100.0 * shrink.excess_shrink.value),
    ]
}
