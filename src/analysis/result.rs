//! What an analysis says, as written to `analysis.json` and drawn by the report.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use super::budget::{
    BatteryCorrection, CalibrationAir, CommonError, ErrorBudget, Quality, QualityFlag, Supply,
    TruthCheck,
};
use super::density::Density;
use super::offset::OffsetMap;
use super::statistics::result::FieldStatistics;
use super::wind::Leaning;
use crate::base::estimate::Estimate;
use crate::flight::{Clock, Indicator};
use crate::mission::plan::{Kind, Purpose};

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
    /// What is doubtful about the whole.
    pub warnings: Vec<String>,
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
    /// Statistics over drones of the fitted parameters (Tables I and II).
    pub table: Vec<TableRow>,
    /// The map of the air, for measurements.
    pub map: Option<UpdraftMap>,
    /// Statistics of the map: scales of the air in space and time, wind, averaging times.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub statistics: Option<FieldStatistics>,
    /// Drones whose log was read but gave no law (calibrations) or no value of the map
    /// (measurements).
    #[serde(default)]
    pub unmeasured: Vec<Unmeasured>,
    /// The paper's table that [`FlightAnalysis::table`] is compared with: `I` (simulation) or `II`
    /// (field, for two drones or more); absent: with none.
    #[serde(default)]
    pub paper_table: Option<String>,
    /// What is doubtful about the flight as a whole (logs that contradict each other), one sentence
    /// each.
    #[serde(default)]
    pub warnings: Vec<String>,
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
    pub reason: String,
}

impl UnusedLog {
    /// One sentence that names the file.
    pub fn sentence(&self) -> String {
        if self.reason.contains(&self.source) {
            self.reason.clone()
        } else {
            format!("{}: {}", self.source, self.reason)
        }
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
    pub reason: String,
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
    pub reason: String,
}

/// A drone whose log gave no law, or no value of the map.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Unmeasured {
    /// Slot number, if planned.
    pub slot: Option<u16>,
    /// Label.
    pub name: String,
    /// Why.
    pub reason: String,
}

/// How much of what was asked for an analysis gave.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Yield {
    /// Every drone has its laws, from the fleet's whole ladder, or its value of the map.
    Whole,
    /// Some drones, or some flights, have none, or a law of a part of the ladder.
    Partial,
    /// There is no law and no value of the map at all.
    Nothing,
}

impl FlightAnalysis {
    /// Drones that have what the flight was for: laws, or a value of the map.
    pub fn results(&self) -> usize {
        match self.purpose {
            Purpose::Calibration => self.drones.iter().filter(|one| one.laws.is_some()).count(),
            Purpose::Measurement => self.map.as_ref().map_or(0, |map| map.drones.len()),
        }
    }
}

impl Analysis {
    /// How much of what was asked for there is.
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
    /// Set if the laws rest on clearly less of the ladder than those of the fleet: then they do not
    /// count in [`FlightAnalysis::table`] and [`FlightAnalysis::flock`], and no map uses them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub partial_ladder: Option<PartialLadder>,
    /// Thinned traces for figures.
    pub trace: Trace,
    /// What is doubtful about this drone.
    pub warnings: Vec<String>,
}

/// That a drone's usable legs are fewer than two thirds of the fleet's, or span less than two thirds
/// of its speeds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PartialLadder {
    /// Usable legs of the drone.
    pub usable: Ladder,
    /// Usable legs of the fleet's middle drone.
    pub fleet: Ladder,
}

impl PartialLadder {
    /// `6 of 14 legs, -1.5 to +1.5 m/s`.
    pub fn short(&self) -> String {
        let Ladder { legs, lowest_mps, highest_mps } = self.usable;
        format!("{legs} of {} legs, {lowest_mps:+} to {highest_mps:+} m/s", self.fleet.legs)
    }
}

/// Legs of vertical motion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Ladder {
    /// How many.
    pub legs: usize,
    /// Lowest commanded vertical velocity, m/s, up positive.
    pub lowest_mps: f64,
    /// Highest commanded vertical velocity, m/s, up positive.
    pub highest_mps: f64,
}

/// Statistics of one window.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct WindowStats {
    /// Kind of the segment.
    pub kind: Kind,
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
    pub pulse_us: SampleStats,
    /// Tilt-corrected pulse width u_phi, us.
    pub pulse_phi_us: SampleStats,
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
    /// In words.
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

/// Location and spread of the samples in a window.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SampleStats {
    /// Median.
    pub median: f64,
    /// Mean.
    pub mean: f64,
    /// Standard deviation of the samples.
    pub sd: f64,
    /// Number of samples.
    pub n: usize,
    /// Mean without the lowest and the highest tenth of the samples.
    #[serde(default)]
    pub trimmed: f64,
    /// Standard error of the mean from the means of blocks longer than the signal's memory.
    #[serde(default)]
    pub se: f64,
}

/// The laws fitted to one set of windows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Laws {
    /// `u = A f(V - W) + u0`, f(x) = x|x|, W free.
    pub signed_quadratic: Option<Fit>,
    /// The same with A and u0 held from a reference, only W fitted.
    pub signed_quadratic_held: Option<Fit>,
    /// `u = A' V + u0`.
    pub linear: Option<Fit>,
    /// Scatter of the windows beyond their own measured noise, us: the standard deviation that was
    /// added to every window's error before the fits, chosen so that the better law's chi² became its
    /// degrees of freedom. It is turbulence longer than a window and what the law does not describe.
    /// `None` when the weights do not ask for it or there are no degrees of freedom.
    #[serde(default)]
    pub sigma_added_us: Option<f64>,
}

/// A fitted law.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Fit {
    /// Parameters in the law's order: `A`, `u0`, `W` or `A'`, `u0`.
    pub parameters: Vec<Parameter>,
    /// Covariance of the free parameters, row-major over all parameters (0 where held).
    pub covariance: Vec<f64>,
    /// Points fitted.
    pub points: usize,
    /// Sum of squared residuals over the windows' own errors, before any scatter was added to them
    /// ([`Laws::sigma_added_us`]).
    pub chi2: f64,
    /// That over the degrees of freedom; `None` without any. A statistic: nothing was tuned for it.
    pub chi2_reduced: Option<f64>,
    /// Probability of a chi² at least this large if the law and the sigmas are right.
    #[serde(default)]
    pub p_value: Option<f64>,
    /// Degrees of freedom.
    pub dof: usize,
    /// Unweighted rms residual, us.
    pub rms_us: f64,
    /// Other local minima within a chi2 of 4 of the best: their parameters.
    pub other_minima: Vec<Vec<f64>>,
    /// What is doubtful about this fit.
    pub warnings: Vec<String>,
}

/// One fitted or held parameter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Parameter {
    /// Symbol: `A`, `u0`, `W`, `A'`.
    pub name: String,
    /// Unit: `us/(m/s)²`, `us`, `m/s`, `us/(m/s)`.
    pub unit: String,
    /// Value and standard error; the error is 0, and unknown, without degrees of freedom.
    pub estimate: Estimate,
    /// Held, not fitted.
    pub held: bool,
}

/// One row of Table I or II: a parameter over the fleet.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TableRow {
    /// Law: `signed quadratic` or `linear`.
    pub law: String,
    /// Parameter symbol, or `chi2_nu`.
    pub parameter: String,
    /// Unit.
    pub unit: String,
    /// Mean over drones.
    pub mean: f64,
    /// Standard deviation between drones.
    pub sd: f64,
    /// Mean of the drones' own standard errors.
    pub mean_se: f64,
    /// Drones.
    pub n: usize,
    /// The paper's value and error where it has one.
    pub paper: Option<Estimate>,
    /// Why the two are not to be compared; absent: they are, where the paper has a value.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub not_compared: Option<String>,
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
}

/// Estimated vertical air speed of the fleet over time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct UpdraftMap {
    /// Law used for the inversion: `linear` or `signed quadratic`.
    pub law: String,
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
    pub mapping: String,
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
    /// What is doubtful, by stretches of time.
    #[serde(default)]
    pub quality: Vec<QualityFlag>,
    /// True value at the same times, when it is known.
    pub truth_mps: Option<Vec<f64>>,
}
