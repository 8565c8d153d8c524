//! The air between the drones: a grid at the fleet's height, every 10 s.

use super::data::Drone;
use super::predict::{Known, Model};
use crate::analysis::running::RUNNING_S;
use crate::numeric::{extent, median};

/// A cell is half of what drones are apart: finer shows nothing that the drones do not. Convention.
const CELL_SHARE: f64 = 0.5;
/// Cells in a row at most: more is finer than a screen shows. Convention.
const MOST_CELLS: usize = 96;
/// What is known less well than this share of what nobody knows is left out; a zero that is not known well hides no pattern.
/// Convention.
const KNOWN_SHARE: f64 = 0.9;

/// A grid of means over 10 s with standard deviations.
#[derive(Clone, Debug, Default, PartialEq)]
pub(in super::super) struct Grid {
    /// Columns, show frame, m.
    pub(in super::super) x_m: Vec<f64>,
    /// Rows, m.
    pub(in super::super) y_m: Vec<f64>,
    /// Height above home, m.
    pub(in super::super) height_m: f64,
    /// Seconds of the record.
    pub(in super::super) seconds: Vec<usize>,
    /// By second, row and column, m/s; `None`: not known.
    pub(in super::super) mean_mps: Vec<Vec<Vec<Option<f64>>>>,
    /// Standard deviations likewise, m/s.
    pub(in super::super) sd_mps: Vec<Vec<Vec<Option<f64>>>>,
}

impl Grid {
    /// Adds to the value of each cell that is known at each second, m/s.
    pub(super) fn add(&mut self, by_mps: impl Fn([f64; 3], usize) -> f64) {
        for (second, rows) in self.seconds.iter().zip(&mut self.mean_mps) {
            for (y_m, row) in self.y_m.iter().zip(rows) {
                for (x_m, value) in self.x_m.iter().zip(row) {
                    if let Some(value) = value {
                        *value += by_mps([*x_m, *y_m, self.height_m], *second);
                    }
                }
            }
        }
    }

    /// Widens standard deviations by how far another of the same cells is off.
    pub(super) fn widen(&mut self, other: &Self) {
        let own = self.mean_mps.iter().flatten().flatten();
        let sds = self.sd_mps.iter_mut().flatten().flatten();
        let there = other.mean_mps.iter().flatten().flatten();
        for ((value, sd), there) in own.zip(sds).zip(there) {
            if let (Some(value), Some(sd), Some(there)) = (value, sd, there) {
                *sd = sd.hypot(there - value);
            }
        }
    }
}

/// The grid over the drones and the places without a log; `None` where drones move, or stand in one place.
pub(super) fn grid(model: &Model<'_>, lost_m: &[[f64; 3]], first: usize) -> Option<Grid> {
    if !model.drones.iter().all(Drone::hovers) {
        return None;
    }
    let places_m: Vec<[f64; 3]> = model
        .drones
        .iter()
        .filter_map(|drone| drone.place_at(0))
        .chain(lost_m.iter().copied())
        .collect();
    let cell_m = CELL_SHARE * apart_m(&places_m)?;
    let axis = |axis: usize| {
        let (low, high) = extent(places_m.iter().map(|place| place[axis]))?;
        // Half a distance beyond the outermost drones.
        let count = (((high - low) / cell_m).round() as usize + 3).min(MOST_CELLS);
        let step = (high - low + 2.0 * cell_m) / (count - 1) as f64;
        Some((0..count).map(|index| low - cell_m + step * index as f64).collect::<Vec<f64>>())
    };
    let (x_m, y_m) = (axis(0)?, axis(1)?);
    let height_m = median(places_m.iter().map(|place| place[2]).collect())?;
    let cells: Vec<[f64; 3]> =
        y_m.iter().flat_map(|y| x_m.iter().map(move |x| [*x, *y, height_m])).collect();
    let over = model.over(&cells, first, RUNNING_S as usize);
    let unknown_mps = model.unknown_mps();
    let mut grid = Grid { x_m, y_m, height_m, ..Grid::default() };
    for (second, values) in over {
        let known = |value: &Option<Known>| {
            value.filter(|known| known.local_mps2 < (KNOWN_SHARE * unknown_mps).powi(2))
        };
        let rows = |of: fn(Known) -> f64| -> Vec<Vec<Option<f64>>> {
            values
                .chunks(grid.x_m.len())
                .map(|row| row.iter().map(|value| known(value).map(of)).collect())
                .collect()
        };
        let (mean_mps, sd_mps) = (rows(|known| known.mean_mps), rows(|known| known.sd_mps));
        grid.seconds.push(second);
        grid.mean_mps.push(mean_mps);
        grid.sd_mps.push(sd_mps);
    }
    Some(grid)
}

/// How far a drone is from its nearest neighbour, m: the median.
fn apart_m(places_m: &[[f64; 3]]) -> Option<f64> {
    let nearest = places_m.iter().enumerate().filter_map(|(index, one)| {
        let others = places_m.iter().enumerate().filter(|(other, _)| *other != index);
        others
            .map(|(_, other)| (one[0] - other[0]).hypot(one[1] - other[1]))
            .filter(|apart| *apart > 0.1)
            .reduce(f64::min)
    });
    median(nearest.collect())
}
