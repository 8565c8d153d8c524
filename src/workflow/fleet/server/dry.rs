//! Dry runs with a server: the requests of each step, which no server hears.

use std::collections::BTreeMap;

use serde_json::{Value, json};

use super::upload::Shows;
use crate::fleet::abort::Action;
use crate::mission::Plan;
use crate::skybrush_server::{StartConfig, end_flight, show_mode};
use crate::workflow::error::WorkflowError;

/// What would be asked for each slot.
pub(crate) type Lines = BTreeMap<String, Vec<String>>;

/// Which drone stands where, only the server knows.
fn name(slot: u16) -> String {
    format!("(who stands on slot {slot})")
}

/// What a flight would ask of the server.
pub(crate) fn dry_fly(plan: &Plan, lead_s: f64) -> Result<Lines, WorkflowError> {
    let jobs = Shows::of(plan)?.jobs(|slot| Some(name(slot)))?;
    let start = |authorized| {
        let mut body = StartConfig {
            unix_s: None,
            authorized,
            drones: plan.slots.iter().map(|slot| name(slot.slot)).collect(),
            duration_s: plan.duration_ms as f64 / 1000.0,
        }
        .body();
        if let Some(time) = body.pointer_mut("/configuration/start/time") {
            *time = Value::from(format!("(now + {lead_s:.0} s)"));
        }
        body.to_string()
    };
    let lines = jobs.into_iter().map(|(slot, job)| {
        let mode = show_mode(&name(slot)).body.to_string();
        (format!("on slot {slot}"), vec![job.body.to_string(), mode, start(false), start(true)])
    });
    Ok(lines.collect())
}

/// What an upload would ask of the server.
pub(crate) fn dry_upload(plan: &Plan) -> Result<Lines, WorkflowError> {
    let jobs = Shows::of(plan)?.jobs(|slot| Some(name(slot)))?;
    let lines = jobs.into_iter().map(|(slot, job)| {
        let mode = show_mode(&name(slot)).body.to_string();
        (format!("on slot {slot}"), vec![job.body.to_string(), mode])
    });
    Ok(lines.collect())
}

/// What a look at the drones would ask of the server: nothing of the drones themselves.
pub(crate) fn dry_look(plan: &Plan) -> Lines {
    let lines = plan.slots.iter().map(|slot| {
        let ask = json!({ "type": "UAV-INF", "ids": [name(slot.slot)] });
        (format!("on slot {}", slot.slot), vec![ask.to_string()])
    });
    lines.collect()
}

/// What an abort would ask of the server.
pub(crate) fn dry_end(plan: &Plan, action: Action) -> Lines {
    let lines = plan.slots.iter().map(|slot| {
        let end = end_flight(&[name(slot.slot)], action == Action::Return).to_string();
        let back = StartConfig::none().body().to_string();
        (format!("on slot {}", slot.slot), vec![end, back])
    });
    lines.collect()
}
