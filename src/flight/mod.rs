//! One drone's log as time series in show time.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::base::time::GpsTime;

/// A channel: samples with their own times.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Series {
    /// Show time of each sample, s, increasing.
    pub time_s: Vec<f64>,
    /// The samples.
    pub value: Vec<f64>,
}

/// What one drone's log says about one flight.
#[derive(Clone, Debug, Default)]
pub struct Flight {
    /// The log file.
    pub source: PathBuf,
    /// MAVLink system id (`SYSID_THISMAV`), if the log has it.
    pub system_id: Option<u8>,
    /// How board time became show time.
    pub clock: Clock,
    /// Vertical velocity V_U, m/s, up positive (EKF).
    pub velocity_up_mps: Series,
    /// Height above home (EKF origin), m, up positive.
    pub height_m: Series,
    /// Position north and east of the EKF origin, m.
    pub north_m: Series,
    /// See [`Flight::north_m`].
    pub east_m: Series,
    /// Rotor control pulse width: mean over the motors, us.
    pub pulse_us: Series,
    /// Largest motor output at each sample of [`Flight::pulse_us`], us (for saturation).
    pub pulse_max_us: Series,
    /// Smallest motor output at each sample, us.
    pub pulse_min_us: Series,
    /// Roll, radians.
    pub roll_rad: Series,
    /// Pitch, radians.
    pub pitch_rad: Series,
    /// Desired vertical velocity, m/s, up positive, where the log has it.
    pub desired_up_mps: Option<Series>,
    /// Battery voltage, V.
    pub voltage_v: Option<Series>,
    /// Battery current, A.
    pub current_a: Option<Series>,
    /// Show stage (0..9), at its changes: (show time s, stage).
    pub stages: Vec<(f64, u8)>,
    /// When motors were armed, (start, end) show time s.
    pub armed_s: Vec<(f64, f64)>,
    /// What is doubtful about this log, one sentence each.
    pub warnings: Vec<String>,
}

/// How a log's board time became show time: `show_s = board_s - offset_s`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Clock {
    /// Where the alignment came from.
    pub method: Alignment,
    /// Board time of show time 0, s.
    pub offset_s: f64,
    /// Spread of the alignment over the flight, s.
    pub residual_s: f64,
    /// GPS time of show time 0, if known.
    pub start: Option<GpsTime>,
}

/// Where the alignment of board time with show time came from, best first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Alignment {
    /// SHOW rows carry the show clock.
    ShowRows,
    /// GPS time and the known start of the show.
    GpsTime,
    /// The plan's velocity profile matched to the log's desired (or measured) velocity.
    Plan,
    /// Nothing to align with: seconds since take-off.
    #[default]
    Takeoff,
}
