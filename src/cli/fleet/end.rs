//! `fleet abort` and `fleet land`: over the links, or by the station that holds them.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::time::Duration;

use super::connect::Target;
use super::crew::Crew;
use super::{EndArgs, StepArgs, dry, one_flight, server, tables};
use crate::base::causes::with_causes;
use crate::campaign::lock::FolderLock;
use crate::campaign::{self, CampaignError, FlightFolder};
use crate::cli::clock::{Stopwatch, SystemClock};
use crate::cli::context::Context;
use crate::cli::exit::{CommandError, Exit};
use crate::fleet::abort::{Aborted, Action};
use crate::fleet::desk::{Desk, Notice};
use crate::fleet::orders::{Given, Inbox, give, has_station};
use crate::link::clock::Clock as _;
use crate::link::id::DroneId;
use crate::link::net::Net;
use crate::mission::Plan;

/// A station that flies answers within this.
const ANSWERS_WITHIN: Duration = Duration::from_secs(3);
/// One that has answered and says nothing more for so long has died.
const DEAD_AFTER: Duration = Duration::from_secs(6);
const PAUSE: Duration = Duration::from_millis(100);

/// What is to be done where the drones cannot be reached from here.
const INSTEAD: &str = "press Ctrl-C in the terminal of the command that holds the link, and give the order \
     again; or use the remote controls";

/// In words.
pub(super) fn word(action: Action) -> &'static str {
    match action {
        Action::Return => "abort",
        Action::Land => "land",
    }
}

fn own_name() -> String {
    format!("{:020}-{}", SystemClock::start().unix_us(), std::process::id())
}

/// A net on which `fleet abort` and `fleet land` of other terminals are carried out, whatever this
/// command is at.
pub(in crate::cli) fn desk<'a>(
    context: &'a Context,
    net: &'a mut dyn Net,
    folder: &'a FlightFolder,
) -> Desk<'a> {
    let inbox = Inbox::open(&folder.0, own_name());
    if let Err(error) = &inbox {
        context.warn(&format!(
            "{}; `fleet abort` from another terminal will not reach the drones: use Ctrl-C here",
            with_causes(error, ": ")
        ));
    }
    Desk::new(net, inbox.ok(), move |notice| tell(context, folder, notice))
}

fn tell(context: &Context, folder: &FlightFolder, notice: &Notice) {
    let (text, step, outcomes) = match notice {
        Notice::Ordered { action, drones } => {
            let text = format!("Ordered from another terminal: {}", word(*action));
            let said = |drone: &DroneId| (*drone, "ordered from another terminal".to_owned());
            (text, word(*action), drones.iter().map(said).collect())
        }
        Notice::Done { action, drone, done } => {
            let outcome = BTreeMap::from([(*drone, done.to_string())]);
            (format!("drone {drone}: {done}"), word(*action), outcome)
        }
        Notice::NoAnswer { reason } => {
            (format!("warning: the order is carried out, but {reason}"), "", BTreeMap::new())
        }
    };
    context.insist(&text);
    if !step.is_empty()
        && let Err(error) =
            super::crew::write_outcomes(folder, SystemClock::start(), step, &outcomes)
    {
        context.warn(&error.to_string());
    }
}

/// Whether another process works in the campaign.
fn is_busy(campaign: &Path) -> bool {
    campaign.is_dir() && matches!(FolderLock::take(campaign), Err(CampaignError::Busy { .. }))
}

/// The flights of a campaign that a station is flying.
pub(super) fn flying(campaign: &Path, name: Option<&str>) -> Vec<FlightFolder> {
    if !is_busy(campaign) {
        return Vec::new();
    }
    let mut folders = campaign::flights(campaign).unwrap_or_default();
    folders.retain(|folder| has_station(&folder.0));
    if let Some(name) = name {
        folders.retain(|folder| folder.read_plan().is_ok_and(|plan| plan.name == name));
    }
    folders
}

fn any_flight(campaign: &Path) -> Option<(FlightFolder, Plan)> {
    let folder = campaign::flights(campaign).ok()?.into_iter().next()?;
    let plan = folder.read_plan().ok()?;
    Some((folder, plan))
}

/// Gives the order to the stations of these flights, and waits for one to carry it out. `None`:
/// nobody has taken it.
fn order(
    context: &Context,
    folders: &[FlightFolder],
    only: Option<&BTreeSet<DroneId>>,
    action: Action,
) -> Result<Option<BTreeMap<DroneId, Aborted>>, CommandError> {
    let name = own_name();
    let drones = only.map(|only| only.iter().copied().collect::<Vec<_>>());
    let mut given: Vec<Given> = Vec::new();
    for folder in folders {
        match give(&folder.0, &name, action, drones.clone()) {
            Ok(order) => given.extend(order),
            Err(error) => context
                .warn(&format!("no order to the running station: {}", with_causes(&error, ": "))),
        }
    }
    let watch = Stopwatch::start();
    loop {
        if let Some(place) = given.iter().position(|given| given.answer().is_some()) {
            let taken = given.swap_remove(place);
            for other in &given {
                other.withdraw();
            }
            context.say("The link is held by a running station: it carries the order out");
            return follow(context, taken).map(Some);
        }
        if given.is_empty() || watch.elapsed() >= ANSWERS_WITHIN {
            break;
        }
        std::thread::sleep(PAUSE);
    }
    // One that was taken at the last moment is waited for.
    let mut taken: Vec<Given> = given.into_iter().filter(|given| !given.withdraw()).collect();
    match taken.pop() {
        Some(taken) => follow(context, taken).map(Some),
        None => Ok(None),
    }
}

/// Tells what a station answers until everyone has confirmed.
fn follow(context: &Context, given: Given) -> Result<BTreeMap<DroneId, Aborted>, CommandError> {
    let mut beat = (None, Stopwatch::start());
    loop {
        let answer = given.answer();
        if let Some(answer) = answer.as_ref().filter(|answer| answer.is_over()) {
            let done = answer.drones.iter().filter_map(|(drone, done)| Some((*drone, (*done)?)));
            let done = done.collect();
            given.forget();
            return Ok(done);
        }
        if let Some(answer) = answer.filter(|answer| Some(answer.beat) != beat.0) {
            beat = (Some(answer.beat), Stopwatch::start());
            if answer.beat % 10 == 9 {
                let open = answer.drones.iter().filter(|(_, done)| done.is_none());
                context.say(&waiting(open.map(|(drone, _)| *drone)));
            }
        }
        if beat.1.elapsed() >= DEAD_AFTER {
            return Err(CommandError::Failed(format!(
                "the station took the order and does not answer any more: {INSTEAD}"
            )));
        }
        if context.check_stop().is_err() {
            return Err(CommandError::Stopped(
                "stopped: nobody waits any more, and the running station goes on with the order",
            ));
        }
        std::thread::sleep(PAUSE);
    }
}

/// Who has not confirmed yet.
pub(super) fn waiting(drones: impl Iterator<Item = DroneId>) -> String {
    let names: Vec<String> = drones.map(|drone| drone.to_string()).collect();
    format!("not confirmed yet, told again and again: {}", names.join(", "))
}

/// Ends flights.
pub(super) fn run(context: &Context, args: &EndArgs, action: Action) -> Result<Exit, CommandError> {
    let campaign = &args.step.campaign;
    let flight = args.step.flight.as_deref();
    if args.step.dry_run {
        return dry::end(context, &args.step, action);
    }
    let only: Option<BTreeSet<DroneId>> =
        args.drones.as_ref().map(|drones| drones.iter().copied().collect());
    let links = match args.step.connect.target()? {
        Target::Links(links) => links,
        Target::Server(address) => {
            server::refuse(&args.step.connect, &[])?;
            return server::end(context, &address, only.as_ref(), action);
        }
        Target::Sim => {
            return Err(CommandError::Usage(
                "give the drones' own links with --connect".to_owned(),
            ));
        }
    };
    let stations = flying(campaign, flight);
    let mut unanswered = "";
    if !stations.is_empty() {
        if let Some(done) = order(context, &stations, only.as_ref(), action)? {
            return print(context, &done);
        }
        unanswered = "no station answered within 3 s";
        context.warn(&format!("{unanswered}; the drones are told from here"));
    } else if is_busy(campaign) {
        unanswered = "another updraft works in this campaign and takes no orders";
    }
    let (folder, plan) = find(&args.step)?;
    let mut station = args.step.connect.open(links).map_err(|error| match error {
        CommandError::Failed(text) if !unanswered.is_empty() => {
            CommandError::Failed(format!("{unanswered}, and {text}\n  what to do: {INSTEAD}"))
        }
        CommandError::Failed(text) => {
            CommandError::Failed(format!("{text}\n  what to do: {INSTEAD}"))
        }
        other => other,
    })?;
    let mut crew = Crew::new(context, &mut station, &folder, &plan);
    crew.hear_anyone(args.step.connect.wait, only.as_ref())?;
    let left_s = args.step.connect.wait - crew.net.now() as f64 * 1e-6;
    let done = crew.abort(only.as_ref(), action, left_s.max(0.0))?;
    crew.withdraw_unflown(&done);
    let exit = print(context, &done)?;
    if context.check_stop().is_err() {
        return Err(CommandError::Stopped(
            "stopped: drones that are not named above have not confirmed it and may fly on",
        ));
    }
    Ok(exit)
}

/// The flight that is meant: nobody looks for its name while drones fall, any plan will do.
pub(super) fn find(args: &StepArgs) -> Result<(FlightFolder, Plan), CommandError> {
    let campaign = &args.campaign;
    one_flight(campaign, args.flight.as_deref()).or_else(|error| any_flight(campaign).ok_or(error))
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
