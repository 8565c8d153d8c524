//! The words for errors of the map of the air: where they come from, what is common to the fleet,
//! what is doubtful, and how the map compares with a known truth.
//!
//! All errors are of the *mean of the true air* over the time that a value speaks of (10 s for a
//! value of the series, the hover for a mean). The scatter of the air itself is no error.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Standard errors of a drone's mean, by origin, m/s. Origins are independent of each other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct ErrorBudget {
    /// Noise of pulse and velocity in the hover: the drone's own.
    pub window_mps: f64,
    /// The drone's law apart from the common zero: noise of its calibration windows, local air
    /// there, slope and curvature.
    pub law_mps: f64,
    /// The zero: slow air during the calibration that the whole fleet shared (common).
    pub zero_mps: f64,
    /// What a change of battery voltage does beyond its correction, and other drift with time since
    /// take-off (common).
    pub battery_mps: f64,
    /// What wind on the leaning drone does beyond its correction (common).
    pub wind_mps: f64,
    /// What air density does beyond its correction (common).
    pub density_mps: f64,
    /// Bias of the vertical velocity.
    pub velocity_mps: f64,
    /// All of these: the root of the sum of squares.
    pub total_mps: f64,
}

/// The part of the map's error that all drones share, as standard errors of the fleet's mean over
/// the hover, m/s. Averaging over drones does not reduce it; differences between drones are free of
/// it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct CommonError {
    /// All of it.
    pub se_mps: f64,
    /// Half width of its 95 % interval (more than 1.96 standard errors where the strength of the
    /// slow air during the calibration is itself uncertain).
    pub half_width_mps: f64,
    /// See [`ErrorBudget::zero_mps`].
    pub zero_mps: f64,
    /// See [`ErrorBudget::battery_mps`].
    pub battery_mps: f64,
    /// See [`ErrorBudget::wind_mps`].
    pub wind_mps: f64,
    /// See [`ErrorBudget::density_mps`].
    pub density_mps: f64,
    /// Slope and curvature of the law, as far as the fleet shares their errors.
    pub law_mps: f64,
}

/// Slow air during a calibration, as its windows show it: posterior medians with 95 % intervals.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct CalibrationAir {
    /// Standard deviation of the updraft that the fleet shared, m/s.
    pub sd_mps: f64,
    /// Its interval, m/s.
    pub sd_interval_mps: [f64; 2],
    /// Its time scale, s.
    pub time_scale_s: f64,
    /// Interval of the time scale, s.
    pub time_scale_interval_s: [f64; 2],
    /// Standard deviation of the updraft that each drone met alone, m/s.
    pub local_sd_mps: f64,
}

/// The battery in a window.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Supply {
    /// Mean voltage without load, V: as logged, else from voltage, current and resistance.
    pub resting_v: f64,
    /// Mean electrical power, W; 0 where no current was logged.
    pub power_w: f64,
    /// Resistance of the pack, ohm; 0 where it is not known.
    pub resistance_ohm: f64,
}

/// How pulses were referred to one battery voltage: `u - 1000` goes with `(V_ref / V)^exponent`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BatteryCorrection {
    /// Voltage that pulses are referred to, V.
    pub reference_v: f64,
    /// Exponent.
    pub exponent: f64,
    /// Standard error of the exponent, common to the fleet.
    pub exponent_se: f64,
}

/// What is doubtful about a drone's values.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum Quality {
    /// A motor output touched its limit.
    Saturation,
    /// The battery was nearly empty.
    LowBattery,
    /// The log has a gap: no values.
    Gap,
    /// The log ends, or the drone comes down, before the hover does: no values behind.
    Incomplete,
    /// The drone moved up or down, or did not hold the commanded speed: no values.
    Manoeuvre,
    /// Its clock may be off against the other drones'.
    Misaligned,
    /// The pulse drifted through the hover by more than the error allows for.
    Drift,
    /// No battery voltage was logged: pulses are not corrected for it, a bound is in the error.
    NoVoltage,
    /// The air was faster than the calibration's speeds reach.
    BeyondLadder,
}

impl Quality {
    /// The quality as a clause for people: "the log has a gap".
    pub fn words(self) -> &'static str {
        match self {
            Self::Saturation => "a motor touched its limit",
            Self::LowBattery => "the battery was nearly empty",
            Self::Gap => "the log has a gap",
            Self::Incomplete => "the log ends early",
            Self::Manoeuvre => "it moved up and down",
            Self::Misaligned => "its clock may be off",
            Self::Drift => "the pulse drifted",
            Self::NoVoltage => "no battery voltage in the log",
            Self::BeyondLadder => "the air was faster than the ladder",
        }
    }

    /// Whether seconds with this flag have no value.
    pub fn excludes(self) -> bool {
        matches!(self, Self::Saturation | Self::Gap | Self::Incomplete | Self::Manoeuvre)
    }
}

/// A stretch of a drone's hover that is doubtful.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct QualityFlag {
    /// What is.
    pub flag: Quality,
    /// From this show time, s.
    pub start_s: f64,
    /// To this show time, s.
    pub end_s: f64,
    /// One phrase for people, with numbers.
    pub reason: String,
}

/// How a map compares with the true air, where that is known (simulation).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct TruthCheck {
    /// Drones compared.
    pub drones: usize,
    /// Values compared (a value is one drone in one second).
    pub values: usize,
    /// Root mean square of estimate less truth over all values, m/s.
    pub rms_mps: f64,
    /// Root mean square of the truth itself, m/s: the error of answering zero everywhere.
    #[serde(default)]
    pub zero_rms_mps: f64,
    /// Mean of estimate less truth, m/s.
    pub bias_mps: f64,
    /// Root mean square without that mean, m/s: what is left when the common zero is known.
    pub rms_without_bias_mps: f64,
    /// Share of the true values inside of their 95 % intervals; absent: they have none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub inside_share: Option<f64>,
    /// Share of the drones whose true mean is inside of the interval of their mean; absent likewise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub means_inside_share: Option<f64>,
    /// Root mean square error of the best linear estimate with the true covariances of the air and of all errors, m/s
    /// (at one second in ten); absent: these are not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub limit_rms_mps: Option<f64>,
    /// That of this map at the same places and seconds, m/s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub at_limit_rms_mps: Option<f64>,
    /// Standard error that the best linear estimate states for the mean of its values, m/s: where `limit_rms_mps` is far above
    /// it, the air of this flight is an unusual one. Absent as `limit_rms_mps` is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub limit_se_mps: Option<f64>,
}
