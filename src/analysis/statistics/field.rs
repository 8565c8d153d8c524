//! The map of the air as the statistics see it: drones by whole seconds, with gaps.

use std::collections::BTreeSet;

use nalgebra::DMatrix;

use super::result::FieldRecord;
use super::words;
use crate::numeric::{self, Line, least};

/// Shorter records say nothing about correlations, s: a few of the shortest time scales. Chosen.
pub(super) const SHORTEST_S: usize = 60;
/// Fewer drones than this have no statistics in space.
pub(super) const FEWEST_DRONES: usize = 3;
/// More drones than this are thinned: costs grow with their cube.
const MOST_DRONES: usize = 144;
/// Longer records are cut: two hours.
const LONGEST_S: usize = 7200;
/// A drone with a smaller share of the record's seconds than this is left out. Chosen.
const LEAST_SHARE: f64 = 0.5;
/// A drone whose values differ by less than this is a constant, m/s.
const CONSTANT_MPS: f64 = 1e-6;

/// The vertical air speed at several places, at whole seconds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FieldInput {
    /// Nominal place of each drone in the show frame, m.
    pub places_m: Vec<[f64; 2]>,
    /// Values of each drone, at seconds common to all, m/s, up positive; `None` in gaps.
    pub values_mps: Vec<Vec<Option<f64>>>,
    /// Length of the running mean that the values went through, s (1: none).
    pub running_s: usize,
}

/// The usable part of a [`FieldInput`].
#[derive(Clone, Debug)]
pub(super) struct Field {
    /// Places, m.
    pub(super) places: Vec<[f64; 2]>,
    /// One row of seconds for each drone; NaN in gaps.
    pub(super) rows: Vec<Vec<f64>>,
    /// Seconds.
    pub(super) seconds: usize,
    /// Length of the running mean, s.
    pub(super) running: usize,
}

impl Field {
    /// The usable part, with a sentence for everything that was left out; or why there is none.
    pub(super) fn new(input: &FieldInput, notes: &mut Vec<String>) -> Result<Self, String> {
        let longest = input.values_mps.iter().map(Vec::len).max().unwrap_or(0);
        let seconds = longest.min(LONGEST_S);
        if seconds < longest {
            notes.push(format!("statistics are of the first {LONGEST_S} s of {longest} s"));
        }
        if seconds < SHORTEST_S {
            return Err(format!(
                "no correlations: the record has {seconds} s, and {SHORTEST_S} s are the least that \
                 could say anything (hover longer)"
            ));
        }
        let (mut places, mut rows) = (Vec::new(), Vec::new());
        let (mut constant, mut sparse, mut nowhere) = (0, 0, 0);
        for (place, values) in input.places_m.iter().zip(&input.values_mps) {
            if !place.iter().all(|metres| metres.is_finite()) {
                nowhere += 1;
                continue;
            }
            let mut row: Vec<f64> = values
                .iter()
                .take(seconds)
                .map(|value| value.filter(|value| value.is_finite()).unwrap_or(f64::NAN))
                .collect();
            row.resize(seconds, f64::NAN);
            let known = || row.iter().copied().filter(|value| value.is_finite());
            let (count, spread) = (
                known().count(),
                known().fold(f64::MIN, f64::max) - known().fold(f64::MAX, f64::min),
            );
            if (count as f64) < LEAST_SHARE * seconds as f64 {
                sparse += 1;
            } else if spread < CONSTANT_MPS {
                constant += 1;
            } else {
                places.push(*place);
                rows.push(row);
            }
        }
        if nowhere > 0 {
            notes.push(format!(
                "{} whose place is not known {} not in the correlations (give the plan)",
                words::drones(nowhere),
                words::are(nowhere)
            ));
        }
        if sparse > 0 {
            notes.push(format!(
                "{} with values in less than half of the {seconds} s {} not in the correlations",
                words::drones(sparse),
                words::are(sparse)
            ));
        }
        if constant > 0 {
            notes.push(format!(
                "{} whose value never changes {} not in the correlations",
                words::drones(constant),
                words::are(constant)
            ));
        }
        if rows.len() < FEWEST_DRONES {
            return Err(format!(
                "no correlations: {} with a known place and a value that changes, and {FEWEST_DRONES} are the least \
                 that could say anything",
                words::drones(rows.len())
            ));
        }
        let field = Self { places, rows, seconds, running: input.running_s.max(1) }.thinned(notes);
        if field.extent_m() < 0.1 {
            return Err("no correlations: all drones are in one place".to_owned());
        }
        Ok(field)
    }

    /// At most [`MOST_DRONES`]: every second (third, ...) row and column of a grid.
    fn thinned(self, notes: &mut Vec<String>) -> Self {
        let all = self.places.len();
        if all <= MOST_DRONES {
            return self;
        }
        let ranks = |axis: usize| {
            let cells: BTreeSet<i64> =
                self.places.iter().map(|place| (place[axis] * 2.0).round() as i64).collect();
            let cells: Vec<i64> = cells.into_iter().collect();
            let rank = |place: &[f64; 2]| {
                cells.binary_search(&((place[axis] * 2.0).round() as i64)).unwrap_or(0)
            };
            self.places.iter().map(rank).collect::<Vec<usize>>()
        };
        let (x, y) = (ranks(0), ranks(1));
        let kept = |step: usize| -> Vec<usize> {
            (0..all)
                .filter(|drone| {
                    [&x, &y]
                        .iter()
                        .all(|ranks| ranks.get(*drone).is_some_and(|rank| rank % step == 0))
                })
                .collect()
        };
        let on_grid =
            (2..=all).map(kept).find(|kept| kept.len() <= MOST_DRONES).unwrap_or_default();
        let chosen = if on_grid.len() >= MOST_DRONES / 8 {
            on_grid
        } else {
            (0..all).step_by(all.div_ceil(MOST_DRONES)).collect()
        };
        notes.push(format!("correlations are of {} of {all} drones, evenly chosen", chosen.len()));
        let pick =
            |index: &usize| Some((*self.places.get(*index)?, self.rows.get(*index)?.clone()));
        let (places, rows) = chosen.iter().filter_map(pick).unzip();
        Self { places, rows, ..self }
    }

    /// Number of drones.
    pub(super) fn drones(&self) -> usize {
        self.places.len()
    }

    fn distances(&self) -> impl Iterator<Item = f64> + '_ {
        self.places.iter().enumerate().flat_map(|(index, one)| {
            let others = self.places.get(index + 1..).unwrap_or_default();
            others.iter().map(|other| (one[0] - other[0]).hypot(one[1] - other[1]))
        })
    }

    /// Largest distance of two drones, m.
    pub(super) fn extent_m(&self) -> f64 {
        self.distances().fold(0.0, f64::max)
    }

    /// Smallest distance of two drones that are not in the same place, m.
    pub(super) fn spacing_m(&self) -> f64 {
        least(self.distances().filter(|distance| *distance > 0.01)).unwrap_or(f64::INFINITY)
    }

    /// Mean over the drones at each second; NaN where there is none.
    fn common(&self) -> Vec<f64> {
        (0..self.seconds)
            .map(|second| mean(self.rows.iter().filter_map(|row| row.get(second).copied())))
            .collect()
    }

    /// Each drone's straight line over time taken out.
    pub(super) fn detrended(&self) -> Self {
        let rows = self.rows.iter().map(|row| without_line(row)).collect();
        Self { rows, ..self.clone() }
    }

    /// The mean of all drones at each second taken out.
    pub(super) fn without_common(&self) -> Self {
        // Each about its own mean first: else a gap of one drone would step the mean of all.
        let mut centred = self.clone();
        for row in &mut centred.rows {
            let middle = mean(row.iter().copied());
            for value in row.iter_mut() {
                *value -= middle;
            }
        }
        let common = centred.common();
        for row in &mut centred.rows {
            row.iter_mut().zip(&common).for_each(|(value, common)| *value -= common);
        }
        centred
    }

    /// One column of seconds for each drone; NaN in gaps.
    pub(super) fn columns(&self) -> DMatrix<f64> {
        let value = |second: usize, drone: usize| {
            self.rows.get(drone).and_then(|row| row.get(second)).copied().unwrap_or(f64::NAN)
        };
        DMatrix::from_fn(self.seconds, self.drones(), value)
    }

    /// What the data are.
    pub(super) fn record(&self) -> FieldRecord {
        let known = |row: &Vec<f64>| row.iter().filter(|value| value.is_finite()).count();
        let count: usize = self.rows.iter().map(known).sum();
        let variance = mean(self.rows.iter().map(|row| sd(row).powi(2)));
        FieldRecord {
            drones: self.drones(),
            length_s: self.seconds as f64,
            missing_share: 1.0 - count as f64 / (self.drones() * self.seconds) as f64,
            running_mean_s: self.running as f64,
            spacing_m: self.spacing_m(),
            extent_m: self.extent_m(),
            sd_mps: variance.sqrt(),
            common_sd_mps: sd(&self.common()),
        }
    }
}

/// Mean of what is finite; NaN of nothing.
pub(super) fn mean(values: impl Iterator<Item = f64>) -> f64 {
    numeric::mean(values.filter(|value| value.is_finite())).unwrap_or(f64::NAN)
}

/// Standard deviation (divided by n) of what is finite.
pub(super) fn sd(values: &[f64]) -> f64 {
    let middle = mean(values.iter().copied());
    mean(values.iter().map(|value| (value - middle).powi(2))).sqrt()
}

fn without_line(row: &[f64]) -> Vec<f64> {
    let points = || row.iter().enumerate().map(|(second, value)| (second as f64, *value));
    let Some(line) = Line::through(points().filter(|(_, value)| value.is_finite())) else {
        return row.to_vec();
    };
    let slope = if line.xx > 0.0 { line.slope() } else { 0.0 };
    let [time, level] = line.mean;
    points().map(|(second, value)| value - level - slope * (second - time)).collect()
}
