//! Results of the statistics of a hover: scales of the air in space and time with their errors, the
//! horizontal wind, and how long an average must be.
//!
//! Lengths are m, times s, speeds m/s (up positive). The unit of a [`Scale`] is that of the field's
//! name. Wherever a number has `fit_se`, that is the standard error of the curve fit alone, as the
//! paper gives it: it takes the points for independent, which they are not, and is too small by an
//! order of magnitude or more. `interval_95` is the honest one.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::base::estimate::Estimate;

/// Statistics of the map of the air of one hover.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FieldStatistics {
    /// What they are made of.
    pub record: FieldRecord,
    /// Correlation of pairs of drones over their distance (the paper's eq. 8 and Fig. 6a, c, d).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub space: Option<SpaceCorrelation>,
    /// Autocorrelation of the drones over time (the paper's eq. 9 and Fig. 6b).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub time: Option<TimeCorrelation>,
    /// The Gaussian field of maximum likelihood: exponential in space and in time.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub likelihood: Option<FieldModel>,
    /// The same estimates from the data as measured, without each drone's trend, without what all
    /// drones have in common, and without both. Air moves on scales that this changes little; what it
    /// changes much came from drift (a sagging battery is one) or from scales beyond grid and record.
    #[serde(default)]
    pub variants: Vec<Variant>,
    /// The simulated flights that intervals and biases come from.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub simulated: Option<Simulated>,
    /// Horizontal wind from the lean of the drones.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wind: Option<TiltWind>,
    /// How much averages of one length differ.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub averaging: Option<Averaging>,
    /// How long a baseline average must be.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub baseline: Option<Baseline>,
    /// The air that a simulated flight was flown in; absent: not known, or without scales.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub true_air: Option<TrueAir>,
    /// What could not be said, one sentence each with the reason.
    #[serde(default)]
    pub absent: Vec<String>,
}

/// The scales of the air that a simulated flight was flown in.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TrueAir {
    /// The random field with exponential correlations; absent: there is none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub field: Option<TrueField>,
    /// Gusts on top of it.
    #[serde(default)]
    pub gusts: Vec<TrueGusts>,
    /// Vertical motions besides, which no scales describe: thermals, a steady updraft; absent: none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub beside: Vec<String>,
}

/// A random field: `sd² exp(-r / lambda) exp(-|dt| / tau)`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TrueField {
    /// Standard deviation, m/s.
    pub sd_mps: f64,
    /// Correlation length along x of the show frame (1/e), m.
    pub lambda_m: f64,
    /// The same along y, m.
    pub lambda_y_m: f64,
    /// Correlation time in the moving air (1/e), s.
    pub tau_s: f64,
    /// Wind that carries the field past the drones, m/s.
    pub wind_mps: f64,
    /// Whether the correlation is Gaussian, `exp(-(r / lambda)² - (dt / tau)²)`, instead of exponential.
    #[serde(default, skip_serializing_if = "is_false")]
    pub is_gaussian: bool,
    /// The same wind along x and y of the show frame, m/s; absent: its direction is not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub drift_mps: Option<[f64; 2]>,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde asks for a reference")]
fn is_false(value: &bool) -> bool {
    !value
}

/// Gusts with a length of their own.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TrueGusts {
    /// Their spectrum.
    pub spectrum: String,
    /// Standard deviation of each axis, m/s.
    pub sd_mps: f64,
    /// Integral length, m.
    pub length_m: f64,
    /// Correlation time of each drone's own gusts (1/e), s; absent: what the wind makes of the length.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub time_s: Option<f64>,
    /// How fast they are carried along x and y of the show frame, so that drones meet each other's, m/s; absent: not known, or
    /// each drone has its own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub drift_mps: Option<[f64; 2]>,
}

/// The data that the statistics are made of.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FieldRecord {
    /// Drones with a place and a usable series.
    pub drones: usize,
    /// Length of the record, s.
    pub length_s: f64,
    /// Share of (drone, second) without a value, among those drones.
    pub missing_share: f64,
    /// Length of the running mean that the values were taken through, s.
    pub running_mean_s: f64,
    /// Smallest distance between two drones, m.
    pub spacing_m: f64,
    /// Largest distance between two drones, m.
    pub extent_m: f64,
    /// Standard deviation of the values about each drone's mean, m/s, root mean square over drones.
    pub sd_mps: f64,
    /// Standard deviation of the fleet's mean over time, m/s: what all drones have in common.
    pub common_sd_mps: f64,
}

/// From where to where.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Interval {
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// An estimated scale with its errors, in the unit of the field's name.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Scale {
    /// The estimate.
    pub value: f64,
    /// Standard error of the curve fit, as the paper gives it; see the module's note.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fit_se: Option<f64>,
    /// 95 % interval for the true value: 95 of 100 flights in such air give one that holds it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub interval_95: Option<Interval>,
    /// What this estimator reads, on this grid and record, in air of a known scale.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reads: Option<Reads>,
    /// The paper's value and the error that it gives.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub paper: Option<Estimate>,
    /// Set where the numbers above mean nothing: grid and record do not determine the scale.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub undetermined: Option<Undetermined>,
}

/// How little is known of a scale.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Undetermined {
    /// Only that it is longer than the lower end of its interval, if it has one.
    Longer,
    /// Only that it is shorter than the upper end of its interval, if it has one.
    Shorter,
    /// Nothing.
    Unknown,
}

/// An interval over more than this factor determines nothing. Chosen.
const WIDEST: f64 = 100.0;
/// An estimate so many times beyond the end of its own interval reads nothing: its curve was fitted to another scale. Chosen.
const FARTHEST: f64 = 2.0;
/// A lower end this close below the estimate bounds it, as a factor. Chosen.
const BOUNDED: f64 = 10.0;

impl Scale {
    /// Marks an estimate whose curve fit or interval says that it means nothing.
    pub(super) fn judged(mut self) -> Self {
        let no_fit = self.fit_se.is_some_and(|se| se.is_nan() || se >= self.value.abs());
        let wide = self.interval_95.filter(|of| of.low <= 0.0 || of.high > WIDEST * of.low);
        let far = self
            .interval_95
            .is_some_and(|of| self.value * FARTHEST < of.low || self.value > FARTHEST * of.high);
        self.undetermined = match wide {
            _ if no_fit || far => Some(Undetermined::Unknown),
            Some(of) if of.low > 0.0 && self.value < BOUNDED * of.low => Some(Undetermined::Longer),
            Some(of) if self.value > of.high / BOUNDED => Some(Undetermined::Shorter),
            Some(_) => Some(Undetermined::Unknown),
            None => None,
        };
        self
    }

    /// Bound of an undetermined scale, with the words that stand before it: "longer than".
    pub fn bound(&self) -> Option<(&'static str, f64)> {
        let ends = self.interval_95;
        match self.undetermined? {
            Undetermined::Longer => Some(("longer than", ends.map_or(self.value, |of| of.low))),
            Undetermined::Shorter => Some(("shorter than", ends.map_or(self.value, |of| of.high))),
            Undetermined::Unknown => None,
        }
    }
}

/// What an estimator reads in simulated flights of the same drones and the same length.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Reads {
    /// The true scale of the simulated air.
    pub truth: f64,
    /// Median of the estimates.
    pub median: f64,
    /// 5th and 95th percentile of the estimates.
    pub range_90: Interval,
    /// Simulated flights that gave an estimate.
    pub flights: usize,
}

/// Correlation over distance.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SpaceCorrelation {
    /// All pairs of drones (Fig. 6a).
    pub all: DistanceCorrelation,
    /// Pairs with the same y: along x of the show frame (Fig. 6c).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub along_x: Option<DistanceCorrelation>,
    /// Pairs with the same x: along y of the show frame (Fig. 6d).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub along_y: Option<DistanceCorrelation>,
    /// Whether the two directions differ.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub anisotropy: Option<Anisotropy>,
    /// What this grid and record make of it, in a sentence.
    pub words: String,
}

/// Correlation over distance for one choice of pairs.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DistanceCorrelation {
    /// Pairs of the same nominal distance, nearest first.
    pub classes: Vec<DistanceClass>,
    /// The paper's estimate, m: `exp(-r / lambda)` fitted to the medians, all alike.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lambda_m: Option<Scale>,
    /// The same with each median weighted by its simulated variance, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub weighted_lambda_m: Option<Scale>,
    /// `C0 exp(-r / lambda)` fitted to the medians.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub with_nugget: Option<NuggetFit>,
}

/// The pairs of one nominal distance.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DistanceClass {
    /// Nominal distance, m: between the places of the plan.
    pub nominal_m: f64,
    /// Median distance of the pairs, m.
    pub distance_m: f64,
    /// Correlation of each pair, ascending.
    pub correlations: Vec<f64>,
    /// Median (the line in the violins of Fig. 6).
    pub median: f64,
    /// Mean (the dots).
    pub mean: f64,
    /// First and third quartile.
    pub quartiles: Interval,
    /// Standard deviation of the median between simulated flights in the same air: its honest error.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub median_se: Option<f64>,
}

/// An exponential that need not be 1 at distance 0: independent noise and small eddies lower it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct NuggetFit {
    /// Correlation that remains at distance 0.
    pub c0: Estimate,
    /// Length, m.
    pub lambda_m: Scale,
}

/// The lengths along x and y compared.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Anisotropy {
    /// Length along y over length along x (the paper: 2.08).
    pub ratio: f64,
    /// Share of flights in isotropic air whose two lengths differ by this factor or more, either way
    /// round.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub p_value: Option<f64>,
    /// In a sentence.
    pub words: String,
}

/// Autocorrelation over time.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TimeCorrelation {
    /// Lag, s.
    pub lag_s: Vec<f64>,
    /// Mean over drones at each lag. Each drone's value is the mean of the products of all pairs of
    /// its values that are a lag apart (not divided by the length of the record, which would shrink
    /// it).
    pub mean: Vec<f64>,
    /// Standard deviation between drones at each lag.
    pub sd_between_drones: Vec<f64>,
    /// Drones with a value at each lag.
    pub drones: Vec<usize>,
    /// Lag of the first zero crossing of the mean, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub first_zero_s: Option<f64>,
    /// The paper's line through the points up to there.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub line: Option<TimeLine>,
    /// What the length of the record does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub half_record: Option<HalfRecord>,
    /// What this record makes of it, in a sentence.
    pub words: String,
}

/// `A (dt - t0)`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TimeLine {
    /// A, 1/s, with the error of the curve fit.
    pub slope_per_s: Estimate,
    /// t0, s. Its interval and its `reads` are for the t0 that flights of this length give on average
    /// in such air: t0 is no property of the air, as it depends on the length of the record.
    pub t0_s: Scale,
    /// Lags fitted.
    pub points: usize,
}

/// t0 of a shorter record: if it shrinks with it, it is made by the length and not by the air.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct HalfRecord {
    /// Length of each half, s.
    pub length_s: f64,
    /// t0 of the first half, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub first_t0_s: Option<f64>,
    /// t0 of the second half, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub second_t0_s: Option<f64>,
    /// Mean of the halves over the whole: 1 where the length does not matter, 0.5 where it is all.
    pub ratio: f64,
    /// The same ratio in simulated flights.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub simulated_ratio: Option<Reads>,
    /// In a sentence.
    pub words: String,
}

/// A Gaussian field: `sd² exp(-r / lambda) exp(-|dt| / tau)`, independent noise on every drone, and
/// an unknown mean of every drone, seen through the running mean. Fitted to means of blocks as long
/// as the running mean.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FieldModel {
    /// Standard deviation of the air, m/s.
    pub sd_mps: Scale,
    /// Correlation length (1/e), m.
    pub lambda_m: Scale,
    /// Correlation time (1/e), s.
    pub tau_s: Scale,
    /// Standard deviation of the independent part of a block's mean, m/s: noise and small eddies.
    pub nugget_mps: Scale,
    /// Logarithm of the restricted likelihood.
    pub log_likelihood: f64,
    /// Drones used.
    pub drones: usize,
    /// Blocks used of each.
    pub blocks: usize,
    /// Length of a block, s.
    pub block_s: f64,
    /// A scale that ran into the end of the searched range, or another doubt; one sentence each.
    #[serde(default)]
    pub warnings: Vec<String>,
}

/// What was taken out of the data before the estimates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Treatment {
    /// Nothing (but each drone's mean, as always).
    #[default]
    AsMeasured,
    /// A straight line over time, of each drone.
    Detrended,
    /// The mean of all drones at each second.
    CommonRemoved,
    /// Both.
    DetrendedCommonRemoved,
}

impl Treatment {
    /// Name of the treatment, for people.
    pub fn words(self) -> &'static str {
        match self {
            Self::AsMeasured => "as measured",
            Self::Detrended => "each drone's trend removed",
            Self::CommonRemoved => "common mode removed",
            Self::DetrendedCommonRemoved => "trends and common mode removed",
        }
    }
}

/// The estimates after a [`Treatment`], without intervals.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Variant {
    /// What was taken out.
    pub treatment: Treatment,
    /// The paper's length, m, over all pairs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lambda_m: Option<f64>,
    /// The same along x, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lambda_x_m: Option<f64>,
    /// The same along y, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lambda_y_m: Option<f64>,
    /// The paper's time, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub t0_s: Option<f64>,
    /// Length of maximum likelihood, m; the model knows what was taken out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub likelihood_lambda_m: Option<f64>,
    /// Time of maximum likelihood, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub likelihood_tau_s: Option<f64>,
    /// The length ran into the end of the searched range.
    #[serde(default)]
    pub likelihood_lambda_at_end: bool,
    /// The time ran into the end of the searched range.
    #[serde(default)]
    pub likelihood_tau_at_end: bool,
}

/// Simulated flights: fields of the model of maximum likelihood at the same places and seconds, with
/// the same missing values, the same running mean and the estimated noise.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Simulated {
    /// Flights.
    pub flights: usize,
    /// Seed: the same data and seed give the same intervals.
    pub seed: u64,
    /// What they are, in a sentence.
    pub words: String,
}

/// Horizontal wind that the drones lean against.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TiltWind {
    /// Wind at which the drag of the vehicle's box is its weight, m/s; absent: the wind follows from
    /// its rotors' drag as well, or its drag is not known and only leans are given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub drag_speed_mps: Option<f64>,
    /// Mean speed over the fleet, m/s, with the standard error from the spread of the drones.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub speed_mps: Option<Estimate>,
    /// Where the fleet's mean wind comes from, degrees clockwise from north.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from_deg: Option<f64>,
    /// Mean lean of the fleet, degrees.
    pub lean_deg: f64,
    /// Change of the speed by a trim error of 0.2 degrees, m/s: it is not in the speed's own error, as all drones may
    /// have it alike.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub trim_se_mps: Option<f64>,
    /// The drones.
    pub drones: Vec<DroneWind>,
    /// In a sentence.
    pub words: String,
}

/// The wind on one drone.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DroneWind {
    /// Slot number, if planned.
    pub slot: Option<u16>,
    /// Label.
    pub name: String,
    /// Angle of the mean attitude from the vertical, degrees.
    pub lean_deg: f64,
    /// Direction that it leans to, which is where the wind comes from, degrees clockwise from north;
    /// absent: the log has no heading.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from_deg: Option<f64>,
    /// Wind speed, m/s; absent: the drag of the vehicle is not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub speed_mps: Option<f64>,
}

/// Allan deviation of the vertical air speed: how much averages over neighbouring spans differ
/// (divided by the square root of 2).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Averaging {
    /// Length of the averages, s.
    pub averaging_s: Vec<f64>,
    /// Median over the fleet, m/s.
    pub median_mps: Vec<f64>,
    /// Quartiles over the fleet, m/s.
    pub quartiles_mps: Vec<Interval>,
    /// The drones.
    pub drones: Vec<DroneAveraging>,
    /// Averages shorter than this are smoothed by the running mean, and their deviation is too small,
    /// s; 0: there was no running mean.
    pub smoothed_below_s: f64,
    /// Where the fleet's median is smallest: the average that repeats best.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub best: Option<Reached>,
    /// Shortest averages whose deviation is below round values.
    #[serde(default)]
    pub reached: Vec<Reached>,
    /// What the deviations say, in a sentence.
    pub words: String,
}

/// How long a baseline average must be for its mean to be that of the air.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Baseline {
    /// Length of the record that says it, s.
    pub record_s: f64,
    /// The mean of one drone.
    pub drone: BaselineOf,
    /// The mean of all drones; absent: there is one drone, or too few together.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fleet: Option<BaselineOf>,
    /// How long a baseline average must be, in a sentence.
    pub words: String,
}

/// How slowly a mean settles: over a time t it is off by `sigma sqrt(2 T / t)`, with T the air's integral time.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BaselineOf {
    /// Standard deviation of the slow air, m/s.
    pub sd_mps: f64,
    /// 95 % interval of it, m/s.
    pub sd_interval_mps: Interval,
    /// Integral time, s.
    pub integral_time_s: f64,
    /// 95 % interval of it, s.
    pub integral_time_interval_s: Interval,
    /// Whether the record is too short to bound the integral time from above.
    #[serde(default)]
    pub is_open: bool,
    /// Averages for round standard errors.
    pub needed: Vec<NeededAverage>,
}

/// A standard error of a mean and the length of the average that has it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct NeededAverage {
    /// Standard error of the mean, m/s.
    pub error_mps: f64,
    /// Length of the average, min.
    pub minutes: f64,
    /// 95 % interval of it, min.
    pub interval_min: Interval,
}

/// The Allan deviation of one drone at each of [`Averaging::averaging_s`].
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DroneAveraging {
    /// Slot number, if planned.
    pub slot: Option<u16>,
    /// Label.
    pub name: String,
    /// Deviation, m/s; null where gaps leave too few averages.
    pub deviation_mps: Vec<Option<f64>>,
}

/// A deviation and the averaging time that reaches it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Reached {
    /// Allan deviation, m/s.
    pub deviation_mps: f64,
    /// Length of the average, s.
    pub averaging_s: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn judged(value: f64, fit_se: Option<f64>, [low, high]: [f64; 2]) -> Scale {
        let interval_95 = Some(Interval { low, high });
        Scale { value, fit_se, interval_95, ..Scale::default() }.judged()
    }

    #[test]
    fn a_scale_without_meaning_is_told_from_a_vague_one() {
        let bound = |scale: Scale| (scale.undetermined, scale.bound());
        assert_eq!(bound(judged(74.4, Some(2.4), [41.8, 136.0])), (None, None));
        assert_eq!(bound(judged(74.4, None, [20.0, 1_900.0])), (None, None), "vague");
        let long = bound(judged(1_495.0, None, [1_495.0, 1_276_479.0]));
        assert_eq!(long, (Some(Undetermined::Longer), Some(("longer than", 1_495.0))));
        let short = bound(judged(2.0, None, [1e-9, 3.0]));
        assert_eq!(short, (Some(Undetermined::Shorter), Some(("shorter than", 3.0))));
        let nothing = bound(judged(60.3, None, [1.2, 3_631.0]));
        assert_eq!(nothing, (Some(Undetermined::Unknown), None));
        let no_fit = bound(judged(0.74, Some(168.0), [0.5, 2.0]));
        assert_eq!(no_fit, (Some(Undetermined::Unknown), None));
    }
}
