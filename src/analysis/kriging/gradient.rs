//! The gradient of the air that was in the drones' own calibrations.
//!
//! A field that is longer than the fleet is wide leaves a plane in the constants of its drones, not a constant of each drone's
//! own. Taken for many independent constants it would seem to be air of the hover: shorter and more lasting than that is.

use nalgebra::{DMatrix, Matrix2, Matrix2xX};

use super::covariance::Covariance;

/// Drones that stand for all. Numerical.
const STAND_INS: usize = 25;
/// A fleet that is this much narrower one way than the other is a line: nothing is said across it. Numerical.
const NARROW: f64 = 1e-6;

/// What a plane has of the air that drones meet each alone.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Plane {
    /// Covariance of its slopes along x and y, 1/m², for air that has a variance of one about the fleet's mean.
    pub(super) slopes: Matrix2<f64>,
    /// Share of the variance that it explains.
    pub(super) share: f64,
}

impl Plane {
    /// In air of these covariances together, for drones at these places.
    pub(super) fn of(air: &[Covariance], homes_m: &[[f64; 2]]) -> Self {
        Self::found(air, homes_m).unwrap_or_default()
    }

    fn found(air: &[Covariance], homes_m: &[[f64; 2]]) -> Option<Self> {
        let count = homes_m.len().min(STAND_INS);
        let place = |index: usize| homes_m[index * homes_m.len() / count.max(1)];
        let mut at_m = Matrix2xX::from_fn(count, |axis, index| place(index)[axis]);
        let middle_m = at_m.column_mean();
        at_m.column_iter_mut().for_each(|mut at| at -= middle_m);
        let mut alone = DMatrix::from_fn(count, count, |row, column| {
            let apart_m = at_m.column(row) - at_m.column(column);
            air.iter().map(|part| part.instant([apart_m.x, apart_m.y, 0.0], 0.0)).sum()
        });
        let (of_each, all) = (alone.column_mean(), alone.mean());
        for row in 0..count {
            for column in 0..count {
                alone[(row, column)] += all - of_each[row] - of_each[column];
            }
        }
        let variance = alone.trace() / count as f64;
        let squares = &at_m * at_m.transpose();
        let fit = squares.pseudo_inverse(NARROW * squares.trace()).ok()? * &at_m;
        let slopes: Matrix2<f64> = &fit * alone * fit.transpose() / variance;
        let share = (squares * slopes).trace() / count as f64;
        let is_known =
            variance > 0.0 && share.is_finite() && slopes.iter().all(|it| it.is_finite());
        is_known.then_some(Self { slopes, share })
    }
}

#[cfg(test)]
mod tests {
    use super::super::calibration_tests::{air, homes_m};
    use super::*;

    fn in_field(length_m: f64, homes_m: &[[f64; 2]]) -> Plane {
        Plane::of(&[Covariance::new(air(length_m))], homes_m)
    }

    #[test]
    fn a_long_field_leaves_a_plane_and_a_short_one_does_not() {
        let long = in_field(200.0, &homes_m());
        assert!(long.share > 0.98, "{long:?}");
        // A plane of equal slopes both ways has the whole variance: 200 m² along each axis.
        let slope = long.slopes[(0, 0)];
        assert!((slope * 400.0 - long.share).abs() < 1e-6, "{long:?}");
        assert!(long.slopes[(0, 1)].abs() < 1e-9);
        let short = in_field(3.0, &homes_m());
        // Two of the 24 directions in which 25 drones differ.
        assert!((short.share - 2.0 / 24.0).abs() < 0.01, "{short:?}");
    }

    #[test]
    fn a_row_of_drones_says_nothing_across_it() {
        let row: Vec<[f64; 2]> = (0..9).map(|index| [10.0 * f64::from(index), 0.0]).collect();
        let plane = in_field(200.0, &row);
        assert!(plane.share > 0.95, "{plane:?}");
        assert_eq!(plane.slopes[(1, 1)], 0.0);
        assert_eq!(in_field(200.0, &row[..1]), Plane::default());
        assert_eq!(in_field(200.0, &[]), Plane::default());
    }
}
