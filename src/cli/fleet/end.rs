//! `fleet abort` and `fleet land`.

use std::collections::BTreeMap;

use super::connect::Target;
use super::{EndArgs, dry, server, tables};
use crate::cli::context::Context;
use crate::cli::exit::{CommandError, Exit};
use crate::fleet::abort::{Aborted, Action};
use crate::link::id::DroneId;
use crate::workflow::fleet::end::{CarriedOut, Order, end};

/// Ends flights.
pub(super) fn run(context: &Context, args: &EndArgs, action: Action) -> Result<Exit, CommandError> {
    let connect = &args.step.connect;
    if args.step.dry_run {
        return dry::end(context, &args.step, action);
    }
    let order = Order {
        campaign: &args.step.campaign,
        flight: args.step.flight.as_deref(),
        only: args.drones.as_ref().map(|drones| drones.iter().copied().collect()),
        action,
        wait_s: connect.wait,
    };
    let links = match connect.target()? {
        Target::Links(links) => links,
        Target::Server(address) => {
            server::refuse(connect, &[])?;
            return server::end(context, &address, order.only.as_ref(), action);
        }
        Target::Sim => {
            return Err(CommandError::Usage(
                "give the drones' own links with --connect".to_owned(),
            ));
        }
    };
    match end(context, &order, || connect.open(context, links))? {
        CarriedOut::ByStation(done) => print(context, &done),
        CarriedOut::Here(done) => {
            let exit = print(context, &done)?;
            if context.check_stop().is_err() {
                return Err(CommandError::Stopped(
                    "stopped: drones that are not named above have not confirmed it and may fly on",
                ));
            }
            Ok(exit)
        }
    }
}

fn print(context: &Context, done: &BTreeMap<DroneId, Aborted>) -> Result<Exit, CommandError> {
    let unsure = done.values().filter(|done| !done.is_confirmed()).count();
    for (drone, done) in done.iter().filter(|(_, done)| !done.is_confirmed()) {
        if context.json || context.quiet {
            context.warn(&format!("drone {drone}: {done}"));
        }
    }
    if context.json {
        context.print_json(&tables::EndOutput::new(done))?;
    } else {
        for (drone, done) in done {
            context.print(&format!("drone {drone}: {done}\n"))?;
        }
    }
    Ok(if unsure == 0 { Exit::Done } else { Exit::Losses })
}
