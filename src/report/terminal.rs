//! The analysis as aligned text for a terminal.

use std::fmt::Write as _;

use crate::analysis::result::{Analysis, FlightAnalysis, LevelledMap, TruthCheck, UpdraftMap};
use crate::base::layout;
use crate::flight::Indicator;
use crate::mission::plan::Purpose;
use crate::numeric::mean;

use super::compare::{
    better_words, clock, compared, comparison, drone_laws, drones_of, flock_lines, no_measurement,
    not_compared_lines, nothing, scatter_line, table_heading, windows_used,
};
use super::figures::air::{mean_error, where_compared};
use super::fleet_air::fleet_air;
use super::headline::{bent_cells, bent_line, held, held_cell, held_words};
use super::notes::{logs_used, note_lines, partly_used_lines, unused_lines, without_result_lines};
use super::opening::laws_sentence;
use super::page::capitalised;
use super::posterior;
use super::statistics_lines::statistics_lines;
use super::table::{Align, Column, column, lines};
use super::text::{
    NONE, clean, count, fixed, prose_width, purpose, share, shortened, signed, usable,
};

/// The table of drones shows no more; all are in the report.
const DRONE_LIMIT: usize = 64;

const BOLD: &str = "\u{1b}[1m";
const DIM: &str = "\u{1b}[2m";
const YELLOW: &str = "\u{1b}[33m";
const RED: &str = "\u{1b}[31m";
const BLUE: &str = "\u{1b}[34m";
const RESET: &str = "\u{1b}[0m";

/// Renders the analysis for a terminal of `width` characters (at least 40), with ANSI colours if
/// `color`.
///
/// For each flight: its drones, the fleet's parameters beside the paper's values, the laws of every
/// drone, the map of the air as a grid of numbers, missing drones and warnings. Text from logs is
/// stripped of control characters.
pub fn terminal_summary(analysis: &Analysis, width: usize, color: bool) -> String {
    let mut out = Output { text: String::new(), width: width.max(40), color };
    let title = clean(&analysis.title);
    out.line(BOLD, if title.is_empty() { "Analysis" } else { &title });
    out.line(DIM, &format!("made by {}", clean(&analysis.made_by)));
    if let Some(from) = &analysis.laws_from {
        out.wrapped(DIM, "", &laws_sentence(from));
    }
    if analysis.flights.is_empty() {
        out.line("", "");
        out.line(YELLOW, "There is no flight in this analysis.");
    }
    for flight in &analysis.flights {
        out.flight(flight);
    }
    if let Some(words) = no_measurement(analysis) {
        out.line("", "");
        out.wrapped("", "", words);
    }
    out.list(
        "Warnings",
        &analysis.warnings.iter().map(|w| clean(&w.to_string())).collect::<Vec<_>>(),
    );
    out.text
}

struct Output {
    text: String,
    width: usize,
    color: bool,
}

impl Output {
    fn line(&mut self, style: &str, text: &str) {
        let text = shortened(text, self.width);
        if self.color && !style.is_empty() && !text.is_empty() {
            let _ = writeln!(self.text, "{style}{text}{RESET}");
        } else {
            let _ = writeln!(self.text, "{text}");
        }
    }

    /// A line that may be longer than the terminal, broken at spaces.
    fn wrapped(&mut self, style: &str, indent: &str, text: &str) {
        // A word longer than the line (a path, say) is broken: nothing is left out.
        let options = layout::options(prose_width(self.width).max(layout::columns(indent) + 10))
            .initial_indent(indent)
            .subsequent_indent(indent);
        for line in layout::wrapped(text, options) {
            self.line(style, &line);
        }
    }

    fn table(&mut self, columns: &[Column], rows: &[Vec<String>]) {
        for (index, line) in lines(columns, rows, self.width - 2).iter().enumerate() {
            self.line(if index == 0 { DIM } else { "" }, &format!("  {line}"));
        }
    }

    /// A list in full: warnings are never cut.
    fn list(&mut self, heading: &str, items: &[String]) {
        self.list_of(heading, items.len(), items);
    }

    /// A list of `n` things, of which one line may tell of several.
    fn list_of(&mut self, heading: &str, n: usize, items: &[String]) {
        if items.is_empty() {
            return;
        }
        self.line("", "");
        self.line(YELLOW, &format!("{heading} ({n})"));
        for item in items {
            self.wrapped("", "  ", &format!("- {item}"));
        }
    }

    fn flight(&mut self, flight: &FlightAnalysis) {
        self.line("", "");
        let name = clean(&flight.name);
        let what = purpose(flight.purpose);
        let heading = if name == what { name } else { format!("{name}, {what}") };
        self.line(BOLD, &format!("{heading}: {}", drones_of(flight)));
        let source = if flight.planned { "windows from the plan" } else { "windows from the log" };
        let truth = flight.true_updraft_mps.map_or_else(String::new, |w| {
            format!(", simulated in a true updraft of {} m/s", signed(w, 2))
        });
        self.wrapped(DIM, "  ", &format!("{}, {source}{truth}", logs_used(flight)));
        if let Some(words) = nothing(flight) {
            self.wrapped(YELLOW, "  ", &words);
        }
        if let Some(words) = better_words(flight) {
            self.wrapped("", "  ", &format!("{}.", capitalised(&words)));
        }
        if let Some(words) = held_words(flight) {
            self.wrapped("", "  ", &format!("{}.", capitalised(&words)));
        }
        self.fleet_table(flight);
        self.flock(flight);
        if let Some(map) = &flight.map {
            self.map(map);
            self.levelled(map, flight.indicator.unit());
        }
        for line in statistics_lines(flight) {
            self.wrapped("", "  ", &line);
        }
        self.drones(flight);
        self.list("  Notes on drones", &note_lines(flight));
        let without = flight.missing.len() + flight.unmeasured.len();
        self.list_of("  Drones without a result", without, &without_result_lines(flight));
        self.list_of("  Logs not used", flight.unused.len(), &unused_lines(flight));
        let partly = partly_used_lines(flight);
        self.list_of("  Logs partly used", flight.partly_used.len(), &partly);
        let warnings: Vec<String> = flight.warnings.iter().map(|w| clean(&w.to_string())).collect();
        self.list("  Cautions", &warnings);
    }

    fn fleet_table(&mut self, flight: &FlightAnalysis) {
        if flight.table.is_empty() {
            return;
        }
        let mut columns = vec![
            column("law", Align::Left, 0),
            column("par.", Align::Left, 0),
            column("fleet mean ± s.d.", Align::Right, 0),
            column("unit", Align::Left, 1),
            column("mean s.e.", Align::Right, 4),
            column("n", Align::Right, 5),
            column("paper", Align::Right, 0),
            column("difference", Align::Right, 2),
            column("/ paper's ±", Align::Right, 3),
        ];
        let ours = if compared(flight) { columns.len() } else { columns.len() - 3 };
        columns.truncate(ours);
        let rows: Vec<Vec<String>> = flight
            .table
            .iter()
            .map(comparison)
            .map(|row| {
                vec![
                    row.law.to_owned(),
                    row.parameter.to_owned(),
                    row.fleet,
                    row.unit,
                    row.mean_se,
                    row.n.to_string(),
                    row.paper,
                    row.difference,
                    row.in_errors,
                ]
            })
            .map(|mut row| {
                row.truncate(ours);
                row
            })
            .collect();
        self.line("", "");
        self.wrapped(DIM, "  ", &table_heading(flight));
        self.table(&columns, &rows);
        for line in not_compared_lines(flight) {
            self.wrapped(DIM, "  ", &line);
        }
    }

    fn flock(&mut self, flight: &FlightAnalysis) {
        let laws = flock_lines(flight);
        if laws.is_empty() {
            return;
        }
        self.line("", "");
        self.wrapped(
            DIM,
            "  ",
            "All drones averaged: the paper's flock mapping, the lines of its Fig. 2",
        );
        for (law, line) in laws {
            self.wrapped("", "  ", &format!("{law}: {line}"));
        }
        if let Some(line) = flight.flock.as_ref().and_then(scatter_line) {
            self.wrapped("", "  ", &line);
        }
    }

    fn drones(&mut self, flight: &FlightAnalysis) {
        let added = if flight.indicator == Indicator::Pulse { "added µs" } else { "added" };
        // What is preferred stands first, and the paper's law gives way where there is no room.
        let bent = bent_line(flight).is_some();
        let held = held(flight).is_some();
        let [law, constant, vertex] = if bent || held { [9, 10, 8] } else { [1, 2, 0] };
        let mut columns = vec![
            column("slot", Align::Right, 0),
            column("name", Align::Left, 3),
            column("W held", Align::Right, 0),
            column("u₀ in hover", Align::Right, 1),
            column("A′ in hover", Align::Right, 0),
            column("A", Align::Right, law),
            column("u₀", Align::Right, constant),
            column("W*", Align::Right, vertex),
            column("χ²/ν", Align::Right, 6),
            column("A′", Align::Right, 0),
            column("χ²/ν (linear)", Align::Right, 6),
            column("u₀ (linear)", Align::Right, 5),
            column("windows", Align::Right, 4),
            column(added, Align::Right, 4),
            column("clock", Align::Left, 7),
        ];
        // In a measurement the map says it all.
        let calibration = flight.purpose == Purpose::Calibration;
        let rows: Vec<Vec<String>> = flight
            .drones
            .iter()
            .filter(|drone| calibration && drone.laws.is_some())
            .take(DRONE_LIMIT)
            .map(|drone| {
                let laws = drone_laws(drone);
                let [bent_u0, bent_slope] = bent_cells(flight, drone);
                vec![
                    drone.slot.map_or_else(|| NONE.to_owned(), |slot| slot.to_string()),
                    shortened(&drone.name, 16),
                    held_cell(drone),
                    bent_u0,
                    bent_slope,
                    laws.a,
                    laws.u0,
                    laws.w,
                    laws.chi2,
                    laws.slope,
                    laws.linear_chi2,
                    laws.linear_u0,
                    if drone.windows.is_empty() { NONE.to_owned() } else { windows_used(drone) },
                    laws.scatter,
                    clock(drone).to_owned(),
                ]
            })
            .collect();
        let shown = |index: usize| match index {
            2 => held,
            3 | 4 => bent,
            _ => true,
        };
        let rows: Vec<Vec<String>> = rows.into_iter().map(|row| kept(row, shown)).collect();
        columns = kept(columns, shown);
        if rows.is_empty() {
            return;
        }
        self.line("", "");
        self.wrapped(DIM, "  ", "Each drone's laws, as the line of the paper's Fig. 3d");
        self.table(&columns, &rows);
        let fitted = flight.drones.iter().filter(|drone| drone.laws.is_some()).count();
        if fitted > rows.len() {
            self.line(DIM, &format!("  and {} more, in the report", fitted - rows.len()));
        }
    }

    fn map(&mut self, map: &UpdraftMap) {
        self.line("", "");
        let Some(air) = fleet_air(map) else {
            self.line(YELLOW, "  No drone gave an estimate of the vertical air speed.");
            return;
        };
        self.wrapped(
            "",
            "  ",
            &format!(
                "vertical air speed W*, m/s: mean {} {}, {} ({})",
                signed(air.mean, 3),
                air.error.words(3),
                match air.n {
                    1 => "of one drone".to_owned(),
                    n => format!(
                        "s.d. between {} {}, from {} to {}",
                        count(n, "drone"),
                        fixed(air.sd, 3),
                        signed(air.lowest, 2),
                        signed(air.highest, 2)
                    ),
                },
                match &map.levelled {
                    Some(_) => "a response with its level fitted".to_owned(),
                    None => format!("{} law", map.law.name()),
                },
            ),
        );
        if let Some(reason) = &map.law_reason {
            self.wrapped(DIM, "  ", &format!("Law of the map: {}.", clean(reason)));
        }
        self.wrapped("", "  ", &air.one_drone_words());
        if let Some(common) = &map.common {
            self.wrapped(
                "",
                "  ",
                &format!(
                    "standard error that all drones have in common: {} m/s (zero {}, battery {}, wind {}, density \
                     {}); 95 % interval of the common shift: ±{} m/s",
                    fixed(common.se_mps, 3),
                    fixed(common.zero_mps, 3),
                    fixed(common.battery_mps, 3),
                    fixed(common.wind_mps, 3),
                    fixed(common.density_mps, 3),
                    fixed(common.half_width_mps, 2),
                ),
            );
        }
        if let Some(truth) = map.truth.filter(|_| map.common.is_some()) {
            self.wrapped(
                "",
                "  ",
                &format!(
                    "against the truth: rms error of the 10 s values {} m/s{} (answering zero: \
                     {}), bias {}, rms without it {}; {}",
                    fixed(truth.rms_mps, 3),
                    air.rms_error.map_or_else(String::new, |rms| {
                        format!(", of the drones' means {}", fixed(rms, 3))
                    }),
                    fixed(truth.zero_rms_mps, 3),
                    signed(truth.bias_mps, 3),
                    fixed(truth.rms_without_bias_mps, 3),
                    inside(&truth),
                ),
            );
        } else if let Some(rms) = air.rms_error {
            let known = map.drones.iter().filter(|drone| mean_error(map, drone).is_some()).count();
            self.wrapped(
                "",
                "  ",
                &format!(
                    "rms error of means against the truth{}: {} m/s ({})",
                    where_compared(map),
                    fixed(rms, 3),
                    count(known, "drone")
                ),
            );
        }
        for sentence in posterior::sentences(map) {
            self.wrapped("", "  ", &sentence);
        }
        for thermal in &map.thermals {
            self.wrapped("", "  ", &thermal.sentence());
        }
        self.grid(map, air.lowest.abs().max(air.highest.abs()));
    }

    /// Level and comparison of a map by a vehicle's response, and what several indicators say together.
    fn levelled(&mut self, map: &UpdraftMap, unit: &str) {
        let levelled = map.levelled.as_ref();
        let of_level = levelled.map(|found| found.level_words(unit)).unwrap_or_default();
        let held_out = levelled.map(LevelledMap::held_out_words).unwrap_or_default();
        let combined = map.combined.as_ref().map(|combined| combined.words.clone());
        for words in of_level.into_iter().chain(held_out).chain(combined) {
            self.wrapped("", "  ", &clean(&words));
        }
    }

    /// The map as numbers, forward up and left to the left; nothing where places form no small grid.
    fn grid(&mut self, map: &UpdraftMap, largest: f64) {
        let cell = |place_m: [f64; 2]| place_m.map(|along| (along * 2.0).round() as i64);
        let mut placed: Vec<([i64; 2], f64, String)> = map
            .drones
            .iter()
            .filter_map(|drone| {
                let place_m = drone.position_m.filter(|p| usable(p[0]) && usable(p[1]))?;
                let value = drone.posterior_mean.unwrap_or(drone.mean).value;
                usable(value).then(|| (cell(place_m), value, signed(value, 2)))
            })
            .collect();
        let filled = map.posterior.iter().flat_map(|map| &map.filled).filter_map(|place| {
            let value = mean(place.posterior_mps.iter().flatten())?;
            let text = format!("{}*", signed(value, 2));
            usable(value).then_some((cell(place.position_m), value, text))
        });
        let with_logs = placed.len();
        placed.extend(filled);
        let is_filled = placed.len() > with_logs;
        let distinct = |axis: usize| {
            let mut values: Vec<i64> = placed.iter().map(|(cell, _, _)| cell[axis]).collect();
            values.sort_unstable();
            values.dedup();
            values.reverse();
            values
        };
        let (rows, columns) = (distinct(0), distinct(1));
        if placed.is_empty() || rows.len() > 30 || columns.len() * 7 + 4 > self.width {
            return;
        }
        self.line("", "");
        let is_posterior = map.drones.iter().any(|drone| drone.posterior_mean.is_some());
        let means =
            if is_posterior { "Posterior means over the hover" } else { "Means over the hover" };
        let filled = if is_filled { ", * filled from its neighbours" } else { "" };
        let words = format!(
            "{means} (the paper's Fig. 5, averaged), seen from above, forward is up; · no data{filled}"
        );
        self.wrapped(DIM, "  ", &words);
        for row in rows {
            let mut line = String::from("  ");
            for &column in &columns {
                let found = placed.iter().find(|(cell, _, _)| *cell == [row, column]);
                let (text, style) = match found {
                    Some((_, value, text)) => (text.as_str(), style_of(*value, largest)),
                    None => ("·", DIM),
                };
                if self.color && !style.is_empty() {
                    let _ = write!(line, "{style}{text:>7}{RESET}");
                } else {
                    let _ = write!(line, "{text:>7}");
                }
            }
            let _ = writeln!(self.text, "{}", line.trim_end());
        }
    }
}

/// `95.3 % of 2544 values and 100.0 % of 16 means inside their 95 % intervals`
fn inside(truth: &TruthCheck) -> String {
    let values = format!("{} % of {} values", share(truth.inside_share), truth.values);
    match (truth.drones, truth.means_inside_share) {
        (1, Some(mean)) => {
            let mean = if mean > 0.5 { "and so is the mean" } else { "but not the mean" };
            format!("{values} inside their 95 % intervals, {mean}")
        }
        (n, means) => {
            format!("{values} and {} % of {n} means inside their 95 % intervals", share(means))
        }
    }
}

fn style_of(value: f64, largest: f64) -> &'static str {
    if value > 0.25 * largest {
        RED
    } else if value < -0.25 * largest {
        BLUE
    } else {
        ""
    }
}

/// What of a row is shown.
fn kept<T>(row: Vec<T>, shown: impl Fn(usize) -> bool) -> Vec<T> {
    row.into_iter().enumerate().filter(|(index, _)| shown(*index)).map(|(_, cell)| cell).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_mean_has_no_percentage() {
        let truth = |drones: usize, means: f64| -> TruthCheck {
            serde_json::from_value(serde_json::json!({
                "drones": drones, "values": 90, "rms_mps": 0.1, "bias_mps": 0.0, "rms_without_bias_mps": 0.1,
                "inside_share": 0.953, "means_inside_share": means,
            }))
            .unwrap()
        };
        let words = "95.3 % of 90 values and 50.0 % of 4 means inside their 95 % intervals";
        assert_eq!(inside(&truth(4, 0.5)), words);
        assert!(inside(&truth(1, 1.0)).ends_with("intervals, and so is the mean"));
        assert!(inside(&truth(1, 0.0)).ends_with("intervals, but not the mean"));
    }
}
