//! Outcome of one campaign: the map's error, its coverage, and what the search named.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::analysis::budget::TruthCheck;
use crate::analysis::result::{DroneUpdraft, UpdraftMap};
use crate::numeric::rms;

/// Half width of a 95 % interval in standard deviations.
const NORMAL_95: f64 = 1.959_964;

/// Outcome of one campaign. A number that is absent could not be told.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct Outcome {
    /// Root mean square of the map less the true air, over drones and seconds, m/s.
    pub rms_mps: Option<f64>,
    /// The same of answering zero everywhere, m/s.
    pub zero_rms_mps: Option<f64>,
    /// `rms_mps` over `zero_rms_mps`: below 1 the map is better than none.
    pub ratio_to_zero: Option<f64>,
    /// Mean of the map less the true air, m/s.
    pub bias_mps: Option<f64>,
    /// Root mean square without that mean, m/s.
    pub rms_without_bias_mps: Option<f64>,
    /// Share of the true values inside of their 95 % intervals.
    pub coverage: Option<f64>,
    /// Share of the drones whose true mean is inside of the interval of their mean.
    pub means_coverage: Option<f64>,
    /// Root mean square of the stated standard deviations over `rms_mps`: 1 where they are as large as the errors.
    pub width_ratio: Option<f64>,
    /// `rms_mps` over that of the best linear estimate, at its places and seconds.
    pub ratio_to_limit: Option<f64>,
    /// Root mean square of what each drone tells alone less the true air, m/s.
    pub alone_rms_mps: Option<f64>,
    /// Drones whose logs gave values.
    pub drones: u32,
    /// Values that were compared with the truth.
    pub values: u32,
    /// What the search for missing physics made of what was hidden; absent: not asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub naming: Option<Naming>,
}

/// Result of the search for missing physics.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Naming {
    /// What the verdict makes of the effect that was hidden.
    pub called: Called,
    /// What was found, in words, in its order.
    pub found: Vec<String>,
    /// Fitted size over the true size, less 1; absent: not named, or of no size.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub size_error: Option<f64>,
}

/// What a verdict makes of a hidden effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Called {
    /// It is named, alone.
    Named,
    /// It is in a class that is given, or another of its class is named.
    Class,
    /// Something unknown is reported.
    Unknown,
    /// Something else is named.
    Wrong,
    /// Nothing is said.
    Nothing,
}

impl fmt::Display for Called {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Named => "named",
            Self::Class => "class",
            Self::Unknown => "unknown",
            Self::Wrong => "wrong",
            Self::Nothing => "nothing",
        })
    }
}

/// A number of an outcome, with its unit and its words.
#[derive(Clone, Copy, Debug)]
pub struct OutcomeColumn {
    /// Name, as in study files and tables.
    pub name: &'static str,
    /// Unit; empty: none.
    pub unit: &'static str,
    /// Words for people, for headings.
    pub title: &'static str,
    /// The number of one outcome.
    pub get: fn(&Outcome) -> Option<f64>,
}

const fn column(
    name: &'static str,
    unit: &'static str,
    title: &'static str,
    get: fn(&Outcome) -> Option<f64>,
) -> OutcomeColumn {
    OutcomeColumn { name, unit, title, get }
}

/// All numbers of an outcome, in the order of tables.
pub const OUTCOMES: &[OutcomeColumn] = &[
    column("rms_mps", "m/s", "error of the map", |o| o.rms_mps),
    column("zero_rms_mps", "m/s", "error of answering zero", |o| o.zero_rms_mps),
    column("ratio_to_zero", "", "error of the map over that of zero", |o| o.ratio_to_zero),
    column("bias_mps", "m/s", "bias of the map", |o| o.bias_mps),
    column("rms_without_bias_mps", "m/s", "error without the bias", |o| o.rms_without_bias_mps),
    column("coverage", "", "share inside of 95 % intervals", |o| o.coverage),
    column("means_coverage", "", "share of means inside of 95 % intervals", |o| o.means_coverage),
    column("width_ratio", "", "stated over true error", |o| o.width_ratio),
    column("ratio_to_limit", "", "error over that of the best estimate", |o| o.ratio_to_limit),
    column("alone_rms_mps", "m/s", "error of each drone alone", |o| o.alone_rms_mps),
    column("drones", "", "drones with values", |o| Some(f64::from(o.drones))),
    column("values", "", "values compared", |o| Some(f64::from(o.values))),
    column("named", "", "whether the hidden effect was named", |o| {
        let called = o.naming.as_ref()?.called;
        Some(f64::from(u8::from(matches!(called, Called::Named | Called::Class))))
    }),
    column("size_error", "", "error of the named size", |o| o.naming.as_ref()?.size_error),
];

/// Outcomes that are shown if a study asks for none.
pub(super) const USUAL: &[&str] = &["rms_mps", "ratio_to_zero", "coverage"];

/// The number of a name, or `None` if there is none.
pub fn outcome_column(name: &str) -> Option<&'static OutcomeColumn> {
    OUTCOMES.iter().find(|column| column.name == name)
}

impl Outcome {
    /// Outcome of a map with known truth; `None`: the map has no value whose truth is known.
    pub fn of_map(map: &UpdraftMap) -> Option<Self> {
        let posterior = map.posterior.as_ref().and_then(|posterior| posterior.truth.as_ref());
        let alone = map.truth.as_ref();
        // Too few values for a posterior: the map is what each drone tells alone.
        let check = posterior.or(alone)?;
        let sds: Vec<f64> = map
            .drones
            .iter()
            .filter(|drone| drone.truth_mps.is_some())
            .flat_map(
                |drone| if posterior.is_some() { of_posterior(drone) } else { of_alone(drone) },
            )
            .collect();
        let TruthCheck { rms_mps, zero_rms_mps, .. } = *check;
        let over = |value: f64, by: f64| (by > 0.0).then_some(value / by);
        Some(Self {
            rms_mps: Some(rms_mps),
            zero_rms_mps: Some(zero_rms_mps),
            ratio_to_zero: over(rms_mps, zero_rms_mps),
            bias_mps: Some(check.bias_mps),
            rms_without_bias_mps: Some(check.rms_without_bias_mps),
            coverage: check.inside_share,
            means_coverage: check.means_inside_share,
            width_ratio: rms(sds).and_then(|sd| over(sd, rms_mps)),
            ratio_to_limit: check
                .at_limit_rms_mps
                .zip(check.limit_rms_mps)
                .and_then(|(own, limit)| over(own, limit)),
            alone_rms_mps: alone.map(|alone| alone.rms_mps),
            drones: check.drones as u32,
            values: check.values as u32,
            naming: None,
        })
    }
}

/// Stated standard deviations of a drone's posterior, m/s.
fn of_posterior(drone: &DroneUpdraft) -> Vec<f64> {
    let known = drone.posterior_mps.iter().zip(&drone.posterior_sd_mps);
    known.filter_map(|(value, sd)| value.and(*sd)).collect()
}

/// Stated standard deviations of what a drone tells alone, m/s: those of its intervals.
fn of_alone(drone: &DroneUpdraft) -> Vec<f64> {
    let known = drone.updraft_mps.iter().zip(&drone.interval_mps);
    known
        .filter_map(|(value, interval)| value.and(*interval))
        .map(|[low, high]| (high - low) / 2.0 / NORMAL_95)
        .collect()
}
