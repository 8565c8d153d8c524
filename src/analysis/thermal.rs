//! Thermals of a map, as part of its result.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::kriging;
use crate::base::estimate::Estimate;

/// A thermal: a column of rising air, the same at all heights of the flight, that keeps its strength and may drift.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Thermal {
    /// When the core is at [`Thermal::core_m`], show time, s: where its place is known best.
    pub time_s: f64,
    /// The core, along show x (forward) and y (left), m.
    pub core_m: [Estimate; 2],
    /// How fast it drifts, along show x and y, m/s.
    pub drift_mps: [Estimate; 2],
    /// Distance from the core at which the updraft has fallen to 1/e of its peak, m.
    pub radius_m: Estimate,
    /// Updraft in the core, over that of the air around it, m/s.
    pub peak_mps: Estimate,
    /// Volume that rises each second through the level disc of [`Thermal::radius_m`] around the core, m³/s: the integral of
    /// the thermal's own updraft over it.
    pub flux_m3ps: Estimate,
    /// How much air sinks in a ring around it: 0 none, 1 as much as rises in it.
    pub sink: Estimate,
    /// Logarithm of the evidence for it over that for a stationary field alone.
    pub log_odds: f64,
}

impl Thermal {
    /// Of a thermal in a record whose second 0 is at `first_s`.
    pub(super) fn new(found: &kriging::Thermal, first_s: f64) -> Self {
        let known = |(value, se): kriging::Known| Estimate::new(value, se);
        Self {
            time_s: first_s + found.at_s,
            core_m: found.core_m.map(known),
            drift_mps: found.drift_mps.map(known),
            radius_m: known(found.radius_m),
            peak_mps: known(found.peak_mps),
            flux_m3ps: known(found.flux_m3ps),
            sink: known(found.sink),
            log_odds: found.log_odds,
        }
    }

    /// One of its numbers with half of its 95 % interval in the place of the standard error.
    pub fn interval(of: &Estimate) -> Estimate {
        Estimate::new(of.value, NORMAL * of.se)
    }

    /// A size, which cannot be negative, as by [`Thermal::interval`], to two digits of its error; `None` if the error
    /// exceeds it, so that it is not determined.
    pub fn size(of: &Estimate) -> Option<Estimate> {
        let Estimate { value, se } = Self::interval(of);
        if !(value.is_finite() && se.is_finite() && se <= value.abs()) {
            return None;
        }
        // Below a hundred the decimals do this.
        let digit = 10_f64.powi((se.max(1.0).log10().floor() as i32 - 1).max(0));
        let to_digit = |number: f64| (number / digit).round() * digit;
        Some(if digit > 1.0 {
            Estimate::new(to_digit(value), to_digit(se))
        } else {
            Self::interval(of)
        })
    }

    /// In a sentence.
    pub fn sentence(&self) -> String {
        let interval = |of: &Estimate| Self::interval(of).to_string();
        let [x, y] = &self.core_m;
        let [u, v] = &self.drift_mps;
        let drift = u.value.hypot(v.value);
        let drift_half = NORMAL * (u.se + v.se);
        let moves = if drift > drift_half {
            format!(", drifting at {drift:.1} m/s")
        } else {
            String::new()
        };
        let size = |of: &Estimate, unit: &str| match Self::size(of) {
            Some(of) => format!("{of} {unit}"),
            None => "not determined".to_owned(),
        };
        format!(
            "a thermal at ({}, {}) m at {:.0} s{moves}: in the core {}, radius {}, flux {} (± is the half width of a 95 % \
             interval)",
            interval(x),
            interval(y),
            self.time_s,
            size(&self.peak_mps, "m/s"),
            size(&self.radius_m, "m"),
            size(&self.flux_m3ps, "m³/s"),
        )
    }
}

/// Standard errors to each side of a normal 95 % interval.
const NORMAL: f64 = 1.96;

#[cfg(test)]
mod tests {
    use super::*;

    fn thermal(flux_m3ps: Estimate) -> Thermal {
        let still = Estimate::new(0.0, 0.1);
        Thermal {
            time_s: 63.0,
            core_m: [Estimate::new(0.2, 0.1), Estimate::new(-30.9, 0.5)],
            drift_mps: [still; 2],
            radius_m: Estimate::new(23.4446, 0.4517),
            peak_mps: Estimate::new(1.8254, 0.031),
            flux_m3ps,
            sink: still,
            log_odds: 9.0,
        }
    }

    #[test]
    fn it_is_told_in_digits_that_its_intervals_support() {
        assert_eq!(
            thermal(Estimate::new(2178.7, 110.5)).sentence(),
            "a thermal at (0.20 ± 0.20, -30.90 ± 0.98) m at 63 s: in the core 1.825 ± 0.061 m/s, radius 23.44 ± 0.89 m, \
             flux 2180 ± 220 m³/s (± is the half width of a 95 % interval)"
        );
    }

    #[test]
    fn a_size_within_its_error_is_not_determined() {
        let words = thermal(Estimate::new(33_634.0, 35_256.0)).sentence();
        assert!(words.contains("flux not determined (±"), "{words}");
        assert!(!words.contains("33634"), "{words}");
        assert_eq!(Thermal::size(&Estimate::new(0.5, f64::NAN)), None);
    }
}
