//! `logs list` and `logs pull` through the server.

use super::bring::bring;
use super::connect;
use super::rows::sum_up;
use super::standing::{Standing, standing};
use crate::campaign::FlightFolder;
use crate::mission::Plan;
use crate::skybrush_server::{Client, LogEntry};
use crate::workflow::error::WorkflowError;
use crate::workflow::fleet::bring::{LogState, Wish};
use crate::workflow::fleet::output::LogOutput;
use crate::workflow::fleet::output::{ListRow, ListedLog};
use crate::workflow::host::Host;
use crate::workflow::slots::SlotSet;

/// Who is there, and the slots that are meant.
fn meet(
    host: &dyn Host,
    address: &str,
    plan: &Plan,
    slots: Option<&SlotSet>,
    wait_s: f64,
) -> Result<(Client, Standing, Vec<u16>), WorkflowError> {
    let mut client = connect(host, address)?;
    let is_meant = |slot: &u16| slots.is_none_or(|slots| slots.contains(*slot));
    let meant: Vec<u16> = plan.slots.iter().map(|slot| slot.slot).filter(is_meant).collect();
    let standing = standing(host, &mut client, plan, meant.len(), wait_s)?;
    Ok((client, standing, meant))
}

/// What logs the drones have: those on the slots, or all that the server knows.
pub(crate) fn list(
    host: &dyn Host,
    address: &str,
    plan: &Plan,
    slots: Option<&SlotSet>,
    wait_s: f64,
) -> Result<Vec<ListRow>, WorkflowError> {
    let (mut client, standing, meant) = meet(host, address, plan, slots, wait_s)?;
    let ids: Vec<String> = match slots {
        None => standing.ids.clone(),
        Some(_) => meant.iter().filter_map(|slot| standing.found.get(slot).cloned()).collect(),
    };
    let nobody = slots.is_some() || ids.is_empty();
    for slot in meant.iter().filter(|slot| nobody && !standing.found.contains_key(slot)) {
        host.warn(&format!("slot {slot} has no drone that the server knows"));
    }
    if ids.is_empty() {
        return Err(WorkflowError::Nothing("the server knows none of the drones".to_owned()));
    }
    let mut listed = client.logs(&ids, || !host.is_stopped())?;
    host.check_stop()?;
    let row = |id: String| {
        let said = listed.remove(&id);
        let said = said.unwrap_or_else(|| Err("the server did not list its logs".to_owned()));
        let slot = standing.slot_of(&id);
        let (logs, reason) = match said {
            Ok(logs) => (logs.iter().filter_map(listed_log).collect(), None),
            Err(reason) => (Vec::new(), Some(reason)),
        };
        ListRow { drone: id, slot, logs, reason }
    };
    Ok(ids.into_iter().map(row).collect())
}

fn listed_log(log: &LogEntry) -> Option<ListedLog> {
    let unix_s = log.unix_s.and_then(|time| u32::try_from(time).ok()).unwrap_or(0);
    Some(ListedLog { number: log.id.parse().ok()?, bytes: log.size, unix_s })
}

/// Brings logs of the drones that stand on the slots that are meant.
pub(crate) fn pull(
    host: &dyn Host,
    address: &str,
    folder: &FlightFolder,
    plan: &Plan,
    slots: Option<&SlotSet>,
    wish: &Wish,
    wait_s: f64,
) -> Result<Vec<LogOutput>, WorkflowError> {
    let (mut client, standing, meant) = meet(host, address, plan, slots, wait_s)?;
    let (wanted, lost): (Vec<u16>, Vec<u16>) =
        meant.into_iter().partition(|slot| standing.found.contains_key(slot));
    if !lost.is_empty() {
        // Everyone else's log comes home all the same.
        for problem in &standing.problems {
            host.warn(problem);
        }
    }
    let wanted: Vec<(u16, String)> = wanted
        .into_iter()
        .filter_map(|slot| standing.found.get(&slot).map(|id| (slot, id.clone())))
        .collect();
    let mut rows = bring(host, &mut client, address, folder, plan, &wanted, wish)?;
    let nobody = |slot| LogOutput {
        slot,
        drone: None,
        state: LogState::Missing,
        bytes: 0,
        reason: Some("no drone of the server is known to stand there".to_owned()),
    };
    rows.extend(lost.into_iter().map(nobody));
    rows.sort_by_key(|row| row.slot);
    sum_up(host, &rows);
    Ok(rows)
}
