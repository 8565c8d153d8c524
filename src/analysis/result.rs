//! Results of an analysis, as written to `analysis.json` and drawn by the report.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use super::beside::{DronePlace, DroneWindSeries};
pub use super::budget::{
    BatteryCorrection, CalibrationAir, CommonError, ErrorBudget, Quality, QualityFlag, Supply,
    TruthCheck,
};
use super::cause::Cause;
pub use super::combine::{CombinedDrone, CombinedIndicator, CombinedMap};
use super::density::Density;
pub use super::fit_warning::FitWarning;
pub use super::fitted::{Fit, Laws, Parameter};
pub use super::headline::{BentLine, Headline};
pub use super::hold::HeldCurve;
use super::kind::{LawKind, LawOf};
pub use super::ladder::{Ladder, PartialLadder};
pub use super::level::{DroneLevel, HeldOut, HeldOutErrors, LevelledMap};
use super::offset::OffsetMap;
pub use super::site::FlightSite;
use super::statistics::result::FieldStatistics;
pub use super::stats::SampleStats;
use super::table::PaperTable;
pub use super::table::TableRow;
pub use super::thermal::Thermal;
pub use super::turbulence::result::*;
use super::warning::Warning;
use super::wind::Leaning;
pub use super::wind_legs::{WindLeg, WindLegs};
pub use super::window::{Rejection, WindowStats};
use crate::base::estimate::Estimate;
use crate::base::sentence::Sentence;
use crate::base::time::GpsTime;
use crate::flight::{Clock, Indicator};
use crate::mission::plan::Purpose;
use crate::numeric::upper_median;

/// Name and version of the analysis format.
pub const ANALYSIS_SCHEMA: &str = "updraft.analysis/1";

/// The analysis of one or several flights of a fleet.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Analysis {
    /// Format name and version: `updraft.analysis/1`.
    pub schema: String,
    /// Program and version that made it.
    pub made_by: String,
    /// Title for people.
    pub title: String,
    /// The flights, calibration first.
    pub flights: Vec<FlightAnalysis>,
    /// The analysis whose laws measure, where they are not those of a flight of this one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub laws_from: Option<LawsFrom>,
    /// What is doubtful about the whole.
    pub warnings: Vec<Warning>,
}

/// An earlier analysis whose laws are held.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LawsFrom {
    /// Path of its file, as it was given.
    pub path: String,
    /// SHA-256 of that file.
    pub sha256: String,
    /// Its title.
    pub title: String,
    /// Number of drones that have laws in its calibration.
    pub drones: usize,
    /// GPS time of show time 0 of that calibration, as the middle one of its logs has it; absent: they have none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub start: Option<GpsTime>,
}

/// One flight of the fleet.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FlightAnalysis {
    /// Short name: `calibration`, `hover`, or the input's file name.
    pub name: String,
    /// What it was for.
    pub purpose: Purpose,
    /// What stands for rotor effort: wherever a name says pulse, and us, it is this and its unit.
    #[serde(default)]
    pub indicator: Indicator,
    /// Whether windows came from a plan (else from the log's desired velocity).
    pub planned: bool,
    /// Direction of the show frame's x axis (forward), degrees clockwise from north; absent without a
    /// plan.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub orientation_deg: Option<f64>,
    /// Place on the globe; absent: neither a plan nor a log says.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub site: Option<FlightSite>,
    /// Name of the place, as the plan has it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub site_name: Option<String>,
    /// Local time there less UTC, h, as the plan has it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub utc_offset_h: Option<f64>,
    /// Whether the simulator wrote the logs.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub simulated: bool,
    /// The true vertical air speed in this flight, m/s, when it was simulated in uniform air.
    pub true_updraft_mps: Option<f64>,
    /// Analysed drones, in slot order.
    pub drones: Vec<DroneAnalysis>,
    /// Logs given. Each is the `source` of one of [`FlightAnalysis::drones`] or stands in
    /// [`FlightAnalysis::unused`].
    #[serde(default)]
    pub logs: usize,
    /// Slots of the plan that no analysed log belongs to, with the reason: there is no log, or what
    /// became of it. With [`FlightAnalysis::unmeasured`] these are the drones without a result.
    pub missing: Vec<Missing>,
    /// Fits to the windows of all drones averaged (the paper's flock mapping), for calibrations.
    pub flock: Option<Laws>,
    /// The law that the windows prefer, for calibrations; absent: not asked for, or the windows do not tell.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub headline: Option<Headline>,
    /// Statistics over drones of the fitted parameters (Tables I and II).
    pub table: Vec<TableRow>,
    /// The map of the air, for measurements.
    pub map: Option<UpdraftMap>,
    /// Statistics of the map: scales of the air in space and time, wind, averaging times.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub statistics: Option<FieldStatistics>,
    /// Turbulence over the hover of a map; absent: drones moved, or their logs or the calibration do not allow it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub turbulence: Option<Turbulence>,
    /// Horizontal legs of known ground speed: what they tell of drag and lift in wind. Absent: none were
    /// flown.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wind_legs: Option<WindLegs>,
    /// Drones whose log was read but gave no law (calibrations) or no value of the map
    /// (measurements).
    #[serde(default)]
    pub unmeasured: Vec<Unmeasured>,
    /// The paper's table that [`FlightAnalysis::table`] is compared with: `I` (simulation) or `II`
    /// (field, for two drones or more); absent: with none.
    #[serde(default)]
    #[schemars(with = "Option<String>")]
    pub paper_table: Option<PaperTable>,
    /// What is doubtful about the flight as a whole (logs that contradict each other), one sentence
    /// each.
    #[serde(default)]
    pub warnings: Vec<Warning>,
    /// Logs that nothing was taken from, those of missing slots among them.
    #[serde(default)]
    pub unused: Vec<UnusedLog>,
    /// Logs that were analysed, but not in full: they end in the air, or are damaged.
    #[serde(default)]
    pub partly_used: Vec<PartlyUsedLog>,
}

/// A log that nothing was taken from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct UnusedLog {
    /// The file, relative to the campaign folder where possible.
    pub source: String,
    /// The slot that it was matched to, else the one that flight record or file name mean; absent:
    /// none of the plan.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub slot: Option<u16>,
    /// Why it is not used.
    pub reason: Cause,
}

impl UnusedLog {
    /// Sentence about the unused log that names its file.
    pub fn sentence(&self) -> Sentence {
        self.reason.about(&self.source)
    }

    /// Whether the reason itself names the file.
    pub fn is_named(&self) -> bool {
        self.reason.sentence().names(&self.source)
    }
}

/// A log that was analysed as far as it goes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PartlyUsedLog {
    /// The file, relative to the campaign folder where possible.
    pub source: String,
    /// Slot number, if the log was matched to a plan.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub slot: Option<u16>,
    /// What is lost of it.
    pub reason: Cause,
    /// Bytes that the reader skipped because no message could be read there.
    #[serde(default)]
    pub skipped_bytes: u64,
}

/// A drone that the plan has and the analysis has not.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Missing {
    /// Slot number.
    pub slot: u16,
    /// Home in the show frame, m (x forward, y left).
    #[serde(default)]
    pub home_m: Option<[f64; 2]>,
    /// Why.
    pub reason: Cause,
}

/// A drone whose log gave no law, or no value of the map.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Unmeasured {
    /// Slot number, if planned.
    pub slot: Option<u16>,
    /// Label.
    pub name: String,
    /// Why.
    pub reason: Cause,
}

/// Completeness of an analysis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Yield {
    /// Every drone has its laws, from the fleet's whole ladder, or its value of the map.
    Whole,
    /// Some drones, or some flights, have none, or a law of a part of the ladder.
    Partial,
    /// No flight has a law or a value of the map.
    Nothing,
}

impl FlightAnalysis {
    /// GPS time of show time 0, as the middle one of the logs has it; `None`: none has GPS time.
    pub fn start(&self) -> Option<GpsTime> {
        let starts = self.drones.iter().filter_map(|drone| drone.clock.start);
        upper_median(starts.map(|start| start.total_ms() as f64).collect())
            .and_then(|ms| GpsTime::from_total_ms(ms as i64))
    }

    /// Number of drones with a result of the kind that the flight was for: laws, or a value of the
    /// map.
    pub fn results(&self) -> usize {
        match self.purpose {
            Purpose::Calibration => self.drones.iter().filter(|one| one.laws.is_some()).count(),
            Purpose::Measurement => self.map.as_ref().map_or(0, |map| map.drones.len()),
        }
    }
}

impl Analysis {
    /// Completeness of the analysis.
    pub fn what_was_found(&self) -> Yield {
        let whole = |flight: &FlightAnalysis| {
            flight.missing.is_empty()
                && flight.results() == flight.drones.len()
                && flight.drones.iter().all(|drone| drone.partial_ladder.is_none())
        };
        if self.flights.iter().all(|flight| flight.results() == 0) {
            Yield::Nothing
        } else if self.flights.iter().all(whole) {
            Yield::Whole
        } else {
            Yield::Partial
        }
    }
}

/// One drone of one flight.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DroneAnalysis {
    /// Slot number, if the log was matched to a plan.
    pub slot: Option<u16>,
    /// Label: slot name or file stem.
    pub name: String,
    /// Log file, relative to the campaign folder where possible.
    pub source: String,
    /// Home in the show frame, m (x forward, y left), if planned.
    pub home_m: Option<[f64; 2]>,
    /// How its clock was aligned.
    pub clock: Clock,
    /// Windows, in time order.
    pub windows: Vec<WindowStats>,
    /// The slow offset of its pulse over time and height, for calibrations in the field.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub offset: Option<OffsetMap>,
    /// Fitted laws, for calibrations.
    pub laws: Option<Laws>,
    /// The line that may bend, for calibrations whose windows prefer it ([`FlightAnalysis::headline`]).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub line: Option<BentLine>,
    /// Set if the laws rest on clearly less of the ladder than those of the fleet: then they do not
    /// count in [`FlightAnalysis::table`] and [`FlightAnalysis::flock`], and no map uses them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub partial_ladder: Option<PartialLadder>,
    /// Thinned traces for figures.
    pub trace: Trace,
    /// What is doubtful about this drone.
    pub warnings: Vec<Warning>,
}

/// Thinned traces of one drone, for figures.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Trace {
    /// Show time, s.
    pub time_s: Vec<f64>,
    /// Height above home, m.
    pub height_m: Vec<f64>,
    /// Vertical velocity, m/s.
    pub velocity_mps: Vec<f64>,
    /// Tilt-corrected pulse width, us.
    pub pulse_phi_us: Vec<f64>,
    /// How far north and east of its home the drone was, m, in whole centimetres; null where its log does not say,
    /// empty where it never does.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub moved_m: Vec<Option<[f64; 2]>>,
}

/// Estimated vertical air speed of the fleet over time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct UpdraftMap {
    /// Law used for the inversion: `linear` or `signed quadratic`.
    #[schemars(with = "String")]
    pub law: LawKind,
    /// Why that law; absent: not told.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub law_reason: Option<String>,
    /// By what the wind on the leaning drones was corrected for; absent: it was not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wind: Option<WindCorrection>,
    /// How the drones lean in wind, where that is the drag of their box alone
    /// ([`WindCorrection::Drag`]).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub leaning: Option<Leaning>,
    /// Density that pulses were referred to before the inversion; absent: not corrected for height.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub density: Option<Density>,
    /// Flock mapping used for the inversion, at that density.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub flock: Option<Laws>,
    /// Common times of all drones, show time s, 1 s apart.
    pub time_s: Vec<f64>,
    /// The drones' estimates.
    pub drones: Vec<DroneUpdraft>,
    /// How pulses were referred to one battery voltage; absent: they were not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub battery: Option<BatteryCorrection>,
    /// Slow air during the calibration, whose mean is the doubt about the zero; absent: the
    /// calibration does not tell.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub calibration_air: Option<CalibrationAir>,
    /// The error that all drones share; absent: not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub common: Option<CommonError>,
    /// Comparison with the true air, when it is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub truth: Option<TruthCheck>,
    /// Set where the law is a vehicle's response with its level fitted to the flight.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub levelled: Option<LevelledMap>,
    /// The map from several indicators together, where that was asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub combined: Option<CombinedMap>,
    /// The map as one estimate of all drones, seconds and the calibration together; absent: too few values, or
    /// drones without places or errors.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub posterior: Option<PosteriorMap>,
    /// Thermals: columns of rising air that no stationary field explains, the most certain first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub thermals: Vec<Thermal>,
}

/// What all values of a flight say together: a uniform updraft, a Gaussian field that may drift with the wind,
/// gusts of each drone's own, and what is not known well of the drones' laws
/// ([`DroneUpdraft::posterior_mps`] has the values).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PosteriorMap {
    /// Mean over all drones and seconds, m/s, up positive.
    pub fleet: Option<Estimate>,
    /// The air where the plan has a drone and the flight has no values.
    #[serde(default)]
    pub filled: Vec<FilledDrone>,
    /// The air between the drones, every 10 s; absent: they moved.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub grid: Option<PosteriorGrid>,
    /// Scales of the air; absent: no stationary field describes it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scales: Option<AirScales>,
    /// Why there are no scales.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub no_scales: Option<String>,
    /// What the flight itself and the air's scales add to the values that the calibration's law alone gives, m/s:
    /// the mean over all.
    pub zero_shift_mps: f64,
    /// Probability that there is an updraft which is everywhere and always the same.
    pub uniform_probability: f64,
    /// Comparison of the posterior with the true air, when it is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub truth: Option<TruthCheck>,
}

/// The air on a grid over the fleet: posterior means of the 10 s around a time, with their standard deviations.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PosteriorGrid {
    /// Show times, s.
    pub time_s: Vec<f64>,
    /// Columns in the show frame (x forward), m.
    pub x_m: Vec<f64>,
    /// Rows in the show frame (y left), m.
    pub y_m: Vec<f64>,
    /// Height above home, m.
    pub height_m: f64,
    /// By time, row and column, m/s, up positive; null: nothing is known there.
    pub updraft_mps: Vec<Vec<Vec<Option<f64>>>>,
    /// Standard deviations likewise, all origins of error included, m/s.
    pub sd_mps: Vec<Vec<Vec<Option<f64>>>>,
}

/// The air at a place of the plan without values.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FilledDrone {
    /// Slot number.
    pub slot: u16,
    /// Place in the show frame, m (x forward, y left).
    pub position_m: [f64; 2],
    /// Posterior mean at each of [`UpdraftMap::time_s`], m/s, up positive.
    pub posterior_mps: Vec<Option<f64>>,
    /// Its standard deviation, m/s.
    pub posterior_sd_mps: Vec<Option<f64>>,
}

/// Scales of the air by the likelihood of all values.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct AirScales {
    /// How the correlation falls with distance and time: `exponential`, `Gaussian`, or `two-thirds`
    /// (`exp(-(r/length)^(2/3) - (t/time)^(2/3))`, as within turbulence).
    pub form: String,
    /// Standard deviation of the field, m/s.
    pub sd_mps: f64,
    /// Distance at which the field's correlation has fallen to 1/e, m.
    pub length_m: PosteriorScale,
    /// Time after which it has, for who drifts along, s.
    pub time_s: PosteriorScale,
    /// How fast the field drifts, along show x (forward) and y (left), m/s.
    pub drift_mps: [f64; 2],
    /// Standard deviation of each drone's own gusts, m/s.
    pub gust_mps: f64,
    /// Their time scale, s.
    pub gust_s: f64,
    /// Standard deviation of slow air besides, which does not drift and varies over 145 m and 186 s, m/s.
    #[serde(default)]
    pub slow_mps: f64,
}

/// A scale with its uncertainty.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PosteriorScale {
    /// Most probable value.
    pub value: f64,
    /// 95 % interval.
    pub interval: [f64; 2],
}

/// By what the wind on leaning drones was corrected for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum WindCorrection {
    /// The drag of the simulated vehicle's box: the wind's part along the rotor axis.
    Drag,
    /// The physics of the vehicle's file: rotor drag, body drag, flow along the axis, translational
    /// lift, by the lean.
    Physics,
}

impl UpdraftMap {
    /// Whether drones moved along tracks.
    pub fn is_scan(&self) -> bool {
        self.drones.iter().any(|drone| !drone.track_m.is_empty())
    }
}

/// One drone's estimate of the vertical air speed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DroneUpdraft {
    /// Slot number, if planned.
    pub slot: Option<u16>,
    /// Label.
    pub name: String,
    /// Position in the show frame, m (x forward, y left).
    pub position_m: Option<[f64; 2]>,
    /// Where a drone that moved was at each of [`UpdraftMap::time_s`], show frame, m (x forward, y
    /// left, z above home); null where its log does not say, empty for a drone that hovered.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub track_m: Vec<Option<[f64; 3]>>,
    /// Height above home, m; along a track the mean.
    pub height_m: f64,
    /// Mapping used: `own` or `flock`.
    #[schemars(with = "String")]
    pub mapping: LawOf,
    /// Mean over the hover, m/s, up positive, with its standard error: that of
    /// [`DroneUpdraft::errors`], which holds all origins.
    pub mean: Estimate,
    /// Interval that holds the true mean with a probability of 95 %, m/s; absent: not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mean_interval_mps: Option<[f64; 2]>,
    /// Where the error of the mean comes from.
    #[serde(default)]
    pub errors: ErrorBudget,
    /// Systematic error of the mean from wind on the leaning drone, m/s: a bound, not a standard
    /// error, and the same in sign for drones in the same wind.
    #[serde(default)]
    pub systematic_mps: f64,
    /// Mean lean in the hover, degrees.
    #[serde(default)]
    pub tilt_deg: f64,
    /// Running 10 s estimate at each of [`UpdraftMap::time_s`], m/s; null where the log has none.
    pub updraft_mps: Vec<Option<f64>>,
    /// Statistical error of each value (its own noise alone), m/s; empty: not known.
    #[serde(default)]
    pub sd_mps: Vec<Option<f64>>,
    /// Interval that holds the true value with a probability of 95 %, all origins of error
    /// included, m/s; empty: not known.
    #[serde(default)]
    pub interval_mps: Vec<Option<[f64; 2]>>,
    /// Posterior mean of the air's running 10 s mean at each of [`UpdraftMap::time_s`], m/s, with gaps filled from
    /// neighbours ([`UpdraftMap::posterior`]); empty: there is none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub posterior_mps: Vec<Option<f64>>,
    /// Its standard deviation, all origins of error included, m/s.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub posterior_sd_mps: Vec<Option<f64>>,
    /// Posterior of the mean over the drone's seconds, m/s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub posterior_mean: Option<Estimate>,
    /// What is doubtful, by stretches of time.
    #[serde(default)]
    pub quality: Vec<QualityFlag>,
    /// True value at the same times, when it is known; null at times at which it is not.
    pub truth_mps: Option<Vec<Option<f64>>>,
    /// Where it was on the globe; absent: its log does not say.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub place: Option<DronePlace>,
    /// Horizontal wind on it; absent: the drag of the vehicle or the heading is not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wind: Option<DroneWindSeries>,
}

impl DroneUpdraft {
    /// True value at one of [`UpdraftMap::time_s`], m/s, where it is known.
    pub fn truth_at(&self, index: usize) -> Option<f64> {
        self.truth_mps.as_ref()?.get(index).copied().flatten()
    }
}
