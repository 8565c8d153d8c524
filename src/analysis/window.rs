//! Measurements of a drone in one window.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::budget::Supply;
use super::stats::SampleStats;
use crate::mission::plan::SegmentKind;

/// Statistics of one window.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct WindowStats {
    /// Kind of the segment.
    pub kind: SegmentKind,
    /// Label: `up 0.5 m/s`.
    pub label: String,
    /// Show time of the window, s.
    pub start_s: f64,
    /// Show time of the end, s.
    pub end_s: f64,
    /// Commanded vertical velocity, m/s, up positive.
    pub commanded_mps: f64,
    /// Mean height above home, m.
    pub height_m: f64,
    /// Vertical velocity V_U, m/s.
    pub velocity_mps: SampleStats,
    /// Rotor control pulse width u, us.
    #[serde(rename = "pulse_us")]
    pub effort: SampleStats,
    /// Tilt-corrected pulse width u_phi, us.
    #[serde(rename = "pulse_phi_us")]
    pub effort_phi: SampleStats,
    /// Tilt from the vertical, degrees.
    pub tilt_deg: SampleStats,
    /// Angle of the mean attitude from the vertical, degrees: what wind does, without noise.
    #[serde(default)]
    pub lean_deg: f64,
    /// What the other form of the tilt correction (the paper's, if ours was used) would change, us.
    #[serde(default)]
    pub tilt_form_us: f64,
    /// Slow offset (eq. 5) at the window's time and height, subtracted before laws are fitted, us.
    pub offset_us: Option<f64>,
    /// The window lies outside the 0-windows: its offset is the nearest one's.
    #[serde(default)]
    pub offset_outside: bool,
    /// The battery in the window, where it was logged.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub supply: Option<Supply>,
    /// Why the window is not used in fits; empty: it is used (if it is of the fitted kind).
    pub rejected: Vec<Rejection>,
}

/// Why a window is not used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Rejection {
    /// A motor output touched its limit.
    Saturated,
    /// The vehicle did not follow the command (|V_U - commanded| > 0.3 m/s).
    NotFollowing,
    /// The log has a gap or too few samples.
    Gap,
    /// The log ends before the window does.
    Incomplete,
    /// The vertical velocity wandered by more than 0.3 m/s (standard deviation) in a hover.
    Manoeuvre,
}

impl Rejection {
    /// The reason as a clause: "the log has a gap".
    pub fn words(self) -> &'static str {
        match self {
            Self::Saturated => "a motor touched its limit",
            Self::NotFollowing => "it did not follow the command",
            Self::Gap => "the log has a gap",
            Self::Incomplete => "the log ends early",
            Self::Manoeuvre => "it moved up and down",
        }
    }
}
