//! `--dry-run`: the messages, and nobody hears them.

use std::collections::BTreeMap;
use std::fmt::Display;

use schemars::JsonSchema;
use serde::Serialize;

use super::StepArgs;
use super::connect::Target;
use crate::cli::context::Context;
use crate::cli::exit::{CommandError, Exit};
use crate::fleet::abort::Action;
use crate::workflow::fleet::{dry, server};

#[derive(Serialize, JsonSchema)]
pub(in crate::cli) struct DryOutput {
    schema: &'static str,
    drones: BTreeMap<String, Vec<String>>,
}

/// Prints what each drone would be sent.
pub(in crate::cli) fn print<D: Display + Ord>(
    context: &Context,
    lines: BTreeMap<D, Vec<String>>,
) -> Result<Exit, CommandError> {
    if context.json {
        let drones = lines.into_iter().map(|(drone, lines)| (drone.to_string(), lines)).collect();
        context.print_json(&DryOutput { schema: "updraft.dry-run/1", drones })?;
        return Ok(Exit::Done);
    }
    for (drone, lines) in lines {
        context.emit(&format!("to drone {drone}, if all goes well:\n"))?;
        for line in lines {
            context.emit(&format!("  {line}\n"))?;
        }
    }
    context.say("Nothing was sent");
    Ok(Exit::Done)
}

impl StepArgs {
    fn of(&self) -> dry::Of<'_> {
        dry::Of { campaign: &self.campaign, flight: self.flight.as_deref() }
    }

    fn is_through_server(&self) -> Result<bool, CommandError> {
        Ok(matches!(self.connect.target()?, Target::Server(_)))
    }
}

/// What a look at the fleet would send.
pub(in crate::cli) fn status(context: &Context, args: &StepArgs) -> Result<Exit, CommandError> {
    if args.is_through_server()? {
        return print(context, server::dry_look(&args.of().plan()?));
    }
    print(context, dry::status(args.of())?)
}

/// What the preflight table would send.
pub(in crate::cli) fn preflight(context: &Context, args: &StepArgs) -> Result<Exit, CommandError> {
    if args.is_through_server()? {
        return print(context, server::dry_look(&args.of().plan()?));
    }
    print(context, dry::preflight(args.of())?)
}

/// What an upload would send.
pub(in crate::cli) fn upload(context: &Context, args: &StepArgs) -> Result<Exit, CommandError> {
    if args.is_through_server()? {
        return print(context, server::dry_upload(&args.of().plan()?)?);
    }
    print(context, dry::upload(context, args.of())?)
}

/// What a start would send.
pub(in crate::cli) fn start(
    context: &Context,
    args: &StepArgs,
    lead_s: f64,
) -> Result<Exit, CommandError> {
    print(context, dry::start(args.of(), lead_s)?)
}

/// What a whole flight would send.
pub(in crate::cli) fn fly(
    context: &Context,
    args: &StepArgs,
    lead_s: f64,
) -> Result<Exit, CommandError> {
    if args.is_through_server()? {
        return print(context, server::dry_fly(&args.of().plan()?, lead_s)?);
    }
    print(context, dry::fly(context, args.of(), lead_s)?)
}

/// What a whole flight by streaming would send.
pub(in crate::cli) fn guided(
    context: &Context,
    args: &StepArgs,
    lead_s: f64,
) -> Result<Exit, CommandError> {
    print(context, dry::guided(context, args.of(), lead_s)?)
}

/// What putting parameters back would send.
pub(in crate::cli) fn restore(
    context: &Context,
    args: &StepArgs,
    fence_off: bool,
) -> Result<Exit, CommandError> {
    print(context, dry::restore(args.of(), fence_off)?)
}

/// What an abort would send.
pub(in crate::cli) fn end(
    context: &Context,
    args: &StepArgs,
    action: Action,
) -> Result<Exit, CommandError> {
    if args.is_through_server()? {
        return print(context, server::dry_end(&args.of().plan()?, action));
    }
    print(context, dry::end(args.of(), action)?)
}
