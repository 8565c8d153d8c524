//! Results of a study, as written to `study.json` and drawn by the report.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::cell::Condition;
use super::regression::Regression;
use crate::analysis::law::Symbol;
use crate::analysis::result::{Rejection, SampleStats};
use crate::base::estimate::Estimate;

/// Name and version of the format of results.
pub const STUDY_RESULT_SCHEMA: &str = "updraft.study-result/1";

/// A finished study.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StudyResult {
    /// Format name and version: `updraft.study-result/1`.
    pub schema: String,
    /// Program and version that made it.
    pub made_by: String,
    /// Title for people.
    pub title: String,
    /// Mission template that was flown.
    pub template: String,
    /// Vehicle that flew.
    pub vehicle: String,
    /// Ground height above mean sea level, m.
    pub ground_amsl_m: f64,
    /// Seed of the study.
    pub seed: u64,
    /// Vertical air speeds of each condition, m/s, up positive.
    pub updrafts_mps: Vec<f64>,
    /// Windows over all flights.
    pub windows: WindowCount,
    /// Fitted the paper's way: medians, weighted by the standard deviation in the window.
    pub paper_way: Evaluation,
    /// Fitted this program's way: trimmed means, weighted by their standard errors.
    pub own_way: Evaluation,
    /// The flights: the updrafts of each condition, in the study's order.
    pub flights: Vec<StudyFlight>,
    /// Flights that could not be flown.
    pub lost: Vec<LostFlight>,
}

/// Moving windows: how many there are, and what became of them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct WindowCount {
    /// Legs with a window.
    pub moving: usize,
    /// Used in fits.
    pub used: usize,
    /// Not used: a motor was at its limit.
    pub saturated: usize,
    /// Not used for another reason alone.
    pub otherwise: usize,
}

/// Laws, updrafts and correlations under one way to fit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Evaluation {
    /// A, u0, W* beside the paper's Table I.
    pub table: Vec<StudyRow>,
    /// One per wind condition, in the study's order.
    pub conditions: Vec<ConditionResult>,
    /// Lowest and highest rho of a condition.
    pub rho: Option<[f64; 2]>,
    /// Lowest and highest p-value of a condition.
    pub p_value: Option<[f64; 2]>,
}

/// One parameter of the law.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StudyRow {
    /// Symbol: `A`, `u0`, `W`.
    #[schemars(with = "String")]
    pub parameter: Symbol,
    /// Unit.
    pub unit: String,
    /// From the flight without wind and updraft; A and u0 of all other fits.
    pub windless: Estimate,
    /// From all flights without updraft, every wind speed with the same weight.
    pub pooled: Option<Estimate>,
    /// The paper's Table I.
    pub paper: Estimate,
}

/// How well the updraft is found in one wind.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ConditionResult {
    /// The wind.
    #[serde(flatten)]
    pub condition: Condition,
    /// Fitted updraft W* on true updraft W; absent with fewer than three flights.
    pub regression: Option<Regression>,
    /// W* where the true updraft is 0, m/s.
    pub at_zero_mps: Option<Estimate>,
    /// Windows of its flights.
    pub windows: WindowCount,
}

/// One flight of the study.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StudyFlight {
    /// Name of its files.
    pub name: String,
    /// The wind.
    #[serde(flatten)]
    pub condition: Condition,
    /// True vertical air speed, m/s, up positive.
    pub updraft_mps: f64,
    /// Fitted vertical air speed with A and u0 held, m/s, the paper's way; absent without windows.
    pub paper_way_mps: Option<Estimate>,
    /// The same, this program's way.
    pub own_way_mps: Option<Estimate>,
    /// Share of the flight in which a rotor was at an end of its range.
    pub saturated_share: f64,
    /// Its moving windows.
    pub windows: Vec<StudyWindow>,
    /// What is doubtful about it.
    pub warnings: Vec<String>,
}

/// One moving window.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StudyWindow {
    /// Label: `up 0.5 m/s`.
    pub label: String,
    /// Commanded vertical velocity, m/s, up positive.
    pub commanded_mps: f64,
    /// Vertical velocity V_U, m/s.
    pub velocity_mps: SampleStats,
    /// Tilt-corrected pulse width u_phi, us.
    pub pulse_phi_us: SampleStats,
    /// Why it is not used; empty: it is used.
    pub rejected: Vec<Rejection>,
}

/// A flight that could not be flown.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct LostFlight {
    /// Its name.
    pub name: String,
    /// Why.
    pub reason: String,
}
