//! Records with the correlation of the air, the drones' constants and the common errors taken out.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use crate::analysis::kriging::covariance::Covariance;
use crate::analysis::kriging::data::{COMMON, Rows};
use crate::analysis::kriging::neighbours::Neighbours;
use crate::analysis::kriging::vecchia::{Common, LEAST_OWN_MPS, Weights, weights};

/// What makes records of one air white.
pub(super) struct Whitening<'a> {
    neighbours: &'a Neighbours,
    weights: Vec<Weights>,
    /// Common errors and constants, each of standard deviation 1, in white records: a row for each value.
    nuisance: DMatrix<f64>,
    /// Factor of their information, with the prior.
    information: Cholesky<f64, Dyn>,
    /// Logarithm of a record's density, but for its square.
    ln_density: f64,
}

/// A record that was made white, with what its nuisances explain.
#[derive(Clone, Debug)]
pub(super) struct White {
    values: DVector<f64>,
    explained: DVector<f64>,
}

impl White {
    /// Product in which independent errors have a variance of 1.
    pub(super) fn dot(&self, other: &Self) -> f64 {
        self.values.dot(&other.values) - self.explained.dot(&other.explained)
    }
}

impl<'a> Whitening<'a> {
    /// Of the air of a covariance; `factor` is that of the common errors' prior, `own_mps` are the standard errors of the
    /// drones' constants. `None` where rounding leaves no positive definite covariance.
    pub(super) fn new(
        rows: &Rows,
        neighbours: &'a Neighbours,
        covariance: &Covariance,
        factor: &Common,
        own_mps: &[f64],
    ) -> Option<Self> {
        let weights: Vec<Weights> = neighbours
            .patterns
            .iter()
            .map(|pattern| weights(pattern, covariance, true))
            .collect::<Option<_>>()?;
        let columns = COMMON + own_mps.len();
        let mut raw = DMatrix::zeros(rows.list.len(), columns);
        for (index, row) in rows.list.iter().enumerate() {
            for column in 0..COMMON {
                raw[(index, column)] =
                    (0..COMMON).map(|inner| row.common[inner] * factor[(inner, column)]).sum();
            }
            let Some(drone) = row.spot.drone else { continue };
            raw[(index, COMMON + drone)] = own_mps[drone].max(LEAST_OWN_MPS);
        }
        let mut nuisance = DMatrix::zeros(rows.list.len(), columns);
        let mut ln_density = 0.0;
        for index in 0..rows.list.len() {
            let Weights { of, variance } = weights.get(neighbours.of[index])?;
            let inverse = 1.0 / variance.sqrt();
            ln_density += inverse.ln();
            for column in 0..columns {
                let mut value = raw[(index, column)];
                for (weight, near) in of.iter().zip(&neighbours.rows[index]) {
                    value -= weight * raw[(*near as usize, column)];
                }
                nuisance[(index, column)] = inverse * value;
            }
        }
        let information = nuisance.tr_mul(&nuisance) + DMatrix::identity(columns, columns);
        let information = information.cholesky()?;
        let ln_information: f64 =
            information.l_dirty().diagonal().iter().map(|value: &f64| value.ln()).sum();
        ln_density -= ln_information;
        Some(Self { neighbours, weights, nuisance, information, ln_density })
    }

    /// A record made white.
    pub(super) fn white(&self, record: &[f64]) -> White {
        let values = DVector::from_fn(record.len(), |index, _| {
            let Weights { of, variance } = &self.weights[self.neighbours.of[index]];
            let near = of.iter().zip(&self.neighbours.rows[index]);
            let expected: f64 = near.map(|(weight, near)| weight * record[*near as usize]).sum();
            (record[index] - expected) / variance.sqrt()
        });
        let mut explained = self.nuisance.tr_mul(&values);
        self.information.l_dirty().solve_lower_triangular_mut(&mut explained);
        White { values, explained }
    }

    /// Logarithm of the density of a record, but for a constant.
    pub(super) fn log_density(&self, record: &White) -> f64 {
        self.ln_density - 0.5 * record.dot(record)
    }
}
