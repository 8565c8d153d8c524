//! Watch over a flight in progress, in place of a station that is gone.

use super::bring::{Wish, bring};
use super::crew::{Crew, Found, nobody};
use super::interrupt::Choice;
use super::start::landed;
use crate::base::plain::Shown as _;
use crate::fleet::slots::FleetTable;
use crate::workflow::ending::Ending;
use crate::workflow::error::WorkflowError;
use crate::workflow::host::Host;
use crate::workflow::words::time_of_day;

/// Watches a flight to its end, and brings its logs.
pub(crate) fn follow(
    host: &dyn Host,
    crew: &mut Crew<'_>,
    wait_s: f64,
    on_interrupt: Choice,
    with_logs: bool,
) -> Result<Ending, WorkflowError> {
    if !FleetTable::path(&crew.folder.0).exists() {
        return Err(WorkflowError::Nothing(format!(
            "{} does not exist, so it is not known which drone flies which slot: no flight was \
             started from this folder. `updraft fleet status` shows which drones are heard, \
             `updraft fleet abort` needs no table",
            FleetTable::path(&crew.folder.0).shown()
        )));
    }
    crew.on_interrupt = on_interrupt;
    crew.hear_anyone(wait_s, None, &nobody(wait_s))?;
    let (exit, over) = match crew.attach(wait_s)? {
        Found::Flight(mut start) => {
            let alarms = crew.watch(&mut start)?;
            crew.clear_start(&mut start)?;
            (landed(host, crew, &alarms), None)
        }
        Found::Over(start) => {
            crew.clear_leftover()?;
            let over = format!("The flight of {} is over", time_of_day(start));
            host.say(&format!("{over}: all drones are on the ground"));
            (Ending::Done, Some(over))
        }
    };
    if !with_logs {
        return Ok(exit);
    }
    let wish = Wish::default();
    let brought = bring(host, &mut crew.net, crew.folder, crew.plan, &crew.table, &wish)?;
    let lost: Vec<String> =
        brought.iter().filter(|one| one.is_missing()).map(|one| one.slot.to_string()).collect();
    match over {
        Some(over) if lost.is_empty() => host.say(&format!("{over}; its logs are downloaded")),
        Some(over) => {
            host.warn(&format!(
                "{over}; not yet downloaded: the logs of slots {}",
                lost.join(", ")
            ));
        }
        None => {}
    }
    Ok(if lost.is_empty() { exit } else { Ending::Losses })
}
