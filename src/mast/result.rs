//! Numbers of a comparison with a mast, as they are written.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use turbulence_statistics::Moment;
use turbulence_statistics::spectrum::{Band, CrossBand};

/// Format name and version.
pub const MAST_SCHEMA: &str = "updraft.mast-comparison/1";

/// A campaign beside a mast.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MastComparison {
    /// Format name and version: [`MAST_SCHEMA`].
    pub schema: String,
    /// Program and version.
    pub made_by: String,
    /// Title of the campaign.
    pub campaign: String,
    /// Name of the mast.
    pub mast: String,
    /// Height of its instrument above the ground, m, if known.
    pub mast_height_m: Option<f64>,
    /// Distance between its values, s.
    pub mast_step_s: f64,
    /// Duration of the means that its values are, s, where it is slow and compared in these; absent: in means over 10 s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mast_mean_s: Option<f64>,
    /// Flights that were compared.
    pub flights: Vec<MastFlight>,
    /// Flights that could not be compared, with the reason, and doubts.
    pub notes: Vec<String>,
}

/// A flight beside the mast.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MastFlight {
    /// Name of the flight.
    pub flight: String,
    /// Times of the first and the last second that both have, UTC, ms since 1970.
    pub span_ms: [i64; 2],
    /// Time over which both are averaged, s: 10, or the means of a slow mast.
    pub mean_s: f64,
    /// Whether the drones' values are those of the posterior, all drones together; variances, spectra and coherence are of
    /// each drone's own values in any case. Absent: all are each drone's own.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub is_posterior: bool,
    /// Mean of all drones against the mast.
    pub fleet: Matched,
    /// Each drone against the mast, the nearest first.
    pub drones: Vec<MastDrone>,
    /// The fleet's mean against the mast in longer averages.
    pub averages: Vec<Average>,
    /// Means of a slow mast within the flight.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub periods: Vec<MastPeriod>,
    /// Variances of w within these means; absent: the mast does not tell them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub period_variance: Option<PeriodVariance>,
    /// Variance of the mast's ten-second means over the flight, (m/s)².
    pub mast_variance: Option<Moment>,
    /// Variance of all of the mast's values over the flight, (m/s)²: with what ten-second means lose; absent of slow
    /// means.
    pub mast_variance_all: Option<f64>,
    /// Mean variance of the drones' ten-second means, without their noise, (m/s)².
    pub drone_variance: Option<Moment>,
    /// Spectrum of the mast's ten-second means.
    pub mast_spectrum: Vec<Band>,
    /// Mean spectrum of the drones' ten-second means.
    pub drone_spectrum: Vec<Band>,
    /// Coherence of the nearest drone with the mast.
    pub coherence: Vec<CrossBand>,
    /// Shift of the mast's record at which the fleet's mean follows it best, s (positive: the drones see the air later),
    /// with the correlation there.
    pub best_shift: Option<[f64; 2]>,
    /// Wind of the fleet against the mast's, towards east and north, if both are known.
    pub wind: Option<[Matched; 2]>,
    /// Ten-second means of mast, fleet and nearest drone, for figures.
    #[serde(skip)]
    pub series: MastSeries,
}

/// A mean of a slow mast beside the same seconds of the drones.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MastPeriod {
    /// Time of its middle, UTC, ms since 1970.
    pub middle_ms: i64,
    /// Mast, m/s.
    pub mast_mps: f64,
    /// Mean of the drones, m/s.
    pub fleet_mps: f64,
    /// Nearest drone, m/s.
    pub nearest_mps: Option<f64>,
    /// Variance of w within the mean by the mast, (m/s)².
    pub mast_variance: Option<f64>,
    /// The same at a drone, mean of the drones, without their noise, (m/s)².
    pub drone_variance: Option<f64>,
}

/// Variances of w within the means of a slow mast.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PeriodVariance {
    /// Number of means.
    pub count: usize,
    /// Mean of the mast's variances, (m/s)².
    pub mast: f64,
    /// Mean of the drones', (m/s)².
    pub drones: f64,
    /// Standard error of the mean difference by its scatter; absent of fewer than three.
    pub difference_se: Option<f64>,
    /// Whether the drones' has the eddies alone that means over ten seconds have: a part of the mast's.
    pub is_slow_part: bool,
}

/// Ten-second means at the seconds that both have.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MastSeries {
    /// Seconds since the first one.
    pub time_s: Vec<f64>,
    /// Mast, m/s; NaN: not known. A slow mast's mean stands in all of its seconds.
    pub mast: Vec<f64>,
    /// Mean of the drones, m/s; NaN: not known.
    pub fleet: Vec<f64>,
    /// Standard error of that mean, all errors included, m/s.
    pub fleet_se: Vec<f64>,
    /// Nearest drone, m/s; NaN: not known.
    pub nearest: Vec<f64>,
}

/// A drone beside the mast.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MastDrone {
    /// Label of the drone.
    pub drone: String,
    /// Slot, if it has one.
    pub slot: Option<u16>,
    /// Horizontal distance from the mast, m, if both places are known.
    pub distance_m: Option<f64>,
    /// Height above the mast's instrument, m, if both are known.
    pub above_m: Option<f64>,
    /// Agreement of the ten-second means.
    pub matched: Matched,
    /// Share of the seconds in which the mast is inside of the drone's 95 % interval.
    pub inside_share: f64,
    /// Variance of the drone's ten-second means, without its noise, (m/s)².
    pub variance: Option<Moment>,
}

/// Agreement of two records of means.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Matched {
    /// Number of times that both have.
    pub count: usize,
    /// Mean of what the mast says, m/s.
    pub mast_mean_mps: f64,
    /// Mean difference, drones less mast, m/s.
    pub bias_mps: f64,
    /// Standard error of that mean by the differences themselves, their correlation counted, m/s: of sampling alone. Absent
    /// of fewer than three.
    pub bias_se_mps: Option<f64>,
    /// Standard error of the drones' mean as they state it, m/s.
    pub stated_se_mps: Option<f64>,
    /// Root mean square difference, m/s.
    pub rms_mps: f64,
    /// The same about the bias, m/s.
    pub sd_mps: f64,
    /// Correlation; absent: one of both does not vary.
    pub correlation: Option<f64>,
    /// Slope of the line by least squares, drones on mast.
    pub slope: Option<f64>,
    /// Its value where the mast says 0, m/s.
    pub intercept_mps: Option<f64>,
}

/// Agreement in averages of one length.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Average {
    /// Length of the averages, s.
    pub length_s: f64,
    /// Agreement of the fleet's mean.
    pub fleet: Matched,
    /// Agreement of the nearest drone alone.
    pub nearest: Matched,
}
