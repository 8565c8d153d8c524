//! Results of a sensitivity study, as written to `sensitivity.json` and drawn by the report.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Name and version of the format of results.
pub const SENSITIVITY_RESULT_SCHEMA: &str = "updraft.sensitivity-result/1";

/// A sensitivity study, as far as it was flown.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SensitivityResult {
    /// Format name and version: `updraft.sensitivity-result/1`.
    pub schema: String,
    /// Program and version that made it.
    pub made_by: String,
    /// Title for people.
    pub title: String,
    /// Template of the campaigns.
    pub campaign: String,
    /// Vehicle that was planned for; absent: the template's.
    pub vehicle: Option<String>,
    /// Seed of the study.
    pub seed: u64,
    /// How campaigns were drawn: `grid`, `latin-hypercube`, `sobol`.
    pub design: String,
    /// Campaigns of the study.
    pub campaigns: usize,
    /// Campaigns with an outcome.
    pub finished: usize,
    /// Campaigns that were lost.
    pub lost: usize,
    /// Campaigns that are not flown yet.
    pub open: usize,
    /// What differed between campaigns. In a Sobol' design `chance` is the last: the seed of air, noise and losses.
    pub factors: Vec<FactorResult>,
    /// Outcomes, in the order that the study asks for.
    pub outcomes: Vec<OutcomeResult>,
    /// Why campaigns were lost, the most frequent first.
    pub lost_reasons: Vec<LostReason>,
    /// How often the search called what was hidden `named`, `class`, `unknown`, `wrong` or `nothing`; absent: it was not
    /// asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub naming: Option<BTreeMap<String, usize>>,
}

/// A factor of a study.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FactorResult {
    /// Name.
    pub name: String,
    /// Unit of its levels; empty: none.
    pub unit: String,
    /// What it drives, as in the study's file.
    pub drives: String,
    /// Its levels in words: `0.1 to 1 (log)`, `2, 4, 6`.
    pub levels: String,
    /// Names of its levels where these are no numbers, in the order of the file: figures and ranks take their places.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub words: Vec<String>,
    /// Whether its levels go by their logarithm.
    pub log: bool,
}

/// What is known of one outcome.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct OutcomeResult {
    /// Name, as in tables.
    pub name: String,
    /// Unit; empty: none.
    pub unit: String,
    /// Words for people.
    pub title: String,
    /// Campaigns that have it.
    pub n: usize,
    /// Mean.
    pub mean: Option<f64>,
    /// Standard deviation.
    pub sd: Option<f64>,
    /// Quantiles at 0, 5, 25, 50, 75, 95 and 100 %; empty: no campaign has it.
    pub quantiles: Vec<f64>,
    /// How much of it each factor decides, in the order of the factors.
    pub influences: Vec<Influence>,
    /// Share of the variance that the factors explain one by one: the sum of first-order indices, or R² of the
    /// regression of ranks.
    pub explained: Option<Uncertain>,
}

/// How much of an outcome one factor decides. Sobol' designs have indices, others have coefficients of ranks; absent:
/// it cannot be told from what was flown.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Influence {
    /// Name of the factor.
    pub factor: String,
    /// Campaigns or rows that tell it.
    pub n: usize,
    /// First-order Sobol' index: share of the variance that goes when the factor alone is fixed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub first: Option<Uncertain>,
    /// Total Sobol' index: share of the variance that stays when all other factors are fixed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub total: Option<Uncertain>,
    /// Standardised coefficient of the regression of ranks.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub regression: Option<Uncertain>,
    /// Partial rank correlation: what is left of Spearman's with the other factors held.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub partial: Option<Uncertain>,
}

/// A value with its 95 % interval from the bootstrap.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Uncertain {
    /// The value.
    pub value: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// Why campaigns were lost.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct LostReason {
    /// One sentence.
    pub reason: String,
    /// Number of campaigns.
    pub campaigns: usize,
}

impl Influence {
    /// The number by which factors are put in order: the total index, or the coefficient of ranks.
    pub fn main(&self) -> Option<Uncertain> {
        self.total.or(self.regression)
    }
}
