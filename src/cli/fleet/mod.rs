//! `updraft fleet`: the steps of a flight one by one.

pub(super) mod bar;
pub(super) mod connect;
pub(super) mod dry;
mod end;
pub(super) mod server;
pub(super) mod start;
pub(super) mod tables;
mod virtual_drones;
mod watch;

use std::path::PathBuf;

use clap::{Args, Subcommand};

use self::connect::{ConnectArgs, Target};
use self::start::LeadArgs;
use super::context::Context;
use super::exit::{CommandError, Exit};
use super::live_args::LiveArgs;
use crate::fleet::abort::Action;
use crate::link::address::Address;
use crate::link::id::DroneId;
use crate::link::station::Station;
use crate::live::tap::Tap;
use crate::workflow::fleet::crew::Crew;
use crate::workflow::fleet::end::{flying, order_handler};
use crate::workflow::fleet::steps::{self, Started, StepWish};
use crate::workflow::fleet::{lock, one_flight};
use crate::workflow::host::Host;
use crate::workflow::live::LiveHost;

/// Arguments of `updraft fleet`.
#[derive(Debug, Args)]
#[command(after_long_help = "Examples:
  updraft fleet status my-campaign --flight calibration
  updraft fleet upload my-campaign --flight calibration --set-params
  updraft fleet preflight my-campaign --flight calibration
  updraft fleet start my-campaign --flight calibration --lead 60
  updraft fleet watch my-campaign --flight calibration        # if the station that started it died
  updraft fleet abort my-campaign --flight calibration        # all drones return
  updraft fleet land my-campaign --drones 7,1:12              # these land where they are
  updraft fleet virtual my-campaign --station 127.0.0.1:14550 # drones to practise with

Drones are assigned to slots by where they stand, and the assignment is kept in fleet.json; `upload
--assign` makes a new one. Everything that happens is recorded in fleet-journal.ndjson.

Ctrl-C, SIGTERM and SIGHUP (a lost terminal) mean the same. In flight, on a terminal, you are asked
whether the drones should land, return or be left flying; elsewhere --on-interrupt decides, and by
default they return. `fleet watch` takes over a flight whose station is gone. Exit codes: 3 some
drones refused, 4 no-go.")]
pub(super) struct FleetArgs {
    #[command(subcommand)]
    command: FleetCommand,
}

#[derive(Debug, Subcommand)]
enum FleetCommand {
    /// Show which drones are heard, where they stand and what they report
    Status(StepArgs),
    /// Upload the show to the drones: file, origin and fence, all read back
    Upload(UploadArgs),
    /// Check everything that must be right before a start, drone by drone
    Preflight(UploadArgs),
    /// Set a start time and authorize it, then watch the show
    Start(StartArgs),
    /// Watch a flight that another station has started, and download its logs
    Watch(watch::WatchArgs),
    /// Send drones home (for those on the ground, cancel the start)
    Abort(EndArgs),
    /// Land drones where they are (for those on the ground, cancel the start)
    Land(EndArgs),
    /// Restore the parameters that were changed; the fence stays on unless --fence-off is given
    Restore(RestoreArgs),
    /// Run virtual drones at the plan's slots, to practise with
    Virtual(Box<virtual_drones::VirtualArgs>),
}

/// What every step needs.
#[derive(Clone, Debug, Args)]
pub(super) struct StepArgs {
    /// Campaign folder
    pub(super) campaign: PathBuf,
    /// Which flight to use, if the campaign has several
    #[arg(long, value_name = "NAME")]
    pub(super) flight: Option<String>,
    #[command(flatten)]
    pub(super) connect: ConnectArgs,
    /// Print the messages that would be sent, but send nothing
    #[arg(long)]
    pub(super) dry_run: bool,
}

/// Arguments of `fleet upload` and `fleet preflight`.
#[derive(Clone, Debug, Args)]
pub(super) struct UploadArgs {
    #[command(flatten)]
    step: StepArgs,
    /// Set parameters that have the wrong value (old values are kept for `fleet restore`)
    #[arg(long)]
    set_params: bool,
    /// Assign drones to slots again, by where they stand
    #[arg(long)]
    assign: bool,
}

/// Arguments of `fleet start`.
#[derive(Clone, Debug, Args)]
pub(super) struct StartArgs {
    #[command(flatten)]
    upload: UploadArgs,
    #[command(flatten)]
    lead: LeadArgs,
    #[command(flatten)]
    live: LiveArgs,
}

/// Arguments of `fleet restore`.
#[derive(Clone, Debug, Args)]
pub(super) struct RestoreArgs {
    #[command(flatten)]
    step: StepArgs,
    /// Also restore values that leave a drone without a fence: FENCE_ENABLE, FENCE_TYPE and
    /// FENCE_ACTION, where they were 0
    #[arg(long)]
    fence_off: bool,
}

/// Arguments of `fleet abort` and `fleet land`.
#[derive(Clone, Debug, Args)]
pub(super) struct EndArgs {
    #[command(flatten)]
    step: StepArgs,
    /// Only these drones: system ids, or network:system, separated by commas [default: all that are
    /// heard]
    #[arg(long, value_name = "IDS", value_delimiter = ',')]
    drones: Option<Vec<DroneId>>,
}

pub(super) fn run(context: &Context, args: &FleetArgs) -> Result<Exit, CommandError> {
    match &args.command {
        FleetCommand::Status(args) => status(context, args),
        FleetCommand::Upload(args) => upload(context, args),
        FleetCommand::Preflight(args) => preflight(context, args),
        FleetCommand::Start(args) => start(context, args),
        FleetCommand::Watch(args) => watch::run(context, args),
        FleetCommand::Abort(args) => end::run(context, args, Action::Return),
        FleetCommand::Land(args) => end::run(context, args, Action::Land),
        FleetCommand::Restore(args) => restore(context, args),
        FleetCommand::Virtual(args) => virtual_drones::run(context, args),
    }
}

/// Opens the links and runs a step.
fn with_crew(
    context: &Context,
    args: &StepArgs,
    body: impl FnOnce(&mut Crew<'_>) -> Result<Exit, CommandError>,
) -> Result<Exit, CommandError> {
    let (folder, plan) = one_flight(&args.campaign, args.flight.as_deref())?;
    let mut station = step_station(context, args)?;
    let mut crew = Crew::new(context, &mut station, &folder, &plan);
    crew.listen(args.connect.wait)?;
    body(&mut crew)
}

/// Opens the links and runs a step that flies: `fleet abort` of other terminals is carried out
/// meanwhile. The step listens for drones itself.
///
/// With `with_logs` the step brings the logs home: the page then shows what they say of the air.
fn with_orders(
    context: &Context,
    args: &StepArgs,
    (live, with_logs): (&LiveArgs, bool),
    body: impl FnOnce(&dyn Host, &mut Crew<'_>) -> Result<Exit, CommandError>,
) -> Result<Exit, CommandError> {
    let (folder, plan) = one_flight(&args.campaign, args.flight.as_deref())?;
    let mut station = step_station(context, args)?;
    let mut live = live.open(context, &args.campaign, &folder, &plan)?;
    let host = LiveHost::new(context, live.station.clone(), live.orders);
    let mut tap = Tap::new(&mut station, live.station.clone());
    let mut handler = order_handler(&host, &mut tap, &folder);
    let mut crew = Crew::new(&host, &mut handler, &folder, &plan);
    let ended = body(&host, &mut crew);
    let ended = crew.ending(ended);
    if with_logs && ended.is_ok() {
        live.show_logs(&host);
    }
    live.tell_end(&ended);
    ended
}

fn step_station(context: &Context, args: &StepArgs) -> Result<Station, CommandError> {
    match args.connect.target()? {
        Target::Links(links) => open(context, &args.campaign, &args.connect, links),
        Target::Sim => Err(CommandError::Usage(
            "virtual drones live as long as their program: use `updraft fly --connect sim`, or \
             `updraft fleet virtual` in another terminal"
                .to_owned(),
        )),
        Target::Server(_) => Err(CommandError::Usage(
            "through Skybrush Server the start is a part of `updraft fly`; there are `fleet status`, \
             `upload`, `preflight`, `watch`, `abort` and `land`"
                .to_owned(),
        )),
    }
}

impl UploadArgs {
    fn wish(&self) -> StepWish {
        let Self { step, set_params, assign } = self;
        StepWish { set_params: *set_params, assign: *assign, wait_s: step.connect.wait }
    }
}

/// Options of an upload that do nothing through a server.
pub(super) fn refuse_of_upload(
    connect: &ConnectArgs,
    set_params: bool,
    assign: bool,
) -> Result<(), CommandError> {
    let params = "parameters are not checked through it; set them over the drones' own links, or \
                  in Skybrush Live";
    let found = "drones are assigned to slots anew every time, by where they stand";
    server::refuse(connect, &[("--set-params", set_params, params), ("--assign", assign, found)])
}

/// The server that a step goes through, if it does; with options that do nothing there refused.
fn server_of(args: &UploadArgs) -> Result<Option<String>, CommandError> {
    let Target::Server(address) = args.step.connect.target()? else { return Ok(None) };
    refuse_of_upload(&args.step.connect, args.set_params, args.assign)?;
    Ok(Some(address))
}

fn preflight(context: &Context, args: &UploadArgs) -> Result<Exit, CommandError> {
    let server = server_of(args)?;
    if args.step.dry_run {
        return dry::preflight(context, &args.step);
    }
    let _lock = lock(context, &args.step.campaign)?;
    if let Some(address) = server {
        let (folder, plan) = one_flight(&args.step.campaign, args.step.flight.as_deref())?;
        return server::preflight(context, &address, &folder, &plan, args.step.connect.wait);
    }
    with_crew(context, &args.step, |crew| {
        tables::preflight(context, &steps::preflight(crew, args.wish())?)
    })
}

fn status(context: &Context, args: &StepArgs) -> Result<Exit, CommandError> {
    if args.dry_run {
        return dry::status(context, args);
    }
    if let Target::Server(address) = args.connect.target()? {
        server::refuse(&args.connect, &[])?;
        let (_, plan) = one_flight(&args.campaign, args.flight.as_deref())?;
        return server::status(context, &address, &plan, args.connect.wait);
    }
    with_crew(context, args, |crew| tables::status(context, crew))
}

fn upload(context: &Context, args: &UploadArgs) -> Result<Exit, CommandError> {
    let server = server_of(args)?;
    if args.step.dry_run {
        return dry::upload(context, &args.step);
    }
    let _lock = lock(context, &args.step.campaign)?;
    if let Some(address) = server {
        let (folder, plan) = one_flight(&args.step.campaign, args.step.flight.as_deref())?;
        return server::upload(context, &address, &folder, &plan, args.step.connect.wait);
    }
    with_crew(context, &args.step, |crew| {
        let (refused, ending) = steps::upload(crew, args.wish())?;
        if context.json {
            let output = tables::UploadOutput::new(&crew.table, &refused);
            context.print_json(&tables::FleetUpload::OverLinks(output))?;
        }
        Ok(ending.into())
    })
}

/// Opens the links, and says who holds them if another command of this campaign does.
fn open(
    context: &Context,
    campaign: &std::path::Path,
    connect: &ConnectArgs,
    links: Vec<Address>,
) -> Result<Station, CommandError> {
    connect.open(context, links).map_err(|error| match error {
        CommandError::Failed(text) if !flying(campaign).is_empty() => {
            CommandError::Failed(format!(
                "{text}\n  the link is held by the command that flies this campaign: it reports \
                 what happens and records it in fleet-journal.ndjson; `fleet abort` and `fleet \
                 land` reach it"
            ))
        }
        other => other,
    })
}

fn start(context: &Context, args: &StartArgs) -> Result<Exit, CommandError> {
    if args.upload.step.dry_run {
        return dry::start(context, &args.upload.step, args.lead.lead);
    }
    let _lock = lock(context, &args.upload.step.campaign)?;
    with_orders(context, &args.upload.step, (&args.live, false), |host, crew| {
        match steps::start(host, crew, args.upload.wish(), &args.lead.lead())? {
            Started::NoGo(table) => tables::preflight(context, &table),
            Started::Flown(ending) => Ok(ending.into()),
        }
    })
}

fn restore(context: &Context, args: &RestoreArgs) -> Result<Exit, CommandError> {
    if let Target::Server(_) = args.step.connect.target()? {
        return Err(CommandError::Usage(
            "parameters are not restored through Skybrush Server, because none are set through \
             it: those in fleet-changes.json were set over the drones' own links, and are \
             restored over those (--connect), or one by one in Skybrush Live; nothing was sent"
                .to_owned(),
        ));
    }
    if args.step.dry_run {
        return dry::restore(context, &args.step, args.fence_off);
    }
    let _lock = lock(context, &args.step.campaign)?;
    with_crew(context, &args.step, |crew| Ok(steps::restore(context, crew, args.fence_off)?.into()))
}
