//! Checks and steps through a server, before a flight.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Serialize;

use super::gate::{Table, cells, gate};
use super::load::{load, patience};
use super::standing::{assign, standing};
use super::upload::Shows;
use super::{ServedFlight, connect};
use crate::campaign::FlightFolder;
use crate::mission::Plan;
use crate::skybrush_server::Client;
use crate::skybrush_server::gate::Step;
use crate::skybrush_server::state::State;
use crate::skybrush_server::watch::code_name;
use crate::workflow::error::WorkflowError;
use crate::workflow::host::Host;

/// Who is known to a server, and where they stand.
pub(crate) struct Status {
    pub(crate) drones: Vec<StatusRow>,
    /// What is not as planned.
    pub(crate) problems: Vec<String>,
}

/// One drone behind a server.
#[derive(Serialize, JsonSchema)]
pub(crate) struct StatusRow {
    pub(crate) drone: String,
    pub(crate) nearest_slot: Option<u16>,
    pub(crate) distance_m: Option<f64>,
    mode: String,
    /// What it says of its show, in the server's words.
    show: Option<String>,
    satellites: Option<u64>,
    battery_percent: Option<f64>,
    battery_v: Option<f64>,
    /// States and errors, in words.
    pub(crate) states: Vec<String>,
    /// As people read it: mode, show, GPS, battery.
    #[serde(skip)]
    pub(crate) cells: [String; 4],
}

/// Who is known to the server, where they stand, what they say.
pub(crate) fn status(
    host: &dyn Host,
    address: &str,
    plan: &Plan,
    wait_s: f64,
) -> Result<Status, WorkflowError> {
    let mut client = connect(host, address)?;
    let standing = standing(host, &mut client, plan, plan.slots.len(), wait_s)?;
    let told = client.status(&standing.ids)?;
    let row = |id: &String| {
        let state = told.get(id).map(State::of).unwrap_or_default();
        let stand = standing.stands.get(id);
        StatusRow {
            drone: id.clone(),
            nearest_slot: stand.map(|stand| stand.nearest),
            distance_m: stand.map(|stand| stand.distance_m),
            cells: cells(&state),
            mode: state.mode.clone(),
            show: state.show.as_ref().map(|show| show.text.clone()),
            satellites: state.satellites,
            battery_percent: state.battery_percent,
            battery_v: state.battery_v,
            states: state.codes.iter().map(|code| code_name(*code).to_owned()).collect(),
        }
    };
    Ok(Status { drones: standing.ids.iter().map(row).collect(), problems: standing.problems })
}

/// Runs a step with the drones that stand on the plan's slots, all of them; who they are, and what came
/// of it.
fn on_slots<T>(
    host: &dyn Host,
    address: &str,
    folder: &FlightFolder,
    plan: &Plan,
    wait_s: f64,
    step: impl FnOnce(&mut Client, &ServedFlight<'_>) -> Result<T, WorkflowError>,
) -> Result<(BTreeMap<u16, String>, T), WorkflowError> {
    let mut client = connect(host, address)?;
    let drones = assign(host, &mut client, plan, wait_s)?;
    let done = step(&mut client, &ServedFlight { address, folder, plan, drones: &drones })?;
    Ok((drones, done))
}

/// Who was given a show.
pub(crate) struct Uploaded {
    /// The drones by slot.
    pub(crate) drones: BTreeMap<u16, String>,
    /// Those that have refused, with their reasons.
    pub(crate) refused: BTreeMap<String, String>,
}

/// Gives every drone its show, origin and fence, and switches it to show mode.
pub(crate) fn upload(
    host: &dyn Host,
    address: &str,
    folder: &FlightFolder,
    plan: &Plan,
    wait_s: f64,
) -> Result<Uploaded, WorkflowError> {
    let shows = Shows::of(plan)?;
    let (drones, loaded) = on_slots(host, address, folder, plan, wait_s, |client, flight| {
        load(host, client, flight, &shows, wait_s)
    })?;
    Ok(Uploaded { drones, refused: loaded.err().unwrap_or_default() })
}

/// Whether every drone may be started. Nothing is sent to them.
pub(crate) fn preflight(
    host: &dyn Host,
    address: &str,
    folder: &FlightFolder,
    plan: &Plan,
    wait_s: f64,
) -> Result<Table, WorkflowError> {
    let (_, table) = on_slots(host, address, folder, plan, wait_s, |client, flight| {
        gate(host, client, flight, Step::Ready, patience(wait_s))
    })?;
    Ok(table)
}
