//! `updraft fleet`: the steps of a flight one by one.

pub(super) mod bring;
pub(super) mod connect;
pub(super) mod crew;
pub(super) mod dry;
pub(super) mod end;
pub(super) mod server;
pub(super) mod sim;
pub(super) mod tables;
pub(super) mod virtual_drones;

use std::collections::BTreeMap;
use std::io::{BufRead as _, IsTerminal as _, Write as _};
use std::path::PathBuf;
use std::sync::mpsc::RecvTimeoutError;
use std::time::Duration;

use clap::{Args, Subcommand};

use self::connect::{ConnectArgs, Target};
use self::crew::Crew;
use super::context::Context;
use super::exit::{CommandError, Exit};
use crate::campaign::lock::FolderLock;
use crate::campaign::{self, FlightFolder};
use crate::fleet::abort::Action;
use crate::fleet::preflight::Preflight;
use crate::fleet::start::{LEAST_LEAD_S, MOST_LEAD_S, Start, StartOptions};
use crate::link::address::Address;
use crate::link::id::DroneId;
use crate::link::station::Station;
use crate::mission::Plan;

/// Arguments of `updraft fleet`.
#[derive(Debug, Args)]
#[command(after_long_help = "Examples:
  updraft fleet status my-campaign --flight calibration
  updraft fleet upload my-campaign --flight calibration --set-params
  updraft fleet preflight my-campaign --flight calibration
  updraft fleet start my-campaign --flight calibration --lead 60
  updraft fleet abort my-campaign --flight calibration        # everyone returns
  updraft fleet land my-campaign --drones 7,1:12              # these land where they are
  updraft fleet virtual my-campaign --station 127.0.0.1:14550 # drones to practise with

Which drone flies which slot is found from where they stand, and kept in fleet.json; `upload
--assign` finds it anew. Everything that happens is in fleet-journal.ndjson. Exit codes: 3 some drones
refused, 4 no-go.")]
pub(super) struct FleetArgs {
    #[command(subcommand)]
    command: FleetCommand,
}

#[derive(Debug, Subcommand)]
enum FleetCommand {
    /// Who is heard, where they stand, what they say
    Status(StepArgs),
    /// Load the show onto the drones: file, origin, fence, all read back
    Upload(UploadArgs),
    /// Everything that must be right before a start, drone by drone
    Preflight(UploadArgs),
    /// Set a start time and authorize it, then watch the show
    Start(StartArgs),
    /// Send drones home (those on the ground: take their start back)
    Abort(EndArgs),
    /// Land drones where they are (those on the ground: take their start back)
    Land(EndArgs),
    /// Put back the parameters that were changed; the fence stays on, unless --fence-off is given
    Restore(RestoreArgs),
    /// Virtual drones at the plan's slots, to practise with
    Virtual(virtual_drones::VirtualArgs),
}

/// What every step needs.
#[derive(Clone, Debug, Args)]
pub(super) struct StepArgs {
    /// Campaign folder
    pub(super) campaign: PathBuf,
    /// Which flight, if the campaign has several
    #[arg(long, value_name = "NAME")]
    pub(super) flight: Option<String>,
    #[command(flatten)]
    pub(super) connect: ConnectArgs,
    /// Print the messages that would be sent, and send nothing
    #[arg(long)]
    pub(super) dry_run: bool,
}

/// Arguments of `fleet upload` and `fleet preflight`.
#[derive(Clone, Debug, Args)]
pub(super) struct UploadArgs {
    #[command(flatten)]
    step: StepArgs,
    /// Set parameters that must be others (old values are kept for `fleet restore`)
    #[arg(long)]
    set_params: bool,
    /// Find anew which drone flies which slot, from where they stand
    #[arg(long)]
    assign: bool,
}

/// How a start is given.
#[derive(Clone, Debug, Args)]
pub(super) struct LeadArgs {
    /// From now to the start, s of the drones' time: 20 to 43200
    #[arg(long, value_name = "S", default_value_t = 30.0, value_parser = lead_seconds)]
    pub(super) lead: f64,
    /// Authorize the start without asking
    #[arg(short, long)]
    pub(super) yes: bool,
}

/// Parser of `--lead`: nothing has been sent when it refuses.
fn lead_seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if (LEAST_LEAD_S..=MOST_LEAD_S).contains(&value) => Ok(value),
        _ => Err(format!(
            "a lead between {LEAST_LEAD_S} and {MOST_LEAD_S} s: the drones set their home and arm in \
             the last 10 s"
        )),
    }
}

impl LeadArgs {
    fn options(&self) -> StartOptions {
        StartOptions { lead_s: self.lead, ..StartOptions::default() }
    }
}

/// Arguments of `fleet start`.
#[derive(Clone, Debug, Args)]
pub(super) struct StartArgs {
    #[command(flatten)]
    upload: UploadArgs,
    #[command(flatten)]
    lead: LeadArgs,
}

/// Arguments of `fleet restore`.
#[derive(Clone, Debug, Args)]
pub(super) struct RestoreArgs {
    #[command(flatten)]
    step: StepArgs,
    /// Also put back values that leave a drone without a fence: FENCE_ENABLE, FENCE_TYPE and
    /// FENCE_ACTION, where they were 0
    #[arg(long)]
    fence_off: bool,
}

/// Arguments of `fleet abort` and `fleet land`.
#[derive(Clone, Debug, Args)]
pub(super) struct EndArgs {
    #[command(flatten)]
    step: StepArgs,
    /// Only these drones: system ids, or network:system, with commas [default: all that are heard]
    #[arg(long, value_name = "IDS", value_delimiter = ',')]
    drones: Option<Vec<DroneId>>,
}

/// A campaign is a folder that is there.
fn needs_folder(campaign: &std::path::Path) -> Result<(), CommandError> {
    if campaign.is_file() {
        return Err(CommandError::Usage(format!(
            "{} is a file: give the campaign's folder",
            campaign.display()
        )));
    }
    Ok(())
}

/// Locks a campaign; a folder that is not there is not made.
pub(super) fn lock(
    context: &Context,
    campaign: &std::path::Path,
) -> Result<FolderLock, CommandError> {
    needs_folder(campaign)?;
    if !campaign.exists() {
        campaign::flights(campaign)?;
    }
    context.lock(campaign)
}

/// The one flight of a campaign that is meant.
pub(super) fn one_flight(
    campaign: &std::path::Path,
    name: Option<&str>,
) -> Result<(FlightFolder, Plan), CommandError> {
    needs_folder(campaign)?;
    let mut names = Vec::new();
    let mut found = Vec::new();
    for folder in campaign::flights(campaign)? {
        let plan = folder.read_plan()?;
        names.push(plan.name.clone());
        if name.is_none_or(|name| name == plan.name) {
            found.push((folder, plan));
        }
    }
    let listed = names.join(", ");
    match (found.len(), name) {
        (1, _) => Ok(found.remove(0)),
        (0, Some(name)) => {
            Err(CommandError::Usage(format!("the campaign has no flight \"{name}\", but {listed}")))
        }
        _ => Err(CommandError::Usage(format!("which flight? give --flight ({listed})"))),
    }
}

pub(super) fn run(context: &Context, args: &FleetArgs) -> Result<Exit, CommandError> {
    match &args.command {
        FleetCommand::Status(args) => status(context, args),
        FleetCommand::Upload(args) => upload(context, args),
        FleetCommand::Preflight(args) => preflight(context, args),
        FleetCommand::Start(args) => start(context, args),
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
    match args.connect.target()? {
        Target::Links(links) => {
            let mut station = open(&args.campaign, &args.connect, links)?;
            let mut crew = Crew::new(context, &mut station, &folder, &plan);
            crew.listen(args.connect.wait)?;
            body(&mut crew)
        }
        Target::Sim => Err(CommandError::Usage(
            "virtual drones live as long as their program: use `updraft fly --connect sim`, or \
             `updraft fleet virtual` in another terminal"
                .to_owned(),
        )),
        Target::Server(_) => Err(CommandError::Usage(
            "through Skybrush Server the whole flight is one command: `updraft fly`; of its \
             single steps there are `fleet abort` and `fleet land`, the others are in Skybrush Live"
                .to_owned(),
        )),
    }
}

/// The same for a step that flies: `fleet abort` of other terminals is carried out meanwhile.
fn with_desk(
    context: &Context,
    args: &StepArgs,
    body: impl FnOnce(&mut Crew<'_>) -> Result<Exit, CommandError>,
) -> Result<Exit, CommandError> {
    with_crew(context, args, |crew| {
        let folder = crew.folder;
        let plan = crew.plan;
        let mut desk = end::desk(context, crew.net, folder);
        let mut with = Crew::new(context, &mut desk, folder, plan);
        with.telemetry = std::mem::take(&mut crew.telemetry);
        body(&mut with)
    })
}

/// Clocks and slots; refuses to go on when a drone stands wrong.
fn prepare(crew: &mut Crew<'_>, args: &UploadArgs) -> Result<(), CommandError> {
    crew.greet()?;
    if crew.assign(args.assign)? {
        return Ok(());
    }
    Err(CommandError::Unsafe("nothing was sent: the drones do not stand as planned".to_owned()))
}

/// The table of drones that were loaded by an earlier command.
fn look(crew: &mut Crew<'_>, args: &UploadArgs) -> Result<Preflight, CommandError> {
    prepare(crew, args)?;
    crew.params(args.set_params)?;
    crew.look_at_files()?;
    crew.preflight(args.step.connect.wait)
}

fn preflight(context: &Context, args: &UploadArgs) -> Result<Exit, CommandError> {
    if args.step.dry_run {
        return dry::preflight(context, &args.step);
    }
    let _lock = lock(context, &args.step.campaign)?;
    with_crew(context, &args.step, |crew| tables::preflight(context, &look(crew, args)?))
}

fn status(context: &Context, args: &StepArgs) -> Result<Exit, CommandError> {
    if args.dry_run {
        return dry::status(context, args);
    }
    with_crew(context, args, |crew| tables::status(context, crew))
}

fn upload(context: &Context, args: &UploadArgs) -> Result<Exit, CommandError> {
    if args.step.dry_run {
        return dry::upload(context, &args.step);
    }
    let _lock = lock(context, &args.step.campaign)?;
    with_crew(context, &args.step, |crew| {
        prepare(crew, args)?;
        let refused = crew.upload()?;
        // The fence's own switch is one of the parameters.
        let right = crew.params(args.set_params)?;
        if context.json {
            context.print_json(&tables::UploadOutput::new(&crew.table, &refused))?;
        }
        // Without --set-params nothing was to be set.
        let set = right || !args.set_params;
        Ok(if refused.is_empty() && set { Exit::Done } else { Exit::Losses })
    })
}

/// Opens the links, and says who holds them if another command of this campaign does.
fn open(
    campaign: &std::path::Path,
    connect: &ConnectArgs,
    links: Vec<Address>,
) -> Result<Station, CommandError> {
    connect.open(links).map_err(|error| match error {
        CommandError::Failed(text) if !end::flying(campaign, None).is_empty() => {
            CommandError::Failed(format!(
                "{text}\n  the link is held by the command that flies this campaign: it tells what \
                 happens and writes it into fleet-journal.ndjson; `fleet abort` and `fleet land` \
                 reach it"
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
    with_desk(context, &args.upload.step, |crew| {
        let table = look(crew, &args.upload)?;
        if !table.go() {
            return tables::preflight(context, &table);
        }
        fly_now(context, crew, &args.lead).map(|(exit, _)| exit)
    })
}

/// What gave an alarm, by drone.
pub(super) type Alarms = BTreeMap<DroneId, Vec<String>>;

/// The two steps of a start, and the show.
pub(super) fn fly_now(
    context: &Context,
    crew: &mut Crew<'_>,
    lead: &LeadArgs,
) -> Result<(Exit, Alarms), CommandError> {
    needs_person(lead)?;
    let mut start = crew.announce(lead.options())?;
    say_start(context, crew, &start, "Every drone has the start time");
    let yes = lead.yes || {
        let answer = asked("Authorize the start? Type yes: ", || crew.idle());
        if !matches!(answer, Ok(true)) {
            crew.cancel(&mut start)?;
        }
        answer?
    };
    if !yes {
        return Err(CommandError::Unsafe("not authorized: the start was taken back".to_owned()));
    }
    crew.authorize(&mut start)?;
    context.say("Authorized. Ctrl-C stops watching; `updraft fleet abort` sends everyone home");
    let alarms = crew.watch(&mut start)?;
    Ok((landed(context, crew, alarms.is_empty()), alarms))
}

/// The same for drones that the station flies itself.
pub(super) fn guide_now(
    context: &Context,
    crew: &mut Crew<'_>,
    lead: &LeadArgs,
) -> Result<(Exit, Alarms), CommandError> {
    needs_person(lead)?;
    let start = crew.set_guided_start(lead.options())?;
    say_start(context, crew, &start, "The start time, by the drones' clocks");
    if !lead.yes && !asked("Authorize the start? Type yes: ", || crew.idle())? {
        return Err(CommandError::Unsafe("not authorized: nobody takes off".to_owned()));
    }
    crew.authorize_guided(&start)?;
    context.say(
        "Authorized. This program flies the drones: Ctrl-C sends everyone home, as does `updraft \
         fleet abort`",
    );
    let alarms = crew.fly_guided(&start)?;
    Ok((landed(context, crew, alarms.is_empty()), alarms))
}

fn needs_person(lead: &LeadArgs) -> Result<(), CommandError> {
    if !lead.yes && !std::io::stdin().is_terminal() {
        return Err(CommandError::Usage(
            "a start is authorized by a person, or with --yes; nothing was started".to_owned(),
        ));
    }
    Ok(())
}

fn say_start(context: &Context, crew: &mut Crew<'_>, start: &Start, what: &str) {
    let time = start.time().map_or_else(String::new, tables::time_of_day);
    context.say(&format!(
        "{what}: {time} ({} s of the GPS week), in {:.0} s",
        start.second_of_week(),
        start.left_s(&crew.telemetry, crew.net.now()).unwrap_or(0.0)
    ));
}

fn landed(context: &Context, crew: &Crew<'_>, quiet: bool) -> Exit {
    let landed = crew.landed();
    context.say(&format!("{landed} of {} drones have landed", crew.table.drones.len()));
    let quiet = quiet && crew.net.ordered_down().is_empty();
    if landed == crew.table.drones.len() && quiet { Exit::Done } else { Exit::Losses }
}

/// Asks a person. While they think, the links are listened to and orders carried out.
pub(super) fn asked(
    question: &str,
    mut meanwhile: impl FnMut() -> Result<(), CommandError>,
) -> Result<bool, CommandError> {
    let failed = |error: std::io::Error| CommandError::Failed(format!("failed to ask: {error}"));
    let mut err = std::io::stderr().lock();
    err.write_all(question.as_bytes()).and_then(|()| err.flush()).map_err(failed)?;
    drop(err);
    let (answers, answered) = std::sync::mpsc::sync_channel(1);
    // Ends with the program if nobody answers.
    let read = move || {
        let mut answer = String::new();
        let _ = answers.send(std::io::stdin().lock().read_line(&mut answer).map(|_| answer));
    };
    std::thread::Builder::new().name("answer".to_owned()).spawn(read).map_err(failed)?;
    loop {
        match answered.recv_timeout(Duration::from_millis(50)) {
            Ok(answer) => return Ok(answer.map_err(failed)?.trim().eq_ignore_ascii_case("yes")),
            Err(RecvTimeoutError::Timeout) => meanwhile()?,
            Err(RecvTimeoutError::Disconnected) => return Ok(false),
        }
    }
}

fn restore(context: &Context, args: &RestoreArgs) -> Result<Exit, CommandError> {
    if args.step.dry_run {
        return dry::restore(context, &args.step, args.fence_off);
    }
    let _lock = lock(context, &args.step.campaign)?;
    with_crew(context, &args.step, |crew| {
        let left = crew.restore(args.fence_off)?;
        let but = if left.is_empty() { "" } else { ", but for the drones named above" };
        context.say(&format!("Parameters are as they were{but}"));
        Ok(if left.is_empty() { Exit::Done } else { Exit::Losses })
    })
}
