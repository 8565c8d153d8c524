//! Windows of a fleet split into averages over drones and the drones' deviations from them.

use std::collections::BTreeMap;

use crate::numeric::{Line, mean};

use super::corrections::DOUBTS;
use super::shape::Shape;

/// No mean of a window is known better, us: a floor for simulated flights without noise. Chosen.
pub(super) const LEAST_NOISE_US: f64 = 0.1;
/// Rounds of the separation into fleet and drones. Numerical.
const ROUNDS: usize = 12;
/// Windows whose times differ by more belong to groups that fly apart, s: half a leg. Convention.
const SAME_TIME_S: f64 = 5.0;
/// Averages over drones of what was flown at the same time.
pub(super) struct Cell {
    pub(super) time_s: f64,
    pub(super) velocity_mps: f64,
    pub(super) members: Vec<usize>,
}

fn cells(points: &[WindowPoint]) -> (Vec<Cell>, Vec<usize>) {
    let mut found: BTreeMap<&(String, usize), Vec<usize>> = BTreeMap::new();
    let mut cells: Vec<Cell> = Vec::new();
    let mut cell_of = Vec::new();
    for (index, point) in points.iter().enumerate() {
        let same = found.entry(&point.key).or_default();
        let near = |cell: &&usize| (cells[**cell].time_s - point.time_s).abs() < SAME_TIME_S;
        let cell = same.iter().find(near).copied().unwrap_or_else(|| {
            same.push(cells.len());
            cells.push(Cell { time_s: point.time_s, velocity_mps: 0.0, members: Vec::new() });
            cells.len() - 1
        });
        cells[cell].members.push(index);
        cell_of.push(cell);
    }
    for cell in &mut cells {
        let velocities = cell.members.iter().map(|index| points[*index].velocity_mps);
        cell.velocity_mps = mean(velocities).unwrap_or_default();
    }
    (cells, cell_of)
}

/// Splits values of the points into averages of cells and a constant and slope for each drone.
pub(super) struct Split {
    pub(super) drones: usize,
    pub(super) cells: Vec<Cell>,
    pub(super) cell_of: Vec<usize>,
    /// What a drone's slope is multiplied with, less its mean over the drone's points.
    pub(super) own: Vec<f64>,
}

pub(super) struct Parts {
    pub(super) cells: Vec<f64>,
    /// Constant (at the mean of the drone's speeds) and slope.
    pub(super) drones: Vec<[f64; 2]>,
}

impl Split {
    pub(super) fn new(shape: Shape, points: &[WindowPoint], drones: usize) -> Self {
        let (cells, cell_of) = cells(points);
        let own = points.iter().map(|point| shape.own(point.velocity_mps)).collect();
        Self { drones, cells, cell_of, own }
    }

    /// Alternating least squares; deviations of the drones have the mean zero.
    pub(super) fn of(&self, points: &[WindowPoint], values: &[f64]) -> Parts {
        let mut parts =
            Parts { cells: vec![0.0; self.cells.len()], drones: vec![[0.0; 2]; self.drones] };
        for _ in 0..ROUNDS {
            for (cell, average) in self.cells.iter().zip(&mut parts.cells) {
                let rest = |index: &usize| {
                    let [constant, slope] = parts.drones[points[*index].drone];
                    values[*index] - constant - slope * self.own[*index]
                };
                *average = mean(cell.members.iter().map(rest)).unwrap_or_default();
            }
            let mut sums = vec![[0.0; 5]; self.drones];
            for (index, point) in points.iter().enumerate() {
                let rest = values[index] - parts.cells[self.cell_of[index]];
                let x = self.own[index];
                let sum = &mut sums[point.drone];
                for (sum, term) in sum.iter_mut().zip([1.0, x, x * x, rest, x * rest]) {
                    *sum += term;
                }
            }
            let mut flown: Vec<usize> = Vec::new();
            for (drone, [n, x, xx, y, xy]) in sums.iter().enumerate() {
                let determinant = n * xx - x * x;
                parts.drones[drone] = if determinant > 1e-9 {
                    let slope = (n * xy - x * y) / determinant;
                    [(y - slope * x) / n, slope]
                } else {
                    [if *n > 0.0 { y / n } else { 0.0 }, 0.0]
                };
                if *n > 0.0 {
                    flown.push(drone);
                }
            }
            for part in 0..2 {
                let deviations = flown.iter().map(|drone| parts.drones[*drone][part]);
                let average = mean(deviations).unwrap_or_default();
                for drone in &flown {
                    parts.drones[*drone][part] -= average;
                }
            }
        }
        parts
    }
}

/// One usable window of one drone, referred.
#[derive(Clone, Debug)]
pub(super) struct WindowPoint {
    /// Index of the drone.
    pub(super) drone: usize,
    /// What was commanded, and its count among equals: the same for all drones of the fleet.
    pub(super) key: (String, usize),
    /// Middle of the window, show time, s.
    pub(super) time_s: f64,
    /// Length of the window, s.
    pub(super) span_s: f64,
    /// Mean height above home, m.
    pub(super) height_m: f64,
    pub(super) velocity_mps: f64,
    pub(super) pulse_us: f64,
    /// Standard error of pulse and velocity together, us.
    pub(super) noise_us: f64,
    pub(super) doubts_us: [f64; DOUBTS],
}

/// Slope of an unweighted line through the points, us per unit of the shape's second term.
pub(super) fn rough_slope(split: &Split, points: &[WindowPoint]) -> f64 {
    let line = Line::through(points.iter().zip(&split.own).map(|(point, x)| (*x, point.pulse_us)));
    line.filter(|line| line.xx > 1e-9).map_or(0.0, |line| line.slope())
}

pub(super) fn noise_us(points: &[WindowPoint], members: &[usize]) -> f64 {
    let squares: f64 =
        members.iter().map(|i| points[*i].noise_us.max(LEAST_NOISE_US).powi(2)).sum();
    squares.sqrt() / members.len() as f64
}

pub(super) fn rough_sensitivity(shape: Shape, rough: f64, air_mps: f64) -> f64 {
    match shape {
        Shape::Line => rough,
        Shape::SignedQuadratic => 2.0 * rough * air_mps.abs(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn air_moves_a_pulse_by_the_slope_of_its_law() {
        for shape in [Shape::Line, Shape::SignedQuadratic] {
            for air_mps in [-3.0, -0.5, 0.4, 2.0] {
                let moved = |by_mps| shape.pulse_us(&[1540.0, 25.0, 0.0, 0.0], air_mps + by_mps);
                let per_mps = (moved(1e-4) - moved(-1e-4)) / 2e-4;
                let sensitivity = rough_sensitivity(shape, 25.0, air_mps);
                assert!((sensitivity - per_mps).abs() < 1e-3, "{shape:?} at {air_mps}");
            }
        }
    }
}
