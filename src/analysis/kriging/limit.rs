//! The limit of a map: the best linear estimate of the air by somebody who knows the covariances of the air and of
//! all errors.
//!
//! It has the same values and the same calibration as the map, and nothing to find out: no scale, no form, no strength.
//! All values are solved at once. What remains is what noise, the calibration's own air and the drones' constants
//! leave. (Best linear unbiased prediction: Cressie, *Statistics for Spatial Data*, 3.2.)

use nalgebra::{DMatrix, DVector};

use super::covariance::{Air, Covariance};
use super::data::{COMMON, Drone, Row, Rows};
use super::make::{Input, prior_factor};
use super::pairs::Pairs;
use crate::analysis::running::RUNNING_S;
use crate::numeric::cholesky;

/// More values than this are thinned: the cost grows with the third power. Numerical.
const MOST: usize = 1500;

/// One value of the best estimate: index of the drone, second of the record, air in m/s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in super::super) struct Best {
    pub(in super::super) drone: usize,
    pub(in super::super) second: usize,
    pub(in super::super) updraft_mps: f64,
}

/// The best estimate with what it states of itself.
#[derive(Clone, Debug, PartialEq)]
pub(in super::super) struct Limit {
    pub(in super::super) values: Vec<Best>,
    /// Standard error of the mean of all values, m/s.
    pub(in super::super) mean_se_mps: f64,
}

/// The best linear estimate in air of known scales, the sum of independent parts, without a uniform updraft: one value in 10 s of each drone, or fewer.
/// `None` where the calibration does not determine the law, and for drones that move: what the correction by lean leaves along a
/// track has no covariance that anybody knows, and a smooth field that is known takes it for its own.
pub(in super::super) fn best(input: &Input<'_>, air: &[Air]) -> Option<Limit> {
    if !input.drones.iter().all(Drone::hovers) {
        return None;
    }
    let step = RUNNING_S as usize;
    let first = (input.seconds.saturating_sub(1) % step) / 2;
    let mut rows = Rows::of(input.drones, first, step);
    while rows.list.len() > MOST {
        let every = rows.list.len().div_ceil(MOST) * (rows.seconds.get(1)? - rows.seconds[0]);
        rows = Rows::of(input.drones, first, every);
    }
    let n = rows.list.len();
    let covariances: Vec<Covariance> = air.iter().copied().map(Covariance::new).collect();
    let component = input.calibration.known(air)?;
    let own_mps = air.iter().fold(0.0_f64, |sum, air| sum.hypot(input.calibration.own_mps(air)));
    let mut of_air = DMatrix::zeros(n, n);
    let pairs: Vec<Pairs<'_>> =
        covariances.iter().map(|covariance| Pairs::of_all(covariance, &rows)).collect();
    for (row, one) in rows.list.iter().enumerate() {
        for (column, other) in rows.list[..=row].iter().enumerate() {
            let value = pairs.iter().map(|air| air.of_values(&one.spot, &other.spot)).sum();
            of_air[(row, column)] = value;
            of_air[(column, row)] = value;
        }
    }
    let common = DMatrix::from_fn(n, COMMON, |row, column| rows.list[row].common[column]);
    let factor = prior_factor(Some(&component), false);
    let spread = &common * DMatrix::from_fn(COMMON, COMMON, |row, column| factor[(row, column)]);
    let mut of_values = &of_air + &spread * spread.transpose();
    let drone_of = |row: &Row| row.spot.drone.unwrap_or(usize::MAX);
    let constant_mps: Vec<f64> =
        input.drones.iter().map(|drone| drone.own_mps().max(own_mps)).collect();
    for row in 0..n {
        let drone = drone_of(&rows.list[row]);
        for column in 0..n {
            if drone_of(&rows.list[column]) == drone {
                of_values[(row, column)] += constant_mps.get(drone).map_or(0.0, |sd| sd * sd);
            }
        }
        of_values[(row, row)] += rows.list[row].noise_mps.powi(2);
    }
    let mean = DVector::from_fn(COMMON, |row, _| component.shift.get(row).copied().unwrap_or(0.0));
    let values = DVector::from_fn(n, |row, _| rows.list[row].value_mps) - common * mean;
    let of_values = cholesky(of_values)?;
    let of_mean = of_air.column_mean();
    let mean_variance = of_mean.mean() - of_mean.dot(&of_values.solve(&of_mean));
    let found = of_air * of_values.solve(&values);
    let best = rows.list.iter().zip(found.iter()).map(|(row, value)| Best {
        drone: drone_of(row),
        second: row.spot.time_s as usize,
        updraft_mps: *value,
    });
    Some(Limit { values: best.collect(), mean_se_mps: mean_variance.max(0.0).sqrt() })
}
