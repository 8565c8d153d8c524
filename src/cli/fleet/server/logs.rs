//! `logs list` and `logs pull` through the server.

use super::bring::bring;
use super::rows::sum_up;
use super::standing::{Standing, standing};
use super::{connect, stopped};
use crate::campaign::FlightFolder;
use crate::cli::context::Context;
use crate::cli::exit::CommandError;
use crate::cli::fleet::bring::Wish;
use crate::cli::fly_output::LogOutput;
use crate::cli::logs::{ListRow, ListedLog};
use crate::mission::Plan;
use crate::skybrush_server::{Client, LogEntry};
use crate::workflow::slots::SlotSet;

/// Who is there, and the slots that are meant.
fn meet(
    context: &Context,
    address: &str,
    plan: &Plan,
    slots: Option<&SlotSet>,
    wait_s: f64,
) -> Result<(Client, Standing, Vec<u16>), CommandError> {
    let mut client = connect(context, address)?;
    let is_meant = |slot: &u16| slots.is_none_or(|slots| slots.contains(*slot));
    let meant: Vec<u16> = plan.slots.iter().map(|slot| slot.slot).filter(is_meant).collect();
    let standing = standing(context, &mut client, plan, meant.len(), wait_s)?;
    Ok((client, standing, meant))
}

/// What logs the drones have: those on the slots, or all that the server knows.
pub(in crate::cli) fn list(
    context: &Context,
    address: &str,
    plan: &Plan,
    slots: Option<&SlotSet>,
    wait_s: f64,
) -> Result<Vec<ListRow>, CommandError> {
    let (mut client, standing, meant) = meet(context, address, plan, slots, wait_s)?;
    let ids: Vec<String> = match slots {
        None => standing.ids.clone(),
        Some(_) => meant.iter().filter_map(|slot| standing.found.get(slot).cloned()).collect(),
    };
    let nobody = slots.is_some() || ids.is_empty();
    for slot in meant.iter().filter(|slot| nobody && !standing.found.contains_key(slot)) {
        context.warn(&format!("slot {slot} has no drone that the server knows"));
    }
    if ids.is_empty() {
        return Err(CommandError::Nothing("the server knows none of the drones".to_owned()));
    }
    let mut listed = client.logs(&ids, || !stopped(context))?;
    context.check_stop()?;
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
pub(in crate::cli) fn pull(
    context: &Context,
    address: &str,
    folder: &FlightFolder,
    plan: &Plan,
    slots: Option<&SlotSet>,
    wish: &Wish,
    wait_s: f64,
) -> Result<Vec<LogOutput>, CommandError> {
    let (mut client, standing, meant) = meet(context, address, plan, slots, wait_s)?;
    let (wanted, lost): (Vec<u16>, Vec<u16>) =
        meant.into_iter().partition(|slot| standing.found.contains_key(slot));
    if !lost.is_empty() {
        // Everyone else's log comes home all the same.
        for problem in &standing.problems {
            context.warn(problem);
        }
    }
    let wanted: Vec<(u16, String)> = wanted
        .into_iter()
        .filter_map(|slot| standing.found.get(&slot).map(|id| (slot, id.clone())))
        .collect();
    let mut rows = bring(context, &mut client, address, folder, plan, &wanted, wish)?;
    let nobody = |slot| LogOutput {
        slot,
        drone: None,
        state: "missing",
        bytes: 0,
        reason: Some("no drone of the server is known to stand there".to_owned()),
    };
    rows.extend(lost.into_iter().map(nobody));
    rows.sort_by_key(|row| row.slot);
    sum_up(context, &rows);
    Ok(rows)
}
