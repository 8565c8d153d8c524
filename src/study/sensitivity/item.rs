//! Records of finished campaigns: one whole file each, a thousand in a folder.

use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::outcome::Outcome;
use crate::base::file::{FileError, read_whole, write_whole};
use crate::base::parse;

/// Name and version of the format of a finished campaign.
pub const ITEM_SCHEMA: &str = "updraft.sensitivity-item/1";

/// Campaigns in a folder.
const IN_FOLDER: usize = 1000;
/// Largest record that is read back, bytes.
const MAX_RECORD_BYTES: u64 = 1 << 20;

/// A finished campaign of a study: `items/NNN/NNNNNN.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ItemRecord {
    /// Format name and version: `updraft.sensitivity-item/1`.
    pub schema: String,
    /// SHA-256 of everything that the outcome depends on.
    pub key: String,
    /// Place in the study, from 0.
    pub item: u64,
    /// The campaign's own seed.
    pub seed: u64,
    /// Level of each factor, by its name.
    pub levels: serde_json::Map<String, serde_json::Value>,
    /// What it came to; absent: it was lost.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub outcome: Option<Outcome>,
    /// Why it was lost, one sentence.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lost: Option<String>,
    /// What is doubtful about it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
}

/// Part of a finished campaign's record that is held while all are gathered.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Outcome of the campaign, or why it was lost.
    pub result: Result<Outcome, Box<str>>,
    /// Number of warnings.
    pub warnings: u32,
}

/// What a record is read for; the rest is passed over.
#[derive(Deserialize)]
struct Read {
    schema: String,
    key: String,
    outcome: Option<Outcome>,
    lost: Option<String>,
    #[serde(default)]
    warnings: Vec<serde::de::IgnoredAny>,
}

/// Folder of the records, in a study's folder.
pub fn items_folder(folder: &Path) -> PathBuf {
    folder.join("items")
}

/// Folder of a campaign's record: one for a thousand.
pub(super) fn shelf(folder: &Path, index: usize) -> PathBuf {
    items_folder(folder).join(format!("{:03}", index / IN_FOLDER))
}

/// Number of folders that this many campaigns need.
pub(super) fn shelves(campaigns: usize) -> impl Iterator<Item = usize> {
    (0..campaigns).step_by(IN_FOLDER)
}

/// Path of a campaign's record, in a study's folder.
pub fn item_path(folder: &Path, index: usize) -> PathBuf {
    shelf(folder, index).join(format!("{index:06}.json"))
}

/// The record of a campaign if it is there, whole, and of this key. A damaged one counts as none.
pub(super) fn finished(folder: &Path, index: usize, key: &str) -> Option<Row> {
    let bytes = read_whole(&item_path(folder, index), MAX_RECORD_BYTES).ok()?;
    let read: Read = parse::json(&bytes).ok()?;
    if read.schema != ITEM_SCHEMA || read.key != key {
        return None;
    }
    let result = match (read.outcome, read.lost) {
        (Some(outcome), None) => Ok(outcome),
        (None, Some(reason)) => Err(reason.into_boxed_str()),
        _ => return None,
    };
    Some(Row { result, warnings: read.warnings.len() as u32 })
}

impl ItemRecord {
    /// Writes the record into a study's folder.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn write(&self, folder: &Path) -> Result<(), FileError> {
        let path = item_path(folder, self.item as usize);
        let mut json = serde_json::to_vec(self)
            .map_err(|error| FileError::new("make the record", &path, error.into()))?;
        json.push(b'\n');
        write_whole(&path, &json)
    }

    /// Part of the record that is held while all are gathered.
    pub fn row(&self) -> Row {
        let result = match (&self.outcome, &self.lost) {
            (Some(outcome), _) => Ok(outcome.clone()),
            (None, reason) => Err(reason.clone().unwrap_or_default().into_boxed_str()),
        };
        Row { result, warnings: self.warnings.len() as u32 }
    }
}
