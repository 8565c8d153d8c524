//! Slow air during a calibration: how strong and how slow it was, and what that leaves open.
//!
//! Windows of a calibration follow a law that is linear in its parameters, plus `S W(t)` with the
//! sensitivity `S` of the pulse and the air `W`, a Gaussian process with the covariance
//! `sd² exp(-|dt|/tau)`, plus white scatter. Neither of the three scales is known: each
//! choice on a grid gives a generalized least squares fit and the likelihood of the windows
//! (restricted: the law's parameters are integrated out), which weighs it. Air that stays for longer
//! than the flight cannot be told from the law's constant, and this is how it gets into that
//! constant's error.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use rayon::prelude::*;

use crate::numeric::most;

/// Time scale that is most likely before the windows are seen, s: a few minutes, as over a field at show
/// heights (docs/physics.md, 5.3). Found by trial: 120 s before, chosen while looking at the coverage of
/// simulated campaigns (docs/errors.md). A shorter scale makes intervals of the zero narrower, as s sqrt(2
/// tau/T).
const USUAL_TAU_S: f64 = 150.0;
/// One standard deviation of its logarithm: a factor of 2.2. Chosen, with the same campaigns.
const TAU_SPREAD: f64 = 0.8;
/// Above this, strong air is taken to be less and less likely, m/s: twice that of a field day. Chosen.
const STRONG_MPS: f64 = 1.0;
/// Choices with less than this share of the weight are dropped. Numerical.
const NEGLIGIBLE: f64 = 1e-4;

/// One choice of the scales.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Air {
    /// Standard deviation, m/s.
    pub(super) sd_mps: f64,
    /// Time scale, s.
    pub(super) tau_s: f64,
    /// White scatter beyond the windows' own noise, us.
    pub(super) white_us: f64,
}

impl Air {
    /// Weight before the windows are seen: any strength below that of a storm, and time scales of
    /// minutes. One short flight cannot tell how slow the air is, and the error of the zero grows
    /// with that, so that some knowledge must come from outside.
    pub(super) fn prior(&self) -> f64 {
        let tau = (self.tau_s / USUAL_TAU_S).ln() / TAU_SPREAD;
        (-0.5 * tau * tau).exp() / (1.0 + (self.sd_mps / STRONG_MPS).powi(2))
    }
}

/// Choices of the scales, even in their logarithms.
pub(super) fn grid(sd_steps: u32, taus_s: &[f64], whites_us: &[f64]) -> Vec<Air> {
    let mut grid = Vec::new();
    let (low, high) = (0.004_f64, 2.5_f64);
    for step in 0..sd_steps {
        let share = f64::from(step) / f64::from(sd_steps.max(2) - 1);
        let sd_mps = low * (high / low).powf(share);
        for tau_s in taus_s {
            for white_us in whites_us {
                grid.push(Air { sd_mps, tau_s: *tau_s, white_us: *white_us });
            }
        }
    }
    grid
}

/// Windows with one law.
#[derive(Clone, Debug)]
pub(super) struct Record {
    /// Derivatives by the law's parameters: a row for each window, and one for each prior.
    pub(super) design: DMatrix<f64>,
    /// Pulses, and the priors' means, us.
    pub(super) pulse_us: DVector<f64>,
    /// Noise, and the priors' errors, us.
    pub(super) noise_us: Vec<f64>,
    /// Pulse per updraft, us/(m/s); 0 for priors.
    pub(super) sensitivity: Vec<f64>,
    /// Time of the windows, s.
    pub(super) time_s: Vec<f64>,
    /// What one standard error of each doubted drift in time does to the windows, us: it must not be
    /// taken for air when the scales are weighed.
    pub(super) doubts_us: Vec<DVector<f64>>,
    /// Rows that are windows; the rest are priors.
    pub(super) windows: usize,
}

/// A fit with one choice of the scales.
#[derive(Clone, Debug)]
pub(super) struct Gls {
    /// What is multiplied with the pulses to give the parameters.
    pub(super) gain: DMatrix<f64>,
    /// Covariance of the parameters.
    pub(super) covariance: DMatrix<f64>,
    /// Logarithm of the restricted likelihood, but for a constant.
    pub(super) log_likelihood: f64,
}

impl Record {
    fn covariance(&self, air: &Air) -> DMatrix<f64> {
        let n = self.noise_us.len();
        let mut covariance = DMatrix::zeros(n, n);
        for row in 0..n {
            for column in 0..=row {
                let dt = (self.time_s[row] - self.time_s[column]).abs() / air.tau_s;
                let mut value = self.sensitivity[row] * self.sensitivity[column];
                if value != 0.0 {
                    value *= air.sd_mps.powi(2) * (-dt).exp();
                }
                if row == column {
                    let white = if row < self.windows { air.white_us } else { 0.0 };
                    value += self.noise_us[row].powi(2) + white * white;
                }
                covariance[(row, column)] = value;
                covariance[(column, row)] = value;
            }
        }
        covariance
    }

    /// Generalized least squares in air with a given covariance between windows, (m/s)².
    pub(super) fn fit_in(&self, air: impl Fn(usize, usize) -> f64, white_us: f64) -> Option<Gls> {
        let n = self.noise_us.len();
        let mut covariance = DMatrix::zeros(n, n);
        for row in 0..n {
            for column in 0..=row {
                let mut value = self.sensitivity[row] * self.sensitivity[column];
                if value != 0.0 && row < self.windows {
                    value *= air(row, column);
                }
                if row == column {
                    let white = if row < self.windows { white_us } else { 0.0 };
                    value += self.noise_us[row].powi(2) + white * white;
                }
                covariance[(row, column)] = value;
                covariance[(column, row)] = value;
            }
        }
        self.with_doubts(covariance)
    }

    /// Generalized least squares with one choice of the scales; `None` if the windows do not
    /// determine the law.
    pub(super) fn fit(&self, air: &Air) -> Option<Gls> {
        self.with_doubts(self.covariance(air))
    }

    /// The fit, with a likelihood that takes no doubted drift for air.
    fn with_doubts(&self, mut covariance: DMatrix<f64>) -> Option<Gls> {
        let fit = self.solve(covariance.clone())?;
        if self.doubts_us.is_empty() {
            return Some(fit);
        }
        for doubt in &self.doubts_us {
            covariance += doubt * doubt.transpose();
        }
        Some(Gls { log_likelihood: self.log_likelihood(covariance)?, ..fit })
    }

    /// That of [`Self::solve`] alone.
    fn log_likelihood(&self, covariance: DMatrix<f64>) -> Option<f64> {
        let factor: Cholesky<f64, Dyn> = covariance.cholesky()?;
        let (mut design, mut pulse_us) = (self.design.clone(), self.pulse_us.clone());
        factor.l_dirty().solve_lower_triangular_mut(&mut design);
        factor.l_dirty().solve_lower_triangular_mut(&mut pulse_us);
        let normal = design.tr_mul(&design).cholesky()?;
        let mut explained = design.tr_mul(&pulse_us);
        normal.l_dirty().solve_lower_triangular_mut(&mut explained);
        let chi2 = pulse_us.norm_squared() - explained.norm_squared();
        let log_likelihood = -0.5 * (log_determinant(&factor) + log_determinant(&normal) + chi2);
        log_likelihood.is_finite().then_some(log_likelihood)
    }

    fn solve(&self, covariance: DMatrix<f64>) -> Option<Gls> {
        let factor: Cholesky<f64, Dyn> = covariance.cholesky()?;
        let whitened = factor.solve(&self.design);
        let normal = (self.design.transpose() * &whitened).cholesky()?;
        let gain = normal.solve(&whitened.transpose());
        let residual = &self.pulse_us - &self.design * (&gain * &self.pulse_us);
        let chi2 = residual.dot(&factor.solve(&residual));
        let log_likelihood = -0.5 * (log_determinant(&factor) + log_determinant(&normal) + chi2);
        let covariance = normal.inverse();
        log_likelihood.is_finite().then_some(Gls { gain, covariance, log_likelihood })
    }
}

fn log_determinant(factor: &Cholesky<f64, Dyn>) -> f64 {
    2.0 * factor.l_dirty().diagonal().iter().map(|value| value.ln()).sum::<f64>()
}

/// One choice with its weight.
#[derive(Clone, Debug)]
pub(super) struct Weighed<T> {
    pub(super) air: Air,
    pub(super) weight: f64,
    pub(super) fit: T,
}

/// All choices that count, with weights that add up to one, heaviest first; `fit` gives the logarithm
/// of a choice's likelihood.
pub(super) fn weigh<T: Send>(
    grid: &[Air],
    fit: impl Fn(&Air) -> Option<(f64, T)> + Sync,
) -> Vec<Weighed<T>> {
    let one = |air: &Air| {
        let (log_likelihood, fit) = fit(air)?;
        Some(Weighed { air: *air, weight: log_likelihood + air.prior().ln(), fit })
    };
    let mut weighed: Vec<Weighed<T>> = grid.par_iter().filter_map(one).collect();
    let most = most(weighed.iter().map(|one| one.weight)).unwrap_or(f64::NEG_INFINITY);
    for one in &mut weighed {
        one.weight = (one.weight - most).exp();
    }
    let keep = |weighed: &mut Vec<Weighed<T>>| {
        let sum: f64 = weighed.iter().map(|one| one.weight).sum();
        for one in weighed {
            one.weight /= sum;
        }
    };
    keep(&mut weighed);
    weighed.retain(|one| one.weight > NEGLIGIBLE);
    keep(&mut weighed);
    weighed.sort_by(|left, right| right.weight.total_cmp(&left.weight));
    weighed
}

/// Quantile of a quantity over weighed choices.
pub(super) fn quantile<T>(
    weighed: &[Weighed<T>],
    share: f64,
    value: impl Fn(&Weighed<T>) -> f64,
) -> f64 {
    let mut values: Vec<(f64, f64)> = weighed.iter().map(|one| (value(one), one.weight)).collect();
    values.sort_by(|left, right| left.0.total_cmp(&right.0));
    let mut sum = 0.0;
    for (value, weight) in &values {
        sum += weight;
        if sum >= share {
            return *value;
        }
    }
    values.last().map_or(0.0, |last| last.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(pulse_us: &[f64]) -> Record {
        let n = pulse_us.len();
        Record {
            design: DMatrix::from_element(n, 1, 1.0),
            pulse_us: DVector::from_row_slice(pulse_us),
            noise_us: vec![1.0; n],
            sensitivity: vec![10.0; n],
            time_s: (0..n).map(|index| 10.0 * index as f64).collect(),
            doubts_us: Vec::new(),
            windows: n,
        }
    }

    #[test]
    fn without_air_it_is_the_mean_and_with_slow_air_nearly_nothing_is_known() {
        let record = record(&[1.0, 2.0, 3.0, 6.0]);
        let calm = Air { sd_mps: 0.0, tau_s: 100.0, white_us: 0.0 };
        let fit = record.fit(&calm).unwrap();
        assert!(((&fit.gain * &record.pulse_us)[0] - 3.0).abs() < 1e-12);
        assert!((fit.covariance[(0, 0)] - 0.25).abs() < 1e-12);
        // Air that stays for the whole flight is in the constant with its full strength: 10 us per
        // m/s, 0.5 m/s.
        let slow = record.fit(&Air { sd_mps: 0.5, tau_s: 1e7, white_us: 0.0 }).unwrap();
        assert!((slow.covariance[(0, 0)] - 25.25).abs() < 0.01, "{}", slow.covariance);
    }

    #[test]
    fn a_doubted_drift_is_not_taken_for_air() {
        let mut record = record(&[0.0, 2.0, 4.0, 6.0, 8.0]);
        let air = Air { sd_mps: 0.3, tau_s: 100.0, white_us: 0.3 };
        let calm = Air { sd_mps: 0.01, ..air };
        let prefers_air = |record: &Record| {
            record.fit(&air).unwrap().log_likelihood - record.fit(&calm).unwrap().log_likelihood
        };
        assert!(prefers_air(&record) > 1.0);
        record.doubts_us = vec![DVector::from_fn(5, |row, _| 4.0 * row as f64)];
        assert!(prefers_air(&record) < 0.0);
    }

    #[test]
    fn a_likelihood_alone_is_that_of_the_fit() {
        let mut record = record(&[1500.3, 1502.0, 1504.1, 1506.0, 1508.2]);
        record.design = DMatrix::from_fn(5, 2, |row, column| (row as f64).powi(column as i32));
        for sd_mps in [0.0, 0.3, 2.0] {
            let covariance = record.covariance(&Air { sd_mps, tau_s: 100.0, white_us: 0.3 });
            let fit = record.solve(covariance.clone()).unwrap();
            let alone = record.log_likelihood(covariance).unwrap();
            assert!((alone - fit.log_likelihood).abs() < 1e-6, "{alone} {}", fit.log_likelihood);
        }
    }

    #[test]
    fn still_windows_speak_for_still_air() {
        let still: Vec<f64> = (0..20).map(|i| if i % 2 == 0 { 1.0 } else { -1.0 }).collect();
        let record = record(&still);
        let grid = grid(8, &[20.0, 200.0], &[0.2, 2.0]);
        let weighed = weigh(&grid, |air| {
            let fit = record.fit(air)?;
            Some((fit.log_likelihood, fit))
        });
        assert!((weighed.iter().map(|one| one.weight).sum::<f64>() - 1.0).abs() < 1e-12);
        assert!(quantile(&weighed, 0.5, |one| one.air.sd_mps) < 0.1);
    }
}
