//! The two steps of a start, each with a check of every drone, and the way back.

use std::sync::Arc;

use super::ServedFlight;
use super::gate::{MOMENT, gate};
use super::identity::Begun;
use crate::link::clock::{Micros, S};
use crate::skybrush_server::gate::Step;
use crate::skybrush_server::{Client, StartConfig};
use crate::workflow::error::{WorkflowError, with_reasons};
use crate::workflow::fleet::start::{Lead, asked};
use crate::workflow::host::Host;

/// Authorization after this is too late, s before the start.
const AUTHORIZE_BEFORE_S: f64 = 12.0;
/// A start that not everyone has taken by now is taken back, s before it: before the others arm.
const TAKEN_BEFORE_S: f64 = 11.0;
/// The server tells the drones once a second, and they answer twice.
const TAKE: Micros = 10 * S;

/// A start that was authorized.
pub(super) struct Started {
    /// When it is, Unix s.
    pub(super) unix_s: i64,
    pub(super) begun: Begun,
    /// Another station has begun it.
    pub(super) attached: bool,
}

/// Sets the start time, has a person (or `--yes`) authorize it, and sees that every drone has it.
/// Whatever comes between takes it back.
pub(super) fn start(
    host: &dyn Host,
    client: &mut Client,
    flight: &ServedFlight<'_>,
    lead: &Lead,
) -> Result<Started, WorkflowError> {
    let now_us = host.clock().unix_us();
    let unix_s = (now_us / 1_000_000) as i64 + lead.ahead_s.ceil() as i64;
    let start = StartConfig {
        unix_s: Some(unix_s),
        authorized: false,
        drones: flight.drones.values().cloned().collect(),
        duration_s: flight.plan.duration_ms as f64 / 1000.0,
    };
    let mut begun = None;
    match steps(host, client, flight, lead, start, &mut begun) {
        Ok(()) => {
            let begun = begun.unwrap_or_default();
            Ok(Started { unix_s, begun, attached: false })
        }
        Err(error) => {
            let back = take_back(host, client, flight);
            if back.is_ok()
                && let Some(begun) = begun
            {
                begun.withdraw(host, flight.folder);
            }
            Err(after(error, back.err()))
        }
    }
}

fn left_s(host: &dyn Host, unix_s: i64) -> f64 {
    unix_s as f64 - host.clock().unix_us() as f64 * 1e-6
}

fn steps(
    host: &dyn Host,
    client: &mut Client,
    flight: &ServedFlight<'_>,
    lead: &Lead,
    mut start: StartConfig,
    begun: &mut Option<Begun>,
) -> Result<(), WorkflowError> {
    let Some(unix_s) = start.unix_s else { return Ok(()) };
    client.set_start(&start)?;
    let table = gate(host, client, flight, Step::Set(unix_s), TAKE)?;
    if !table.go() {
        return Err(WorkflowError::Unsafe(format!("not every drone is ready: {}", table.words())));
    }
    host.say(&format!("Every drone has the start time, in {:.0} s", left_s(host, unix_s)));
    if !lead.yes {
        let answer = asked(host, "Authorize the start? Type yes: ", || host.check_stop())?;
        if !answer {
            return Err(WorkflowError::Unsafe("not authorized".to_owned()));
        }
    }
    // A person may take their time, and drones do not wait for it.
    let table = gate(host, client, flight, Step::Set(unix_s), MOMENT)?;
    if !table.go() {
        return Err(WorkflowError::Unsafe(format!(
            "not every drone is ready any more: {}",
            table.words()
        )));
    }
    let left = left_s(host, unix_s);
    if left < AUTHORIZE_BEFORE_S {
        return Err(WorkflowError::Usage(format!(
            "{left:.0} s before the start it is too late to authorize it: the drones set their \
             home and arm in the last 10 s; give a longer --lead"
        )));
    }
    *begun = Some(Begun::write(host, flight, unix_s)?);
    start.authorized = true;
    client.set_start(&start).map_err(|error| {
        WorkflowError::Failed(format!("the start was not authorized: {}", with_reasons(&error)))
    })?;
    let patience = ((left_s(host, unix_s) - TAKEN_BEFORE_S).max(0.0) * S as f64) as Micros;
    let table = gate(host, client, flight, Step::Authorized(unix_s), TAKE.min(patience))?;
    if !table.go() {
        return Err(WorkflowError::Unsafe(format!(
            "not every drone accepted the authorization: {}",
            table.words()
        )));
    }
    Ok(())
}

/// Takes a start back, over a new connection if the old one is broken.
pub(super) fn take_back(
    host: &dyn Host,
    client: &mut Client,
    flight: &ServedFlight<'_>,
) -> Result<(), WorkflowError> {
    if client.set_start(&StartConfig::none()).is_ok() {
        return Ok(());
    }
    let again = || -> Result<(), WorkflowError> {
        let mut client = Client::connect(flight.address, Arc::clone(host.clock()))?;
        Ok(client.set_start(&StartConfig::none())?)
    };
    again()
}

/// What went wrong, and what became of the start.
fn after(error: WorkflowError, back: Option<WorkflowError>) -> WorkflowError {
    let Some(failed) = back else {
        let back = "the start was cancelled";
        return match error {
            WorkflowError::Unsafe(text) => WorkflowError::Unsafe(format!("{text}; {back}")),
            WorkflowError::Usage(text) => WorkflowError::Usage(format!("{text}; {back}")),
            WorkflowError::Failed(text) => WorkflowError::Failed(format!("{text}\n  {back}")),
            WorkflowError::Interrupted => {
                WorkflowError::Stopped("stopped: the start was cancelled")
            }
            other => other,
        };
    };
    WorkflowError::Failed(format!(
        "{error}\n  THE START MAY BE AUTHORIZED all the same, and it could not be cancelled \
         ({failed}): use Skybrush Live, or `updraft fleet abort`"
    ))
}
