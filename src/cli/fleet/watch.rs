//! `fleet watch`: a station in place of one that is gone, for a flight that is on its way.

use clap::Args;

use super::connect::Target;
use super::start::InterruptArgs;
use super::{StepArgs, dry, server, with_orders};
use crate::cli::context::Context;
use crate::cli::exit::{CommandError, Exit};
use crate::cli::live_args::LiveArgs;
use crate::workflow::fleet::server::take_over;
use crate::workflow::fleet::watch::follow;
use crate::workflow::fleet::{lock, one_flight};

/// Arguments of `fleet watch`.
#[derive(Clone, Debug, Args)]
#[command(after_long_help = "Examples:
  updraft fleet watch my-campaign --flight calibration
  updraft fleet watch my-campaign --flight calibration --connect udpin:0.0.0.0:14550 --no-logs
  updraft fleet watch my-campaign --flight calibration --connect skybrush://localhost:5001

Which drone flies which slot is in fleet.json; the start is what the drones report, or is in
logs/start.json, which says both for flights through Skybrush Server. Drones that were flown with
--guided no longer receive targets: they are watched as they come down. `fleet abort` and `fleet
land` in other terminals are carried out. Exit codes: 3 a drone has not landed or raised an alarm,
or a log is missing; 5 no drone is flying, and no start is set.")]
pub(in crate::cli) struct WatchArgs {
    #[command(flatten)]
    step: StepArgs,
    /// Leave the logs on the drones; `updraft logs pull` downloads them
    #[arg(long)]
    no_logs: bool,
    #[command(flatten)]
    interrupt: InterruptArgs,
    #[command(flatten)]
    live: LiveArgs,
}

pub(super) fn run(context: &Context, args: &WatchArgs) -> Result<Exit, CommandError> {
    if args.step.dry_run {
        return dry::status(context, &args.step);
    }
    let server = match args.step.connect.target()? {
        Target::Server(address) => {
            server::refuse(&args.step.connect, &[])?;
            args.live.refuse("a flight through Skybrush Server is seen in Skybrush Live")?;
            Some(address)
        }
        _ => None,
    };
    let _lock = lock(context, &args.step.campaign)?;
    if let Some(address) = server {
        let (folder, plan) = one_flight(&args.step.campaign, args.step.flight.as_deref())?;
        let (wait_s, on_interrupt) = (args.step.connect.wait, args.interrupt.on_interrupt.into());
        let with_logs = !args.no_logs;
        let ending = take_over(context, &address, &folder, &plan, wait_s, on_interrupt, with_logs)?;
        return Ok(ending.into());
    }
    with_orders(context, &args.step, (&args.live, !args.no_logs), |host, crew| {
        let on_interrupt = args.interrupt.on_interrupt.into();
        let ending = follow(host, crew, args.step.connect.wait, on_interrupt, !args.no_logs)?;
        Ok(ending.into())
    })
}
