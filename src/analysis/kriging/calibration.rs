//! The zero of a map by its calibration, in air of given scales.
//!
//! The windows of a calibration follow the fleet's law in air that has the scales which the hover shows.
//! How strong it was on that occasion, how fast it changes with height, and how much the windows scatter
//! besides is left open within bounds.

use nalgebra::{DMatrix, DVector};

use super::covariance::{Air, Covariance};
use crate::analysis::air_prior::Gls;
use crate::analysis::shape::PARAMETERS;
use crate::analysis::zero::{CellAt, Windows};

/// How much stronger the air of the calibration may have been than that of the hover, with weights: hours
/// apart the air differs by such factors. Chosen.
const STRENGTHS: [(f64, f64); 3] = [(0.6, 0.25), (1.0, 0.5), (1.7, 0.25)];
/// How much longer the air is in height than on the level, with weights: turbulence is alike in all
/// directions, thermals are tall.
const TALLER: [(f64, f64); 2] = [(1.0, 0.5), (4.0, 0.5)];
/// White scatter of the windows' averages besides their noise, us. A grid.
const WHITES_US: [f64; 3] = [0.3, 1.0, 3.0];
/// Drones that stand for all.
const STAND_INS: usize = 6;
/// Nodes of the mean over a window, as shares of its length from its middle on (Gauss and Legendre).
const NODES: [f64; 2] = [-0.288_675_135, 0.288_675_135];

/// Weight of each pair of them.
const WEIGHT: f64 = 0.25;

/// The law of the fleet in air of one kind.
#[derive(Clone, Debug)]
pub(super) struct Component {
    /// Parameters less those that the values were made with.
    pub(super) shift: [f64; PARAMETERS],
    /// Their covariance.
    pub(super) covariance: DMatrix<f64>,
    /// Logarithm of the likelihood of the windows with the choice's own weight.
    pub(super) log_weight: f64,
}

impl CellAt {
    /// Time and height at a share of the window's length from its middle on.
    fn at(&self, share: f64) -> (f64, f64) {
        let by_s = share * self.span_s;
        (self.time_s + by_s, self.height_m + by_s * self.climb_mps)
    }
}

/// The windows of a calibration with where the drones were.
pub(in super::super) struct Calibration<'a> {
    windows: &'a Windows,
    /// From each of some drones to each other of them, m: the covariance of *their* average is one, however the air
    /// drifts, which a choice of pairs would not give.
    pairs_m: Vec<[f64; 2]>,
    /// How many these are.
    stand_ins: f64,
    /// Drones in a window, on average.
    drones: f64,
}

impl<'a> Calibration<'a> {
    /// `homes_m` are the drones' places on the level.
    pub(in super::super) fn new(windows: &'a Windows, homes_m: &[[f64; 2]]) -> Self {
        let count = homes_m.len().min(STAND_INS);
        // Spread over the list, and by no step that follows the rows of a grid.
        let chosen =
            (0..count).map(|index| (index as f64 * homes_m.len() as f64 / count as f64) as usize);
        let stand_ins: Vec<[f64; 2]> =
            chosen.filter_map(|index| homes_m.get(index).copied()).collect();
        let mut pairs_m: Vec<[f64; 2]> = Vec::new();
        for (index, one) in stand_ins.iter().enumerate() {
            for other in &stand_ins[index + 1..] {
                pairs_m.push([one[0] - other[0], one[1] - other[1]]);
            }
        }
        let members = windows.cells.iter().map(|cell| cell.drones as f64);
        Self {
            windows,
            pairs_m,
            stand_ins: count.max(1) as f64,
            drones: crate::numeric::mean(members).unwrap_or(1.0).max(1.0),
        }
    }

    /// Covariance of the averages over drones of the air in two windows, (m/s)²; and of one drone's own
    /// deviation from them.
    fn air(
        &self,
        covariance: &Covariance,
        one: &CellAt,
        other: &CellAt,
        taller: f64,
    ) -> (f64, f64) {
        let gusts = covariance.gusts(one.time_s - other.time_s);
        let over = |x_m: f64, y_m: f64| {
            let mut sum = 0.0;
            for at in NODES {
                for other_at in NODES {
                    let (time_s, height_m) = one.at(at);
                    let (other_s, other_m) = other.at(other_at);
                    let apart_m = [x_m, y_m, (height_m - other_m) / taller];
                    sum += WEIGHT * covariance.instant(apart_m, time_s - other_s);
                }
            }
            sum
        };
        let own = over(0.0, 0.0);
        if self.pairs_m.is_empty() {
            return (own + gusts, 0.0);
        }
        let both = |[x_m, y_m]: &[f64; 2]| {
            let there = over(*x_m, *y_m);
            there + if covariance.is_reversible() { there } else { over(-x_m, -y_m) }
        };
        let each = self.pairs_m.iter().map(both);
        let shared = (own * self.stand_ins + each.sum::<f64>()) / self.stand_ins.powi(2);
        (shared + gusts / self.drones, own + gusts - shared)
    }

    /// The fleet's law under all that is left open in air of these scales.
    pub(super) fn components(&self, air: &Air) -> Vec<Component> {
        let covariance = Covariance::new(*air);
        let cells = &self.windows.cells;
        let mut found = Vec::new();
        for (taller, tall_weight) in TALLER {
            let shared = DMatrix::from_fn(cells.len(), cells.len(), |row, column| {
                if column > row {
                    0.0
                } else {
                    self.air(&covariance, &cells[row], &cells[column], taller).0
                }
            });
            for (strength, weight) in STRENGTHS {
                for white_us in WHITES_US {
                    let air = |row: usize, column: usize| {
                        strength * strength * shared[(row.max(column), row.min(column))]
                    };
                    found.extend(self.component(air, white_us, (weight * tall_weight).ln()));
                }
            }
        }
        found
    }

    /// The fleet's law in air of known scales, alike in all directions and as strong as they say.
    pub(super) fn known(&self, air: &[Air]) -> Option<Component> {
        let air: Vec<Covariance> = air.iter().copied().map(Covariance::new).collect();
        let cells = &self.windows.cells;
        let shared = |row: usize, column: usize| {
            air.iter().map(|part| self.air(part, &cells[row], &cells[column], 1.0).0).sum()
        };
        self.component(shared, WHITES_US[0], 0.0)
    }

    /// The fleet's law in air with a covariance between windows; `None` where they do not determine it.
    fn component(
        &self,
        air: impl Fn(usize, usize) -> f64,
        white_us: f64,
        ln_weight: f64,
    ) -> Option<Component> {
        let Windows { record, parameters, .. } = self.windows;
        let Gls { gain, covariance, log_likelihood } = record.fit_in(air, white_us)?;
        let law = gain * &record.pulse_us;
        let mut shift = [0.0; PARAMETERS];
        shift
            .iter_mut()
            .zip(law.iter().zip(parameters))
            .for_each(|(shift, (law, used))| *shift = law - used);
        Some(Component { shift, covariance, log_weight: log_likelihood + ln_weight })
    }

    /// Standard error of one drone's constant against the fleet's by air that it met alone, us.
    pub(super) fn own_us(&self, air: &Air) -> f64 {
        let covariance = Covariance::new(*air);
        let Windows { record, cells, .. } = self.windows;
        let alone =
            |row: usize, column: usize| self.air(&covariance, &cells[row], &cells[column], 1.0).1;
        let fit = record.fit_in(alone, WHITES_US[1]);
        fit.map_or(0.0, |fit| fit.covariance[(0, 0)].max(0.0).sqrt())
    }
}

/// A factor `L` of a covariance, `L L'`, that need not be positive definite.
pub(super) fn factor(covariance: &DMatrix<f64>) -> DMatrix<f64> {
    let eigen = covariance.clone().symmetric_eigen();
    let roots = eigen.eigenvalues.map(|value| value.max(0.0).sqrt());
    &eigen.eigenvectors * DMatrix::from_diagonal(&DVector::from_column_slice(roots.as_slice()))
}
