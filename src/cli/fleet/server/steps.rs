//! `fleet status`, `fleet upload` and `fleet preflight` through a server.

use std::collections::BTreeMap;

use serde::Serialize;

use super::gate::{cells, gate, write_aligned};
use super::load::{load, patience};
use super::standing::{assign, standing};
use super::upload::Shows;
use super::{Flight, connect};
use crate::campaign::FlightFolder;
use crate::cli::context::Context;
use crate::cli::exit::{CommandError, Exit};
use crate::mission::Plan;
use crate::skybrush_server::Client;
use crate::skybrush_server::gate::Step;
use crate::skybrush_server::state::State;
use crate::skybrush_server::watch::code_name;

#[derive(Serialize)]
struct StatusOutput {
    schema: &'static str,
    drones: Vec<StatusRow>,
}

#[derive(Serialize)]
struct StatusRow {
    drone: String,
    nearest_slot: Option<u16>,
    distance_m: Option<f64>,
    mode: String,
    /// What it says of its show, in the server's words.
    show: Option<String>,
    satellites: Option<u64>,
    battery_percent: Option<f64>,
    battery_v: Option<f64>,
    /// States and errors, in words.
    states: Vec<String>,
}

/// Who is known to the server, where they stand, what they say.
pub(in crate::cli) fn status(
    context: &Context,
    address: &str,
    plan: &Plan,
    wait_s: f64,
) -> Result<Exit, CommandError> {
    let mut client = connect(context, address)?;
    let standing = standing(context, &mut client, plan, plan.slots.len(), wait_s)?;
    let told = client.status(&standing.ids)?;
    let row = |id: &String| {
        let state = told.get(id).map(State::of).unwrap_or_default();
        let stand = standing.stands.get(id);
        let row = StatusRow {
            drone: id.clone(),
            nearest_slot: stand.map(|stand| stand.nearest),
            distance_m: stand.map(|stand| stand.distance_m),
            mode: state.mode.clone(),
            show: state.show.as_ref().map(|show| show.text.clone()),
            satellites: state.satellites,
            battery_percent: state.battery_percent,
            battery_v: state.battery_v,
            states: state.codes.iter().map(|code| code_name(*code).to_owned()).collect(),
        };
        (row, state)
    };
    let rows: Vec<(StatusRow, State)> = standing.ids.iter().map(row).collect();
    let problems = &standing.problems;
    let is_empty = rows.is_empty();
    if context.json {
        let drones = rows.into_iter().map(|(row, _)| row).collect();
        context.print_json(&StatusOutput { schema: "updraft.fleet-status/1", drones })?;
    } else {
        let head = ["drone", "slot", "away m", "mode", "show", "GPS", "battery", "states"];
        let mut lines: Vec<Vec<String>> = vec![head.map(str::to_owned).into()];
        for (row, state) in &rows {
            let dash = || "-".to_owned();
            let away = |m: f64| if m < 1000.0 { format!("{m:.1}") } else { "far".to_owned() };
            let mut line = vec![
                row.drone.clone(),
                row.nearest_slot.map_or_else(dash, |slot| slot.to_string()),
                row.distance_m.map_or_else(dash, away),
            ];
            line.extend(cells(state));
            line.push(row.states.join(", "));
            lines.push(line);
        }
        let mut text = String::new();
        // Writing into a text does not fail.
        let _ = write_aligned(&mut text, &lines);
        context.print(&text)?;
    }
    for problem in problems {
        context.warn(problem);
    }
    if is_empty {
        return Err(CommandError::Nothing("the server knows no drone".to_owned()));
    }
    Ok(Exit::Done)
}

#[derive(Serialize)]
struct UploadOutput {
    schema: &'static str,
    drones: Vec<UploadRow>,
}

#[derive(Serialize)]
struct UploadRow {
    slot: u16,
    drone: String,
    loaded: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    reason: Option<String>,
}

/// Runs a step with the drones that stand on the plan's slots, all of them; who they are, and what came
/// of it.
fn on_slots<T>(
    context: &Context,
    address: &str,
    folder: &FlightFolder,
    plan: &Plan,
    wait_s: f64,
    step: impl FnOnce(&mut Client, &Flight<'_>) -> Result<T, CommandError>,
) -> Result<(BTreeMap<u16, String>, T), CommandError> {
    let mut client = connect(context, address)?;
    let drones = assign(context, &mut client, plan, wait_s)?;
    let done = step(&mut client, &Flight { address, folder, plan, drones: &drones })?;
    Ok((drones, done))
}

/// Gives every drone its show, origin and fence, and switches it to show mode.
pub(in crate::cli) fn upload(
    context: &Context,
    address: &str,
    folder: &FlightFolder,
    plan: &Plan,
    wait_s: f64,
) -> Result<Exit, CommandError> {
    let shows = Shows::of(plan)?;
    let (drones, loaded) = on_slots(context, address, folder, plan, wait_s, |client, flight| {
        load(context, client, flight, &shows, wait_s)
    })?;
    let refused = loaded.err().unwrap_or_default();
    context.say(&format!(
        "{} of {} drones have the show",
        drones.len().saturating_sub(refused.len()),
        drones.len()
    ));
    if context.json {
        let row = |(slot, drone): (&u16, &String)| UploadRow {
            slot: *slot,
            drone: drone.clone(),
            loaded: !refused.contains_key(drone),
            reason: refused.get(drone).cloned(),
        };
        let drones = drones.iter().map(row).collect();
        context.print_json(&UploadOutput { schema: "updraft.upload/1", drones })?;
    }
    Ok(if refused.is_empty() { Exit::Done } else { Exit::Losses })
}

/// Whether every drone may be started. Nothing is sent to them.
pub(in crate::cli) fn preflight(
    context: &Context,
    address: &str,
    folder: &FlightFolder,
    plan: &Plan,
    wait_s: f64,
) -> Result<Exit, CommandError> {
    let (_, table) = on_slots(context, address, folder, plan, wait_s, |client, flight| {
        gate(context, client, flight, Step::Ready, patience(wait_s))
    })?;
    if context.json {
        context.print_json(&table.output())?;
    } else {
        context.emit(&table.to_string())?;
    }
    context.say(
        "The server does not report which show they carry, their parameters or their fences: \
         `updraft fly` uploads show and fence anew, and checks again before the start",
    );
    Ok(if table.go() { Exit::Done } else { Exit::Unsafe })
}
