//! Assignment of logs to slots: by the campaign's table, otherwise by where the drones stand. A
//! missing drone, or two on one slot, does not keep the logs of others away.

use std::collections::BTreeMap;

use crate::fleet::slots::{FleetTable, SlotProblem, picture, propose, propose_clear};
use crate::link::clock::{MS, Micros, S};
use crate::link::conversation::Observer as _;
use crate::link::net::Net as _;
use crate::workflow::error::WorkflowError;
use crate::workflow::fleet::crew::{Crew, nobody};
use crate::workflow::host::Host;
use crate::workflow::slots::SlotSet;

/// How often it is looked who stands where.
const LOOK: Micros = 200 * MS;
/// Slots that are empty for so long are waited for, aloud.
const SAID_AFTER: Micros = 3 * S;

/// Fills the crew's table with the drones whose slots are clear. Returns why the other slots that
/// are meant have none.
pub(crate) fn find(
    host: &dyn Host,
    crew: &mut Crew<'_>,
    slots: Option<&SlotSet>,
    wait_s: f64,
) -> Result<BTreeMap<u16, String>, WorkflowError> {
    let is_meant = |slot: u16| slots.is_none_or(|slots| slots.contains(slot));
    let mut why = BTreeMap::new();
    if FleetTable::path(&crew.folder.0).exists() {
        crew.table = FleetTable::read(&crew.folder.0)?;
        // Drones that are off are waited for while the others' logs come.
        crew.hear_anyone(wait_s, None, &nobody(wait_s))?;
    } else {
        let meant: Vec<u16> =
            crew.plan.slots.iter().map(|slot| slot.slot).filter(|slot| is_meant(*slot)).collect();
        listen(host, crew, &meant, wait_s)?;
        let now = crew.net.now();
        if propose(crew.plan, &crew.telemetry, now).is_ok() {
            crew.assign(false)?;
        } else {
            let (table, problems) = propose_clear(crew.plan, &crew.telemetry, now);
            crew.table = table;
            host.insist(&picture(crew.plan, &crew.telemetry, now));
            for problem in &problems {
                host.warn(&problem.to_string());
            }
            let found = crew.table.by_slot();
            let nobody = "no drone is known to stand on it".to_owned();
            why.extend(
                meant.iter().filter(|slot| !found.contains_key(slot)).map(|slot| {
                    let of_slot = |problem: &&SlotProblem| {
                        matches!(problem, SlotProblem::BothOn { slot: on, .. } if on == slot)
                    };
                    let problem = problems.iter().find(of_slot);
                    (*slot, problem.map_or_else(|| nobody.clone(), ToString::to_string))
                }),
            );
        }
    }
    crew.table.drones.retain(|line| is_meant(line.slot));
    Ok(why)
}

/// Listens until a drone stands clearly on each of these slots, or for `wait_s`.
fn listen(
    host: &dyn Host,
    crew: &mut Crew<'_>,
    meant: &[u16],
    wait_s: f64,
) -> Result<(), WorkflowError> {
    let begun = crew.net.now();
    let until = begun + (wait_s * 1e6) as Micros;
    let mut said = false;
    loop {
        host.check_stop()?;
        let now = crew.net.now();
        let found = propose_clear(crew.plan, &crew.telemetry, now).0.by_slot();
        let mut absent = meant.iter().filter(|slot| !found.contains_key(slot)).peekable();
        // A second drone on a slot may be heard a moment later.
        if (absent.peek().is_none() && now >= begun + 1500 * MS) || now >= until {
            break;
        }
        if !said && now >= begun + SAID_AFTER {
            said = true;
            for slot in absent {
                host.say(&format!("waiting for a drone on slot {slot}"));
            }
        }
        let next = (now + LOOK).min(until);
        while let Some(received) = crew.net.recv(next)? {
            crew.telemetry.on_message(crew.net.now(), &received);
            if crew.net.now() >= next {
                break;
            }
        }
    }
    if crew.telemetry.drones.is_empty() {
        return Err(WorkflowError::Nothing(nobody(wait_s)));
    }
    // Who is heard, but refuses what this station says, is asked in vain: the reason is known.
    crew.tell_troubles();
    Ok(())
}
