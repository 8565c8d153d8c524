//! Records with the correlation of the air, the drones' constants and the common errors taken out: all values of a short
//! record at once, each value of a longer one by its neighbours.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use rayon::prelude::*;

use crate::analysis::kriging::covariance::Covariance;
use crate::analysis::kriging::data::{COMMON, Rows};
use crate::analysis::kriging::dense::factor;
use crate::analysis::kriging::neighbours::Neighbours;
use crate::analysis::kriging::pairs::Pairs;
use crate::analysis::kriging::vecchia::{Common, LEAST_OWN_MPS, Weights, weights};

/// Records of more values than this are made white by neighbours. Numerical: the time grows with the third power, and a
/// record of 25 drones over 300 s has 750.
const MOST_AT_ONCE: usize = 800;

/// Records that are made white side by side: weights and places of a value's neighbours are looked up once for all of them.
const LANES: usize = 8;

/// What takes the correlation of the air out of a record.
enum Uncorrelated<'a> {
    /// The factor of the covariance of all values.
    All(DMatrix<f64>),
    /// The weights of each value's neighbours, and by pattern one over the standard deviation that they leave.
    Neighbours(&'a Neighbours, Vec<Weights>, Vec<f64>),
}

impl<'a> Uncorrelated<'a> {
    fn new(rows: &Rows, neighbours: &'a Neighbours, covariance: &Covariance) -> Option<Self> {
        if !Whitening::is_of_all(rows) {
            return Self::by_neighbours(rows, neighbours, covariance);
        }
        factor(&rows.list, covariance).map(Self::All)
    }

    fn by_neighbours(
        rows: &Rows,
        neighbours: &'a Neighbours,
        covariance: &Covariance,
    ) -> Option<Self> {
        let pairs = Pairs::of(covariance, rows);
        let each = neighbours.patterns.par_iter();
        let weights: Option<Vec<Weights>> =
            each.map(|pattern| weights(pattern, &pairs, true)).collect();
        let weights = weights?;
        let inverse = weights.iter().map(|weights| 1.0 / weights.variance.sqrt()).collect();
        Some(Self::Neighbours(neighbours, weights, inverse))
    }

    /// Logarithm of what records are divided by.
    fn ln_sd(&self) -> f64 {
        match self {
            Self::All(factor) => factor.diagonal().iter().map(|sd| sd.ln()).sum(),
            Self::Neighbours(neighbours, weights, _) => {
                let ln_sd: Vec<f64> = weights.iter().map(|one| 0.5 * one.variance.ln()).collect();
                neighbours.of.iter().map(|pattern| ln_sd[*pattern]).sum()
            }
        }
    }

    /// Records, each in a column.
    fn white(&self, mut raw: DMatrix<f64>) -> DMatrix<f64> {
        match self {
            Self::All(factor) => {
                factor.solve_lower_triangular_mut(&mut raw);
                raw
            }
            Self::Neighbours(neighbours, weights, inverse) => {
                let mut white = DMatrix::zeros(raw.nrows(), raw.ncols());
                let record = raw.nrows().max(1);
                let some = raw.as_slice().chunks(LANES * record);
                for (raw, white) in some.zip(white.as_mut_slice().chunks_mut(LANES * record)) {
                    let lanes = raw.len() / record;
                    let mut by_value = vec![[0.0; LANES]; record];
                    for (lane, raw) in raw.chunks_exact(record).enumerate() {
                        by_value.iter_mut().zip(raw).for_each(|(of, raw)| of[lane] = *raw);
                    }
                    for (index, own) in by_value.iter().enumerate() {
                        let pattern = neighbours.of[index];
                        let mut expected = [0.0; LANES];
                        let near = weights[pattern].of.iter().zip(&neighbours.rows[index]);
                        for (weight, near) in near {
                            let near = &by_value[*near as usize];
                            for lane in 0..LANES {
                                expected[lane] += weight * near[lane];
                            }
                        }
                        let inverse = inverse[pattern];
                        for lane in 0..lanes {
                            white[lane * record + index] = (own[lane] - expected[lane]) * inverse;
                        }
                    }
                }
                white
            }
        }
    }
}

/// What makes records of one air white.
pub(super) struct Whitening<'a> {
    uncorrelated: Uncorrelated<'a>,
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
    /// Whether all values of a record are made white at once.
    pub(super) fn is_of_all(rows: &Rows) -> bool {
        rows.list.len() <= MOST_AT_ONCE
    }

    /// Of the air of a covariance; `factor` is that of the common errors' prior, `own_mps` are the standard errors of the
    /// drones' constants. `None` where rounding leaves no positive definite covariance.
    pub(super) fn new(
        rows: &Rows,
        neighbours: &'a Neighbours,
        covariance: &Covariance,
        factor: &Common,
        own_mps: &[f64],
    ) -> Option<Self> {
        let uncorrelated = Uncorrelated::new(rows, neighbours, covariance)?;
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
        let nuisance = uncorrelated.white(raw);
        let information = nuisance.tr_mul(&nuisance) + DMatrix::identity(columns, columns);
        let information = information.cholesky()?;
        let ln_information: f64 =
            information.l_dirty().diagonal().iter().map(|value: &f64| value.ln()).sum();
        let ln_density = -uncorrelated.ln_sd() - ln_information;
        Some(Self { uncorrelated, nuisance, information, ln_density })
    }

    /// A record made white.
    pub(super) fn white(&self, record: &[f64]) -> White {
        self.all_white(DMatrix::from_column_slice(record.len(), 1, record)).swap_remove(0)
    }

    /// Several records made white, each in a column.
    pub(super) fn all_white(&self, records: DMatrix<f64>) -> Vec<White> {
        let values = self.uncorrelated.white(records);
        let mut explained = self.nuisance.tr_mul(&values);
        self.information.l_dirty().solve_lower_triangular_mut(&mut explained);
        let each = values.column_iter().zip(explained.column_iter());
        each.map(|(values, explained)| White {
            values: values.into_owned(),
            explained: explained.into_owned(),
        })
        .collect()
    }

    /// Logarithm of the density of a record, but for a constant.
    pub(super) fn log_density(&self, record: &White) -> f64 {
        self.ln_density - 0.5 * record.dot(record)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::kriging::covariance::Form;
    use crate::analysis::kriging::covariance::tests::air;
    use crate::analysis::kriging::data::{Drone, Value};
    use crate::analysis::kriging::neighbours::{Reach, before};

    #[test]
    fn records_side_by_side_are_made_white_as_each_alone() {
        let value = Value {
            updraft_mps: 0.3,
            law: std::array::from_fn(|_| 0.0),
            doubts_mps: std::array::from_fn(|_| 0.0),
            own_mps: 0.05,
            noise_mps: 0.04,
        };
        let drone = |index: u32| Drone {
            calibrated_m: None,
            place_m: vec![[12.0 * f64::from(index % 3), 15.0 * f64::from(index / 3), 40.0]],
            values: (0..120).map(|_| Some(value)).collect(),
            slope_share: 0.0,
            own_slope_share: 0.0,
        };
        let drones: Vec<Drone> = (0..6).map(drone).collect();
        let rows = Rows::of(&drones, 5, 10);
        let neighbours = before(&drones, &rows, Reach { beside: 3, step: 3, own: 2 });
        let covariance = Covariance::new(air(Form::Exponential));
        let uncorrelated = Uncorrelated::by_neighbours(&rows, &neighbours, &covariance).unwrap();
        let Uncorrelated::Neighbours(_, weights, inverse) = &uncorrelated else {
            panic!("by neighbours")
        };
        let n = rows.list.len();
        for columns in [1, LANES, LANES + 3, 2 * LANES] {
            let raw = DMatrix::from_fn(n, columns, |row, column| {
                (0.7 * row as f64 + 1.3 * column as f64).sin()
            });
            let white = uncorrelated.white(raw.clone());
            for (column, own) in raw.column_iter().enumerate() {
                let alone = uncorrelated.white(DMatrix::from_column_slice(n, 1, own.as_slice()));
                assert_eq!(white.column(column), alone.column(0), "{columns} {column}");
                for row in 0..n {
                    let pattern = neighbours.of[row];
                    let near = weights[pattern].of.iter().zip(&neighbours.rows[row]);
                    let expected: f64 =
                        near.map(|(weight, near)| weight * own[*near as usize]).sum();
                    let by_hand = (own[row] - expected) * inverse[pattern];
                    assert!((white[(row, column)] - by_hand).abs() < 1e-12);
                }
            }
        }
    }
}
