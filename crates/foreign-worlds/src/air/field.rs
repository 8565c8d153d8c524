//! A random field of the updraft in space and time: a sum of plane waves with random directions, which
//! may drift with the wind.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::random::{Purpose, normal, stream};
use crate::vector::{Vector, dot};

/// Number of waves: enough that values are close to normal.
const WAVES: usize = 48;

/// Scales of a field of the updraft.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FieldSettings {
    /// Standard deviation, m/s.
    pub sd_mps: f64,
    /// Length over which the correlation falls to exp(-1/2), m.
    pub length_m: f64,
    /// Time over which it does, for who drifts along, s.
    pub time_s: f64,
    /// Whether the field drifts with the mean wind.
    pub is_advected: bool,
    /// Number of waves; absent: 48. A record of a smooth field of few waves tells them from a Gaussian field's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub waves: Option<usize>,
    /// How many times as long it is along show x as along y; `length_m` is then their geometric mean. Absent: once.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stretch: Option<f64>,
}

/// A field of the updraft, with the Gaussian correlation of [`FieldSettings`].
#[derive(Clone, Debug)]
pub struct Field {
    amplitude_mps: f64,
    drift_mps: Vector,
    waves: Vec<Wave>,
}

#[derive(Clone, Copy, Debug)]
struct Wave {
    number_radpm: Vector,
    rate_radps: f64,
    phase_rad: f64,
}

impl Field {
    /// Draws a field in a mean wind (show frame x and y, m/s).
    pub fn new(settings: &FieldSettings, wind_mps: [f64; 2], seed: u64) -> Self {
        let mut rng = stream(seed, 0, Purpose::Field);
        let mut draw = |scale: f64| normal(&mut rng) / scale;
        let count = settings.waves.unwrap_or(WAVES);
        let root = settings.stretch.map_or(1.0, f64::sqrt);
        let lengths_m = [root, 1.0 / root, 1.0].map(|share| share * settings.length_m);
        let waves = (0..count)
            .map(|_| Wave {
                number_radpm: lengths_m.map(&mut draw),
                rate_radps: draw(settings.time_s),
                // A normal deviate of many turns is uniform on the circle.
                phase_rad: draw(0.01),
            })
            .collect();
        let [x, y] = if settings.is_advected { wind_mps } else { [0.0; 2] };
        let amplitude_mps = settings.sd_mps * (2.0 / count as f64).sqrt();
        Self { amplitude_mps, drift_mps: [x, y, 0.0], waves }
    }

    /// Updraft at a place (show frame, m) and show time, m/s.
    pub fn updraft_mps(&self, position_m: Vector, time_s: f64) -> f64 {
        let [x, y, z] = position_m;
        let [u, v, _] = self.drift_mps;
        let place = [x - u * time_s, y - v * time_s, z];
        let one = |wave: &Wave| {
            (dot(wave.number_radpm, place) + wave.rate_radps * time_s + wave.phase_rad).cos()
        };
        self.amplitude_mps * self.waves.iter().map(one).sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_correlates_over_its_length_and_drifts_with_the_wind() {
        let settings = FieldSettings {
            sd_mps: 0.5,
            length_m: 60.0,
            time_s: 1e4,
            is_advected: true,
            waves: None,
            stretch: None,
        };
        let (mut variance, mut apart, mut drifted, mut stayed) = (0.0, 0.0, 0.0, 0.0);
        let count = 600;
        for seed in 0..count {
            let field = Field::new(&settings, [2.0, 0.0], seed);
            let here = field.updraft_mps([0.0; 3], 0.0);
            variance += here * here;
            apart += here * field.updraft_mps([0.0, 60.0, 0.0], 0.0);
            drifted += here * field.updraft_mps([120.0, 0.0, 0.0], 60.0);
            stayed += here * field.updraft_mps([0.0; 3], 60.0);
        }
        let of = |sum: f64| sum / variance;
        assert!((variance / count as f64 / 0.25 - 1.0).abs() < 0.2);
        assert!((of(apart) - (-0.5_f64).exp()).abs() < 0.12, "{}", of(apart));
        assert!(of(drifted) > 0.98, "{}", of(drifted));
        assert!(of(stayed) < 0.3, "{}", of(stayed));
    }

    #[test]
    fn it_is_longer_along_than_across_where_it_is_stretched() {
        let settings = FieldSettings {
            sd_mps: 0.5,
            length_m: 60.0,
            time_s: 1e4,
            is_advected: false,
            waves: None,
            stretch: Some(4.0),
        };
        let (mut variance, mut along, mut across) = (0.0, 0.0, 0.0);
        for seed in 0..600 {
            let field = Field::new(&settings, [0.0; 2], seed);
            let here = field.updraft_mps([0.0; 3], 0.0);
            variance += here * here;
            along += here * field.updraft_mps([120.0, 0.0, 0.0], 0.0);
            across += here * field.updraft_mps([0.0, 30.0, 0.0], 0.0);
        }
        for (way, sum) in [("along", along), ("across", across)] {
            let correlation = sum / variance;
            assert!((correlation - (-0.5_f64).exp()).abs() < 0.12, "{way}: {correlation}");
        }
    }
}
