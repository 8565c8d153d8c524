//! Preparation of a start: no other start is set, all drones are on the ground, shows are uploaded,
//! show mode is on.

use std::collections::BTreeMap;

use super::ServedFlight;
use super::gate::{Row, Table, gate};
use super::upload::Shows;
use crate::link::clock::{Micros, S};
use crate::skybrush_server::gate::Step;
use crate::skybrush_server::state::State;
use crate::skybrush_server::{Client, Foreman, Job, Outcome, show_mode};
use crate::workflow::error::WorkflowError;
use crate::workflow::host::Host;

/// Drones that are switched to show mode at once.
const AT_ONCE: usize = 20;

/// How long drones are waited for.
pub(super) fn patience(wait_s: f64) -> Micros {
    (wait_s * S as f64) as Micros
}

/// Nothing is sent while a start is authorized: drones may be about to take off.
pub(super) fn not_authorized_yet(
    client: &mut Client,
    flight: &ServedFlight<'_>,
) -> Result<(), WorkflowError> {
    if client.authorized()?.is_some() {
        return Err(WorkflowError::Unsafe(format!(
            "a start is authorized on this server already, by Skybrush Live or another updraft: \
             nothing was sent; `updraft fleet watch` follows a flight of this folder to its end, \
             and if no drone is flying, `{}` cancels the start",
            flight.abort()
        )));
    }
    Ok(())
}

/// Sends every drone its show and switches it to show mode. Everyone must be on the ground first:
/// why not, otherwise.
pub(super) fn load(
    host: &dyn Host,
    client: &mut Client,
    flight: &ServedFlight<'_>,
    shows: &Shows<'_>,
    wait_s: f64,
) -> Result<Result<(), BTreeMap<String, String>>, WorkflowError> {
    not_authorized_yet(client, flight)?;
    let grounded = gate(host, client, flight, Step::Grounded, patience(wait_s))?;
    if !grounded.go() {
        return Ok(Err(refusals(host, &grounded)));
    }
    let refused = shows.send(host, client, flight)?;
    if !refused.is_empty() {
        return Ok(Err(refused));
    }
    enter_show_mode(host, client, flight)?;
    Ok(Ok(()))
}

/// Nobody gets anything when one drone may be in the air: the show is all drones' or nobody's.
fn refusals(host: &dyn Host, table: &Table) -> BTreeMap<String, String> {
    let reason = |row: &Row| {
        if row.no_go.is_empty() {
            return "nothing was sent, because others are not ready".to_owned();
        }
        let why = row.no_go.join(", ");
        host.warn(&format!("drone {} (slot {}) {why}: nothing was sent", row.drone, row.slot));
        why
    };
    table.rows.iter().map(|row| (row.drone.clone(), reason(row))).collect()
}

/// A show does not put a drone into show mode, and after an abort it is in another one. Who does
/// not obey is not in show mode when it is looked at next.
fn enter_show_mode(
    host: &dyn Host,
    client: &mut Client,
    flight: &ServedFlight<'_>,
) -> Result<(), WorkflowError> {
    let ids: Vec<String> = flight.drones.values().cloned().collect();
    let status = client.status(&ids)?;
    let jobs = status.iter().filter_map(|(id, status)| {
        let state = State::of(status);
        let is_there = state.is_in_show_mode() || state.is_make_believe();
        (!is_there).then(|| show_mode(id))
    });
    let jobs: Vec<Job> = jobs.collect();
    let mut orders = Orders { host };
    client.work(jobs, AT_ONCE, &mut orders)?;
    host.check_stop()
}

struct Orders<'a> {
    host: &'a dyn Host,
}

impl Foreman for Orders<'_> {
    fn over(&mut self, drone: &str, outcome: Outcome) -> Option<Job> {
        if let Err(reason) = outcome {
            self.host.warn(&format!("drone {drone} was not switched to show mode: {reason}"));
        }
        None
    }

    fn stop(&mut self) -> bool {
        self.host.is_stopped()
    }
}
