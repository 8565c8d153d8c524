//! Flight of one cell and measurement of its windows, all in memory.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::cell::Cell;
use super::template::StudyPlan;
use crate::analysis::result::WindowStats;
use crate::analysis::windows::{Tilt, WindowOptions, correct_tilt, measure, planned};
use crate::base::time::GpsTime;
use crate::flight::{Flight, FlightError, FlightOptions};
use crate::log::Log;
use crate::sim::{FlightSetup, Hooks, SimError, Uniform, fly};

/// Name and version of the format of a finished flight.
pub const CELL_SCHEMA: &str = "updraft.cell/1";
/// Program and version.
pub(super) const MADE_BY: &str = concat!("updraft ", env!("CARGO_PKG_VERSION"));
/// When simulated flights start: 2026-06-01 12:00 UTC. Fixed, so that the same seed gives the same
/// bytes.
pub(super) const START: GpsTime = GpsTime { week: 2421, tow_ms: 129_618_000 };

/// A finished flight of a study: what its windows say. Fits are made from it, so that another way to
/// fit needs no flight.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CellRecord {
    /// Format name and version: `updraft.cell/1`.
    pub schema: String,
    /// SHA-256 of everything that the flight depends on.
    pub key: String,
    /// Motion of the air towards east, north and up, m/s.
    pub air_mps: [f64; 3],
    /// The flight's own seed.
    pub seed: u64,
    /// Share of the flight in which a rotor was at an end of its range.
    pub saturated_share: f64,
    /// Its log, if it was kept.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub log: Option<CellLog>,
    /// What is doubtful about the flight.
    pub warnings: Vec<String>,
    /// All windows, in time order.
    pub windows: Vec<WindowStats>,
}

/// The kept log of a flight.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct CellLog {
    /// File name in the folder of logs.
    pub file: String,
    /// Size, bytes.
    pub bytes: u64,
    /// SHA-256, hexadecimal.
    pub sha256: String,
}

/// Why a flight gave no windows.
#[derive(Debug)]
pub(super) enum FlyError {
    Sim(SimError),
    Flight(FlightError),
}

/// Flies a cell; the record has no key yet.
pub(super) fn fly_cell(
    study: &StudyPlan,
    cell: &Cell,
    seed: u64,
    stop: &AtomicBool,
) -> Result<(CellRecord, Log), FlyError> {
    let trajectory = study.plan.trajectory(&study.slot);
    let frame = study.plan.site.frame();
    let air_mps = cell.air_mps();
    let [east, north, up] = air_mps;
    let air = Uniform(frame.from_neu(nalgebra::Vector3::new(north, east, up)));
    let setup = FlightSetup {
        vehicle: &study.vehicle,
        trajectory: &trajectory,
        home_m: study.slot.home_m.into(),
        frame,
        atmosphere: &air,
        seed: cell.seed(seed),
        drone: study.slot.slot,
        lights: &[],
        start: START,
        full_logs: false,
        hooks: Hooks { progress: None, stop: Some(stop) },
    };
    let mut bytes = Vec::new();
    let summary = fly(&setup, &mut bytes).map_err(FlyError::Sim)?;
    let log = Log::from_bytes(bytes);
    let options = FlightOptions {
        start: Some(START),
        segments: Some(&study.segments),
        ..FlightOptions::default()
    };
    let name = format!("{}.BIN", cell.name());
    let flight = Flight::from_log(&log, Path::new(&name), options).map_err(FlyError::Flight)?;
    // The paper's numbers are compared with: its form of the tilt correction.
    let windows = WindowOptions { tilt: Tilt::Paper, ..WindowOptions::default() };
    let corrected = correct_tilt(&flight, &windows);
    let record = CellRecord {
        schema: CELL_SCHEMA.to_owned(),
        key: String::new(),
        air_mps,
        seed: setup.seed,
        saturated_share: summary.saturated_share,
        log: None,
        windows: measure(&flight, &corrected, &planned(&study.segments), &windows),
        warnings: flight.warnings.iter().map(ToString::to_string).collect(),
    };
    Ok((record, log))
}
