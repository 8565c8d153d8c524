//! Series of blind flights for a table: flown, explained and scored one by one, and resumed.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use rand_distr::{Distribution as _, StandardUniform};
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::error::BlindError;
use super::explain::Explain;
use super::fly::fly;
use super::hide::kind_of;
use super::scenario::{AirClass, Base, Cell, Protocol, Scenario};
use super::score::{Outcome, score};
use super::seal;
use super::worlds::{self, Worlds};
use crate::base::file::{FileError, create_folder, write_whole};
use crate::base::rng::{Purpose, stream};
use crate::campaign::{read_json, to_json};

/// Name and version of the format of one finished flight.
pub const RESULT_SCHEMA: &str = "updraft.blind-flight/1";
/// First seed that is used for scoring; smaller ones are for tuning.
pub const FIRST_SCORING_SEED: u64 = 1_000_000;
/// Bits of a flight's seed that number the flights of one table.
const FLIGHT_BITS: u32 = 20;
/// Stream of the order of the cells.
const ORDER: u64 = u64::MAX - 1;

/// What is flown.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Whose physics is flown.
    #[serde(default = "home_alone", skip_serializing_if = "is_home_alone")]
    pub worlds: Vec<Worlds>,
    /// Protocols.
    pub protocols: Vec<Protocol>,
    /// Airs.
    pub airs: Vec<AirClass>,
    /// Known vehicles.
    pub bases: Vec<Base>,
    /// Sets of what is hidden together; an empty one hides nothing.
    pub hidden: Vec<Vec<String>>,
    /// Flights in all.
    pub flights: usize,
    /// Seed of the table.
    pub seed: u64,
    /// Drones along each side of the grid.
    pub side: u16,
    /// Whether this is for tuning.
    pub tuning: bool,
}

fn home_alone() -> Vec<Worlds> {
    vec![Worlds::Home]
}

fn is_home_alone(worlds: &[Worlds]) -> bool {
    worlds == [Worlds::Home]
}

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

/// Seed of one flight of a table; flights of different tables never share one.
///
/// # Errors
/// Numbers that are too large.
pub fn flight_seed(table: u64, index: usize) -> Result<u64, BlindError> {
    let most = (1 << FLIGHT_BITS) - 1;
    let index = index as u64;
    if index > most {
        return Err(BlindError::TooLarge { what: "the number of flights", value: index, most });
    }
    let most = u64::MAX >> FLIGHT_BITS;
    if table > most {
        return Err(BlindError::TooLarge { what: "the seed", value: table, most });
    }
    Ok(table << FLIGHT_BITS | index)
}

/// Whether a set of effects can be hidden from a base.
fn worlds_take(worlds: Worlds, base: Base, hidden: &[String]) -> Result<(), BlindError> {
    let not = |name: &String| BlindError::NotEligible { name: name.clone(), base: base.name() };
    if !worlds.is_home() {
        let nothing = "nothing".to_owned();
        let first = || not(hidden.first().unwrap_or(&nothing));
        return if worlds::takes(base, hidden) { Ok(()) } else { Err(first()) };
    }
    for name in hidden {
        if !kind_of(name)?.bases.contains(&base) {
            return Err(not(name));
        }
    }
    Ok(())
}

impl Settings {
    /// Checks that the seed is in the right range: seeds for tuning and for scoring never meet.
    ///
    /// # Errors
    /// A seed of the wrong range, or a number that is too large.
    pub fn check_seed(&self) -> Result<(), BlindError> {
        let (seed, first) = (self.seed, FIRST_SCORING_SEED);
        match (seed < first, self.tuning) {
            (true, false) => Err(BlindError::TuningSeed { seed, first }),
            (false, true) => Err(BlindError::ScoringSeed { seed, first }),
            _ => flight_seed(seed, self.flights.saturating_sub(1)).map(|_| ()),
        }
    }

    /// Cells, in the order in which flights take them in turn: shuffled by the seed, so that a
    /// table that was cut short is balanced too. A base that does not take a set of effects has no
    /// cell with it.
    ///
    /// # Errors
    /// An unknown name, or nothing that could be flown.
    pub fn cells(&self) -> Result<Vec<Cell>, BlindError> {
        let mut cells = Vec::new();
        let mut refused = None;
        for worlds in &self.worlds {
            for hidden in &self.hidden {
                for base in &self.bases {
                    if let Err(error) = worlds_take(*worlds, *base, hidden) {
                        refused = Some(error);
                        continue;
                    }
                    for protocol in &self.protocols {
                        cells.extend(self.airs.iter().map(|air| Cell {
                            worlds: *worlds,
                            protocol: *protocol,
                            air: *air,
                            base: *base,
                            hidden: hidden.clone(),
                            side: self.side,
                            columns: None,
                        }));
                    }
                }
            }
        }
        if cells.is_empty()
            && let Some(refused) = refused
        {
            return Err(refused);
        }
        let mut rng = stream(self.seed, ORDER, Purpose::Hidden);
        let mut keyed: Vec<(u64, Cell)> =
            cells.into_iter().map(|cell| (StandardUniform.sample(&mut rng), cell)).collect();
        keyed.sort_by_key(|(key, _)| *key);
        Ok(keyed.into_iter().map(|(_, cell)| cell).collect())
    }

    /// Truths of all flights of the table.
    ///
    /// # Errors
    /// As [`Settings::check_seed`] and [`Settings::cells`].
    pub fn scenarios(&self) -> Result<Vec<Scenario>, BlindError> {
        self.check_seed()?;
        let cells = self.cells()?;
        let flights = cells.iter().cycle().take(self.flights).enumerate();
        flights.map(|(index, cell)| Scenario::draw(flight_seed(self.seed, index)?, cell)).collect()
    }
}

/// Folder of a table of blind flights.
#[derive(Clone, Debug)]
pub struct Place {
    /// Folder that holds the table's files.
    pub folder: PathBuf,
    /// Whether flights are kept after they are scored.
    pub keep: bool,
}

impl Place {
    fn result(&self, index: usize) -> PathBuf {
        self.folder.join("flights").join(format!("{index:05}.json"))
    }

    /// Folder of one flight's work: `flight/`, `sealed/` and `verdict.json`.
    pub fn work(&self, index: usize) -> PathBuf {
        self.folder.join("work").join(format!("{index:05}"))
    }
}

/// Flies, explains and scores all flights that are not finished yet. In the order of the table: what
/// became of each. `done` is called after each.
///
/// # Errors
/// Unreadable or foreign files in the folder, or `stop` was raised. What becomes of a single flight is
/// in its own place.
pub fn run(
    settings: &Settings,
    place: &Place,
    made_by: &str,
    explain: &dyn Explain,
    stop: &AtomicBool,
    done: &(dyn Fn() + Sync),
) -> Result<Vec<Result<FlightResult, BlindError>>, BlindError> {
    let truths = settings.scenarios()?;
    create_folder(&place.folder.join("flights"))?;
    let finished: Vec<Option<FlightResult>> = truths
        .iter()
        .enumerate()
        .map(|(index, truth)| finished(place, index, truth))
        .collect::<Result<_, _>>()?;
    let results: Vec<_> = truths
        .par_iter()
        .zip(finished)
        .enumerate()
        .map(|(index, (truth, finished))| {
            let result = match finished {
                Some(result) => Ok(result),
                None if stop.load(Ordering::Relaxed) => Err(BlindError::Stopped),
                None => one(truth, index, place, made_by, explain, stop),
            };
            done();
            result
        })
        .collect();
    if stop.load(Ordering::Relaxed) {
        return Err(BlindError::Stopped);
    }
    Ok(results)
}

/// A flight that was finished before, if it is of this table.
fn finished(
    place: &Place,
    index: usize,
    truth: &Scenario,
) -> Result<Option<FlightResult>, BlindError> {
    let path = place.result(index);
    if !path.exists() {
        return Ok(None);
    }
    let result: FlightResult = read_json(&path)?;
    if result.schema != RESULT_SCHEMA {
        let found = result.schema;
        return Err(BlindError::Schema { path, found, wanted: RESULT_SCHEMA });
    }
    let outcome = &result.outcome;
    if outcome.seed != truth.seed || outcome.cell != truth.cell {
        let why = format!(
            "it is {} with seed {}, not {} with seed {}",
            outcome.cell.name(),
            outcome.seed,
            truth.cell.name(),
            truth.seed
        );
        return Err(BlindError::Other { folder: place.folder.clone(), index, why });
    }
    Ok(Some(result))
}

/// Seals, flies, explains, and only then opens and scores.
fn one(
    truth: &Scenario,
    index: usize,
    place: &Place,
    made_by: &str,
    explain: &dyn Explain,
    stop: &AtomicBool,
) -> Result<FlightResult, BlindError> {
    let work = place.work(index);
    remove(&work)?;
    create_folder(&work)?;
    let hash = seal::seal(&work, truth)?;
    let flight = work.join("flight");
    fly(truth, &flight, Some(stop))?;
    let verdict = explain
        .explain(&flight)
        .map_err(|source| BlindError::Explain { flight: flight.clone(), source })?;
    let verdict_path = work.join("verdict.json");
    write_whole(&verdict_path, &json(&verdict)?)?;
    let opened = seal::open(&work, &verdict_path, Some(&hash))?;
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
    write_whole(&place.result(index), &json(&result)?)?;
    if !place.keep {
        remove(&work)?;
    }
    Ok(result)
}

fn remove(folder: &Path) -> Result<(), BlindError> {
    match std::fs::remove_dir_all(folder) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(FileError::new("remove", folder, error).into())
        }
        _ => Ok(()),
    }
}

fn json<T: Serialize>(value: &T) -> Result<Vec<u8>, BlindError> {
    to_json(value).map_err(|error| BlindError::Text { what: "a result", reason: error.to_string() })
}
