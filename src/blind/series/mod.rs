//! Series of blind flights for a table: flown, explained and scored one by one, and resumed; by one
//! process or by many.

mod place;
mod run;

use std::collections::BTreeSet;
use std::sync::Arc;

use rand_distr::{Distribution as _, StandardUniform};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::error::BlindError;
use super::hide::kind_of;
use super::scenario::{AirClass, Base, Cell, Protocol, Scenario};
use super::worlds::{self, Worlds};
use crate::base::digest::sha256;
use crate::base::rng::{Purpose, stream};
use crate::campaign::to_json;

pub use place::Place;
pub use run::{FlightResult, RESULT_SCHEMA, Taken, run};

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

    /// Flights of the table, in order; their truths are not drawn yet.
    ///
    /// # Errors
    /// As [`Settings::check_seed`] and [`Settings::cells`]; two names of one effect that are to be hidden
    /// together.
    pub fn draws(&self) -> Result<Vec<Draw>, BlindError> {
        self.check_seed()?;
        let cells: Vec<Arc<Cell>> = self.cells()?.into_iter().map(Arc::new).collect();
        // What no seed can make is told before anything is flown.
        let mut looked_at = BTreeSet::new();
        for cell in cells.iter().filter(|cell| cell.worlds.is_home() && cell.hidden.len() > 1) {
            if looked_at.insert(&cell.hidden) {
                Scenario::draw(flight_seed(self.seed, 0)?, cell)?;
            }
        }
        let flights = cells.iter().cycle().take(self.flights).enumerate();
        let draw = |(index, cell): (usize, &Arc<Cell>)| {
            Ok(Draw { seed: flight_seed(self.seed, index)?, cell: Arc::clone(cell) })
        };
        flights.map(draw).collect()
    }

    /// Truths of all flights of the table.
    ///
    /// # Errors
    /// As [`Settings::draws`].
    pub fn scenarios(&self) -> Result<Vec<Scenario>, BlindError> {
        self.draws()?.iter().map(Draw::truth).collect()
    }

    /// SHA-256 of everything that a flight with a given place in the table depends on, hexadecimal: not
    /// of their number, so that a table can be made longer.
    ///
    /// # Errors
    /// When the settings have no form as JSON.
    pub fn flight_sha256(&self) -> Result<String, BlindError> {
        let same_for_all = Self { flights: 0, ..self.clone() };
        Ok(sha256(&json(&same_for_all)?))
    }
}

/// A flight of a table whose truth can be drawn at any time.
#[derive(Clone, Debug)]
pub struct Draw {
    /// Seed of the flight.
    pub seed: u64,
    /// Kind of the flight.
    pub cell: Arc<Cell>,
}

impl Draw {
    /// The truth.
    ///
    /// # Errors
    /// As [`Scenario::draw`].
    pub fn truth(&self) -> Result<Scenario, BlindError> {
        Scenario::draw(self.seed, &self.cell)
    }
}

fn json<T: Serialize>(value: &T) -> Result<Vec<u8>, BlindError> {
    to_json(value).map_err(|error| BlindError::Text { what: "a result", reason: error.to_string() })
}
