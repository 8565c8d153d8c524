//! Simulated flights: exact draws of the field at the drones' places.

use nalgebra::{Cholesky, DMatrix};
use rand::Rng;
use rand_distr::{Distribution as _, StandardNormal};

/// A Gaussian field `sd² exp(-r / lambda) exp(-|dt| / tau)`, with independent noise on every drone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldScales {
    /// Standard deviation of the field, m/s.
    pub sd_mps: f64,
    /// Correlation lengths (1/e) along x and y, m.
    pub length_m: [f64; 2],
    /// Correlation time (1/e), s.
    pub tau_s: f64,
    /// Standard deviation of the independent noise after the running mean, m/s.
    pub noise_mps: f64,
}

/// Generator of simulated flights: draws of a field at given places.
#[derive(Clone, Debug)]
pub struct Simulator {
    /// Transposed Cholesky factor of the covariance in space.
    factor: DMatrix<f64>,
    scales: FieldScales,
    seconds: usize,
    running: usize,
}

impl Simulator {
    /// Prepares draws of `seconds` values at each place, each a running mean over `running_s`
    /// seconds.
    pub fn new(
        places_m: &[[f64; 2]],
        scales: FieldScales,
        seconds: usize,
        running_s: usize,
    ) -> Option<Self> {
        let variance = scales.sd_mps.powi(2);
        let kernel = covariance(places_m, scales.length_m) * variance;
        // Places that coincide make the matrix singular.
        let jitter = DMatrix::identity(places_m.len(), places_m.len()) * (1e-9 * variance);
        let factor = Cholesky::new(kernel + jitter)?.l().transpose();
        Some(Self { factor, scales, seconds, running: running_s.max(1) })
    }

    /// Draws one flight: a column of seconds for each place, m/s.
    pub fn flight<R: Rng>(&self, rng: &mut R) -> DMatrix<f64> {
        let long = self.seconds + self.running - 1;
        let keep = (-1.0 / self.scales.tau_s).exp();
        let fresh = (1.0 - keep * keep).sqrt();
        let mut air = DMatrix::zeros(long, self.factor.nrows());
        for mut column in air.column_iter_mut() {
            let mut state: f64 = StandardNormal.sample(rng);
            for value in column.iter_mut() {
                *value = state;
                let next: f64 = StandardNormal.sample(rng);
                state = keep * state + fresh * next;
            }
        }
        let mut air = air * &self.factor;
        let noise = self.scales.noise_mps * (self.running as f64).sqrt();
        if noise > 0.0 {
            for value in air.iter_mut() {
                let normal: f64 = StandardNormal.sample(rng);
                *value += noise * normal;
            }
        }
        if self.running == 1 {
            return air;
        }
        let mut smooth = DMatrix::zeros(self.seconds, self.factor.nrows());
        for (mut to, from) in smooth.column_iter_mut().zip(air.column_iter()) {
            let mut sum: f64 = from.iter().take(self.running - 1).sum();
            let ahead = from.iter().skip(self.running - 1);
            for (to, (first, last)) in to.iter_mut().zip(from.iter().zip(ahead)) {
                sum += last;
                *to = sum / self.running as f64;
                sum -= first;
            }
        }
        smooth
    }
}

/// Correlation `exp(-sqrt((dx / lx)² + (dy / ly)²))` of all pairs of places.
pub(super) fn covariance(places_m: &[[f64; 2]], length_m: [f64; 2]) -> DMatrix<f64> {
    let place = |index: usize| places_m.get(index).copied().unwrap_or_default();
    DMatrix::from_fn(places_m.len(), places_m.len(), |i, j| {
        let (one, other) = (place(i), place(j));
        let along = |axis: usize| (one[axis] - other[axis]) / length_m[axis];
        (-along(0).hypot(along(1))).exp()
    })
}
