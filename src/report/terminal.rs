//! The analysis as aligned text for a terminal.

use std::fmt::Write as _;

use crate::analysis::result::{Analysis, FlightAnalysis, UpdraftMap};
use crate::mission::plan::Purpose;

use super::compare::{
    clock, comparison, drone_laws, drones_of, flags, fleet_air, flock_lines, windows_used,
};
use super::figure_air::mean_truth;
use super::table::{Align, Column, lines};
use super::text::{NONE, clean, count, fixed, purpose, shortened, signed, usable};

/// Above so many drones the table of drones shows only those with flags.
const DRONE_LIMIT: usize = 64;
/// Lists longer than this are cut, with the number of what follows.
const LIST_LIMIT: usize = 20;

const BOLD: &str = "\u{1b}[1m";
const DIM: &str = "\u{1b}[2m";
const YELLOW: &str = "\u{1b}[33m";
const RED: &str = "\u{1b}[31m";
const BLUE: &str = "\u{1b}[34m";
const RESET: &str = "\u{1b}[0m";

/// The analysis for a terminal of `width` characters (at least 40), with ANSI colours if `color`.
///
/// For each flight: its drones, the fleet's parameters beside the paper's values, the laws of every
/// drone, the map of the air as a grid of numbers, missing drones and warnings. Text from logs is
/// stripped of control characters.
pub fn terminal_summary(analysis: &Analysis, width: usize, color: bool) -> String {
    let mut out = Output { text: String::new(), width: width.max(40), color };
    let title = clean(&analysis.title);
    out.line(BOLD, if title.is_empty() { "Analysis" } else { &title });
    out.line(DIM, &format!("made by {}", clean(&analysis.made_by)));
    if analysis.flights.is_empty() {
        out.line("", "");
        out.line(YELLOW, "There is no flight in this analysis.");
    }
    for flight in &analysis.flights {
        out.flight(flight);
    }
    if !analysis.warnings.is_empty() {
        out.line("", "");
        out.list("Warnings", &analysis.warnings.iter().map(|w| clean(w)).collect::<Vec<_>>());
    }
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
        let room = self.width.saturating_sub(indent.chars().count()).max(10);
        let mut current = String::new();
        for word in text.split(' ') {
            let longer = current.chars().count() + 1 + word.chars().count();
            if !current.is_empty() && longer > room {
                self.line(style, &format!("{indent}{current}"));
                current.clear();
            }
            if !current.is_empty() {
                current.push(' ');
            }
            current.push_str(word);
        }
        self.line(style, &format!("{indent}{current}"));
    }

    fn table(&mut self, columns: &[Column], rows: &[Vec<String>]) {
        for (index, line) in lines(columns, rows, self.width - 2).iter().enumerate() {
            self.line(if index == 0 { DIM } else { "" }, &format!("  {line}"));
        }
    }

    fn list(&mut self, heading: &str, items: &[String]) {
        self.line(YELLOW, &format!("{heading} ({})", items.len()));
        for item in items.iter().take(LIST_LIMIT) {
            self.wrapped("", "  ", item);
        }
        if items.len() > LIST_LIMIT {
            self.line(DIM, &format!("  and {} more", items.len() - LIST_LIMIT));
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
        self.line(DIM, &format!("  {source}{truth}"));
        self.fleet_table(flight);
        self.flock(flight);
        if let Some(map) = &flight.map {
            self.map(map);
        }
        self.drones(flight);
        if !flight.missing.is_empty() {
            let missing: Vec<String> = flight
                .missing
                .iter()
                .map(|missing| format!("slot {}: {}", missing.slot, clean(&missing.reason)))
                .collect();
            self.line("", "");
            self.list("  Missing drones", &missing);
        }
        let lost: Vec<String> = flight.lost.iter().map(|log| clean(&log.sentence())).collect();
        let doubts: Vec<String> = flight.warnings.iter().map(|doubt| clean(doubt)).collect();
        for (heading, items) in [("  Lost logs", lost), ("  Warnings", doubts)] {
            if !items.is_empty() {
                self.line("", "");
                self.list(heading, &items);
            }
        }
    }

    fn fleet_table(&mut self, flight: &FlightAnalysis) {
        if flight.table.is_empty() {
            return;
        }
        let columns = [
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
        let rows: Vec<Vec<String>> = flight
            .table
            .iter()
            .map(comparison)
            .map(|row| {
                vec![
                    row.law,
                    row.parameter,
                    row.fleet,
                    row.unit,
                    row.mean_se,
                    row.n.to_string(),
                    row.paper,
                    row.difference,
                    row.in_errors,
                ]
            })
            .collect();
        self.line("", "");
        self.table(&columns, &rows);
    }

    fn flock(&mut self, flight: &FlightAnalysis) {
        let laws = flock_lines(flight);
        if laws.is_empty() {
            return;
        }
        self.line("", "");
        self.line(DIM, "  all drones averaged (flock mapping)");
        for (law, line) in laws {
            self.wrapped("", "  ", &format!("{law}: {line}"));
        }
    }

    fn drones(&mut self, flight: &FlightAnalysis) {
        let columns = [
            column("slot", Align::Right, 0),
            column("name", Align::Left, 3),
            column("A", Align::Right, 1),
            column("u₀", Align::Right, 2),
            column("W*", Align::Right, 0),
            column("χ²/ν", Align::Right, 6),
            column("A′", Align::Right, 0),
            column("u₀ (linear)", Align::Right, 5),
            column("windows", Align::Right, 4),
            column("clock", Align::Left, 7),
            column("notes", Align::Left, 0),
        ];
        // In a measurement the map says it all; only what is doubtful is worth a line.
        let fitted = flight.drones.iter().any(|drone| drone.laws.is_some());
        let calibration = fitted || flight.purpose == Purpose::Calibration;
        let all = calibration && flight.drones.len() <= DRONE_LIMIT;
        let rows: Vec<Vec<String>> = flight
            .drones
            .iter()
            .map(|drone| (drone, flags(drone)))
            .filter(|(_, flags)| all || !flags.is_empty())
            .take(DRONE_LIMIT)
            .map(|(drone, flags)| {
                let laws = drone_laws(drone);
                vec![
                    drone.slot.map_or_else(|| NONE.to_owned(), |slot| slot.to_string()),
                    shortened(&drone.name, 16),
                    laws.a,
                    laws.u0,
                    laws.w,
                    laws.chi2,
                    laws.slope,
                    laws.linear_u0,
                    if drone.windows.is_empty() { NONE.to_owned() } else { windows_used(drone) },
                    clock(drone).to_owned(),
                    flags.join("; "),
                ]
            })
            .collect();
        if flight.drones.is_empty() {
            self.line("", "");
            self.line(YELLOW, "  No drone of this flight could be analysed.");
        }
        if !rows.is_empty() {
            self.line("", "");
            if !all {
                let n = flight.drones.len();
                let more = if calibration { "; all are in the report" } else { "" };
                self.line(DIM, &format!("  {} of {n} drones have notes{more}", rows.len()));
            }
            self.table(&columns, &rows);
        }
        if calibration && !fitted && flight.flock.is_none() {
            self.line(YELLOW, "  No laws were fitted in this flight.");
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
                "vertical air speed W*, m/s: mean {}, s.d. between {} {}, from {} to {} ({} law)",
                signed(air.mean, 3),
                count(air.n, "drone"),
                fixed(air.sd, 3),
                signed(air.lowest, 2),
                signed(air.highest, 2),
                clean(&map.law),
            ),
        );
        if let Some(rms) = air.rms_error {
            let known = map.drones.iter().filter(|drone| mean_truth(drone).is_some()).count();
            self.line(
                "",
                &format!(
                    "  rms error against the truth: {} m/s ({})",
                    fixed(rms, 3),
                    count(known, "drone")
                ),
            );
        }
        self.grid(map, air.lowest.abs().max(air.highest.abs()));
    }

    /// The map as numbers, forward up and left to the left; nothing where places form no small grid.
    fn grid(&mut self, map: &UpdraftMap, largest: f64) {
        let placed: Vec<([i64; 2], f64, String)> = map
            .drones
            .iter()
            .filter_map(|drone| {
                let [x, y] = drone.position_m.filter(|p| usable(p[0]) && usable(p[1]))?;
                let cell = [(x * 2.0).round() as i64, (y * 2.0).round() as i64];
                usable(drone.mean.value)
                    .then(|| (cell, drone.mean.value, signed(drone.mean.value, 2)))
            })
            .collect();
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
        self.line(DIM, "  seen from above, forward is up; · where there is no data");
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

fn column(head: &'static str, align: Align, drop: u8) -> Column {
    Column { head, align, drop }
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
