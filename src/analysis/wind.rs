//! Wind on a leaning drone: what it adds to the vertical flow through the rotors.
//!
//! A drone that holds its place in wind leans into it, and then part of the wind blows along its
//! rotor axis: a lean of `phi` in a wind of `U` adds `U tan(phi)` to the speed that rotors and body
//! feel along that axis, which reads as sinking air. And drag in the rotor plane carries part of the
//! weight: at a lean the thrust is `m g cos(phi)` (plus what the axial flow adds), not
//! `m g / cos(phi)`, so that a pulse is brought to level flight by dividing by the cosine, where the
//! paper's `u cos(phi)` multiplies. Both effects are of second order in the lean: 0.07 m/s at 1
//! degree and 1 m/s at 4 degrees for the stock quad.
//!
//! The wind is not logged, but where the vehicle's drag is known it follows from the lean:
//! `k U² = m g tan(phi)`. Where it is not known, nothing is corrected, and what the correction could
//! have been is the systematic error of the map.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::law::Law;
use super::stats::SampleStats;
use super::window::WindowStats;
use super::windows::Corrected;
use crate::flight::{Flight, Series};
use crate::numeric::mean;

/// Pulse at which the rotors make no thrust, us.
const NO_THRUST_US: f64 = 1000.0;
/// Speed of [`Leaning::drag_speed_mps`] for the cleanest airframe known (AirSim's generic quad is at
/// 39 m/s): an upper bound where the drag is unknown.
const CLEANEST_MPS: f64 = 40.0;
/// Share of a correction that may be wrong: drag factors of AirSim's sides differ by 8 %, and a lean also
/// has parts (trim, sensor errors) that are not the wind's (docs/physics.md, 2.6). Chosen at twice the 8 %.
const DOUBTED_SHARE: f64 = 0.15;
/// Steepest lean that is taken for wind, degrees. Convention: beyond it nothing hovers.
const STEEPEST_DEG: f64 = 45.0;
/// Samples of a pulse are not joined over longer silences than this, s. Chosen.
const GAP_S: f64 = 1.0;

/// How a vehicle leans in wind, and how its pulse depends on thrust.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Leaning {
    /// `u - 1000` is proportional to thrust to this power: 1 where thrust is linear in the pulse.
    pub thrust_exponent: f64,
    /// Wind at which horizontal drag is the vehicle's weight (a lean of 45 degrees), m/s.
    pub drag_speed_mps: f64,
}

impl Leaning {
    /// What the wind adds to the flow along the rotor axis at a lean, m/s (positive: it reads as
    /// sinking air). With quadratic drag, `U = U45 sqrt(tan phi)`.
    pub(super) fn axial_mps(self, tilt_deg: f64) -> f64 {
        axial_mps(self.drag_speed_mps, tilt_deg)
    }

    /// A raw pulse at a lean, brought to level flight, us.
    pub(super) fn level_us(self, pulse_us: f64, tilt_deg: f64) -> f64 {
        let cos = tilt_deg.min(STEEPEST_DEG).to_radians().cos();
        NO_THRUST_US + (pulse_us - NO_THRUST_US) * cos.powf(-self.thrust_exponent)
    }

    /// The pulses of a flight brought to level flight, at the times that have a tilt.
    pub(super) fn level_series(self, flight: &Flight, corrected: &Corrected) -> Series {
        let tilt = &corrected.tilt_deg;
        let (time_s, value) = tilt
            .time_s
            .iter()
            .zip(&tilt.value)
            .filter_map(|(time, tilt_deg)| {
                let pulse_us = flight.effort.values.at(*time, GAP_S)?;
                Some((*time, self.level_us(pulse_us, *tilt_deg)))
            })
            .unzip();
        Series { time_s, value }
    }

    /// A window brought to level flight in air without wind.
    pub(super) fn level_window(self, window: &WindowStats) -> WindowStats {
        let tilt_deg = window.lean_deg;
        let raw = &window.effort;
        let level = |pulse_us: f64| self.level_us(pulse_us, tilt_deg);
        let axial = self.axial_mps(tilt_deg);
        let moved = &window.velocity_mps;
        WindowStats {
            effort_phi: SampleStats {
                median: level(raw.median),
                mean: level(raw.mean),
                trimmed: level(raw.trimmed),
                // The spread of the corrected pulse: without that of the tilt itself.
                ..window.effort_phi
            },
            velocity_mps: SampleStats {
                median: moved.median + axial,
                mean: moved.mean + axial,
                trimmed: moved.trimmed + axial,
                ..*moved
            },
            ..window.clone()
        }
    }
}

/// What wind adds to the flow along the rotor axis at a lean, m/s; an upper bound where the drag is
/// not known.
pub(super) fn axial_of(leaning: Option<Leaning>, tilt_deg: f64) -> f64 {
    axial_mps(leaning.map_or(CLEANEST_MPS, |leaning| leaning.drag_speed_mps), tilt_deg)
}

fn axial_mps(drag_speed_mps: f64, tilt_deg: f64) -> f64 {
    drag_speed_mps * tilt_deg.clamp(0.0, STEEPEST_DEG).to_radians().tan().powf(1.5)
}

/// Systematic error of a map value from wind at the leans of its hover and of its calibration, m/s:
/// what the correction is unsure of, or all of it where nothing could be corrected.
///
/// The correction is the wind along the rotor axis and the difference between the level pulse and the
/// paper's `u cos(phi)`. Hover and calibration err in the same direction, so that the larger one
/// bounds their difference.
pub(super) fn systematic_mps(
    leaning: Option<Leaning>,
    law: Law,
    hover: (f64, f64),
    calibration: &[WindowStats],
) -> f64 {
    let assumed = leaning.unwrap_or(Leaning { thrust_exponent: 1.0, drag_speed_mps: CLEANEST_MPS });
    let whole = |pulse_us: f64, tilt_deg: f64| {
        let paper = pulse_us * tilt_deg.to_radians().cos();
        let level = assumed.level_us(pulse_us, tilt_deg);
        let form = law.air_velocity_mps(level) - law.air_velocity_mps(paper);
        assumed.axial_mps(tilt_deg) + if form.is_finite() { form.abs() } else { 0.0 }
    };
    let used =
        calibration.iter().filter(|window| window.kind.is_leg() && window.rejected.is_empty());
    let of_ladder = mean(used.map(|window| whole(window.effort.mean, window.lean_deg)));
    let (pulse_us, tilt_deg) = hover;
    let share = if leaning.is_some() { DOUBTED_SHARE } else { 1.0 };
    share * whole(pulse_us, tilt_deg).max(of_ladder.unwrap_or_default())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// AirSim's stock quad: 1 kg, drag factor 0.0056 m² at 1.2 kg/m³.
    const QUAD: Leaning = Leaning { thrust_exponent: 1.0, drag_speed_mps: 38.2 };

    #[test]
    fn a_lean_of_four_degrees_is_a_wind_of_ten_metres_per_second() {
        let tilt_deg: f64 = 3.92;
        let wind = QUAD.axial_mps(tilt_deg) / tilt_deg.to_radians().tan();
        assert!((wind - 10.0).abs() < 0.05, "{wind}");
        assert!((QUAD.axial_mps(tilt_deg) - 0.685).abs() < 0.005, "{}", QUAD.axial_mps(tilt_deg));
        assert_eq!(QUAD.axial_mps(0.0), 0.0);
    }

    #[test]
    fn a_lean_takes_weight_off_the_rotors() {
        // m g cos(phi) in the rotors: 586.6 us of thrust read 1.37 us low at 3.92 degrees.
        let leaning = 1000.0 + 586.6 * 3.92_f64.to_radians().cos();
        assert!((QUAD.level_us(leaning, 3.92) - 1586.6).abs() < 1e-9);
    }

    #[test]
    fn an_unknown_drag_is_an_error_as_large_as_the_correction_of_a_clean_airframe() {
        let law = Law::Linear { slope: 26.4, u0_us: 1546.5 };
        let known = systematic_mps(Some(QUAD), law, (1546.5, 4.0), &[]);
        let unknown = systematic_mps(None, law, (1546.5, 4.0), &[]);
        assert!((0.1..0.2).contains(&known), "{known}");
        assert!(unknown > 0.9 && unknown > 5.0 * known, "{unknown}");
        assert_eq!(systematic_mps(None, law, (1546.5, 0.0), &[]), 0.0);
    }
}
