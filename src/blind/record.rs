//! The record of a game: what was hidden, what was said, and the hashes of both.

use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::error::BlindError;
use super::scenario::Scenario;
use super::score::{Outcome, score};
use super::seal::Opened;
use super::told::{air_words, is_right, words};
use crate::base::digest::sha256;
use crate::campaign::to_json;
use crate::gap::Verdict;
use crate::gap::verdict::Shrink;

/// Name of the record of an opened seal.
const RECORD: &str = "reveal.json";

/// Path of the record of an opened seal, in the folder of a game.
pub fn path(folder: &Path) -> PathBuf {
    folder.join(RECORD)
}

/// Name and version of the format of `reveal.json`.
pub const RECORD_SCHEMA: &str = "updraft.blind-record/1";

/// A game after its seal was opened: `reveal.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BlindRecord {
    /// Format name and version: `updraft.blind-record/1`.
    pub schema: String,
    /// Program and version.
    pub made_by: String,
    /// SHA-256 of the sealed truth, published before the flight.
    pub truth_sha256: String,
    /// SHA-256 of `game.json`, which has those of all files of the flight.
    pub game_sha256: String,
    /// Folder of the verdict, below the game's folder if it lies there.
    pub gap: String,
    /// SHA-256 of the verdict that was on the disk when the seal was opened.
    pub verdict_sha256: String,
    /// The verdict in one or two sentences.
    pub verdict: String,
    /// The gap on held-out drones (few drones: held-out rungs), before and after.
    pub shrink: Option<Shrink>,
    /// What was hidden, in a few words.
    pub truth: String,
    /// Whether all that was hidden is named, or in a class that is given, and nothing else is.
    pub right: bool,
    /// The comparison in plain words.
    pub words: Vec<String>,
    /// Updraft and wind of the whole flight, and what the verdict says of them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub air: Option<String>,
    /// The comparison.
    pub outcome: Outcome,
    /// SHA-256 of this file as it is with this text empty.
    pub sha256: String,
}

/// Parts that a record is made of, beside the comparison.
#[derive(Clone, Copy, Debug)]
pub struct Parts<'a> {
    /// Program and version.
    pub made_by: &'a str,
    /// SHA-256 of `game.json`, hexadecimal.
    pub game_sha256: &'a str,
    /// Folder of the verdict, as it is written down.
    pub gap: &'a str,
    /// The truth, after its seal was opened.
    pub opened: &'a Opened,
    /// Verdict that was on the disk.
    pub verdict: &'a Verdict,
    /// Fisher z of each hidden effect, in the truth's order.
    pub fisher_z: &'a [Option<f64>],
}

impl BlindRecord {
    /// Compares the verdict with the truth.
    ///
    /// # Errors
    /// When it has no form as JSON.
    pub fn of(parts: &Parts<'_>) -> Result<Self, BlindError> {
        let Parts { opened, verdict, .. } = *parts;
        let outcome = score(&opened.truth, verdict, parts.fisher_z);
        let mut record = Self {
            schema: RECORD_SCHEMA.to_owned(),
            made_by: parts.made_by.to_owned(),
            truth_sha256: opened.truth_sha256.clone(),
            game_sha256: parts.game_sha256.to_owned(),
            gap: parts.gap.to_owned(),
            verdict_sha256: opened.verdict_sha256.clone(),
            verdict: verdict.summary.clone(),
            shrink: verdict.gap.drones.or(verdict.gap.rungs),
            truth: opened.truth.words(),
            right: is_right(&outcome),
            words: words(&outcome, verdict),
            air: Some(air_words(&opened.truth, verdict)),
            outcome,
            sha256: String::new(),
        };
        record.sha256 = sha256(&record.to_json()?);
        Ok(record)
    }

    /// The record as its file has it.
    ///
    /// # Errors
    /// When it has no form as JSON.
    pub fn to_json(&self) -> Result<Vec<u8>, BlindError> {
        let text = |error: std::io::Error| BlindError::Text {
            what: "the record",
            reason: error.to_string(),
        };
        to_json(self).map_err(text)
    }

    /// Whether these bytes are the record as it was written.
    ///
    /// # Errors
    /// When it has no form as JSON.
    pub fn is_unedited(&self, bytes: &[u8]) -> Result<bool, BlindError> {
        let bare = Self { sha256: String::new(), ..self.clone() };
        Ok(sha256(&bare.to_json()?) == self.sha256 && self.to_json()? == bytes)
    }

    /// Whether truth and verdict give this comparison; Fisher z is taken as it is written down.
    pub fn is_score_of(&self, truth: &Scenario, verdict: &Verdict) -> bool {
        let fisher_z: Vec<Option<f64>> = self.outcome.hidden.iter().map(|one| one.z).collect();
        let outcome = score(truth, verdict, &fisher_z);
        self.right == is_right(&outcome)
            && self.words == words(&outcome, verdict)
            && self.air.as_ref().is_none_or(|air| *air == air_words(truth, verdict))
            && self.truth == truth.words()
            && self.verdict == verdict.summary
            && self.outcome == outcome
    }
}
