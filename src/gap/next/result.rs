//! The proposed flight as `gap/next.json` has it.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::elements::Elements;
use super::questions::Kind;

/// Name and version of the format.
pub const NEXT_SCHEMA: &str = "updraft.next/1";

/// The flight that would tell what a verdict left open: `gap/next.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Next {
    /// Format name and version: `updraft.next/1`.
    pub schema: String,
    /// Program and version.
    pub made_by: String,
    /// The flight whose verdict was taken.
    pub flight: String,
    /// Fisher z that was asked for.
    pub wanted_z: f64,
    /// Length of that flight, s.
    pub present_s: f64,
    /// Length of the proposed one, s.
    pub proposed_s: f64,
    /// Whether it reaches what was asked for in every question.
    pub reaches: bool,
    /// What it is made of.
    pub elements: Elements,
    /// Why, an element a line.
    pub why: Vec<String>,
    /// What the crew must do.
    pub briefing: Vec<String>,
    /// The questions.
    pub questions: Vec<Asked>,
    /// Flights whose information was predicted.
    pub predicted_flights: usize,
    /// What a reader must know.
    pub notes: Vec<String>,
}

impl Next {
    /// Title of the flight: one that falls short tells most, and not enough.
    pub fn title(&self) -> &'static str {
        if self.reaches {
            "The flight that would tell"
        } else {
            "The flight that would tell most, and not enough"
        }
    }

    /// In how many questions the flight falls short and by what, as the rest of a sentence; `None`: in none.
    pub fn shortfall(&self) -> Option<String> {
        let missed: Vec<&Asked> = self.questions.iter().filter(|asked| !asked.reached).collect();
        let by: Vec<String> = missed
            .iter()
            .map(|asked| format!("{:.1}", asked.wanted_z - asked.proposed_z))
            .collect();
        (!missed.is_empty()).then(|| {
            format!(
                "it falls short in {} of {} questions, by z {}",
                missed.len(),
                self.questions.len(),
                by.join(", ")
            )
        })
    }
}

/// One question.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Asked {
    /// What kind of question it is.
    pub kind: Kind,
    /// In words.
    pub question: String,
    /// Fisher z that is wanted: what was asked for, or half as much again as the flight had that should
    /// have told and did not.
    pub wanted_z: f64,
    /// Fisher z of the flight that was flown: of the effect, or of the least separation.
    pub present_z: f64,
    /// Of the proposed one.
    pub proposed_z: f64,
    /// Whether that is what was asked for.
    pub reached: bool,
    /// How often the proposed flight must be flown to reach it (z adds up in quadrature); absent: it is
    /// reached at once, or never.
    pub flights_needed: Option<u32>,
    /// From what it is told, and how well.
    pub from: Vec<Told>,
    /// The proposed flight was simulated with each answer in turn: what the search made of it.
    pub verified: Vec<Verified>,
}

/// One separation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Told {
    /// From what; empty: from nothing.
    pub from: String,
    /// Size of it that looks most alike in the proposed flight.
    pub size: Option<f64>,
    /// Fisher z of the flight that was flown.
    pub present_z: f64,
    /// Of the proposed one.
    pub proposed_z: f64,
}

/// One simulated flight with one answer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Verified {
    /// The effect that the simulated drones truly had.
    pub truth: String,
    /// Its size.
    pub size: f64,
    /// What the search found.
    pub found: Vec<String>,
    /// Whether it named just that.
    pub told: bool,
    /// Fisher z that was predicted for telling it from the other answers; from nothing: its size over its standard error, as
    /// the verdict will state it.
    #[serde(default)]
    pub predicted_z: f64,
    /// Fisher z that the search reached. From nothing: the size over its standard error. From other answers: the root of twice
    /// the lead in log-likelihood, negative where another one leads. Absent: the verdict does not say.
    #[serde(default)]
    pub reached_z: Option<f64>,
}
