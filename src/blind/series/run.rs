//! Flights of a table, one after the other or many at once: sealed, flown, explained, opened, scored.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::place::Place;
use super::{Draw, Settings, json};
use crate::base::file::{create_folder, write_whole};
use crate::base::shard::Share;
use crate::blind::error::BlindError;
use crate::blind::explain::Explain;
use crate::blind::fly::fly;
use crate::blind::score::{Outcome, score};
use crate::blind::seal;
use crate::campaign::{CampaignError, read_json};

/// Name and version of the format of one finished flight.
pub const RESULT_SCHEMA: &str = "updraft.blind-flight/1";
/// File of the verdict in the folder of a flight.
const VERDICT: &str = "verdict.json";

/// One finished flight: `flights/NNNNN.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FlightResult {
    /// Format name and version: `updraft.blind-flight/1`.
    pub schema: String,
    /// Program and version.
    pub made_by: String,
    /// Its place in the table.
    pub index: usize,
    /// Published hash of its truth.
    pub truth_sha256: String,
    /// Hash of its verdict.
    pub verdict_sha256: String,
    /// What was hidden, in words.
    pub truth: String,
    /// The verdict against the truth.
    pub outcome: Outcome,
}

/// Flies, explains and scores the flights of a share that are not finished yet. In the order of the
/// table: what became of each. `done` is called after each.
///
/// Any number of processes may do so at once in one folder, on any number of machines: a result appears
/// whole or not at all, and two that fly the same flight write the same.
///
/// # Errors
/// Unreadable or foreign files in the folder, or `stop` was raised. What becomes of a single flight is
/// in its own place.
pub fn run(
    settings: &Settings,
    place: &Place,
    share: Share,
    made_by: &str,
    explain: &dyn Explain,
    stop: &AtomicBool,
    done: &(dyn Fn() + Sync),
) -> Result<Vec<Taken>, BlindError> {
    let mut draws: Vec<(usize, Draw)> = settings.draws()?.into_iter().enumerate().collect();
    draws.retain(|(index, _)| share.takes(*index));
    create_folder(&place.folder.join("flights"))?;
    let read: Vec<_> =
        draws.par_iter().map(|(index, draw)| finished(place, *index, draw, made_by)).collect();
    // Of several that are not of this table always the first is told.
    let finished = read.into_iter().collect::<Result<Vec<_>, _>>()?;
    place.sweep();
    // A disk that is full fills for no flight after it.
    let is_unwritable = AtomicBool::new(false);
    let taken: Vec<_> = draws
        .par_iter()
        .zip(finished)
        .map(|((index, draw), finished)| {
            let was_there = finished.is_some();
            let result = match finished {
                Some(result) => Ok(result),
                None if share.gather_only => Err(BlindError::NotFlown { index: *index }),
                None if stop.load(Ordering::Relaxed) || is_unwritable.load(Ordering::Relaxed) => {
                    Err(BlindError::Stopped)
                }
                None => one(draw, *index, place, made_by, explain, stop),
            };
            if result.as_ref().is_err_and(is_of_file) {
                is_unwritable.store(true, Ordering::Relaxed);
            }
            done();
            Taken { index: *index, result, was_there }
        })
        .collect();
    if stop.load(Ordering::Relaxed) {
        return Err(BlindError::Stopped);
    }
    if is_unwritable.load(Ordering::Relaxed) {
        let first = taken.into_iter().filter_map(|taken| taken.result.err()).find(is_of_file);
        return Err(first.unwrap_or(BlindError::Stopped));
    }
    Ok(taken)
}

/// Whether a file could not be read or written.
fn is_of_file(error: &BlindError) -> bool {
    matches!(error, BlindError::File(_) | BlindError::Campaign(CampaignError::File(_)))
}

/// A flight of a table after a run, with its result or without.
#[derive(Debug)]
pub struct Taken {
    /// Place in the table.
    pub index: usize,
    /// Result of the flight, or why there is none.
    pub result: Result<FlightResult, BlindError>,
    /// Whether it was finished before.
    pub was_there: bool,
}

/// What every version's result says of itself.
#[derive(Deserialize)]
struct Head {
    schema: String,
    made_by: String,
}

/// Content of a result; `None` if it is damaged.
fn there<T: serde::de::DeserializeOwned>(path: &Path) -> Result<Option<T>, BlindError> {
    match read_json(path) {
        Ok(value) => Ok(Some(value)),
        Err(CampaignError::Json { .. }) => Ok(None),
        Err(error) => Err(error.into()),
    }
}

/// A flight that was finished before, if it is of this table and this version.
fn finished(
    place: &Place,
    index: usize,
    draw: &Draw,
    made_by: &str,
) -> Result<Option<FlightResult>, BlindError> {
    let path = place.result(index);
    if !path.exists() {
        return Ok(None);
    }
    // What is no result, a file cut short for example, is missing.
    let Some(Head { schema, made_by: found }) = there(&path)? else { return Ok(None) };
    if schema != RESULT_SCHEMA {
        return Err(BlindError::Schema { path, found: schema, wanted: RESULT_SCHEMA });
    }
    if found != made_by {
        return Err(BlindError::Version { path, found, wanted: made_by.to_owned() });
    }
    let Some(result) = there::<FlightResult>(&path)? else { return Ok(None) };
    let outcome = &result.outcome;
    if outcome.seed != draw.seed || outcome.cell != *draw.cell {
        let why = format!(
            "it is {} with seed {}, not {} with seed {}",
            outcome.cell.name(),
            outcome.seed,
            draw.cell.name(),
            draw.seed
        );
        return Err(BlindError::Other { folder: place.folder.clone(), index, why });
    }
    Ok(Some(result))
}

/// Seals, flies, explains, and only then opens and scores.
fn one(
    draw: &Draw,
    index: usize,
    place: &Place,
    made_by: &str,
    explain: &dyn Explain,
    stop: &AtomicBool,
) -> Result<FlightResult, BlindError> {
    let truth = draw.truth()?;
    let own = place.flying(index)?;
    let work = own.path();
    let hash = seal::seal(work, &truth)?;
    let flight = work.join("flight");
    fly(&truth, &flight, Some(stop))?;
    let verdict = match explain.explain(&flight) {
        Ok(verdict) => verdict,
        Err(source) => {
            // For whoever looks into it.
            let kept = place.work(index);
            let flight =
                if own.keep(&kept, VERDICT).is_ok() { kept.join("flight") } else { flight };
            return Err(BlindError::Explain { flight, source });
        }
    };
    let verdict_path = work.join(VERDICT);
    write_whole(&verdict_path, &json(&verdict)?)?;
    let opened = seal::open(work, &verdict_path, Some(&hash))?;
    let fisher_z = explain.fisher_z(&flight, &opened.truth);
    let result = FlightResult {
        schema: RESULT_SCHEMA.to_owned(),
        made_by: made_by.to_owned(),
        index,
        truth_sha256: opened.truth_sha256,
        verdict_sha256: opened.verdict_sha256,
        truth: opened.truth.words(),
        outcome: score(&opened.truth, &verdict, &fisher_z),
    };
    if place.keep {
        own.keep(&place.work(index), VERDICT)?;
    }
    // The result last: where it is, all is.
    write_whole(&place.result(index), &json(&result)?)?;
    Ok(result)
}
