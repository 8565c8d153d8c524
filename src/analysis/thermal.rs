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
        format!(
            "a thermal at ({}, {}) m at {:.0} s{moves}: {} m/s in the core, radius {} m, {} m³/s (95 %)",
            interval(x),
            interval(y),
            self.time_s,
            interval(&self.peak_mps),
            interval(&self.radius_m),
            interval(&self.flux_m3ps)
        )
    }
}

/// Standard errors to each side of a normal 95 % interval.
const NORMAL: f64 = 1.96;
