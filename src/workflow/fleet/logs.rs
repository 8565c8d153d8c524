//! Logs on drones, listed and brought home over their own links.

use super::bring::{Brought, LogState, Wish, bring};
use super::crew::Crew;
use super::output::{ListRow, ListedLog};
use super::who;
use crate::base::plain::Shown as _;
use crate::campaign::origin::LogOrigin;
use crate::mission::Plan;
use crate::workflow::error::WorkflowError;
use crate::workflow::host::Host;
use crate::workflow::slots::SlotSet;

/// That a plan has these slots.
pub(crate) fn has_slots(plan: &Plan, slots: Option<&SlotSet>) -> Result<(), WorkflowError> {
    match slots.and_then(|slots| slots.stray(plan)) {
        None => Ok(()),
        Some(stray) => Err(WorkflowError::Usage(format!(
            "the plan has no slot {stray}: it has {}",
            plan.slots.len()
        ))),
    }
}

/// What logs the drones have, slot by slot.
pub(crate) fn list(
    host: &dyn Host,
    crew: &mut Crew<'_>,
    slots: Option<&SlotSet>,
    wait_s: f64,
) -> Result<Vec<ListRow>, WorkflowError> {
    let nobody = who::find(host, crew, slots, wait_s)?;
    let listed = crew.list_logs()?;
    let mut rows: Vec<ListRow> = crew
        .table
        .drones
        .iter()
        .map(|line| {
            let (logs, reason) = match listed.get(&line.drone) {
                Some(Ok(logs)) => (logs.as_slice(), None),
                Some(Err(error)) => (&[][..], Some(error.clone())),
                None => (&[][..], Some("it was not asked".to_owned())),
            };
            let logs = logs.iter().map(|log| ListedLog {
                number: log.id,
                bytes: log.size,
                unix_s: log.time_utc_s,
            });
            ListRow {
                drone: line.drone.to_string(),
                slot: Some(line.slot),
                logs: logs.collect(),
                reason,
            }
        })
        .collect();
    rows.extend(nobody.into_iter().map(|(slot, why)| ListRow {
        drone: "-".to_owned(),
        slot: Some(slot),
        logs: Vec::new(),
        reason: Some(why),
    }));
    rows.sort_by_key(|row| row.slot);
    Ok(rows)
}

/// Brings logs home; slots of which nobody is known to stand there are rows, too.
pub(crate) fn pull(
    host: &dyn Host,
    crew: &mut Crew<'_>,
    slots: Option<&SlotSet>,
    wait_s: f64,
    wish: &Wish,
) -> Result<Vec<Brought>, WorkflowError> {
    let folder = crew.folder;
    let nobody = who::find(host, crew, slots, wait_s).map_err(|error| match error {
        WorkflowError::Nothing(text) if folder.has_simulated_logs() => {
            WorkflowError::Nothing(format!(
                "{text}\n  (simulated logs need no download: they are in {})",
                folder.logs_of(LogOrigin::Simulated).folder.shown()
            ))
        }
        error => error,
    })?;
    let mut brought = bring(host, &mut crew.net, folder, crew.plan, &crew.table, wish)?;
    let nobody = nobody.into_iter().map(|(slot, why)| Brought {
        slot,
        drone: None,
        state: LogState::Missing,
        bytes: 0,
        reason: Some(why),
        unchecked: None,
    });
    let nobody: Vec<Brought> = nobody.collect();
    for loss in nobody.iter().filter_map(Brought::loss) {
        host.warn(&loss);
    }
    brought.extend(nobody);
    brought.sort_by_key(|one| one.slot);
    Ok(brought)
}
