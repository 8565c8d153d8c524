//! Errors of what is logged.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Noise of pulses, position filter and clocks.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NoiseSettings {
    /// Standard deviation of the white part of each logged mean pulse, us.
    pub pulse_white_us: f64,
    /// Standard deviation of the part that remembers, us.
    pub pulse_coloured_us: f64,
    /// Its correlation time, s.
    pub pulse_coloured_s: f64,
    /// Standard deviation of the vertical velocity, m/s.
    pub velocity_mps: f64,
    /// Its correlation time, s.
    pub velocity_s: f64,
    /// Standard deviation of the height, m.
    pub height_m: f64,
    /// Its correlation time, s.
    pub height_s: f64,
    /// Standard deviation of a drone's show clock against the true one, s.
    pub clock_s: f64,
    /// Standard deviation of a drone's logged roll and pitch, constant in a flight, degrees.
    pub level_deg: f64,
    /// Rows of each message a second.
    pub rate_hz: f64,
}
