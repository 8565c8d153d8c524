//! One drone's log as time series in show time.
//!
//! This is the border where NED becomes up-positive, board time becomes show time, and the message
//! names of different firmwares become one set of channels:
//!
//! | channel | messages, best first |
//! |---|---|
//! | velocity, height, position | XKF1, NKF1, EKF1 (core 0, or the primary core) |
//! | pulses | RCOU, channels by SERVOn_FUNCTION 33..40, else C1..C4 |
//! | rotor speeds | ESC |
//! | electrical power | BAT, CURR |
//! | roll, pitch, heading | ATT |
//! | desired vertical velocity | GUIP, PSCD, CTUN |
//! | battery | BAT (with the voltage at rest), CURR |
//! | show time and stage | SHOW |
//! | place on the globe | POS, GPS |

mod align;
mod channels;
#[cfg(test)]
mod channels_tests;
mod choose;
mod clean;
mod fit;
pub mod identity;
mod indicator;
mod load;
mod pick;
mod place;
mod series;
mod supply;
pub mod table;
mod warning;

use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::base::plain::Shown as _;
use crate::base::time::GpsTime;
use crate::log::{Log, LogError, ScanStats};
use crate::mission::plan::Segment;

pub(crate) use align::planned_up_mps;
pub use fit::share_flown;
pub use identity::{Belongs, Identity, identify};
pub use indicator::{Effort, Indicator};
pub use place::{Place, PlaceBy};
pub use warning::{Loss, Warning};

/// A channel: samples with their own times.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Series {
    /// Show time of each sample, s, increasing.
    pub time_s: Vec<f64>,
    /// Value of each sample, in the unit of the series.
    pub value: Vec<f64>,
}

/// One drone's flight as its log tells it: time series in show time.
#[derive(Clone, Debug, Default)]
pub struct Flight {
    /// Path of the log file.
    pub source: PathBuf,
    /// MAVLink system id (`SYSID_THISMAV`), if the log has it.
    pub system_id: Option<u8>,
    /// Conversion from board time to show time.
    pub clock: Clock,
    /// Vertical velocity V_U, m/s, up positive (EKF).
    pub velocity_up_mps: Series,
    /// Height above home (EKF origin), m, up positive.
    pub height_m: Series,
    /// Position north of the EKF origin, m.
    pub north_m: Series,
    /// Position east of the EKF origin, m.
    pub east_m: Series,
    /// Rotor effort: mean over the motors.
    pub effort: Effort,
    /// Largest motor output over time, us (for saturation).
    pub pulse_max_us: Series,
    /// Smallest motor output over time, us.
    pub pulse_min_us: Series,
    /// Roll, rad, right side down positive.
    pub roll_rad: Series,
    /// Pitch, rad, nose up positive.
    pub pitch_rad: Series,
    /// Heading, degrees clockwise from north; empty if the log has none. It jumps at north.
    pub yaw_deg: Series,
    /// Desired vertical velocity, m/s, up positive, where the log has it.
    pub desired_up_mps: Option<Series>,
    /// Desired horizontal speed, m/s, where the log has it (tells horizontal legs from hovers).
    pub desired_horizontal_mps: Option<Series>,
    /// Battery voltage, V, if the log has it.
    pub voltage_v: Option<Series>,
    /// Battery current, A, if the log has it.
    pub current_a: Option<Series>,
    /// True vertical velocity of the air, m/s, up positive, where something beside the drone measured
    /// it.
    pub truth_up_mps: Option<Series>,
    /// Battery voltage without load, V: as the autopilot estimates it (`BAT.VoltR`), or by voltage and current
    /// where its estimate has not settled. Unlike the voltage at the terminals it does not follow the pulse.
    pub resting_v: Option<Series>,
    /// Resistance of the battery, ohm: as the autopilot found it (`BAT.Res`, median), or by voltage and current.
    pub resistance_ohm: Option<f64>,
    /// Show stage (0..9), at its changes: (show time s, stage).
    pub stages: Vec<(f64, u8)>,
    /// Intervals in which the motors were armed, (start, end) show time, s.
    pub armed_s: Vec<(f64, f64)>,
    /// Pulse widths between which the autopilot keeps a spinning motor, us: (lowest, highest).
    pub pulse_limits_us: (f64, f64),
    /// Share of the square in the motors' thrust that the autopilot counts with (`MOT_THST_EXPO`), if the log has it.
    pub thrust_expo: Option<f64>,
    /// Largest lean that the autopilot lets its position controller ask for, degrees (`PSC_ANGLE_MAX`, else `ANGLE_MAX`), if the log
    /// has it.
    pub lean_limit_deg: Option<f64>,
    /// Place where the vehicle was armed or first had a fix: (latitude, longitude), degrees.
    pub first_fix_deg: Option<(f64, f64)>,
    /// Place on the globe over time; absent: the log has none.
    pub place: Option<Place>,
    /// Height above home at which the vehicle was when the log ended with its motors running, m;
    /// `None` if the log goes on until the vehicle is on the ground.
    pub cut_off_at_m: Option<f64>,
    /// Statistics of the log's reader: messages, damage, unknown types.
    pub scan: ScanStats,
    /// Doubts about this log, one sentence each.
    pub warnings: Vec<Warning>,
}

/// Knowledge about a flight from beside its log.
#[derive(Clone, Copy, Debug, Default)]
pub struct FlightOptions<'a> {
    /// GPS time of show time 0: which flight of a log with several is meant, and when it began in
    /// logs without SHOW rows.
    pub start: Option<GpsTime>,
    /// Indicator of rotor effort to read.
    pub indicator: Indicator,
    /// Planned segments, which give the show time of logs that have neither SHOW rows nor a start
    /// time.
    pub segments: Option<&'a [Segment]>,
}

/// A log is not usable as a flight.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum FlightError {
    /// The log could not be read.
    #[error(transparent)]
    Log(#[from] LogError),
    /// The file has no messages at all.
    #[error(
        "{}: the log is empty (was it copied before the drone finished writing it?)",
        source_path.shown()
    )]
    Empty {
        /// Path of the log file.
        source_path: PathBuf,
    },
    /// A message that the analysis cannot do without is missing.
    #[error("{}: the log has no {what} ({messages}); {remedy}", source_path.shown())]
    Missing {
        /// Path of the log file.
        source_path: PathBuf,
        /// Name of the missing quantity, for people.
        what: &'static str,
        /// Message names that would carry it.
        messages: &'static str,
        /// Remedy, as a clause.
        remedy: &'static str,
    },
    /// A column that the analysis cannot do without has no number in it.
    #[error(
        "{}: {columns} in the log holds not one number: the position filter had failed, or the log \
         is damaged; fetch the log again, and do not use the drone if it stays so",
        source_path.shown()
    )]
    NoNumbers {
        /// Path of the log file.
        source_path: PathBuf,
        /// The columns, as `MESSAGE.FIELD`.
        columns: String,
    },
    /// The values of a message that the analysis cannot do without are all impossible.
    #[error(
        "{}: {columns} in the log holds no value that can be one ({range}): the log is damaged; \
         fetch it again",
        source_path.shown()
    )]
    OutOfRange {
        /// Path of the log file.
        source_path: PathBuf,
        /// The message or column.
        columns: String,
        /// Range of believable values, for people.
        range: &'static str,
    },
    /// The vehicle never armed or never left the ground.
    #[error("{}: no flight in this log: {reason}", source_path.shown())]
    NoFlight {
        /// Path of the log file.
        source_path: PathBuf,
        /// Observation that the log offers instead of a flight, as a clause.
        reason: String,
    },
}

impl Flight {
    /// Losses of this flight, one phrase each as in [`Flight::warnings`]: a log that ends in the
    /// air, or damage that its reader skipped. Empty if nothing is lost.
    pub fn losses(&self) -> Vec<Loss> {
        let cut_off = self.cut_off_at_m.map(|height_m| Loss::CutOff { height_m });
        cut_off.into_iter().chain(Loss::of(&self.scan)).collect()
    }

    /// Reads one flight of a log.
    ///
    /// With several flights or boots in the log, the one of the start ([`FlightOptions::start`]) that
    /// flew the plan is read ([`FlightOptions::segments`]); without a plan the last one that performed a show, else the
    /// last armed one. [`Flight::warnings`] says so.
    ///
    /// # Errors
    ///
    /// [`FlightError`]: an empty log, no EKF velocity, no motor outputs, no attitude, or no flight.
    pub fn from_log(
        log: &Log,
        source: &Path,
        options: FlightOptions<'_>,
    ) -> Result<Self, FlightError> {
        choose::load(log, source, options)
    }

    /// Opens and reads a log file; see [`Flight::from_log`].
    ///
    /// # Errors
    ///
    /// If the file is no log, or as [`Flight::from_log`].
    pub fn open(path: &Path, options: FlightOptions<'_>) -> Result<Self, FlightError> {
        Self::from_log(&Log::open(path)?, path, options)
    }
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
