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
const STRENGTHS: [(f64, f64); 5] = [(0.45, 0.1), (0.7, 0.2), (1.0, 0.4), (1.4, 0.2), (2.0, 0.1)];
/// How much longer the air is in height than on the level, with weights: turbulence is alike in all
/// directions, thermals are tall.
const TALLER: [(f64, f64); 2] = [(1.0, 0.5), (4.0, 0.5)];
/// White scatter of the windows' averages besides their noise, us. A grid.
const WHITES_US: [f64; 3] = [0.1, 0.5, 2.0];
/// Pairs of drones whose distances stand for those of all.
const PAIRS: usize = 24;

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

/// The windows of a calibration with where the drones were.
pub(in super::super) struct Calibration<'a> {
    windows: &'a Windows,
    /// Distances of pairs of drones, m.
    pairs_m: Vec<[f64; 2]>,
    /// Drones in a window, on average.
    drones: f64,
}

impl<'a> Calibration<'a> {
    /// `homes_m` are the drones' places on the level.
    pub(in super::super) fn new(windows: &'a Windows, homes_m: &[[f64; 2]]) -> Self {
        let mut pairs_m: Vec<[f64; 2]> = Vec::new();
        for (index, one) in homes_m.iter().enumerate() {
            for other in &homes_m[index + 1..] {
                pairs_m.push([one[0] - other[0], one[1] - other[1]]);
            }
        }
        pairs_m.sort_by(|a, b| a[0].hypot(a[1]).total_cmp(&b[0].hypot(b[1])));
        let step = (pairs_m.len() as f64 / PAIRS as f64).max(1.0);
        let chosen = (0..PAIRS).map(|index| ((index as f64 + 0.5) * step) as usize);
        let pairs_m = chosen.filter_map(|index| pairs_m.get(index).copied()).collect();
        let members = windows.cells.iter().map(|cell| cell.drones as f64);
        Self { windows, pairs_m, drones: crate::numeric::mean(members).unwrap_or(1.0).max(1.0) }
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
        let dt = one.time_s - other.time_s;
        let dz = (one.height_m - other.height_m) / taller;
        let own = covariance.field([0.0, 0.0, dz], dt);
        let gusts = covariance.gusts(dt);
        if self.pairs_m.is_empty() {
            return (own + gusts, 0.0);
        }
        let mut sum = 0.0;
        for [x, y] in &self.pairs_m {
            sum +=
                0.5 * (covariance.field([*x, *y, dz], dt) + covariance.field([-*x, -*y, dz], dt));
        }
        let apart = sum / self.pairs_m.len() as f64;
        let share = 1.0 / self.drones;
        (share * (own + gusts) + (1.0 - share) * apart, (own + gusts - apart).max(0.0))
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
    pub(super) fn known(&self, air: &[Covariance]) -> Option<Component> {
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
