//! Curves that a drone's response to the vertical air speed may be: a line with bends, and a smooth rest.
//!
//! The curve is a Gaussian process: two windows have the covariance
//! `sum_b sd_b² b(v) b(v') + s² k(|v - v'| / l)` of all that it may be, with the functions `b` of
//! [`super::super::shape`]'s line and a Matérn kernel, whose `s` and `l` the calibration's windows weigh.

/// Prior standard deviations of constant (us, about the calibration's mean), slope (us/(m/s)) and both bends
/// (us/(m/s)²). Far above what rotors have (docs/physics.md, 2.3 and 2.4), and AirSim's 8 us/(m/s)² among
/// them: the windows decide.
const PRIOR: [f64; 4] = [300.0, 60.0, 5.0, 8.0];
/// Strengths of the smooth rest that are tried, us. A grid.
pub(super) const RESTS_US: [f64; 4] = [0.03, 0.2, 1.2, 7.0];
/// Air speeds over which the rest changes that are tried, m/s: from three rungs to the whole ladder. A grid.
pub(super) const LENGTHS_MPS: [f64; 2] = [1.5, 4.0];

/// How far off the continued curve may be beyond the calibration's speeds: a vortex ring takes 10 to 50 us where it
/// begins (docs/physics.md, 2.4), and nothing slower tells of it. us/(m/s), and us/(m/s)². Chosen around that.
const BEYOND: [f64; 2] = [2.0, 10.0];

/// A choice of the smooth rest.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rest {
    /// Its standard deviation, us.
    pub(super) sd_us: f64,
    /// Air speed over which it changes, m/s.
    pub(super) length_mps: f64,
}

/// Functions of the line with bends.
pub(super) fn basis(air_mps: f64) -> [f64; 4] {
    [1.0, air_mps, air_mps * air_mps, air_mps * air_mps.abs()]
}

/// Covariance of the pulse at two air speeds by the line with bends, us².
pub(super) fn bent(left: &[f64; 4], right: &[f64; 4]) -> f64 {
    PRIOR.iter().zip(left).zip(right).map(|((sd, left), right)| sd * sd * left * right).sum()
}

/// Standard error of the continued curve at an air speed, us: below the calibration's speeds, and above.
pub(super) fn beyond_us(air_mps: f64, [low, high]: [f64; 2]) -> [f64; 2] {
    [low - air_mps, air_mps - high].map(|by| {
        let by = by.max(0.0);
        BEYOND[0] * by + BEYOND[1] * by * by
    })
}

impl Rest {
    /// Covariance of the rest at two air speeds, us²: Matérn with two derivatives (5/2).
    pub(super) fn covariance(&self, left_mps: f64, right_mps: f64) -> f64 {
        let x = 5_f64.sqrt() * (left_mps - right_mps).abs() / self.length_mps;
        self.sd_us * self.sd_us * (1.0 + x + x * x / 3.0) * (-x).exp()
    }
}
