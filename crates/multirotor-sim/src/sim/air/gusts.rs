//! Gusts with the Dryden or the von Kármán spectrum, in all three axes.
//!
//! The military handbooks give one-dimensional spectra along a flight path and filters of white
//! noise that make them. Here the same spectra come from isotropic, divergence-free turbulence of
//! plane waves: its energy spectrum E(k) is the one whose one-dimensional cuts are exactly those
//! spectra, so that neighbouring drones meet the same gusts as they pass. Carried along by the wind
//! (frozen); a hovering drone in wind U sees `Φ_w(ω) = Φ_w(Ω = ω/U) / U`.

use std::f64::consts::PI;

use nalgebra::Vector3;
use rand::Rng;
use rand_distr::{Distribution as _, Gamma, StandardNormal, StandardUniform};

use super::field::is_felt;
use super::waves::{Wave, Waves};
use super::{AirSampler, Atmosphere, Knots};

/// Dryden's model is made for moving aircraft: without wind, gusts move at this speed, m/s.
const SLOWEST_MPS: f64 = 1.0;

/// Spectrum of the gusts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GustSpectrum {
    /// Dryden: rational, falls with k^-2.
    Dryden,
    /// von Kármán: falls with k^-5/3, as turbulence does.
    VonKarman,
}

impl GustSpectrum {
    /// Factor of length in the formulas.
    fn stretch(self) -> f64 {
        match self {
            Self::Dryden => 1.0,
            Self::VonKarman => 1.339,
        }
    }

    /// Power spectrum of the velocity across the path over wave number (rad/m, one-sided), for
    /// standard deviation 1 m/s: (m/s)² per rad/m. MIL-F-8785C 3.7.1.
    pub fn transverse_psd(self, length_m: f64, wave_radpm: f64) -> f64 {
        let square = (self.stretch() * length_m * wave_radpm).powi(2);
        length_m / PI
            * match self {
                Self::Dryden => (1.0 + 3.0 * square) / (1.0 + square).powi(2),
                Self::VonKarman => (1.0 + 8.0 / 3.0 * square) / (1.0 + square).powf(11.0 / 6.0),
            }
    }

    /// Power spectrum of the velocity along the path; as [`GustSpectrum::transverse_psd`].
    pub fn longitudinal_psd(self, length_m: f64, wave_radpm: f64) -> f64 {
        let square = (self.stretch() * length_m * wave_radpm).powi(2);
        2.0 * length_m / PI
            * match self {
                Self::Dryden => 1.0 / (1.0 + square),
                Self::VonKarman => (1.0 + square).powf(-5.0 / 6.0),
            }
    }

    /// Draws (k L)² from E(k): `s = (stretch k L)²` has the density `s^(3/2) (1+s)^-p` (p = 3 for
    /// Dryden, 17/6 for von Kármán), a beta prime distribution: the ratio of two gamma variates.
    fn draw_square<R: Rng>(self, rng: &mut R) -> f64 {
        let second = match self {
            Self::Dryden => 0.5,
            Self::VonKarman => 1.0 / 3.0,
        };
        let gamma = |shape: f64, rng: &mut R| -> f64 {
            Gamma::new(shape, 1.0).map_or(1.0, |gamma| gamma.sample(rng))
        };
        gamma(2.5, rng) / gamma(second, rng)
    }
}

/// A frozen field of gusts.
#[derive(Clone, Debug)]
pub struct Gusts {
    waves: Waves<3>,
}

impl Gusts {
    /// Draws gusts with a standard deviation of each axis (m/s) and an integral length along the
    /// wind (m), carried by a wind (show frame, m/s; at least 1 m/s), as a sum of `waves` waves.
    pub fn new<R: Rng>(
        spectrum: GustSpectrum,
        sd_mps: f64,
        length_m: f64,
        wind_mps: Vector3<f64>,
        waves: usize,
        rng: &mut R,
    ) -> Self {
        let speed_mps = wind_mps.norm();
        let wind_mps = if speed_mps >= SLOWEST_MPS {
            wind_mps
        } else if speed_mps > 0.0 {
            wind_mps * (SLOWEST_MPS / speed_mps)
        } else {
            Vector3::x() * SLOWEST_MPS
        };
        // Each axis has a third of a wave's energy.
        let size_mps = sd_mps * (6.0 / waves.max(1) as f64).sqrt();
        let mut drawn = Vec::with_capacity(waves);
        for _ in 0..waves {
            let number = spectrum.draw_square(rng).sqrt() / (spectrum.stretch() * length_m);
            let along = direction(rng);
            // A random direction at right angles to the wave: no divergence.
            let across = along.cross(&direction(rng));
            let norm = across.norm();
            let phase_turns = StandardUniform.sample(rng);
            let wave_radpm = along * number;
            let rate_radps = -wave_radpm.dot(&wind_mps);
            if is_felt(&wave_radpm, rate_radps) && norm > 0.0 {
                let amplitude = (across * (size_mps / norm)).into();
                drawn.push(Wave { number_radpm: wave_radpm, rate_radps, phase_turns, amplitude });
            }
        }
        Self { waves: Waves::new(&drawn) }
    }
}

/// A direction, all equally likely.
fn direction<R: Rng>(rng: &mut R) -> Vector3<f64> {
    let mut normal = || -> f64 { StandardNormal.sample(rng) };
    let vector = Vector3::new(normal(), normal(), normal());
    let norm = vector.norm();
    if norm > 0.0 { vector / norm } else { Vector3::z() }
}

impl Atmosphere for Gusts {
    fn air_velocity(&self, position_m: &Vector3<f64>, time_s: f64) -> Vector3<f64> {
        self.waves.at(position_m, time_s).into()
    }

    fn sampler(&self, _drone: u16) -> Box<dyn AirSampler + Send + '_> {
        Box::new(Knots::new(|position_m: &Vector3<f64>, time_s| {
            self.air_velocity(position_m, time_s)
        }))
    }
}
