//! Cells of a table that are numbers, and cannot be what their column says.
//!
//! A rotor that stands, a counter that has run over and a code for "no value" are numbers: one of them in ten thousand would
//! move the noise, the level or the windows of the whole flight. They are no measurement, as an empty cell is none.

use crate::numeric::median;

/// A rotor effort is not above this many times its median: chosen, no flight is.
const MOST_TIMES: f64 = 3.0;
/// Where more than this share of the cells is so high, the median is that of a drone at rest, and they are its flight.
const MOST_SHARE: f64 = 0.1;
/// A column that is 0 or less in more than this share of the rows in which another one is above is of a rotor that
/// stands, or that is not measured: its other cells are no flight of that drone either.
const DEAD_SHARE: f64 = 0.5;
/// No drone and no air is faster, m/s.
const FASTEST_MPS: f64 = 100.0;

/// What a channel's cells are.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Effort,
    Velocity,
}

/// A column without a rotor effort, while the others have one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Dead {
    /// Number of the column in its channel, from 0.
    pub(super) column: usize,
    /// Rows in which it is 0 or less.
    pub(super) standing: usize,
    /// Rows in which another column is above 0.
    pub(super) turning: usize,
}

/// The cells of a channel, in our unit, row by row.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Cells {
    kind: Kind,
    /// Values of all columns, one row after the other.
    pub(super) values: Vec<f64>,
    /// Line of each row in the file, from 1.
    pub(super) lines: Vec<u64>,
}

impl Cells {
    /// Those of a channel by its name in mappings; `None`: any number can be one.
    pub(super) fn of(channel: &str) -> Option<Self> {
        let kind = match channel {
            "effort" => Kind::Effort,
            "velocity_up" | "command_up" | "truth" => Kind::Velocity,
            _ => return None,
        };
        Some(Self { kind, values: Vec::new(), lines: Vec::new() })
    }

    /// The first column of a rotor effort that is none in most of the rows in which the others are one.
    pub(super) fn dead(&self, columns: usize) -> Option<Dead> {
        if self.kind != Kind::Effort || columns < 2 {
            return None;
        }
        let look = |column: usize| {
            let (mut standing, mut turning) = (0, 0);
            for row in self.values.chunks_exact(columns) {
                let mut others = row.iter().enumerate().filter(|(index, _)| *index != column);
                if others.any(|(_, value)| *value > 0.0) {
                    turning += 1;
                    standing += usize::from(row.get(column).is_some_and(|value| *value <= 0.0));
                }
            }
            Dead { column, standing, turning }
        };
        let is_dead = |found: &Dead| found.standing as f64 > DEAD_SHARE * found.turning as f64;
        (0..columns).map(look).find(is_dead)
    }

    /// Whether each row has a cell that cannot be, and a sentence for each column and reason.
    pub(super) fn impossible(&self, channel: &str, columns: &[&str]) -> (Vec<bool>, Vec<String>) {
        let mut bad = vec![false; self.lines.len()];
        let mut told = Vec::new();
        for (column, name) in columns.iter().enumerate() {
            let values: Vec<f64> =
                self.values.iter().skip(column).step_by(columns.len()).copied().collect();
            let mut note = |found: &[usize], what: &str| {
                let Some(first) = found.first().and_then(|row| self.lines.get(*row)) else {
                    return;
                };
                for row in found {
                    if let Some(bad) = bad.get_mut(*row) {
                        *bad = true;
                    }
                }
                let (count, are) = match found.len() {
                    1 => ("1 cell".to_owned(), "is"),
                    n => (format!("{n} cells"), "are"),
                };
                told.push(format!(
                    "{channel}: {count} of \"{name}\" {are} {what}, first in line {first}: left out"
                ));
            };
            let rows = |is: &dyn Fn(f64) -> bool| -> Vec<usize> {
                (0..values.len()).filter(|row| values.get(*row).copied().is_some_and(is)).collect()
            };
            match self.kind {
                Kind::Velocity => note(
                    &rows(&|value| value.abs() > FASTEST_MPS),
                    &format!("faster than {FASTEST_MPS:.0} m/s"),
                ),
                Kind::Effort => {
                    let middle = median(values.clone()).unwrap_or_default();
                    if middle > 0.0 {
                        note(&rows(&|value| value <= 0.0), "0 or less");
                        let high = rows(&|value| value > MOST_TIMES * middle);
                        if high.len() as f64 <= MOST_SHARE * values.len() as f64 {
                            note(
                                &high,
                                &format!("more than three times its median of {middle:.0}"),
                            );
                        }
                    }
                }
            }
        }
        (bad, told)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(channel: &str, values: Vec<f64>) -> (usize, Vec<String>) {
        let cells = Cells {
            lines: (2..).take(values.len() / 2).collect(),
            values,
            ..Cells::of(channel).unwrap()
        };
        let (bad, told) = cells.impossible(channel, &["a", "b"]);
        (bad.iter().filter(|bad| **bad).count(), told)
    }

    #[test]
    fn efforts_that_cannot_be_are_named_by_column_and_line() {
        let mut values = vec![5400.0; 80];
        values[1] = 65_535.0;
        values[5] = 1e9;
        values[6] = 0.0;
        values[20] = -5000.0;
        values[21] = 17_000.0;
        let (rows, said) = told("effort", values);
        assert_eq!(rows, 4, "one row has two of them");
        assert_eq!(
            said,
            [
                "effort: 2 cells of \"a\" are 0 or less, first in line 5: left out",
                "effort: 3 cells of \"b\" are more than three times its median of 5400, first in line 2: left out",
            ]
        );
    }

    #[test]
    fn a_table_that_is_mostly_of_a_drone_at_rest_keeps_its_flight() {
        let values: Vec<f64> = (0..80).map(|cell| if cell < 50 { 900.0 } else { 5400.0 }).collect();
        assert_eq!(told("effort", values), (0, Vec::new()));
        // Rotors that stand for most of the time have no median to go by.
        let values: Vec<f64> = (0..80).map(|cell| if cell < 50 { 0.0 } else { 5400.0 }).collect();
        assert_eq!(told("effort", values), (0, Vec::new()));
    }

    #[test]
    fn a_column_that_is_nothing_while_the_others_turn_is_dead() {
        let dead = |values: Vec<f64>| {
            let lines = (2..).take(values.len() / 2).collect();
            Cells { values, lines, ..Cells::of("effort").unwrap() }.dead(2)
        };
        let rows = |first: f64, second: f64| [first, second].repeat(40);
        let found = dead([rows(0.0, 0.0), rows(5400.0, 0.0)].concat());
        assert_eq!(
            found,
            Some(Dead { column: 1, standing: 40, turning: 40 }),
            "at rest both are 0"
        );
        assert_eq!(dead([rows(5400.0, 5300.0), rows(5400.0, 0.0)].concat()), None, "half of it");
        assert_eq!(dead(rows(0.0, 0.0)), None);
        let cells = Cells { values: vec![0.0; 40], ..Cells::of("effort").unwrap() };
        assert_eq!(cells.dead(1), None, "there is nothing beside it");
        let cells = Cells { values: rows(3.0, 0.0), ..Cells::of("velocity_up").unwrap() };
        assert_eq!(cells.dead(2), None, "velocities may be 0");
    }

    #[test]
    fn no_velocity_is_of_a_code_for_none() {
        let (rows, said) = told("velocity_up", vec![0.1, -9999.0, 3.0, -3.0]);
        assert_eq!(rows, 1);
        assert_eq!(
            said,
            ["velocity_up: 1 cell of \"b\" is faster than 100 m/s, first in line 2: left out"]
        );
        assert!(Cells::of("height").is_none(), "any height can be one");
    }
}
