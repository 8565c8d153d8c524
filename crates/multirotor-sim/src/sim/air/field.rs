//! A random field of vertical velocity with chosen correlation lengths and time.
//!
//! `C(d, dt) = sd² exp(-|(d_x - U_x dt)/l_x, ...|) exp(-|dt|/tau)`: the exponential kernel that the
//! paper fits, anisotropic, decaying in time, carried along by the wind U (Taylor's hypothesis; a
//! long `tau` makes it frozen turbulence). Drawn as plane waves from its spectrum: the exponential
//! kernel is Matérn 1/2, whose spectrum is the multivariate Cauchy distribution, `k = z / |g|` with
//! normal z and g; in time, Cauchy of scale 1/tau.

use std::f64::consts::TAU;

use nalgebra::Vector3;
use rand::Rng;
use rand_distr::{Distribution as _, StandardNormal, StandardUniform};

use super::waves::{Wave, Waves};
use super::{AirSampler, Atmosphere, Knots};

/// Shortest wave, m: below a rotor's size the drone does not feel it.
pub(super) const SHORTEST_M: f64 = 0.5;
/// Highest angular frequency at a fixed place, rad/s (2.5 Hz): what is faster is neither resolved by
/// [`Knots`] nor followed by the drone.
pub(super) const HIGHEST_RADPS: f64 = TAU * 2.5;

/// Statistics of a [`RandomField`]. Lengths are along the show's axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldScales {
    /// Standard deviation of the vertical velocity, m/s.
    pub sd_mps: f64,
    /// Correlation lengths (1/e) along show x, y and z, m.
    pub length_m: Vector3<f64>,
    /// Correlation time (1/e) in the air that moves along, s.
    pub time_s: f64,
    /// Velocity that the field moves along with, show frame, m/s.
    pub wind_mps: Vector3<f64>,
    /// Number of waves: 600 or more for a field that is close to Gaussian.
    pub waves: usize,
}

/// A Gaussian random field of vertical air velocity.
#[derive(Clone, Debug)]
pub struct RandomField {
    waves: Waves<1>,
}

impl RandomField {
    /// Draws the waves of a field.
    pub fn new<R: Rng>(scales: &FieldScales, rng: &mut R) -> Self {
        let amplitude = [scales.sd_mps * (2.0 / scales.waves.max(1) as f64).sqrt()];
        let mut waves = Vec::with_capacity(scales.waves);
        for _ in 0..scales.waves {
            let mut normal = || -> f64 { StandardNormal.sample(rng) };
            let z = Vector3::new(normal(), normal(), normal());
            let wave_radpm = z.component_div(&scales.length_m) / normal().abs();
            let turn: f64 = StandardUniform.sample(rng);
            let own_radps = (std::f64::consts::PI * (turn - 0.5)).tan() / scales.time_s;
            let phase_turns = StandardUniform.sample(rng);
            let rate_radps = own_radps - wave_radpm.dot(&scales.wind_mps);
            if is_felt(&wave_radpm, rate_radps) {
                waves.push(Wave { number_radpm: wave_radpm, rate_radps, phase_turns, amplitude });
            }
        }
        Self { waves: Waves::new(&waves) }
    }

    /// Vertical velocity of the air at a position (show frame, m) and show time, m/s, up positive.
    pub fn updraft_mps(&self, position_m: &Vector3<f64>, time_s: f64) -> f64 {
        self.waves.at(position_m, time_s)[0]
    }
}

/// Whether a wave is long and slow enough to matter; NaN is not.
pub(super) fn is_felt(wave_radpm: &Vector3<f64>, rate_radps: f64) -> bool {
    wave_radpm.norm() < TAU / SHORTEST_M && rate_radps.abs() < HIGHEST_RADPS
}

impl Atmosphere for RandomField {
    fn air_velocity(&self, position_m: &Vector3<f64>, time_s: f64) -> Vector3<f64> {
        Vector3::new(0.0, 0.0, self.updraft_mps(position_m, time_s))
    }

    fn sampler(&self, _drone: u16) -> Box<dyn AirSampler + Send + '_> {
        Box::new(Knots::new(|position_m: &Vector3<f64>, time_s| {
            self.air_velocity(position_m, time_s)
        }))
    }
}
