//! `updraft fly`: upload, preflight, start, watch, and bring the logs home.

use std::collections::BTreeMap;
use std::path::PathBuf;

use clap::Args;

use super::context::Context;
use super::exit::{CommandError, Exit};
use super::fleet::bring::{Brought, Wish, bring};
use super::fleet::connect::{ConnectArgs, Target};
use super::fleet::crew::Crew;
use super::fleet::sim::{Hangar, Mishaps, TO_START};
use super::fleet::start::{LeadArgs, asked, fly_now, guide_now, needs_person, say_landed};
use super::fleet::tables::PreflightOutput;
use super::fleet::{dry, end, lock, one_flight, refuse_of_upload, server};
use super::fly_output::{FlightEnd, FlightOutput, FlyOutput, LogOutput};
use super::simulate::{AirArgs, air_help, updraft};
use crate::base::time::GpsTime;
use crate::campaign::origin::LogOrigin;
use crate::campaign::start::StartRecord;
use crate::campaign::{self, FlightFolder};
use crate::fleet::logs::manifest::Shelf;
use crate::fleet::preflight::Preflight;
use crate::fleet::start::StartOptions;
use crate::link::id::DroneId;
use crate::link::station::Station;
use crate::mission::Plan;
use crate::virtual_fleet::lossy::Faults;
use crate::virtual_fleet::server::Pace;
use crate::virtual_fleet::vehicle::BootTimes;
use crate::workflow::clock::Stopwatch;
use crate::workflow::simulate::{Flown, Ready, Simulation, make_ready, settle};

/// Virtual drones on the ground live so many times as fast as the clock on the wall.
const GROUND_PACE: f64 = 20.0;

/// Arguments of `updraft fly`.
#[derive(Debug, Args)]
#[expect(clippy::struct_excessive_bools, reason = "each is an option of the command line")]
#[command(after_long_help = format!("Examples:
  updraft fly my-campaign --flight calibration --connect udpin:0.0.0.0:14550 --set-params
  updraft fly my-campaign --flight hover --connect tcp:10.0.0.7:5760 --key swarm.key --lead 60
  updraft fly my-campaign --flight hover --connect skybrush://localhost:5001
  updraft fly my-campaign --flight calibration --connect udpin:0.0.0.0:14550 --guided  # stock firmware
  updraft fly my-campaign --connect sim             # every flight, by virtual drones

The steps of a flight: find who flies which slot (from where they stand), check parameters, load show,
origin and fence, the preflight table, the start time, its authorization (asked for, or --yes), the
show, the logs. Each is a command of its own, too: see `updraft fleet` and `updraft logs`. Exit codes:
3 done with losses, 4 no-go: nothing was started.

{}", air_help()))]
pub(super) struct FlyArgs {
    /// Campaign folder
    campaign: PathBuf,
    /// Which flight, if the campaign has several
    #[arg(long, value_name = "NAME")]
    flight: Option<String>,
    #[command(flatten)]
    connect: ConnectArgs,
    #[command(flatten)]
    lead: LeadArgs,
    /// Set parameters that must be others (old values are kept for `fleet restore`)
    #[arg(long)]
    set_params: bool,
    /// Find anew which drone flies which slot, from where they stand
    #[arg(long)]
    assign: bool,
    /// Fly the drones by streaming targets in GUIDED: needs no show firmware, but a link without
    /// gaps until everyone has landed
    #[arg(long)]
    guided: bool,
    /// Leave the logs on the drones; `updraft logs pull` brings them
    #[arg(long)]
    no_logs: bool,
    /// Print the messages of the upload and the start, and send nothing
    #[arg(long)]
    dry_run: bool,
    /// Vertical air speed for virtual drones, m/s, up positive
    #[arg(long, value_name = "MPS", default_value_t = 0.0, value_parser = updraft, allow_hyphen_values = true)]
    updraft: f64,
    /// Replace logs of virtual drones that were flown with other settings
    #[arg(long)]
    force: bool,
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
            "--guided streams to the drones themselves: give their own links with --connect"
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

/// Refuses to fly while records that the flight needs when it is over cannot be read.
fn readable(folder: &FlightFolder) -> Result<(), CommandError> {
    StartRecord::read(folder)?;
    Shelf::open(&folder.logs(), "")?;
    Ok(())
}

fn fly_target(
    context: &Context,
    args: &FlyArgs,
    target: Target,
) -> Result<(Vec<FlightOutput>, Exit), CommandError> {
    match target {
        Target::Links(links) => {
            let (folder, plan) = one_flight(&args.campaign, args.flight.as_deref())?;
            readable(&folder)?;
            let mut station = args.connect.open(links)?;
            let mut handler = end::order_handler(context, &mut station, &folder);
            let mut crew = Crew::new(context, &mut handler, &folder, &plan);
            crew.is_guided = args.guided;
            let flown = crew.listen(args.connect.wait).and_then(|()| fly(context, &mut crew, args));
            let (flight, exit) = crew.ending(flown)?;
            Ok((vec![flight], exit))
        }
        Target::Sim => {
            needs_person(&args.lead)?;
            let simulation = args.air.simulation(args.updraft, args.force);
            let mut lost = false;
            let mut flights = Vec::new();
            for folder in campaign::flights(&args.campaign)? {
                let plan = folder.read_plan()?;
                if args.flight.as_ref().is_some_and(|name| *name != plan.name) {
                    continue;
                }
                let lead = Some(&args.lead);
                let (flown, output) = fly_and_tell(context, &folder, &plan, &simulation, lead)?;
                lost |= !flown.failed.is_empty();
                flights.push(output);
            }
            if flights.is_empty() {
                one_flight(&args.campaign, args.flight.as_deref())?;
            }
            Ok((flights, if lost { Exit::Losses } else { Exit::Done }))
        }
        Target::Server(address) => {
            let (folder, plan) = one_flight(&args.campaign, args.flight.as_deref())?;
            let (with_logs, wait_s) = (!args.no_logs, args.connect.wait);
            readable(&folder)?;
            let (flight, exit) =
                server::fly(context, &address, &folder, &plan, &args.lead, with_logs, wait_s)?;
            Ok((vec![flight], exit))
        }
    }
}

/// The whole flight of real drones.
fn fly(
    context: &Context,
    crew: &mut Crew<'_>,
    args: &FlyArgs,
) -> Result<(FlightOutput, Exit), CommandError> {
    if let Some(words) = crew.in_flight() {
        context.insist(&format!("NO-GO: {words}"));
        return Ok((FlightOutput::no_go(&crew.plan.name, Vec::new(), None), Exit::Unsafe));
    }
    crew.greet()?;
    let stands = crew.assign(args.assign)?;
    crew.not_ordered_down()?;
    if !stands {
        context.insist("NO-GO: nothing was sent, as the drones do not stand as planned");
        return Ok((FlightOutput::no_go(&crew.plan.name, Vec::new(), None), Exit::Unsafe));
    }
    crew.clear_leftover()?;
    let refused = if args.guided {
        crew.make_guided()?
    } else {
        if let Some(mixed) = crew.firmwares() {
            context.insist(&mixed);
            let drones = not_started(crew, &BTreeMap::new());
            return Ok((FlightOutput::no_go(&crew.plan.name, drones, None), Exit::Unsafe));
        }
        crew.upload()?
    };
    crew.not_ordered_down()?;
    // The fence's own switch is one of the parameters.
    crew.params(args.set_params)?;
    crew.not_ordered_down()?;
    let table = crew.preflight(args.connect.wait)?;
    crew.not_ordered_down()?;
    if !refused.is_empty() || !table.go() {
        if context.json {
            context.insist(&table.to_string());
        } else {
            context.emit(&table.to_string())?;
        }
        let drones = not_started(crew, &refused);
        let found = Some(PreflightOutput::of(&table));
        return Ok((FlightOutput::no_go(&crew.plan.name, drones, found), Exit::Unsafe));
    }
    if context.json {
        context.say(&table.to_string());
    } else {
        context.print(&table.to_string())?;
    }
    let (flown, alarms) = if args.guided {
        guide_now(context, crew, &args.lead)?
    } else {
        fly_now(context, crew, &args.lead)?
    };
    let mut output = FlightOutput::flown(crew, &alarms, Some(PreflightOutput::of(&table)));
    if args.no_logs {
        return Ok((output, flown));
    }
    let brought =
        bring(context, &mut crew.net, crew.folder, crew.plan, &crew.table, &Wish::default())?;
    let lost = brought.iter().any(|one| one.state == "missing");
    output.logs = brought.iter().map(LogOutput::from).collect();
    Ok((output, if lost { Exit::Losses } else { flown }))
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

/// A flight by virtual drones: over MAVLink, like real ones, with logs that come home.
pub(super) fn fly_virtual(
    context: &Context,
    folder: &FlightFolder,
    plan: &Plan,
    simulation: &Simulation,
) -> Result<Flown, CommandError> {
    fly_and_tell(context, folder, plan, simulation, None).map(|(flown, _)| flown)
}

/// The same, with what `--json` prints of it. `rehearsed`: people practise, and are shown and asked what
/// they are in the field.
fn fly_and_tell(
    context: &Context,
    folder: &FlightFolder,
    plan: &Plan,
    simulation: &Simulation,
    rehearsed: Option<&LeadArgs>,
) -> Result<(Flown, FlightOutput), CommandError> {
    let watch = Stopwatch::start(context);
    let ready = make_ready(context, folder, plan, simulation)?;
    let mut output = FlightOutput {
        flight: plan.name.clone(),
        outcome: FlightEnd::Flown,
        preflight: None,
        drones: Vec::new(),
        logs: ready.wanted.iter().map(|slot| LogOutput::there(slot.slot)).collect(),
    };
    let mut failed = Vec::new();
    if !ready.open.is_empty() {
        let (flown, brought) = launch(context, folder, plan, simulation, &ready, rehearsed)?;
        output.preflight = flown.preflight;
        failed.extend(brought.iter().filter_map(Brought::loss));
        output.drones = flown.drones;
        for one in &brought {
            output.logs.retain(|log| log.slot != one.slot);
            output.logs.push(LogOutput::from(one));
        }
        output.logs.sort_by_key(|log| log.slot);
    }
    Ok((settle(context, folder, plan, ready, failed, &watch)?, output))
}

/// A crew for virtual drones of this program, once they are heard.
fn virtual_crew<'a>(
    context: &'a Context,
    station: &'a mut Station,
    folder: &'a FlightFolder,
    plan: &'a Plan,
) -> Result<Crew<'a>, CommandError> {
    let mut crew = Crew::new(context, station, folder, plan);
    crew.is_virtual = true;
    crew.listen(60.0)?;
    crew.greet()?;
    Ok(crew)
}

/// Everything before the start; virtual drones have no reason to refuse.
fn make_start_ready(crew: &mut Crew<'_>) -> Result<Preflight, CommandError> {
    let no_go =
        |what: &str| CommandError::Failed(format!("the virtual drones do not start: {what}"));
    if !crew.assign(true)? {
        return Err(no_go("they do not stand as planned"));
    }
    let refused = crew.upload()?;
    crew.params(true)?;
    let table = crew.preflight(20.0)?;
    if !refused.is_empty() || !table.go() {
        return Err(no_go(&format!("\n{table}")));
    }
    Ok(table)
}

fn launch(
    context: &Context,
    folder: &FlightFolder,
    plan: &Plan,
    simulation: &Simulation,
    ready: &Ready<'_>,
    rehearsed: Option<&LeadArgs>,
) -> Result<(FlightOutput, Vec<Brought>), CommandError> {
    let start = ready.record.start;
    let switched_on = GpsTime::from_total_ms(start.total_ms() - (TO_START / 1000) as i64)
        .ok_or_else(|| CommandError::Failed("the start time is not a GPS time".to_owned()))?;
    let hangar = Hangar {
        plan,
        slots: ready.open.clone(),
        vehicle: &ready.vehicle,
        air: &ready.air,
        seed: simulation.seed,
        full_logs: simulation.full_logs,
        boots_by_seed: true,
        switched_on,
        pace: Pace::Fast { ground: GROUND_PACE },
        faults: Faults::default(),
        boot: BootTimes::short(),
        mishaps: Mishaps::default(),
        key: None,
    };
    // A part of the fleet is a fleet of its own.
    let mut part = plan.clone();
    part.slots.retain(|slot| ready.open.iter().any(|open| open.slot == slot.slot));
    let mut found = None;
    if let Some(lead) = rehearsed {
        context.say(&format!("Practice of {} with virtual drones: as in the field", plan.name));
        // While a person thinks, time goes on for drones on the ground, and the start that is the same
        // every time would pass: they are switched on again for the flight.
        found = hangar.open(|station| {
            let mut crew = virtual_crew(context, station, folder, &part)?;
            let table = make_start_ready(&mut crew)?;
            if context.json {
                context.say(&table.to_string());
            } else {
                context.print(&table.to_string())?;
            }
            if !lead.yes && !asked("Authorize the start? Type yes: ", || crew.idle())? {
                return Err(CommandError::Unsafe("not authorized: nobody takes off".to_owned()));
            }
            Ok(Some(PreflightOutput::of(&table)))
        })?;
    }
    hangar.open(|station| {
        let mut crew = virtual_crew(context, station, folder, &part)?;
        crew.tells_all = rehearsed.is_some();
        make_start_ready(&mut crew)?;
        let options = StartOptions { at: Some(start), ..StartOptions::default() };
        let mut start = crew.announce(options)?;
        crew.authorize(&mut start)?;
        let alarms = crew.watch(&mut start)?;
        if rehearsed.is_some() {
            say_landed(context, &crew);
        }
        let flown = FlightOutput::flown(&crew, &alarms, found);
        // Virtual drones fly again at any time.
        let wish = Wish {
            quiet: true,
            is_durable: false,
            origin: LogOrigin::Simulated,
            ..Wish::default()
        };
        Ok((flown, bring(context, &mut crew.net, folder, plan, &crew.table, &wish)?))
    })
}
