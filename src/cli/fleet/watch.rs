//! `fleet watch`: a station in place of one that is gone, for a flight that is on its way.

use clap::Args;

use super::connect::Target;
use super::interrupt::InterruptArgs;
use super::start::landed;
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
        crew.hear_anyone(args.step.connect.wait, None)?;
        let mut start = crew.attach()?;
        let alarms = crew.watch(&mut start)?;
        let exit = landed(context, crew, &alarms);
        if args.no_logs {
            return Ok(exit);
        }
        let wish = bring::Wish::default();
        let brought =
            bring::bring(context, &mut crew.net, crew.folder, crew.plan, &crew.table, &wish)?;
        let lost = brought.iter().any(|one| one.state == "missing");
        Ok(if lost { Exit::Losses } else { exit })
    })
}
