//! Flight of real drones from preparation to logs, step by step.

use std::collections::BTreeMap;

use super::bring::{Brought, Wish, bring};
use super::crew::Crew;
use super::output::{FlightOutput, LogOutput};
use super::preflight::PreflightOutput;
use super::start::{Lead, fly_now, guide_now};
use crate::campaign::FlightFolder;
use crate::campaign::start::StartRecord;
use crate::fleet::logs::manifest::Shelf;
use crate::link::id::DroneId;
use crate::workflow::ending::Ending;
use crate::workflow::error::WorkflowError;
use crate::workflow::host::Host;

/// How a flight is to be flown.
#[expect(clippy::struct_excessive_bools, reason = "each is a choice of whoever flies")]
pub(crate) struct FlyWish {
    pub(crate) lead: Lead,
    /// Whether parameters are set that must be others.
    pub(crate) set_params: bool,
    /// Whether it is found anew which drone flies which slot.
    pub(crate) assign: bool,
    /// Whether the station flies the drones by streaming targets.
    pub(crate) guided: bool,
    /// Whether logs are brought home.
    pub(crate) with_logs: bool,
    /// How long drones are waited for, s.
    pub(crate) wait_s: f64,
}

/// Refuses to fly while records that the flight needs when it is over cannot be read.
pub(crate) fn readable(folder: &FlightFolder) -> Result<(), WorkflowError> {
    StartRecord::read(folder)?;
    Shelf::open(&folder.logs(), "")?;
    Ok(())
}

/// The whole flight of real drones.
pub(crate) fn fly(
    host: &dyn Host,
    crew: &mut Crew<'_>,
    wish: &FlyWish,
) -> Result<(FlightOutput, Ending), WorkflowError> {
    if let Some(words) = crew.in_flight() {
        host.insist(&format!("NO-GO: {words}"));
        return Ok((FlightOutput::no_go(&crew.plan.name, Vec::new(), None), Ending::NoGo));
    }
    crew.greet()?;
    let stands = crew.assign(wish.assign)?;
    crew.not_ordered_down()?;
    if !stands {
        host.insist("NO-GO: nothing was sent, because the drones do not stand as planned");
        return Ok((FlightOutput::no_go(&crew.plan.name, Vec::new(), None), Ending::NoGo));
    }
    crew.clear_leftover()?;
    let refused = if wish.guided {
        crew.make_guided()?
    } else {
        if let Some(mixed) = crew.firmwares() {
            host.insist(&mixed);
            let drones = not_started(crew, &BTreeMap::new());
            return Ok((FlightOutput::no_go(&crew.plan.name, drones, None), Ending::NoGo));
        }
        crew.upload()?
    };
    crew.not_ordered_down()?;
    // The fence's own switch is one of the parameters.
    crew.params(wish.set_params)?;
    crew.not_ordered_down()?;
    let table = crew.preflight(wish.wait_s)?;
    crew.not_ordered_down()?;
    if !refused.is_empty() || !table.go() {
        host.show_no_go(&table.to_string()).map_err(WorkflowError::Output)?;
        let drones = not_started(crew, &refused);
        let found = Some(PreflightOutput::of(&table));
        return Ok((FlightOutput::no_go(&crew.plan.name, drones, found), Ending::NoGo));
    }
    host.show(&table.to_string()).map_err(WorkflowError::Output)?;
    let (flown, alarms) = if wish.guided {
        guide_now(host, crew, &wish.lead)?
    } else {
        fly_now(host, crew, &wish.lead)?
    };
    let mut output = FlightOutput::flown(crew, &alarms, Some(PreflightOutput::of(&table)));
    if !wish.with_logs {
        return Ok((output, flown));
    }
    let brought =
        bring(host, &mut crew.net, crew.folder, crew.plan, &crew.table, &Wish::default())?;
    let lost = brought.iter().any(Brought::is_missing);
    output.logs = brought.iter().map(LogOutput::from).collect();
    Ok((output, if lost { Ending::Losses } else { flown }))
}

/// The drones of a flight that is not started, with what each has refused.
fn not_started(
    crew: &Crew<'_>,
    refused: &BTreeMap<DroneId, String>,
) -> Vec<(u16, String, Vec<String>)> {
    let drones = crew.table.drones.iter();
    drones
        .map(|line| {
            let reasons = refused.get(&line.drone).cloned().into_iter().collect();
            (line.slot, line.drone.to_string(), reasons)
        })
        .collect()
}
