//! Values of a map with what is uncertain about them, as the model of the air sees them.

use super::covariance::Spot;
use crate::analysis::corrections::DOUBTS;
use crate::analysis::shape::PARAMETERS;
use crate::numeric::mean;

/// Errors that all drones share: the parameters of the fleet's law, the doubts of the corrections, the gradient of the air
/// that was in the drones' own calibrations, and the updraft that is everywhere the same.
pub(super) const COMMON: usize = PARAMETERS + DOUBTS + 3;
/// First of the two places of the gradient of the drones' constants along x and y, m/s per m.
pub(super) const GRADIENT: usize = PARAMETERS + DOUBTS;
/// Place of the updraft that is everywhere the same.
pub(super) const UNIFORM: usize = COMMON - 1;

/// One value: the mean over the 10 s around a second.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in super::super) struct Value {
    /// Vertical air speed, m/s, up positive.
    pub(in super::super) updraft_mps: f64,
    /// What one unit of each of the fleet's law parameters adds to it, m/s.
    pub(in super::super) law: [f64; PARAMETERS],
    /// What one standard error of each doubt adds to it, m/s.
    pub(in super::super) doubts_mps: [f64; DOUBTS],
    /// Standard error by the drone's own part of its law, m/s.
    pub(in super::super) own_mps: f64,
    /// Standard error by noise of pulse and velocity, m/s.
    pub(in super::super) noise_mps: f64,
}

/// One drone's values.
#[derive(Clone, Debug, Default)]
pub(in super::super) struct Drone {
    /// Where it was at each second, show frame, m; for a hover always the same.
    pub(in super::super) place_m: Vec<[f64; 3]>,
    /// Where it hovered in its own calibration, show frame, m; none if it has the fleet's law.
    pub(in super::super) calibrated_m: Option<[f64; 2]>,
    /// Values at the seconds common to all drones.
    pub(in super::super) values: Vec<Option<Value>>,
    /// Standard error of the fleet's slope as a share of it.
    pub(in super::super) slope_share: f64,
    /// Standard error of its own slope against the fleet's, likewise.
    pub(in super::super) own_slope_share: f64,
}

/// One value as a row of the model.
#[derive(Clone, Copy, Debug)]
pub(super) struct Row {
    pub(super) spot: Spot,
    pub(super) value_mps: f64,
    pub(super) common: [f64; COMMON],
    pub(super) noise_mps: f64,
}

/// Values that share no second: one in each 10 s of each drone.
#[derive(Clone, Debug, Default)]
pub(super) struct Rows {
    /// All of them, second by second.
    pub(super) list: Vec<Row>,
    /// Index of the drone's and the second's row.
    pub(super) place: Vec<Vec<Option<usize>>>,
    /// Seconds of the record that the rows are at.
    pub(super) seconds: Vec<usize>,
}

impl Rows {
    /// The rows at `first`, `first + step`, ... of the record.
    pub(super) fn of(drones: &[Drone], first: usize, step: usize) -> Self {
        let length = drones.iter().map(|drone| drone.values.len()).max().unwrap_or(0);
        let seconds: Vec<usize> = (first..length).step_by(step.max(1)).collect();
        let off_m = off_centre(drones);
        let mut list = Vec::new();
        let mut place = vec![vec![None; seconds.len()]; drones.len()];
        for (block, second) in seconds.iter().enumerate() {
            for (index, drone) in drones.iter().enumerate() {
                let value = drone.values.get(*second).copied().flatten();
                let Some((value, place_m)) = value.zip(drone.place_at(*second)) else { continue };
                let mut common = [0.0; COMMON];
                common[..PARAMETERS].copy_from_slice(&value.law);
                common[PARAMETERS..GRADIENT].copy_from_slice(&value.doubts_mps);
                common[GRADIENT..UNIFORM].copy_from_slice(&off_m[index]);
                common[UNIFORM] = 1.0;
                place[index][block] = Some(list.len());
                let velocity_mps = drone.velocity_at(*second);
                let time_s = *second as f64;
                let spot = Spot { place_m, time_s, drone: Some(index), velocity_mps };
                let noise_mps = value.noise_mps.max(LEAST_NOISE_MPS);
                list.push(Row { spot, value_mps: value.updraft_mps, common, noise_mps });
            }
        }
        Self { list, place, seconds }
    }
}

/// How far each drone was from the middle of the calibration, m; those with the fleet's law are at it.
fn off_centre(drones: &[Drone]) -> Vec<[f64; 2]> {
    let calibrated = || drones.iter().filter_map(|drone| drone.calibrated_m);
    let middle = [0, 1].map(|axis| mean(calibrated().map(|at| at[axis])).unwrap_or_default());
    let off = |at: [f64; 2]| [at[0] - middle[0], at[1] - middle[1]];
    drones.iter().map(|drone| drone.calibrated_m.map_or([0.0; 2], off)).collect()
}

/// No value is known better, m/s: quantization, and small effects that nothing here describes. Chosen.
const LEAST_NOISE_MPS: f64 = 0.005;

impl Drone {
    pub(super) fn place_at(&self, second: usize) -> Option<[f64; 3]> {
        self.place_m.get(second).or(self.place_m.last()).copied()
    }

    /// How fast it moves around a second, by its places 2 s before and after, m/s.
    pub(super) fn velocity_at(&self, second: usize) -> [f64; 3] {
        let Some(last) = self.place_m.len().checked_sub(1).filter(|last| *last > 0) else {
            return [0.0; 3];
        };
        let (from, to) = (second.saturating_sub(2).min(last), (second + 2).min(last));
        if from == to {
            return [0.0; 3];
        }
        [0, 1, 2]
            .map(|axis| (self.place_m[to][axis] - self.place_m[from][axis]) / (to - from) as f64)
    }

    /// Whether it stands still in the map.
    pub(super) fn hovers(&self) -> bool {
        self.place_m.len() == 1
    }

    /// Standard error by its own part of its law, m/s: the mean over its values.
    pub(super) fn own_mps(&self) -> f64 {
        mean(self.values.iter().flatten().map(|value| value.own_mps)).unwrap_or(0.0)
    }
}
