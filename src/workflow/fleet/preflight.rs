//! The preflight table, for other programs.

use schemars::JsonSchema;
use serde::Serialize;

use crate::fleet::preflight::{COLUMNS, Preflight};
use crate::link::id::DroneId;

/// What `fleet preflight --json` prints.
#[derive(Serialize, JsonSchema)]
pub(crate) struct PreflightOutput {
    /// Format name and version: `updraft.preflight/1`.
    schema: &'static str,
    /// Whether everything is right for a start.
    go: bool,
    /// Headings of every drone's cells.
    columns: [&'static str; 11],
    /// The drones, in slot order.
    drones: Vec<PreflightRow>,
    /// What is wrong with the fleet as a whole.
    fleet: Vec<String>,
}

/// One drone before a start.
#[derive(Serialize, JsonSchema)]
struct PreflightRow {
    /// Number of the slot.
    slot: u16,
    /// The drone that flies it.
    drone: DroneId,
    /// Whether everything is right with it.
    go: bool,
    /// What was found, a text per column.
    cells: Vec<String>,
    /// Why it must not start.
    no_go: Vec<String>,
}

impl PreflightOutput {
    /// Of a table.
    pub(crate) fn of(table: &Preflight) -> Self {
        let drones = table.rows.iter().map(|row| PreflightRow {
            slot: row.slot,
            drone: row.drone,
            go: row.go(),
            cells: row.cells.iter().map(|cell| cell.text.clone()).collect(),
            no_go: row.cells.iter().filter_map(|cell| cell.no_go.clone()).collect(),
        });
        Self {
            schema: "updraft.preflight/1",
            go: table.go(),
            columns: COLUMNS,
            drones: drones.collect(),
            fleet: table.fleet.clone(),
        }
    }
}
