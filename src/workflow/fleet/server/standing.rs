//! Assignment of the server's drones to the slots that they stand on.

use std::collections::BTreeMap;
use std::time::Duration;

use serde_json::Value;

use crate::base::frame::Geodetic;
use crate::fleet::slots::{Stand, allowed_m};
use crate::link::clock::S;
use crate::mission::Plan;
use crate::skybrush_server::Client;
use crate::workflow::error::WorkflowError;
use crate::workflow::host::Host;

/// How often the server is asked who is there.
const EVERY: Duration = Duration::from_millis(500);

/// A drone that was heard so much longer ago than another is not there any more, ms: the server keeps
/// what it last said.
const SILENT_MS: i64 = 15_000;

/// Who stands where.
pub(super) struct Standing {
    /// The server's names of all drones.
    pub(super) ids: Vec<String>,
    /// The server's names of the drones by slot.
    pub(super) found: BTreeMap<u16, String>,
    /// Where they all stand, of those that say so.
    pub(super) stands: BTreeMap<String, Stand>,
    /// Those that the server hears no more; they stand nowhere.
    pub(super) silent: Vec<String>,
    /// What is not as planned.
    pub(super) problems: Vec<String>,
    /// How many say where they are.
    placed: usize,
}

impl Standing {
    /// The slot of a drone.
    pub(super) fn slot_of(&self, id: &str) -> Option<u16> {
        self.found.iter().find(|(_, other)| *other == id).map(|(slot, _)| *slot)
    }
}

/// Who stands where, once as many drones as are wanted say where they are, or after `wait_s`: a
/// server that has only just been started hears its drones one after the other, and some of its
/// drivers begin with the first client.
pub(super) fn standing(
    host: &dyn Host,
    client: &mut Client,
    plan: &Plan,
    wanted: usize,
    wait_s: f64,
) -> Result<Standing, WorkflowError> {
    let clock = host.clock();
    let until = clock.now() + (wait_s * S as f64) as u64;
    let mut said = false;
    loop {
        let now = look(client, plan)?;
        if now.placed >= wanted || clock.now() >= until {
            if !now.silent.is_empty() {
                host.say(&format!(
                    "Left out, because the server has not heard them for a while: drones {}",
                    now.silent.join(", ")
                ));
            }
            return Ok(now);
        }
        if !said {
            said = true;
            host.say(&format!(
                "The server knows where {} of {wanted} drones are; waiting for the others",
                now.placed
            ));
        }
        if host.is_stopped() {
            return Err(WorkflowError::Interrupted);
        }
        clock.pause(EVERY);
    }
}

/// When the server heard it last, ms.
fn told_ms(status: &Value) -> Option<i64> {
    status.get("timestamp").and_then(Value::as_i64)
}

/// Where a status says that its drone is; `None` without a position fix.
fn place(status: &Value) -> Option<Geodetic> {
    // 1e-7 degrees.
    let part = |index: usize| {
        let value = status.pointer(&format!("/position/{index}")).and_then(Value::as_f64);
        value.map(|value| value * 1e-7)
    };
    let place = Geodetic { lat_deg: part(0)?, lon_deg: part(1)?, amsl_m: 0.0 };
    (place.lat_deg != 0.0 || place.lon_deg != 0.0).then_some(place)
}

fn look(client: &mut Client, plan: &Plan) -> Result<Standing, WorkflowError> {
    let mut ids = client.drones()?;
    ids.sort();
    let status = client.status(&ids)?;
    let allowed_m = allowed_m(plan);
    let mut found: BTreeMap<u16, String> = BTreeMap::new();
    let mut stands = BTreeMap::new();
    let mut doubled = Vec::new();
    let mut problems = Vec::new();
    let mut placed = 0;
    let newest_ms = status.values().filter_map(told_ms).max();
    let mut silent = Vec::new();
    for (id, status) in &status {
        if newest_ms.zip(told_ms(status)).is_some_and(|(newest, told)| newest - told > SILENT_MS) {
            silent.push(id.clone());
            continue;
        }
        let Some(place) = place(status) else {
            problems.push(format!("drone {id} does not say where it stands"));
            continue;
        };
        placed += 1;
        let Some(stand) = Stand::of(plan, place) else { continue };
        let (slot, away_m) = (stand.nearest, stand.distance_m);
        stands.insert(id.clone(), stand);
        if away_m > allowed_m {
            problems.push(format!("drone {id} stands {away_m:.1} m from slot {slot}"));
        } else if let Some(other) = found.insert(slot, id.clone()) {
            problems.push(format!("drones {other} and {id} both stand on slot {slot}"));
            doubled.push(slot);
        }
    }
    for slot in &plan.slots {
        if !found.contains_key(&slot.slot) {
            problems.push(format!("slot {} has no drone", slot.slot));
        }
    }
    // Whose it is, nobody knows.
    found.retain(|slot, _| !doubled.contains(slot));
    Ok(Standing { ids, found, stands, silent, problems, placed })
}

/// Slots and the server's names of their drones; everyone must stand as planned.
pub(super) fn assign(
    host: &dyn Host,
    client: &mut Client,
    plan: &Plan,
    wait_s: f64,
) -> Result<BTreeMap<u16, String>, WorkflowError> {
    let standing = standing(host, client, plan, plan.slots.len(), wait_s)?;
    if standing.problems.is_empty() {
        return Ok(standing.found);
    }
    for problem in &standing.problems {
        host.warn(problem);
    }
    Err(WorkflowError::Unsafe("the drones do not stand as planned; nothing was sent".to_owned()))
}
