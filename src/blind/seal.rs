//! Seal of the truth: its hash is published first, and it is opened only when there is a verdict.

use std::path::{Path, PathBuf};

use rand::Rng as _;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::error::BlindError;
use super::scenario::{SCENARIO_SCHEMA, Scenario};
use crate::base::digest::sha256;
use crate::base::file::{FileError, create_folder, read_whole, write_whole};
use crate::base::rng::{Purpose, stream};
use crate::campaign::to_json;

/// Largest truth that is read, bytes.
const MAX_BYTES: u64 = 4 << 20;
/// Stream of the nonce: far from those of hidden effects.
const NONCE: u64 = u64::MAX;

/// What a sealed file holds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Sealed {
    /// Random digits, so that the hash cannot be guessed from a likely truth.
    pub nonce: String,
    /// The truth.
    pub truth: Scenario,
}

/// A truth after its seal was opened.
#[derive(Clone, Debug, PartialEq)]
pub struct Opened {
    /// The truth, as it was sealed before the flight.
    pub truth: Scenario,
    /// SHA-256 of the truth as published before the flight, hexadecimal.
    pub truth_sha256: String,
    /// SHA-256 of the verdict that was on disk when the seal was opened, hexadecimal.
    pub verdict_sha256: String,
}

/// Path of the folder of the seal, beside a flight.
pub fn folder(beside: &Path) -> PathBuf {
    beside.join("sealed")
}

/// Path of the published hash, in the folder of the sealed truth.
pub fn hash_path(beside: &Path) -> PathBuf {
    folder(beside).join("SHA256")
}

/// Path of the sealed truth.
pub fn truth_path(beside: &Path) -> PathBuf {
    folder(beside).join("truth.json")
}

/// Seals a truth: publishes its hash in `sealed/SHA256`, then writes `sealed/truth.json`. Returns the
/// hash. Done before the flight is flown.
///
/// # Errors
/// When the files cannot be written.
pub fn seal(beside: &Path, truth: &Scenario) -> Result<String, BlindError> {
    let mut rng = stream(truth.seed, NONCE, Purpose::Hidden);
    seal_with(beside, truth, format!("{:016x}{:016x}", rng.next_u64(), rng.next_u64()))
}

/// Seals a truth as [`seal`] does, with a nonce that does not follow from the truth's seed: who knows or
/// guesses the seed cannot check it against the published hash.
///
/// # Errors
/// When the files cannot be written.
pub fn seal_with(beside: &Path, truth: &Scenario, nonce: String) -> Result<String, BlindError> {
    let sealed = Sealed { nonce, truth: truth.clone() };
    let bytes = to_json(&sealed)
        .map_err(|error| BlindError::Text { what: "the truth", reason: error.to_string() })?;
    let hash = sha256(&bytes);
    create_folder(&folder(beside))?;
    write_whole(&hash_path(beside), format!("{hash}  truth.json\n").as_bytes())?;
    write_whole(&truth_path(beside), &bytes)?;
    Ok(hash)
}

/// Opens a seal, now that the verdict is there, and checks that the truth is the one whose hash was
/// published: `told`, if that is still known, else what stands in the file.
///
/// # Errors
/// [`BlindError::NoVerdict`] when there is no verdict yet, [`BlindError::Tampered`] when the truth was
/// changed, or unreadable files.
pub fn open(beside: &Path, verdict: &Path, told: Option<&str>) -> Result<Opened, BlindError> {
    // First of all: without a verdict nothing of the truth is read.
    if !std::fs::metadata(verdict).is_ok_and(|found| found.is_file() && found.len() > 0) {
        let (sealed, verdict) = (folder(beside), verdict.to_owned());
        return Err(BlindError::NoVerdict { sealed, verdict });
    }
    let verdict_sha256 = sha256(&read_whole(verdict, 64 * MAX_BYTES)?);
    let published = published(beside)?;
    let published = told.map_or(published, str::to_owned);
    let path = truth_path(beside);
    let bytes = read_whole(&path, MAX_BYTES)?;
    let found = sha256(&bytes);
    if found != published {
        return Err(BlindError::Tampered { path, found, published });
    }
    let sealed: Sealed = crate::campaign::read_json(&path)?;
    if sealed.truth.schema != SCENARIO_SCHEMA {
        let found = sealed.truth.schema;
        return Err(BlindError::Schema { path, found, wanted: SCENARIO_SCHEMA });
    }
    Ok(Opened { truth: sealed.truth, truth_sha256: found, verdict_sha256 })
}

/// The hash that was published, as it stands in `sealed/SHA256`.
///
/// # Errors
/// When the file cannot be read.
pub fn published(beside: &Path) -> Result<String, FileError> {
    let text = read_whole(&hash_path(beside), MAX_BYTES)?;
    let text = String::from_utf8_lossy(&text);
    Ok(text.split_whitespace().next().unwrap_or_default().to_owned())
}

/// SHA-256 of the sealed truth as it is now, hexadecimal. Nothing of the truth is told.
///
/// # Errors
/// When the file cannot be read.
pub fn truth_sha256(beside: &Path) -> Result<String, FileError> {
    Ok(sha256(&read_whole(&truth_path(beside), MAX_BYTES)?))
}
