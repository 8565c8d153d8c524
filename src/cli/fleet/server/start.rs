//! The two steps of a start, each with a look at every drone, and the way back.

use std::sync::Arc;

use super::Flight;
use super::gate::{MOMENT, gate};
use super::identity::Begun;
use crate::cli::context::Context;
use crate::cli::exit::{CommandError, with_reasons};
use crate::cli::fleet::start::{LeadArgs, asked};
use crate::link::clock::{Micros, S};
use crate::skybrush_server::gate::Step;
use crate::skybrush_server::{Client, StartConfig};

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
    context: &Context,
    client: &mut Client,
    flight: &Flight<'_>,
    lead: &LeadArgs,
) -> Result<Started, CommandError> {
    let now_us = context.clock().unix_us();
    let unix_s = (now_us / 1_000_000) as i64 + lead.lead.ceil() as i64;
    let start = StartConfig {
        unix_s: Some(unix_s),
        authorized: false,
        drones: flight.drones.values().cloned().collect(),
        duration_s: flight.plan.duration_ms as f64 / 1000.0,
    };
    let mut begun = None;
    match steps(context, client, flight, lead, start, &mut begun) {
        Ok(()) => {
            let begun = begun.unwrap_or_default();
            Ok(Started { unix_s, begun, attached: false })
        }
        Err(error) => {
            let back = take_back(context, client, flight);
            if back.is_ok()
                && let Some(begun) = begun
            {
                begun.withdraw(context, flight.folder);
            }
            Err(after(error, back.err()))
        }
    }
}

fn left_s(context: &Context, unix_s: i64) -> f64 {
    unix_s as f64 - context.clock().unix_us() as f64 * 1e-6
}

fn steps(
    context: &Context,
    client: &mut Client,
    flight: &Flight<'_>,
    lead: &LeadArgs,
    mut start: StartConfig,
    begun: &mut Option<Begun>,
) -> Result<(), CommandError> {
    let Some(unix_s) = start.unix_s else { return Ok(()) };
    client.set_start(&start)?;
    let table = gate(context, client, flight, Step::Set(unix_s), TAKE)?;
    if !table.go() {
        return Err(CommandError::Unsafe(format!("not every drone is ready: {}", table.words())));
    }
    context.say(&format!("Every drone has the start time, in {:.0} s", left_s(context, unix_s)));
    if !lead.yes {
        let answer = asked("Authorize the start? Type yes: ", || context.check_stop())?;
        if !answer {
            return Err(CommandError::Unsafe("not authorized".to_owned()));
        }
    }
    // A person may take their time, and drones do not wait for it.
    let table = gate(context, client, flight, Step::Set(unix_s), MOMENT)?;
    if !table.go() {
        return Err(CommandError::Unsafe(format!(
            "not every drone is ready any more: {}",
            table.words()
        )));
    }
    let left = left_s(context, unix_s);
    if left < AUTHORIZE_BEFORE_S {
        return Err(CommandError::Usage(format!(
            "{left:.0} s before the start it is too late to authorize it: the drones set their \
             home and arm in the last 10 s; give a longer --lead"
        )));
    }
    *begun = Some(Begun::write(context, flight, unix_s)?);
    start.authorized = true;
    client.set_start(&start).map_err(|error| {
        CommandError::Failed(format!("the start was not authorized: {}", with_reasons(&error)))
    })?;
    let patience = ((left_s(context, unix_s) - TAKEN_BEFORE_S).max(0.0) * S as f64) as Micros;
    let table = gate(context, client, flight, Step::Authorized(unix_s), TAKE.min(patience))?;
    if !table.go() {
        return Err(CommandError::Unsafe(format!(
            "not every drone has taken the authorization: {}",
            table.words()
        )));
    }
    Ok(())
}

/// Takes a start back, over a new connection if the old one is broken.
pub(super) fn take_back(
    context: &Context,
    client: &mut Client,
    flight: &Flight<'_>,
) -> Result<(), CommandError> {
    if client.set_start(&StartConfig::none()).is_ok() {
        return Ok(());
    }
    let again = || -> Result<(), CommandError> {
        let mut client = Client::connect(flight.address, Arc::clone(context.clock()))?;
        Ok(client.set_start(&StartConfig::none())?)
    };
    again()
}

/// What went wrong, and what became of the start.
fn after(error: CommandError, back: Option<CommandError>) -> CommandError {
    let Some(failed) = back else {
        let back = "the start was taken back";
        return match error {
            CommandError::Unsafe(text) => CommandError::Unsafe(format!("{text}; {back}")),
            CommandError::Usage(text) => CommandError::Usage(format!("{text}; {back}")),
            CommandError::Failed(text) => CommandError::Failed(format!("{text}\n  {back}")),
            CommandError::Interrupted => CommandError::Stopped("stopped: the start was taken back"),
            other => other,
        };
    };
    CommandError::Failed(format!(
        "{error}\n  THE START MAY BE AUTHORIZED all the same, and it could not be taken back \
         ({failed}): use Skybrush Live, or `updraft fleet abort`"
    ))
}
