//! `updraft fly`: upload, preflight, start, watch, and bring the logs home.

use std::path::PathBuf;

use clap::Args;

use super::context::Context;
use super::exit::{CommandError, Exit};
use super::fleet::connect::{ConnectArgs, Target};
use super::fleet::start::LeadArgs;
use super::fleet::{dry, refuse_of_upload, server};
use super::live_args::LiveArgs;
use super::simulate::{AirArgs, air_help, updraft};
use crate::campaign;
use crate::live::tap::Tap;
use crate::workflow::fleet::crew::Crew;
use crate::workflow::fleet::end::order_handler;
use crate::workflow::fleet::fly::{FlyWish, fly, readable};
use crate::workflow::fleet::output::{FlightOutput, FlyOutput, LogOutput};
use crate::workflow::fleet::server::fly as fly_through;
use crate::workflow::fleet::start::needs_person;
use crate::workflow::fleet::{lock, one_flight, rehearse};
use crate::workflow::live::LiveHost;

/// Arguments of `updraft fly`.
#[derive(Debug, Args)]
#[expect(clippy::struct_excessive_bools, reason = "each is an option of the command line")]
#[command(after_long_help = format!("Examples:
  updraft fly my-campaign --flight calibration --connect udpin:0.0.0.0:14550 --set-params
  updraft fly my-campaign --flight hover --connect tcp:10.0.0.7:5760 --key swarm.key --lead 60
  updraft fly my-campaign --flight hover --connect skybrush://localhost:5001
  updraft fly my-campaign --flight calibration --guided   # stock firmware
  updraft fly my-campaign --flight hover --live --live-orders   # seen, and flown, in a browser
  updraft fly my-campaign --connect sim                   # every flight, with virtual drones

The steps of a flight: assign drones to slots by where they stand, check parameters, upload show,
origin and fence, print the preflight table, set the start time, authorize it (after a question, or
with --yes), watch the show, download the logs. Each is also a command of its own: see `updraft
fleet` and `updraft logs`. Exit codes: 3 done with losses, 4 no-go: nothing was started.

{}", air_help()))]
pub(super) struct FlyArgs {
    /// Campaign folder
    campaign: PathBuf,
    /// Which flight to use, if the campaign has several
    #[arg(long, value_name = "NAME")]
    flight: Option<String>,
    #[command(flatten)]
    connect: ConnectArgs,
    #[command(flatten)]
    lead: LeadArgs,
    /// Set parameters that have the wrong value (old values are kept for `fleet restore`)
    #[arg(long)]
    set_params: bool,
    /// Assign drones to slots again, by where they stand
    #[arg(long)]
    assign: bool,
    /// Fly the drones by streaming targets in GUIDED mode: needs no show firmware, but a link without
    /// gaps until every drone has landed
    #[arg(long)]
    guided: bool,
    /// Leave the logs on the drones; `updraft logs pull` downloads them
    #[arg(long)]
    no_logs: bool,
    /// Print the messages of the upload and the start, but send nothing
    #[arg(long)]
    dry_run: bool,
    /// Vertical air speed for virtual drones, m/s, up positive
    #[arg(long, value_name = "MPS", default_value_t = 0.0, value_parser = updraft, allow_hyphen_values = true)]
    updraft: f64,
    /// Replace logs of virtual drones that were flown with other settings
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    live: LiveArgs,
    #[command(flatten)]
    air: AirArgs,
}

pub(super) fn run(context: &Context, args: &FlyArgs) -> Result<Exit, CommandError> {
    if args.dry_run {
        if let Target::Server(_) = args.connect.target()? {
            refuse_of_server(args)?;
        }
        let step = super::fleet::StepArgs {
            campaign: args.campaign.clone(),
            flight: args.flight.clone(),
            connect: args.connect.clone(),
            dry_run: true,
        };
        let shown = if args.guided { dry::guided } else { dry::fly };
        return shown(context, &step, args.lead.lead);
    }
    let target = args.connect.target()?;
    if args.guided && !matches!(target, Target::Links(_)) {
        return Err(CommandError::Usage(
            "--guided streams to the drones directly: give their own links with --connect"
                .to_owned(),
        ));
    }
    if let Target::Server(_) = target {
        refuse_of_server(args)?;
    }
    let _lock = lock(context, &args.campaign)?;
    let (flights, exit) = fly_target(context, args, target)?;
    if context.json {
        context.print_json(&FlyOutput::new(flights))?;
    }
    Ok(exit)
}

/// Options that do nothing through a server.
fn refuse_of_server(args: &FlyArgs) -> Result<(), CommandError> {
    refuse_of_upload(&args.connect, args.set_params, args.assign)?;
    let of_virtual = "it is for virtual drones of our own (--connect sim)";
    let air = server::of_air(&args.air, args.updraft);
    server::refuse(
        &args.connect,
        &[
            ("--force", args.force, of_virtual),
            (air.unwrap_or_default(), air.is_some(), of_virtual),
        ],
    )
}

fn fly_target(
    context: &Context,
    args: &FlyArgs,
    target: Target,
) -> Result<(Vec<FlightOutput>, Exit), CommandError> {
    let lead = args.lead.lead();
    match target {
        Target::Links(links) => {
            let wish = FlyWish {
                lead,
                set_params: args.set_params,
                assign: args.assign,
                guided: args.guided,
                with_logs: !args.no_logs,
                wait_s: args.connect.wait,
            };
            let (folder, plan) = one_flight(&args.campaign, args.flight.as_deref())?;
            readable(&folder)?;
            let mut station = args.connect.open(context, links)?;
            let mut live = args.live.open(context, &args.campaign, &folder, &plan)?;
            let host = LiveHost::new(context, live.station.clone(), live.orders);
            let mut tap = Tap::new(&mut station, live.station.clone());
            let mut handler = order_handler(&host, &mut tap, &folder);
            let mut crew = Crew::new(&host, &mut handler, &folder, &plan);
            crew.is_guided = args.guided;
            let flown = crew.listen(args.connect.wait).and_then(|()| fly(&host, &mut crew, &wish));
            let ended = crew.ending(flown);
            let is_home =
                |(flight, _): &(FlightOutput, _)| !flight.logs.iter().all(LogOutput::is_missing);
            if ended.as_ref().is_ok_and(is_home) {
                live.show_logs(&host);
            }
            live.tell_end(&ended);
            let (flight, ending) = ended?;
            Ok((vec![flight], ending.into()))
        }
        Target::Sim => {
            args.live.refuse(
                "these drones live in a time of their own; fly drones of `updraft fleet virtual` over \
                 --connect udpin:..., or look at the flight afterwards with `updraft live`",
            )?;
            needs_person(context, &lead)?;
            let simulation = args.air.simulation(args.updraft, args.force);
            let mut lost = false;
            let mut flights = Vec::new();
            for folder in campaign::flights(&args.campaign)? {
                let plan = folder.read_plan()?;
                if args.flight.as_ref().is_some_and(|name| *name != plan.name) {
                    continue;
                }
                let (flown, output) = rehearse(context, &folder, &plan, &simulation, Some(&lead))?;
                lost |= !flown.failed.is_empty();
                flights.push(output);
            }
            if flights.is_empty() {
                one_flight(&args.campaign, args.flight.as_deref())?;
            }
            Ok((flights, if lost { Exit::Losses } else { Exit::Done }))
        }
        Target::Server(address) => {
            args.live.refuse(
                "a flight through Skybrush Server is seen in Skybrush Live; afterwards `updraft live` \
                 shows it from its logs",
            )?;
            let (folder, plan) = one_flight(&args.campaign, args.flight.as_deref())?;
            let (with_logs, wait_s) = (!args.no_logs, args.connect.wait);
            readable(&folder)?;
            let (flight, ending) =
                fly_through(context, &address, &folder, &plan, &lead, with_logs, wait_s)?;
            Ok((vec![flight], ending.into()))
        }
    }
}
