//! The likelihood of values of which no order makes a stationary record: drones that move, or whose records have gaps. Some
//! of the values, spread over all, are solved at once.

use nalgebra::DMatrix;

use super::covariance::Covariance;
use super::data::{COMMON, Row, Rows};
use super::vecchia::{Common, CommonVector, Parts, System};
use crate::numeric::cholesky;

/// The golden ratio's part after the point: multiples of it fill the unit interval evenly.
const GOLDEN: f64 = 0.618_033_988_749_895;

/// Lower triangle of the factor of the covariance of values, with their noise; `None` where rounding leaves none that is
/// positive definite.
pub(super) fn factor(rows: &[Row], covariance: &Covariance) -> Option<DMatrix<f64>> {
    let mut matrix = DMatrix::zeros(rows.len(), rows.len());
    for (column, one) in rows.iter().enumerate() {
        for (row, other) in rows.iter().enumerate().skip(column) {
            matrix[(row, column)] = covariance.of(&other.spot, &one.spot);
        }
        matrix[(column, column)] += one.noise_mps * one.noise_mps;
    }
    Some(cholesky(matrix)?.unpack())
}

/// Some of the values of a record.
#[derive(Clone, Debug)]
pub(super) struct Dense {
    rows: Vec<Row>,
}

impl Dense {
    /// At most so many values: the cost grows with the third power.
    pub(super) fn of(rows: &Rows, most: usize) -> Self {
        let share = most as f64 / rows.list.len().max(1) as f64;
        let is_kept = |index: usize| (index as f64 * GOLDEN).fract() < share;
        let kept =
            rows.list.iter().enumerate().filter(|(index, _)| share >= 1.0 || is_kept(*index));
        Self { rows: kept.map(|(_, row)| *row).collect() }
    }

    /// The likelihood with everything linear left open; `own_mps` are standard errors of all drones' constants. `None`
    /// where rounding leaves no positive definite covariance.
    pub(super) fn system(&self, covariance: &Covariance, own_mps: &[f64]) -> Option<System> {
        let factor = factor(&self.rows, covariance)?;
        let drones = own_mps.len();
        let mut white = DMatrix::zeros(self.rows.len(), 1 + COMMON + drones);
        for (index, row) in self.rows.iter().enumerate() {
            white[(index, 0)] = row.value_mps;
            for column in 0..COMMON {
                white[(index, 1 + column)] = row.common[column];
            }
            white[(index, 1 + COMMON + row.spot.drone.unwrap_or(0))] = 1.0;
        }
        factor.solve_lower_triangular_mut(&mut white);
        let (value, common) = (white.column(0), white.columns(1, COMMON));
        let own = white.columns(1 + COMMON, drones);
        let parts = Parts {
            information: Common::from_fn(|row, column| {
                common.column(row).dot(&common.column(column))
            }),
            score: CommonVector::from_fn(|row, _| common.column(row).dot(&value)),
            own: own.tr_mul(&own),
            own_common: own.tr_mul(&common),
            own_score: own.tr_mul(&value),
            squares: value.norm_squared(),
            ln_sd: factor.diagonal().iter().map(|sd| sd.ln()).sum(),
        };
        System::integrated(parts, own_mps)
    }
}
