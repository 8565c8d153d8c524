//! One flight of a study: its air, its name, and what its result depends on.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::fly::{CELL_SCHEMA, START};
use super::template::StudyPlan;
use crate::base::digest::sha256;
use crate::base::time::GpsTime;
use crate::mission::plan::{Segment, Site, Slot};
use crate::vehicle::Vehicle;

/// A horizontal wind.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Condition {
    /// Wind speed, m/s.
    pub wind_mps: f64,
    /// Where it comes from, degrees clockwise from north; absent in still air.
    pub from_deg: Option<f64>,
}

impl Condition {
    /// Still air: no horizontal wind.
    pub const STILL: Self = Self { wind_mps: 0.0, from_deg: None };

    /// Name of the condition for people: `still air`, `2.5 m/s from 060°`.
    pub fn label(&self) -> String {
        match self.from_deg {
            Some(from_deg) => format!("{} m/s from {from_deg:03}°", self.wind_mps),
            None => "still air".to_owned(),
        }
    }
}

/// One flight of a study.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// Horizontal wind of the flight.
    pub condition: Condition,
    /// Vertical air speed, m/s, up positive.
    pub updraft_mps: f64,
}

/// Everything that the windows of a flight depend on.
#[derive(Serialize)]
struct Settings<'a> {
    format: &'a str,
    made_by: &'a str,
    site: &'a Site,
    slot: &'a Slot,
    segments: &'a [Segment],
    vehicle: &'a Vehicle,
    air_mps: [f64; 3],
    seed: u64,
    start: GpsTime,
}

impl Cell {
    /// Name of the flight's files: `wind2.5-from060-updraft+0.7`.
    pub fn name(&self) -> String {
        let updraft = self.updraft_mps;
        match self.condition.from_deg {
            Some(from) => {
                format!("wind{}-from{from:03}-updraft{updraft:+}", self.condition.wind_mps)
            }
            None => format!("still-updraft{updraft:+}"),
        }
    }

    /// Motion of the air towards east, north and up, m/s.
    pub fn air_mps(&self) -> [f64; 3] {
        let wind_mps = self.condition.wind_mps;
        let (sin, cos) = self.condition.from_deg.unwrap_or(0.0).to_radians().sin_cos();
        // Adding zero turns -0 into 0, which reads better in files.
        [-wind_mps * sin + 0.0, -wind_mps * cos + 0.0, self.updraft_mps]
    }

    /// Whether A and u0 are taken from this flight: it has neither wind nor updraft.
    pub fn is_reference(&self) -> bool {
        self.condition == Condition::STILL && self.updraft_mps == 0.0
    }

    /// Seed of the flight, which depends on its air but not on the rest of the study. Below 2^48,
    /// so that every JSON reader reads it exactly.
    pub fn seed(&self, study_seed: u64) -> u64 {
        let digest = Sha256::digest(format!("{study_seed} {}", self.name()));
        digest.iter().take(6).fold(0, |seed, byte| (seed << 8) | u64::from(*byte))
    }

    /// SHA-256 of everything that the flight's windows depend on, hexadecimal.
    ///
    /// # Errors
    /// If the settings cannot be written as JSON.
    pub fn key(&self, study: &StudyPlan, study_seed: u64) -> Result<String, serde_json::Error> {
        let settings = Settings {
            format: CELL_SCHEMA,
            made_by: super::fly::MADE_BY,
            site: &study.plan.site,
            slot: &study.slot,
            segments: &study.segments,
            vehicle: &study.vehicle,
            air_mps: self.air_mps(),
            seed: self.seed(study_seed),
            start: START,
        };
        Ok(sha256(&serde_json::to_vec(&settings)?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wind_goes_where_it_does_not_come_from() {
        let east = Condition { wind_mps: 5.0, from_deg: Some(90.0) };
        let cell = Cell { condition: east, updraft_mps: -0.7 };
        let [to_east, to_north, up] = cell.air_mps();
        assert!((to_east + 5.0).abs() < 1e-12 && to_north.abs() < 1e-12 && up == -0.7);
        assert_eq!(cell.name(), "wind5-from090-updraft-0.7");
        assert_eq!(
            Cell { condition: Condition::STILL, updraft_mps: 0.0 }.name(),
            "still-updraft+0"
        );
    }

    #[test]
    fn flights_have_noise_of_their_own() {
        let at = |updraft_mps| Cell { condition: Condition::STILL, updraft_mps };
        assert_ne!(at(0.7).seed(1), at(1.4).seed(1));
        assert_ne!(at(0.7).seed(1), at(0.7).seed(2));
        assert_eq!(at(0.7).seed(1), at(0.7).seed(1));
    }
}
