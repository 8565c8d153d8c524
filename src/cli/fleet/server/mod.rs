//! Output of flights through a running Skybrush Server.

mod options;

use std::collections::BTreeSet;

use schemars::JsonSchema;
use serde::Serialize;

use super::tables::{FleetStatus, FleetUpload};
use crate::base::layout;
use crate::campaign::FlightFolder;
use crate::cli::context::Context;
use crate::cli::exit::{CommandError, Exit};
use crate::fleet::abort::Action;
use crate::link::id::DroneId;
use crate::mission::Plan;
use crate::workflow::fleet::server::{self, Status, StatusRow, Uploaded};

pub(in crate::cli) use options::{of_air, refuse};

#[derive(Serialize, JsonSchema)]
pub(in crate::cli) struct StatusOutput<'a> {
    schema: &'static str,
    drones: &'a [StatusRow],
}

/// Who is known to the server, where they stand, what they say.
pub(in crate::cli) fn status(
    context: &Context,
    address: &str,
    plan: &Plan,
    wait_s: f64,
) -> Result<Exit, CommandError> {
    let Status { drones, problems } = &server::status(context, address, plan, wait_s)?;
    if drones.is_empty() {
        for problem in problems {
            context.warn(problem);
        }
        return Err(CommandError::Nothing("the server knows no drone".to_owned()));
    }
    if context.json {
        let output = StatusOutput { schema: "updraft.fleet-status/1", drones };
        context.print_json(&FleetStatus::ThroughServer(output))?;
    } else {
        let head = ["drone", "slot", "away m", "mode", "show", "GPS", "battery", "states"];
        let mut lines: Vec<Vec<String>> = vec![head.map(str::to_owned).into()];
        for row in drones {
            let dash = || "-".to_owned();
            let away = |m: f64| if m < 1000.0 { format!("{m:.1}") } else { "far".to_owned() };
            let mut line = vec![
                row.drone.clone(),
                row.nearest_slot.map_or_else(dash, |slot| slot.to_string()),
                row.distance_m.map_or_else(dash, away),
            ];
            line.extend(row.cells.clone());
            line.push(row.states.join(", "));
            lines.push(line);
        }
        context.print(&format!("{}\n", layout::aligned(&lines).join("\n")))?;
    }
    for problem in problems {
        context.warn(problem);
    }
    Ok(Exit::Done)
}

#[derive(Serialize, JsonSchema)]
pub(in crate::cli) struct UploadOutput {
    schema: &'static str,
    drones: Vec<UploadRow>,
}

#[derive(Serialize, JsonSchema)]
struct UploadRow {
    slot: u16,
    drone: String,
    loaded: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    reason: Option<String>,
}

/// Gives every drone its show, origin and fence, and switches it to show mode.
pub(in crate::cli) fn upload(
    context: &Context,
    address: &str,
    folder: &FlightFolder,
    plan: &Plan,
    wait_s: f64,
) -> Result<Exit, CommandError> {
    let Uploaded { drones, refused } = server::upload(context, address, folder, plan, wait_s)?;
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
        let output = UploadOutput { schema: "updraft.upload/1", drones };
        context.print_json(&FleetUpload::ThroughServer(output))?;
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
    let table = server::preflight(context, address, folder, plan, wait_s)?;
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

/// Ends flights: those in the air return or land, the start is taken back when all are meant.
pub(in crate::cli) fn end(
    context: &Context,
    address: &str,
    only: Option<&BTreeSet<DroneId>>,
    action: Action,
) -> Result<Exit, CommandError> {
    let mut ended = server::end(context, address, only, action)?;
    for (id, text, confirmed) in &ended.told {
        if !confirmed {
            context.warn(&format!("drone {id}: {text}"));
        }
        context.emit(&format!("drone {id}: {text}\n"))?;
    }
    for id in &ended.on_ground {
        context.emit(&format!("drone {id}: on the ground\n"))?;
    }
    if only.is_none() {
        ended.take_start_back()?;
        context.emit("the start is cancelled\n")?;
    } else if !ended.on_ground.is_empty() {
        context.warn(
            "the start stays valid for drones on the ground: without --drones it is \
                      cancelled",
        );
    }
    Ok(ended.ending().into())
}
