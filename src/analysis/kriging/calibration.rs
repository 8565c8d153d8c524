//! The zero of a map by its calibration, in air of given scales.
//!
//! The windows of a calibration follow the fleet's law in air that has the scales which the hover shows.
//! How strong it was on that occasion, how fast it changes with height, and how much the windows scatter
//! besides is left open within bounds.

use nalgebra::{DMatrix, DVector, Matrix2};

use super::covariance::{Air, Covariance};
use super::gradient::Plane;
use super::scatter::Scatter;
use super::windows::{Between, Met, StandIns};
use crate::analysis::air_prior::Gls;
use crate::analysis::shape::PARAMETERS;
use crate::analysis::zero::{CellAt, Windows};
use crate::numeric::log_sum;

/// How much stronger the air of the calibration may have been than that of the hover, with weights: hours apart the air differs
/// by such factors, and a calm morning from a day with thermals by the small ones. From strong to weak. Chosen.
const STRENGTHS: [(f64, f64); 6] =
    [(1.7, 0.2), (1.0, 0.4), (0.6, 0.2), (0.2, 0.1), (0.06, 0.05), (0.02, 0.05)];
/// A strength is not asked for where the one before it explains the windows by so much less than the best, nats: they tell how
/// much the air changed, and the weaker it is said to be, the worse that gets.
const NOT_WEAKER_NATS: f64 = 12.0;
/// How much longer the air is in height than on the level, with weights: turbulence is alike in all
/// directions, thermals are tall. The first is alike.
const TALLER: [(f64, f64); 2] = [(1.0, 0.5), (4.0, 0.5)];
/// White scatter of the windows' averages besides their noise, us. A grid.
const WHITES_US: [f64; 4] = [0.1, 0.3, 1.0, 3.0];
/// The white scatter that a drone's own windows are given, us.
const OWN_WHITE_US: f64 = 1.0;
/// How far the pulse of a rotor is from the fleet's law in a climb, m/s (standard deviation): no rotor is a polynomial, and with
/// none of it half a microsecond that comes again at each speed is taken for air that changes within tens of metres of height.
/// Chosen, with [`MISFIT_CLIMB_MPS`]: on four calibrations of foreign rotors it explains 12 to 21 nats more than none in air of the
/// true length.
const MISFIT_MPS: f64 = 0.075;
/// Climb speeds that differ by this differ in it, m/s.
const MISFIT_CLIMB_MPS: f64 = 1.0;

/// The law of the fleet in air of one kind.
#[derive(Clone, Debug)]
pub(super) struct Component {
    /// Parameters less those that the values were made with.
    pub(super) shift: [f64; PARAMETERS],
    /// Their covariance.
    pub(super) covariance: DMatrix<f64>,
    /// Covariance of the gradient of the drones' constants along x and y, (m/s)²/m².
    pub(super) gradient: Matrix2<f64>,
    /// Logarithm of the likelihood of the windows with the choice's own weight.
    pub(super) log_weight: f64,
}

impl CellAt {
    /// Covariance of how far two windows are from the fleet's law by how fast they climb, (m/s)²; none in hover, since the zero
    /// is what the law has there.
    fn misfit(&self, other: &Self) -> f64 {
        let alike = |apart_mps: f64| (-0.5 * (apart_mps / MISFIT_CLIMB_MPS).powi(2)).exp();
        let (one, other) = (self.climb_mps, other.climb_mps);
        MISFIT_MPS * MISFIT_MPS * (alike(one - other) - alike(one) * alike(other))
    }
}

/// The windows of a calibration with where the drones were.
pub(in super::super) struct Calibration<'a> {
    windows: &'a Windows,
    stand_ins: StandIns,
    /// The windows in air of each of [`TALLER`].
    met: [Met; TALLER.len()],
    /// Where all drones were on the level, m.
    homes_m: &'a [[f64; 2]],
    /// Pulse per vertical air speed of the fleet, us/(m/s).
    slope: f64,
    /// How far windows are from the fleet's law by how fast they climb, (m/s)².
    misfit: DMatrix<f64>,
    /// How the drones' constants scatter; `None` for too few drones.
    scatter: Option<Scatter>,
}

impl<'a> Calibration<'a> {
    /// `homes_m` are the drones' places on the level, `slope` is the pulse per vertical air speed, us/(m/s).
    pub(in super::super) fn new(windows: &'a Windows, homes_m: &'a [[f64; 2]], slope: f64) -> Self {
        let cells = &windows.cells;
        let misfit = DMatrix::from_fn(cells.len(), cells.len(), |row, column| {
            cells[row].misfit(&cells[column])
        });
        let members = cells.iter().map(|cell| cell.drones as f64);
        let drones = crate::numeric::mean(members).unwrap_or(1.0).max(1.0);
        let stand_ins = StandIns::of(homes_m, drones);
        Self {
            windows,
            met: TALLER.map(|(taller, _)| Met::of(cells, &stand_ins, taller)),
            stand_ins,
            homes_m,
            slope: slope.max(1.0),
            misfit,
            scatter: None,
        }
    }

    /// With the constants of the drones' own laws and where they were flown, us and m.
    pub(in super::super) fn with_constants(self, constants_us: &[([f64; 2], f64)]) -> Self {
        let constants_mps: Vec<([f64; 2], f64)> =
            constants_us.iter().map(|(home_m, us)| (*home_m, us / self.slope)).collect();
        Self { scatter: Scatter::of(&constants_mps), ..self }
    }

    /// Logarithm of the likelihood of the drones' constants where air that each met alone adds so much to their variance, (m/s)².
    fn scatters(&self, by_air: f64) -> f64 {
        self.scatter.map_or(0.0, |scatter| scatter.ln_likelihood(by_air))
    }

    /// The air between the windows, alike in all directions.
    fn between(&self, covariance: &Covariance) -> Between {
        let [alike, ..] = &self.met;
        alike.between(covariance, &self.stand_ins)
    }

    /// The fleet's law under all that is left open in air of these scales.
    pub(super) fn components(&self, air: &Air) -> Vec<Component> {
        let covariance = Covariance::new(*air);
        let plane = Plane::of(&[covariance], self.homes_m);
        let mut found = Vec::new();
        for (met, (_, tall_weight)) in self.met.iter().zip(TALLER) {
            let air = met.between(&covariance, &self.stand_ins);
            let mut best = f64::NEG_INFINITY;
            for (strength, weight) in STRENGTHS {
                let ln_weight = (weight * tall_weight).ln();
                let these = self.of_strength(&air, strength, &plane, ln_weight);
                let most = these.iter().map(|one| one.log_weight).fold(f64::NEG_INFINITY, f64::max);
                best = best.max(most);
                found.extend(these);
                if most < best - NOT_WEAKER_NATS {
                    break;
                }
            }
        }
        found
    }

    /// The fleet's law in air that is so many times as strong, with each white scatter of the windows that they determine it with.
    fn of_strength(
        &self,
        air: &Between,
        strength: f64,
        plane: &Plane,
        ln_weight: f64,
    ) -> Vec<Component> {
        let of = |white_us| self.component(air, strength, plane, white_us, ln_weight);
        WHITES_US.into_iter().filter_map(of).collect()
    }

    /// The fleet's law in air of known scales, alike in all directions and as strong as they say.
    pub(super) fn known(&self, air: &[Air]) -> Option<Component> {
        let air: Vec<Covariance> = air.iter().copied().map(Covariance::new).collect();
        let mut all = Between::none(self.windows.cells.len());
        for part in &air {
            let Between { shared, by_field, by_gusts } = self.between(part);
            all.shared += shared;
            all.by_field += by_field;
            all.by_gusts += by_gusts;
        }
        self.component(&all, 1.0, &Plane::of(&air, self.homes_m), WHITES_US[0], 0.0)
    }

    /// The fleet's law in air that is so many times as strong; `None` where the windows do not determine it.
    fn component(
        &self,
        air: &Between,
        strength: f64,
        plane: &Plane,
        white_us: f64,
        ln_weight: f64,
    ) -> Option<Component> {
        let Windows { record, parameters, .. } = self.windows;
        let square = strength * strength;
        let shared = |row, column| square * air.shared[(row, column)] + self.misfit[(row, column)];
        let fit = record.fit_in(shared, white_us)?;
        let by_field = square * self.by_air_us2(&fit, &air.by_field) / self.slope.powi(2);
        let gradient = plane.slopes * by_field;
        let ln_scatter = self.scatters(by_field * (1.0 - plane.share));
        let Gls { gain, covariance, log_likelihood } = fit;
        let law = gain * &record.pulse_us;
        let mut shift = [0.0; PARAMETERS];
        shift
            .iter_mut()
            .zip(law.iter().zip(parameters))
            .for_each(|(shift, (law, used))| *shift = law - used);
        Some(Component {
            shift,
            covariance,
            gradient,
            log_weight: log_likelihood + ln_scatter + ln_weight,
        })
    }

    /// Variance of the constant that a fit gives by air between windows, us².
    fn by_air_us2(&self, fit: &Gls, air: &DMatrix<f64>) -> f64 {
        let Windows { record, cells, .. } = self.windows;
        let answers = DVector::from_fn(cells.len(), |window, _| {
            fit.gain[(0, window)] * record.sensitivity[window]
        });
        answers.dot(&(air * &answers)).max(0.0)
    }

    /// Standard error of one drone's constant by air that it met alone, against the fleet's constant and the plane over all
    /// drones' places, m/s.
    pub(super) fn own_mps(&self, air: &Air) -> f64 {
        let covariance = Covariance::new(*air);
        let air = self.between(&covariance);
        let alone = |row, column| air.by_field[(row, column)] + air.by_gusts[(row, column)];
        let own = self.windows.record.fit_in(alone, OWN_WHITE_US).map(|fit| {
            let plane = Plane::of(&[covariance], self.homes_m);
            let square = self.slope.powi(2);
            let of = |air: &DMatrix<f64>| self.by_air_us2(&fit, air) / square;
            let (all, by_field, by_gusts) =
                (fit.covariance[(0, 0)] / square, of(&air.by_field), of(&air.by_gusts));
            let beside = by_field * (1.0 - plane.share);
            let strength2 = self.mean_square_strength(&air, &plane, beside);
            all - by_field - by_gusts + strength2 * (beside + by_gusts)
        });
        own.map_or(0.0, |square| square.max(0.0).sqrt())
    }

    /// Mean square of the strength of the calibration's air, by how much it changed between the windows and by how the drones'
    /// constants scatter, where air as strong as the hover's adds so much to their variance, (m/s)².
    fn mean_square_strength(&self, air: &Between, plane: &Plane, by_air: f64) -> f64 {
        let weighed = STRENGTHS.map(|(strength, weight)| {
            let square: f64 = strength * strength;
            let by_windows = self.of_strength(air, strength, plane, weight.ln());
            let ln = if by_windows.is_empty() {
                weight.ln() + self.scatters(square * by_air)
            } else {
                log_sum(by_windows.iter().map(|one| one.log_weight))
            };
            (square, ln)
        });
        let most = weighed.iter().map(|(_, ln)| *ln).fold(f64::NEG_INFINITY, f64::max);
        let (mut sum, mut all) = (0.0, 0.0);
        for (square, ln) in weighed {
            let weight = (ln - most).exp();
            sum += weight * square;
            all += weight;
        }
        sum / all
    }
}

/// A factor `L` of a covariance, `L L'`, that need not be positive definite.
pub(super) fn factor(covariance: &DMatrix<f64>) -> DMatrix<f64> {
    let eigen = covariance.clone().symmetric_eigen();
    let roots = eigen.eigenvalues.map(|value| value.max(0.0).sqrt());
    &eigen.eigenvectors * DMatrix::from_diagonal(&DVector::from_column_slice(roots.as_slice()))
}
