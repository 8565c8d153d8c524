//! `fleet watch`: a station in place of one that is gone, for a flight that is on its way.

use clap::Args;

use super::connect::Target;
use super::crew::{Found, nobody};
use super::interrupt::InterruptArgs;
use super::start::landed;
use super::tables::time_of_day;
use super::{StepArgs, bring, dry, lock, one_flight, server, with_desk};
use crate::base::plain::Shown as _;
use crate::cli::context::Context;
use crate::cli::exit::{CommandError, Exit};
use crate::fleet::slots::FleetTable;

/// Arguments of `fleet watch`.
#[derive(Clone, Debug, Args)]
#[command(after_long_help = "Examples:
  updraft fleet watch my-campaign --flight calibration
  updraft fleet watch my-campaign --flight calibration --connect udpin:0.0.0.0:14550 --no-logs
  updraft fleet watch my-campaign --flight calibration --connect skybrush://localhost:5001

Who flies which slot is in fleet.json; the start is what the drones say, or logs/start.json, which through
Skybrush Server tells both. Drones that
were flown with --guided have lost who flew them: they are watched as they come down. `fleet abort` and
`fleet land` of other terminals are carried out. Exit codes: 3 somebody has not landed, gave an alarm, or
a log is missing; 5 nobody flies, and no start is set.")]
pub(in crate::cli) struct WatchArgs {
    #[command(flatten)]
    step: StepArgs,
    /// Leave the logs on the drones; `updraft logs pull` brings them
    #[arg(long)]
    no_logs: bool,
    #[command(flatten)]
    interrupt: InterruptArgs,
}

pub(super) fn run(context: &Context, args: &WatchArgs) -> Result<Exit, CommandError> {
    if args.step.dry_run {
        return dry::status(context, &args.step);
    }
    let server = match args.step.connect.target()? {
        Target::Server(address) => {
            server::refuse(&args.step.connect, &[])?;
            Some(address)
        }
        _ => None,
    };
    let _lock = lock(context, &args.step.campaign)?;
    if let Some(address) = server {
        let (folder, plan) = one_flight(&args.step.campaign, args.step.flight.as_deref())?;
        let (wait_s, on_interrupt) = (args.step.connect.wait, args.interrupt.on_interrupt);
        let with_logs = !args.no_logs;
        return server::take_over(
            context,
            &address,
            &folder,
            &plan,
            wait_s,
            on_interrupt,
            with_logs,
        );
    }
    with_desk(context, &args.step, |crew| {
        if !FleetTable::path(&crew.folder.0).exists() {
            return Err(CommandError::Nothing(format!(
                "{} is not there, so nobody knows which drone flies which slot: no flight was \
                 started from this folder. `updraft fleet status` shows who is heard, `updraft fleet \
                 abort` needs no table",
                FleetTable::path(&crew.folder.0).shown()
            )));
        }
        crew.on_interrupt = args.interrupt.on_interrupt;
        let wait_s = args.step.connect.wait;
        crew.hear_anyone(wait_s, None, &nobody(wait_s))?;
        let (exit, over) = match crew.attach(wait_s)? {
            Found::Flight(mut start) => {
                let alarms = crew.watch(&mut start)?;
                crew.clear_start(&mut start)?;
                (landed(context, crew, &alarms), None)
            }
            Found::Over(start) => {
                crew.clear_leftover()?;
                let over = format!("The flight of {} is over", time_of_day(start));
                context.say(&format!("{over}: everyone is on the ground"));
                (Exit::Done, Some(over))
            }
        };
        if args.no_logs {
            return Ok(exit);
        }
        let wish = bring::Wish::default();
        let brought =
            bring::bring(context, &mut crew.net, crew.folder, crew.plan, &crew.table, &wish)?;
        let lost: Vec<String> = brought
            .iter()
            .filter(|one| one.state == "missing")
            .map(|one| one.slot.to_string())
            .collect();
        match over {
            Some(over) if lost.is_empty() => context.say(&format!("{over}; its logs are at home")),
            Some(over) => context
                .warn(&format!("{over}; not at home are the logs of slots {}", lost.join(", "))),
            None => {}
        }
        Ok(if lost.is_empty() { exit } else { Exit::Losses })
    })
}
