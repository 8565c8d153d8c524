//! A study as aligned text for a terminal.

use std::fmt::Write as _;

use crate::study::paper;
use crate::study::result::{ConditionResult, Evaluation, StudyResult, WindowCount};

use super::figures::study::rho;
use super::table::{Align, Column, column, lines};
use super::text::{NONE, clean, count, estimate, shortened, signed, symbol, unit};

const BOLD: &str = "\u{1b}[1m";
const DIM: &str = "\u{1b}[2m";
const YELLOW: &str = "\u{1b}[33m";
const RESET: &str = "\u{1b}[0m";

/// Renders a study for a terminal of `width` characters, with ANSI colours if `color`: Table I, the
/// correlations of all conditions, and lost flights, beside the paper's values.
pub fn study_summary(study: &StudyResult, width: usize, color: bool) -> String {
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
    line(
        DIM,
        &format!(
            "{} of {}, {} x {}, seed {}",
            count(study.flights.len(), "flight"),
            clean(&study.vehicle),
            count(study.paper_way.conditions.len(), "wind condition"),
            count(study.updrafts_mps.len(), "updraft"),
            study.seed,
        ),
    );
    let mut table = |heading: &str, columns: &[Column], rows: &[Vec<String>]| {
        line("", "");
        line(BOLD, heading);
        for (index, row) in lines(columns, rows, width.saturating_sub(2)).iter().enumerate() {
            line(if index == 0 { DIM } else { "" }, &format!("  {row}"));
        }
    };
    let (columns, rows) = law_table(study);
    table("Table I: the law without updraft", &columns, &rows);
    let (columns, rows) = condition_table(study);
    table("Fitted updraft W* against true updraft W", &columns, &rows);
    let (columns, rows) = range_table(study);
    table("Over all conditions", &columns, &rows);
    line("", "");
    line("", &windows(&study.windows));
    if !study.lost.is_empty() {
        line(YELLOW, &format!("Lost ({})", study.lost.len()));
        for lost in study.lost.iter().take(20) {
            line("", &format!("  {}: {}", clean(&lost.name), clean(&lost.reason)));
        }
    }
    text
}

fn law_table(study: &StudyResult) -> (Vec<Column>, Vec<Vec<String>>) {
    let columns = vec![
        column("", Align::Left, 0),
        column("unit", Align::Left, 3),
        column("paper", Align::Right, 0),
        column("still air", Align::Right, 0),
        column("all winds", Align::Right, 1),
        column("still air, own way", Align::Right, 2),
    ];
    let rows = study
        .paper_way
        .table
        .iter()
        .map(|row| {
            let own = study.own_way.table.iter().find(|own| own.parameter == row.parameter);
            vec![
                symbol(row.parameter).to_owned(),
                unit(&row.unit),
                estimate(row.paper),
                estimate(row.windless),
                row.pooled.map_or_else(|| NONE.to_owned(), estimate),
                own.map_or_else(|| NONE.to_owned(), |own| estimate(own.windless)),
            ]
        })
        .collect();
    (columns, rows)
}

fn condition_table(study: &StudyResult) -> (Vec<Column>, Vec<Vec<String>>) {
    let columns = vec![
        column("wind", Align::Left, 0),
        column("n", Align::Right, 4),
        column("rho", Align::Right, 0),
        column("p", Align::Right, 2),
        column("slope", Align::Right, 0),
        column("intercept", Align::Right, 0),
        column("W* at W = 0", Align::Right, 3),
        column("rho, own way", Align::Right, 5),
        column("unused", Align::Right, 1),
    ];
    let rows = study
        .paper_way
        .conditions
        .iter()
        .enumerate()
        .map(|(index, condition)| {
            let words = ConditionWords::of(condition);
            let own = study.own_way.conditions.get(index).and_then(|own| own.regression);
            vec![
                words.label,
                words.n,
                words.rho,
                words.p_value,
                words.slope,
                words.intercept,
                words.at_zero,
                own.map_or_else(|| NONE.to_owned(), |own| rho(own.rho)),
                words.unused,
            ]
        })
        .collect();
    (columns, rows)
}

fn range_table(study: &StudyResult) -> (Vec<Column>, Vec<Vec<String>>) {
    let columns = vec![
        column("", Align::Left, 0),
        column("n", Align::Right, 0),
        column("rho", Align::Left, 0),
        column("p", Align::Left, 0),
    ];
    let rows = range_rows(study).map(|[name, n, rhos, p_values]| vec![name, n, rhos, p_values]);
    (columns, rows.into())
}

/// Name, n, lowest and highest rho and p: the paper's, and both ways to fit.
pub(super) fn range_rows(study: &StudyResult) -> [[String; 4]; 3] {
    let of = |name: &str, evaluation: &Evaluation| {
        let range = |range: Option<[f64; 2]>, words: fn(f64) -> String| {
            range.map_or_else(
                || NONE.to_owned(),
                |[low, high]| format!("{} to {}", words(low), words(high)),
            )
        };
        [
            name.to_owned(),
            study.updrafts_mps.len().to_string(),
            range(evaluation.rho, rho),
            range(evaluation.p_value, p_value),
        ]
    };
    let [low, high] = paper::RHO;
    let [least, most] = paper::P_VALUE.map(p_value);
    [
        [
            "the paper".to_owned(),
            paper::N.to_string(),
            format!("{low} to {high}"),
            format!("{least} to {most}"),
        ],
        of("here, the paper's way", &study.paper_way),
        of("here, this program's way", &study.own_way),
    ]
}

/// A condition's numbers in words.
pub(super) struct ConditionWords {
    pub(super) label: String,
    pub(super) n: String,
    pub(super) rho: String,
    pub(super) p_value: String,
    pub(super) slope: String,
    pub(super) intercept: String,
    pub(super) at_zero: String,
    pub(super) unused: String,
}

impl ConditionWords {
    pub(super) fn of(condition: &ConditionResult) -> Self {
        let found = condition.regression.as_ref();
        let none = || NONE.to_owned();
        let windows = &condition.windows;
        Self {
            label: condition.condition.label(),
            n: found.map_or_else(none, |found| found.n.to_string()),
            rho: found.map_or_else(none, |found| rho(found.rho)),
            p_value: found.map_or_else(none, |found| p_value(found.p_value)),
            slope: found.map_or_else(none, |found| estimate(found.slope)),
            intercept: found.map_or_else(none, |found| estimate(found.intercept)),
            at_zero: condition.at_zero_mps.map_or_else(none, |w| signed(w.value, 4)),
            unused: format!("{}/{}", windows.moving - windows.used, windows.moving),
        }
    }
}

/// A probability as a power of ten.
pub(super) fn p_value(value: f64) -> String {
    format!("{value:.0e}").replace('-', "−")
}

/// What became of the windows.
pub(super) fn windows(windows: &WindowCount) -> String {
    let mut text = format!("{} of {} moving windows used", windows.used, windows.moving);
    let reasons = [
        (windows.saturated, "left out with a motor at its limit"),
        (windows.otherwise, "left out for another reason"),
    ];
    for (n, reason) in reasons {
        if n > 0 {
            let _ = write!(text, ", {n} {reason}");
        }
    }
    text
}
