//! The preflight table: the charge that a flight needs, and parameters that could not be set.

use super::params::SetError;
use super::preflight::{COLUMNS, Cell, Known, Limits, charge_needed, preflight};
use super::required::Standing;
use super::slots::FleetTable;
use super::telemetry::Telemetry;
use crate::link::id::DroneId;
use crate::mission::Plan;
use crate::mission::resolve::resolve;

fn plan() -> Plan {
    resolve("calibration", &[]).unwrap().flights.remove(0).plan
}

#[test]
fn a_flight_needs_its_share_of_the_endurance_and_the_reserve() {
    let mut plan = plan();
    plan.duration_ms = 300_000;
    plan.limits.endurance_s = 1_000.0;
    plan.limits.endurance_reserve = 0.25;
    assert!((charge_needed(&plan) - 55.0).abs() < 1e-9);
}

/// The cell of a drone whose parameters stand so.
fn params(standing: Option<Standing>) -> Cell {
    let drone = DroneId { network: 0, system: 1 };
    let table = FleetTable::new([(drone, 1)]);
    let params = standing.map(|standing| (drone, standing)).into_iter().collect();
    let known = Known { params, ..Known::default() };
    let found = preflight(&plan(), &table, &Telemetry::default(), &known, &Limits::default(), 0);
    let column = COLUMNS.iter().position(|column| *column == "params").unwrap();
    found.rows[0].cells[column].clone()
}

#[test]
fn a_drone_whose_parameter_could_not_be_set_must_not_start() {
    assert_eq!(params(Some(Standing::default())), Cell { text: "ok".to_owned(), no_go: None });
    let failed = Some(SetError::Silent { name: "FENCE_ALT_MAX".to_owned(), wanted: 60.0 });
    let cell = params(Some(Standing { failed, ..Standing::default() }));
    assert_eq!((cell.text.as_str(), cell.no_go.is_some()), ("failed", true));
    assert!(params(None).no_go.is_some(), "what was not checked is not taken for good");
}
