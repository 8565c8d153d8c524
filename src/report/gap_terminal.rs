//! Verdict as text for a terminal.

use std::fmt::Write as _;

use super::gap_parts::first_gap;
use super::gap_words::{in_field, kind, left_over, lost, map_words, per_thousand, percent};
use super::table::{Align, Column, column, lines};
use super::text::{clean, count, fixed, prose_width, reduced, signed};
use crate::base::layout;
use crate::gap::Verdict;
use crate::gap::left_out::said_together;
use crate::gap::verdict::{Detectable, Finding, Shrink, Step};
use crate::gap::words::{phrase, short};

const BOLD: &str = "\u{1b}[1m";
const DIM: &str = "\u{1b}[2m";
const YELLOW: &str = "\u{1b}[33m";
const RESET: &str = "\u{1b}[0m";

/// A smaller updraft is printed as none, m/s.
const LEAST_UPDRAFT_MPS: f64 = 0.005;
/// An updraft of zero that is known no better than to this is worth a word, m/s.
const WIDE_MPS: f64 = 0.5;
/// Rivals that are shown of each step.
const RIVALS: usize = 4;

/// Lines with their styles.
struct Page {
    text: String,
    width: usize,
    color: bool,
}

impl Page {
    /// A paragraph, broken between words; later lines are indented.
    fn say(&mut self, style: &str, content: &str, indent: usize) {
        for line in wrapped(&clean(content), prose_width(self.width), indent) {
            self.line(style, &line);
        }
    }

    fn line(&mut self, style: &str, line: &str) {
        let _ = if self.color && !style.is_empty() {
            writeln!(self.text, "{style}{line}{RESET}")
        } else {
            writeln!(self.text, "{line}")
        };
    }

    fn table(&mut self, columns: &[Column], rows: &[Vec<String>]) {
        for (index, row) in lines(columns, rows, self.width).iter().enumerate() {
            self.line(if index == 0 { DIM } else { "" }, row);
        }
    }
}

/// Renders a verdict for a terminal of `width` characters, with ANSI colours if `color`: in words,
/// the steps, the gap, and what the flight could not have shown.
pub fn gap_summary(verdict: &Verdict, width: usize, color: bool) -> String {
    let mut page = Page { text: String::new(), width, color };
    page.say(BOLD, &verdict.summary, 0);
    page.say(DIM, &data(verdict), 2);
    for (index, step) in verdict.steps.iter().enumerate() {
        say_step(&mut page, index + 1, step);
    }
    page.line("", "");
    let rest = &verdict.rest;
    let left = if rest.candidate.is_empty() {
        "no candidate gains anything".to_owned()
    } else {
        left_over(rest)
    };
    page.say("", &format!("Left: {left}; reduced chi2 {}", reduced(rest.reduced_chi2)), 2);
    air(&mut page, verdict);
    gap(&mut page, verdict);
    undetectable(&mut page, &verdict.detectable);
    if !verdict.data.left_out.is_empty() {
        page.line("", "");
        page.say(YELLOW, &format!("Left out ({})", verdict.data.left_out.len()), 0);
        for reason in said_together(&verdict.data.left_out) {
            page.say("", &format!("  {reason}"), 4);
        }
    }
    for caution in &verdict.cautions {
        page.line("", "");
        page.say(YELLOW, &format!("Note: {caution}"), 6);
    }
    page.text
}

fn data(verdict: &Verdict) -> String {
    let data = &verdict.data;
    let groups: Vec<String> = data
        .groups
        .iter()
        .enumerate()
        .map(|(index, (name, drones))| {
            let bins = data.bins.get(index).copied().unwrap_or(0);
            format!("{name} ({}, {})", count(*drones, "drone"), count(bins, "bin"))
        })
        .collect();
    format!(
        "{} of {} used: {}; {}",
        data.drones,
        count(data.logs, "log"),
        groups.join(", "),
        match data.held_out.len() {
            0 => "none held out from fitting".to_owned(),
            n => format!("{} held out", count(n, "drone")),
        }
    )
}

fn say_step(page: &mut Page, number: usize, step: &Step) {
    page.line("", "");
    let what = kind(&step.finding);
    page.say(BOLD, &format!("Step {number}, {what}: {}", phrase(step)), 2);
    page.say(
        "",
        &format!(
            "  gain {:.1} nats (by chance, at most {} flights in 1,000 exceed {:.1}); {}",
            step.gain_nats,
            per_thousand(step.alpha),
            step.threshold_nats,
            if step.size_us > 0.0 {
                format!("moves the pulse by {:.1} us", step.size_us)
            } else {
                "told by how the drones lean, not by their pulse".to_owned()
            }
        ),
        4,
    );
    if let Some(size) = &step.in_field {
        page.say("", &format!("  in the field: {}", in_field(size)), 4);
    }
    let own = |name: &str| match &step.finding {
        Finding::Unknown { depends_on, .. } => depends_on.name() == name,
        other => other.effects().contains(&name),
    };
    let rivals: Vec<String> = step
        .rivals
        .iter()
        .filter(|rival| !own(&rival.name))
        .take(RIVALS)
        .map(|rival| {
            let kind = if rival.generic { "any shape in " } else { "" };
            format!("{kind}{} {:.1}", rival.name, rival.gain_nats)
        })
        .collect();
    if !rivals.is_empty() {
        page.say(DIM, &format!("  rivals: {}", rivals.join(", ")), 4);
    }
}

/// The updraft of the whole flight, which the sizes and the gap depend on.
fn air(page: &mut Page, verdict: &Verdict) {
    let updraft_mps = verdict.noise.updraft_mps;
    let half = verdict.noise.updraft_half_mps;
    if let Some(half) = half.filter(|half| *half > WIDE_MPS && *half > updraft_mps.abs()) {
        let told = format!(
            "Air: this flight does not tell a uniform updraft of the whole flight from none: {} ± {half:.2} \
             m/s (95 %)",
            signed(updraft_mps, 2)
        );
        page.say("", &told, 2);
    } else if updraft_mps.abs() >= LEAST_UPDRAFT_MPS || half.is_some_and(|half| half > WIDE_MPS) {
        let within = half.map_or_else(String::new, |half| format!(" ± {half:.2}"));
        let told = format!(
            "Air: the whole flight is explained best in a uniform updraft of {}{within} m/s{}",
            signed(updraft_mps, 2),
            if within.is_empty() { "" } else { " (95 %)" }
        );
        page.say("", &told, 2);
    }
}

fn gap(page: &mut Page, verdict: &Verdict) {
    if first_gap(verdict).is_none() {
        return;
    }
    let shrinks = [("held-out drones", verdict.gap.drones), ("held-out rungs", verdict.gap.rungs)];
    let named = !verdict.steps.is_empty();
    let rows: Vec<Vec<String>> = shrinks
        .iter()
        .filter_map(|(name, shrink)| Some(shrink_row(name, (*shrink)?, named)))
        .collect();
    let columns = [
        column("Gap, rms", Align::Left, 0),
        column("us", Align::Right, 0),
        column("m/s", Align::Right, 2),
        column("no air, us", Align::Right, 0),
        column("floor", Align::Right, 1),
        column("chi2", Align::Right, 3),
        column("excess gone", Align::Right, 0),
    ];
    page.line("", "");
    page.table(&columns, &rows);
    if let Some(map) = &verdict.map {
        page.say("", &map_words(map), 2);
    }
}

fn shrink_row(name: &str, shrink: Shrink, named: bool) -> Vec<String> {
    let pair = |before: f64, after: f64, decimals: usize| {
        format!("{} -> {}", fixed(before, decimals), fixed(after, decimals))
    };
    let (gone, range) = percent(shrink.excess_shrink);
    vec![
        name.to_owned(),
        pair(shrink.before_us.value, shrink.after_us.value, 1),
        pair(shrink.before_mps, shrink.after_mps, 2),
        pair(shrink.before_without_air_us, shrink.after_without_air_us, 1),
        fixed(shrink.floor_us, 1),
        format!("{} -> {}", reduced(shrink.chi2.0), reduced(shrink.chi2.1)),
        if named { format!("{gone} ({range})") } else { "–".to_owned() },
    ]
}

fn undetectable(page: &mut Page, all: &[Detectable]) {
    let (sought, other): (Vec<&Detectable>, Vec<&Detectable>) =
        all.iter().filter(|one| !one.would_be_seen).partition(|one| !one.parameter.is_empty());
    if sought.is_empty() && all.iter().any(|one| one.would_be_seen) {
        page.line("", "");
        page.say(
            "",
            "Every effect that is searched for would have been seen at its usual size.",
            2,
        );
    }
    if !sought.is_empty() {
        let rows: Vec<Vec<String>> = sought.iter().map(|one| hidden_row(one)).collect();
        let columns = [
            column("effect", Align::Left, 0),
            column("smallest", Align::Right, 0),
            column("usual", Align::Right, 1),
            column("z", Align::Right, 2),
            column("why", Align::Left, 0),
        ];
        page.line("", "");
        page.say(BOLD, "What this flight could not have shown at its usual size", 0);
        page.table(&columns, &rows);
    }
    if !other.is_empty() {
        let names: Vec<&str> = other.iter().map(|one| one.effect.as_str()).collect();
        page.line("", "");
        page.say(DIM, &format!("Not searched for in the pulse: {}", names.join(", ")), 2);
    }
}

fn hidden_row(one: &Detectable) -> Vec<String> {
    let unit = if one.unit.is_empty() { String::new() } else { format!(" {}", clean(&one.unit)) };
    let why = match (one.why.is_empty(), one.like.is_empty()) {
        (false, _) => clean(&one.why),
        (true, true) => lost(one).to_owned(),
        (true, false) => format!("looks like {}", clean(&one.like.join(", "))),
    };
    vec![
        clean(&one.effect),
        one.smallest.map_or_else(
            || "none".to_owned(),
            |smallest| format!("{}{unit}", short(smallest.copysign(one.usual))),
        ),
        short(one.usual),
        format!("{:.1}", one.usual_z.abs()),
        why,
    ]
}

/// Lines of at most `width` columns, broken between words; those after the first are indented.
fn wrapped(text: &str, width: usize, indent: usize) -> Vec<String> {
    let first = text.len() - text.trim_start().len();
    // A word that fits no line is cut.
    let most = width.saturating_sub(indent.max(first));
    let words: Vec<String> =
        text.split_whitespace().map(|word| super::text::shortened(word, most)).collect();
    let (first, indent) = (" ".repeat(first), " ".repeat(indent));
    let options = layout::options(width).initial_indent(&first).subsequent_indent(&indent);
    layout::wrapped(&words.join(" "), options)
}
