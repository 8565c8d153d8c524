//! Air density: known physics that is computed, never fitted.
//!
//! Thinner air needs more pulse for the same thrust. A calibration at 20 m and a hover at 100 m
//! differ by several microseconds for this reason alone, which reads as tenths of a metre per second.
//! Pulses are therefore referred to the density at ground height before a calibration is used at
//! another height. The calibration itself is reported as it was measured, like the paper's.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::base::air::density_ratio;
use crate::flight::{Indicator, Series};

/// Exponent of rotor speed and power: at one thrust both go with the root of the density, by momentum theory and for
/// blades alike (the flow through the disc grows as the speed of the blades does).
const OF_ROTORS: f64 = 0.5;
/// Heights are not interpolated over longer silences than this, s.
const LONGEST_GAP_S: f64 = 1.0;

/// How pulses depend on air density: `u - 1000` is proportional to `density^-exponent` at constant
/// thrust (standard atmosphere).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Density {
    /// Ground height above mean sea level, m: the density that pulses are referred to.
    pub ground_amsl_m: f64,
    /// 1 where thrust is linear in the pulse above 1000 us (AirSim), about 0.4 with the thrust curve
    /// of real electric rotors (a duty cycle sets a voltage, and thrust grows with its square).
    pub exponent: f64,
    /// Indicator of rotor effort that is referred, where it is not the pulse: all of it instead of `u - 1000`.
    #[serde(default, skip_serializing_if = "Indicator::is_pulse")]
    pub indicator: Indicator,
}

impl Density {
    /// The same for another indicator.
    pub(super) fn of(self, indicator: Indicator) -> Self {
        match indicator {
            Indicator::Pulse => self,
            Indicator::RotorSpeed | Indicator::Power => {
                Self { exponent: OF_ROTORS, indicator, ..self }
            }
        }
    }

    /// What `u - 1000` at a height above ground is multiplied with.
    pub(super) fn factor(self, height_m: f64) -> f64 {
        let here = density_ratio(self.ground_amsl_m + height_m);
        (here / density_ratio(self.ground_amsl_m)).powf(self.exponent)
    }

    /// Logarithm of the density at a height above ground over that at the ground.
    pub(super) fn log_ratio(self, height_m: f64) -> f64 {
        (density_ratio(self.ground_amsl_m + height_m) / density_ratio(self.ground_amsl_m)).ln()
    }

    /// A pulse width measured at a height above ground, referred to the ground, us.
    pub fn refer_us(self, pulse_us: f64, height_m: f64) -> f64 {
        let zero = self.indicator.without_thrust();
        zero + (pulse_us - zero) * self.factor(height_m)
    }

    /// A whole series of pulses, with the height interpolated to its times.
    pub(super) fn refer_series(self, pulse_us: &Series, height_m: &Series) -> Series {
        let (time_s, value) = pulse_us
            .time_s
            .iter()
            .zip(&pulse_us.value)
            .filter_map(|(time, pulse)| {
                let height = height_m.at(*time, LONGEST_GAP_S)?;
                Some((*time, self.refer_us(*pulse, height)))
            })
            .unzip();
        Series { time_s, value }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hover_pulses_of_a_linear_rotor_become_equal_at_all_heights() {
        // physics of the stock quad: u0 = 1000 + 586.6 / (rho / rho0), 0.0575 us per metre.
        let u0 = |amsl_m: f64| 1000.0 + 586.6 / density_ratio(amsl_m);
        assert!((u0(290.0) - u0(190.0) - 5.75).abs() < 0.1);
        let density = Density { ground_amsl_m: 190.0, exponent: 1.0, indicator: Indicator::Pulse };
        let referred = density.refer_us(u0(290.0), 100.0);
        assert!((referred - u0(190.0)).abs() < 1e-9, "{referred}");
    }

    #[test]
    fn rotors_turn_faster_in_thin_air_by_its_root() {
        let of_pulse = Density { ground_amsl_m: 190.0, exponent: 0.4, indicator: Indicator::Pulse };
        let ratio = density_ratio(290.0) / density_ratio(190.0);
        for indicator in [Indicator::RotorSpeed, Indicator::Power] {
            let referred = of_pulse.of(indicator).refer_us(8000.0 / ratio.sqrt(), 100.0);
            assert!((referred - 8000.0).abs() < 1e-9, "{referred}");
        }
        assert_eq!(of_pulse.of(Indicator::Pulse), of_pulse);
    }

    #[test]
    fn a_pulse_on_the_ground_stays() {
        let density = Density { ground_amsl_m: 190.0, exponent: 0.4, indicator: Indicator::Pulse };
        assert_eq!(density.refer_us(1546.5, 0.0), 1546.5);
    }
}
