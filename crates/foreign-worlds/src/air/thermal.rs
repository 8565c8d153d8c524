//! A thermal: a column of rising air with one core, which may drift.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How the updraft of a thermal falls with the distance from its core.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Profile {
    /// `exp(-(r/R)²)`.
    Gaussian,
    /// `(1 - (r/R)²) exp(-(r/R)²)`: as much air sinks around the core as rises in it.
    Ring,
    /// `1 / (1 + (r/R)⁴)`: a flat core with a steep edge, near the shapes that Allen (2006) fitted to flights.
    Flat,
}

/// A thermal.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ThermalSettings {
    /// Its shape.
    pub profile: Profile,
    /// Core at the time 0, show frame, m.
    pub core_m: [f64; 2],
    /// Length R of its profile, m.
    pub radius_m: f64,
    /// Updraft in the core, m/s.
    pub peak_mps: f64,
    /// How fast the core moves, m/s.
    pub drift_mps: [f64; 2],
}

impl ThermalSettings {
    /// Updraft at a place (show frame, m) and show time, m/s.
    pub fn updraft_mps(&self, [x, y]: [f64; 2], time_s: f64) -> f64 {
        let Self { core_m, drift_mps, radius_m, peak_mps, profile } = self;
        let off = [x, y].into_iter().zip(core_m.iter().zip(drift_mps));
        let square: f64 =
            off.map(|(place, (core, drift))| (place - core - drift * time_s).powi(2)).sum();
        let s = square / (radius_m * radius_m);
        peak_mps
            * match profile {
                Profile::Gaussian => (-s).exp(),
                Profile::Ring => (1.0 - s) * (-s).exp(),
                Profile::Flat => 1.0 / (1.0 + s * s),
            }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_peaks_in_its_core_which_drifts_and_a_ring_has_no_flux() {
        for profile in [Profile::Gaussian, Profile::Ring, Profile::Flat] {
            let thermal = ThermalSettings {
                profile,
                core_m: [10.0, -5.0],
                radius_m: 20.0,
                peak_mps: 1.5,
                drift_mps: [1.0, 0.5],
            };
            assert!((thermal.updraft_mps([10.0, -5.0], 0.0) - 1.5).abs() < 1e-12);
            assert!((thermal.updraft_mps([70.0, 25.0], 60.0) - 1.5).abs() < 1e-12);
            assert!(thermal.updraft_mps([30.0, -5.0], 0.0) < 0.8);
            let flux: f64 = (0..4000)
                .map(|step| 0.05 * (f64::from(step) + 0.5))
                .map(|r| r * 0.05 * thermal.updraft_mps([10.0 + r, -5.0], 0.0))
                .sum();
            assert_eq!(flux.abs() < 1e-3 * 400.0, profile == Profile::Ring, "{profile:?} {flux}");
        }
    }
}
