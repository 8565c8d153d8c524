//! The likelihood of values by their neighbours, and what it says about everything linear: errors that
//! all drones share and constants of their own.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn, SMatrix, SVector};
use rayon::prelude::*;

use super::covariance::Covariance;
use super::data::{COMMON, Rows};
use super::neighbours::{Neighbours, Pattern};
use super::pairs::Pairs;
use crate::numeric::Banded;

/// Square matrix over the common errors.
pub(super) type Common = SMatrix<f64, COMMON, COMMON>;
/// Vector over the common errors.
pub(super) type CommonVector = SVector<f64, COMMON>;

/// A drone's own constant is not known better than this, m/s. Numerical.
pub(super) const LEAST_OWN_MPS: f64 = 2e-3;

/// What the values around a place say about it.
#[derive(Clone, Debug)]
pub(super) struct Weights {
    pub(super) of: Vec<f64>,
    /// Variance that is left, (m/s)².
    pub(super) variance: f64,
}

/// Weights of a pattern, for its target's value or (without noise) the air itself; `None` where rounding leaves no positive definite covariance.
pub(super) fn weights(pattern: &Pattern, pairs: &Pairs<'_>, with_noise: bool) -> Option<Weights> {
    let Pattern { target, neighbours, target_noise_mps, noise_mps } = pattern;
    let n = neighbours.len();
    let own = if with_noise {
        pairs.of_values(target, target) + target_noise_mps * target_noise_mps
    } else {
        pairs.with_air(target, target)
    };
    if n == 0 {
        return Some(Weights { of: Vec::new(), variance: own });
    }
    let mut matrix = DMatrix::zeros(n, n);
    for row in 0..n {
        for column in 0..row {
            let value = pairs.of_values(&neighbours[row], &neighbours[column]);
            matrix[(row, column)] = value;
            matrix[(column, row)] = value;
        }
        matrix[(row, row)] =
            pairs.of_values(&neighbours[row], &neighbours[row]) + noise_mps[row] * noise_mps[row];
    }
    let to = DVector::from_fn(n, |row, _| {
        if with_noise {
            pairs.of_values(target, &neighbours[row])
        } else {
            pairs.with_air(target, &neighbours[row])
        }
    });
    let of = matrix.cholesky()?.solve(&to);
    let variance = own - of.dot(&to);
    (variance > 0.0).then(|| Weights { of: of.as_slice().to_vec(), variance })
}

/// Sums over values that were made white: what they say about everything linear.
#[derive(Clone, Debug)]
pub(super) struct Parts {
    /// Products of the common errors, and with the values.
    pub(super) information: Common,
    pub(super) score: CommonVector,
    /// Products of the drones' constants, with the common errors and with the values.
    pub(super) own: DMatrix<f64>,
    pub(super) own_common: DMatrix<f64>,
    pub(super) own_score: DVector<f64>,
    /// Of the values.
    pub(super) squares: f64,
    /// Of the logarithms of what values were divided by.
    pub(super) ln_sd: f64,
}

impl Parts {
    pub(super) fn new(drones: usize) -> Self {
        Self {
            information: Common::zeros(),
            score: CommonVector::zeros(),
            own: DMatrix::zeros(drones, drones),
            own_common: DMatrix::zeros(drones, COMMON),
            own_score: DVector::zeros(drones),
            squares: 0.0,
            ln_sd: 0.0,
        }
    }
}

/// More drones than this are solved by bands: their constants are coupled with those of drones nearby.
const BANDED: usize = 256;

/// The factor of the information about drones' constants.
#[derive(Clone, Debug)]
enum Constants {
    Dense(Cholesky<f64, Dyn>),
    Banded(Banded),
}

impl Constants {
    fn factor(information: DMatrix<f64>) -> Option<Self> {
        if information.nrows() > BANDED {
            return Banded::factor(&information).map(Self::Banded);
        }
        information.cholesky().map(Self::Dense)
    }

    fn ln_diagonal(&self) -> f64 {
        match self {
            Self::Dense(factor) => {
                factor.l_dirty().diagonal().iter().map(|value: &f64| value.ln()).sum()
            }
            Self::Banded(factor) => factor.ln_diagonal(),
        }
    }

    fn solve(&self, right: &DMatrix<f64>) -> DMatrix<f64> {
        match self {
            Self::Dense(factor) => factor.solve(right),
            Self::Banded(factor) => factor.solve(right),
        }
    }

    fn solve_vector(&self, right: &DVector<f64>) -> DVector<f64> {
        match self {
            Self::Dense(factor) => factor.solve(right),
            Self::Banded(factor) => {
                let solved =
                    factor.solve(&DMatrix::from_column_slice(right.len(), 1, right.as_slice()));
                solved.column(0).into_owned()
            }
        }
    }

    fn inverse(&self) -> DMatrix<f64> {
        match self {
            Self::Dense(factor) => factor.inverse(),
            Self::Banded(factor) => factor.inverse(),
        }
    }
}

/// The likelihood with everything linear left open.
#[derive(Clone, Debug)]
pub(super) struct System {
    /// Logarithm of the likelihood at no common error, with the drones' own constants integrated out.
    log_likelihood: f64,
    /// Information about the common errors, with the constants integrated out.
    information: Common,
    /// Its product with the best values.
    score: CommonVector,
    /// The drones' constants: factor of their information with the prior, its product with the common errors, and its
    /// score.
    own: Constants,
    own_common: DMatrix<f64>,
    own_score: DVector<f64>,
}

/// Common errors after the values were seen.
#[derive(Clone, Debug)]
pub(super) struct Posterior {
    pub(super) mean: CommonVector,
    pub(super) covariance: Common,
    /// Logarithm of the values' likelihood.
    pub(super) log_likelihood: f64,
}

impl System {
    /// Of rows with their neighbours before them. `own_mps` are standard errors of the drones' constants.
    pub(super) fn new(
        rows: &Rows,
        neighbours: &Neighbours,
        covariance: &Covariance,
        own_mps: &[f64],
    ) -> Option<Self> {
        let pairs = Pairs::of(covariance, rows);
        let weights: Option<Vec<Weights>> =
            neighbours.patterns.par_iter().map(|pattern| weights(pattern, &pairs, true)).collect();
        let weights = weights?;
        let mut parts = Parts::new(own_mps.len());
        let mut constants: Vec<(usize, f64)> = Vec::new();
        for (index, row) in rows.list.iter().enumerate() {
            let Weights { of, variance } = weights.get(neighbours.of[index])?;
            let inverse = 1.0 / variance.sqrt();
            parts.ln_sd -= inverse.ln();
            let mut value = row.value_mps;
            let mut common = row.common;
            constants.clear();
            constants.push((row.spot.drone.unwrap_or(0), inverse));
            for (weight, near) in of.iter().zip(&neighbours.rows[index]) {
                let near = &rows.list[*near as usize];
                value -= weight * near.value_mps;
                for (own, other) in common.iter_mut().zip(&near.common) {
                    *own -= weight * other;
                }
                let drone = near.spot.drone.unwrap_or(0);
                let by = -weight * inverse;
                match constants.iter_mut().find(|(known, _)| *known == drone) {
                    Some((_, factor)) => *factor += by,
                    None => constants.push((drone, by)),
                }
            }
            value *= inverse;
            let common = CommonVector::from(common) * inverse;
            parts.squares += value * value;
            parts.information.ger(1.0, &common, &common, 1.0);
            parts.score.axpy(value, &common, 1.0);
            for (drone, factor) in &constants {
                parts.own_score[*drone] += factor * value;
                for column in 0..COMMON {
                    parts.own_common[(*drone, column)] += factor * common[column];
                }
                for (other, other_factor) in &constants {
                    parts.own[(*drone, *other)] += factor * other_factor;
                }
            }
        }
        Self::integrated(parts, own_mps)
    }

    /// With the drones' constants of these standard errors integrated out.
    pub(super) fn integrated(parts: Parts, own_mps: &[f64]) -> Option<Self> {
        let Parts { information, score, mut own, own_common, own_score, squares, mut ln_sd } =
            parts;
        for (drone, sd) in own_mps.iter().enumerate() {
            let sd = sd.max(LEAST_OWN_MPS);
            own[(drone, drone)] += 1.0 / (sd * sd);
            ln_sd += sd.ln();
        }
        let own = Constants::factor(own)?;
        let ln_own = own.ln_diagonal();
        let solved = own.solve(&own_common);
        let information = information
            - Common::from_fn(|row, column| own_common.column(row).dot(&solved.column(column)));
        let score = score - CommonVector::from_fn(|row, _| solved.column(row).dot(&own_score));
        let squares = squares - own_score.dot(&own.solve_vector(&own_score));
        let log_likelihood = -ln_sd - 0.5 * squares - ln_own;
        log_likelihood.is_finite().then_some(Self {
            log_likelihood,
            information,
            score,
            own,
            own_common,
            own_score,
        })
    }

    /// The common errors with a prior: their expected values, and a factor `L` of their covariance `L L'`.
    pub(super) fn posterior(&self, mean: &CommonVector, factor: &Common) -> Option<Posterior> {
        let pulled = self.score - self.information * mean;
        let inner = factor.transpose() * self.information * factor + Common::identity();
        let cholesky = inner.cholesky()?;
        let score = factor.transpose() * pulled;
        let solved = cholesky.solve(&score);
        let ln_inner: f64 =
            cholesky.l_dirty().diagonal().iter().map(|value: &f64| value.ln()).sum();
        let at_mean = self.score.dot(mean) - 0.5 * mean.dot(&(self.information * mean));
        let log_likelihood = self.log_likelihood + at_mean + 0.5 * score.dot(&solved) - ln_inner;
        Some(Posterior {
            mean: mean + factor * solved,
            covariance: factor * cholesky.inverse() * factor.transpose(),
            log_likelihood,
        })
    }

    /// The drones' own constants where the common errors are known, and how they answer these (negated), m/s.
    pub(super) fn own(&self) -> (DVector<f64>, DMatrix<f64>) {
        (self.own.solve_vector(&self.own_score), self.own.solve(&self.own_common))
    }

    /// Covariance of the constants where the common errors are known, (m/s)².
    pub(super) fn own_covariance(&self) -> DMatrix<f64> {
        self.own.inverse()
    }
}

/// Values less what their neighbours say, in standard deviations: independent and of variance 1 if the covariance is the
/// air's.
pub(super) fn innovations(
    rows: &Rows,
    neighbours: &Neighbours,
    covariance: &Covariance,
    values_mps: &[f64],
) -> Vec<f64> {
    let pairs = Pairs::of(covariance, rows);
    let weights: Vec<Option<Weights>> =
        neighbours.patterns.par_iter().map(|pattern| weights(pattern, &pairs, true)).collect();
    (0..rows.list.len())
        .map(|index| {
            let Some(weights) = &weights[neighbours.of[index]] else { return f64::NAN };
            let near = weights.of.iter().zip(&neighbours.rows[index]);
            let expected: f64 =
                near.map(|(weight, near)| weight * values_mps[*near as usize]).sum();
            (values_mps[index] - expected) / weights.variance.sqrt()
        })
        .collect()
}
