//! Flights through a running Skybrush Server.

mod bring;
mod dry;
mod logs;
mod rows;
mod standing;
mod upload;
mod watch;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::sync::atomic::Ordering;

use serde_json::Value;

use self::bring::bring;
use self::rows::sum_up;
use self::standing::assign;
use self::upload::Shows;
use super::bring::Wish;
use super::start::{LeadArgs, asked, needs_person};
use crate::base::plain::Shown as _;
use crate::campaign::FlightFolder;
use crate::cli::clock::SystemClock;
use crate::cli::context::Context;
use crate::cli::exit::{CommandError, Exit, with_reasons};
use crate::cli::fly_output::{DroneEnd, FlightEnd, FlightOutput};
use crate::fleet::abort::Action;
use crate::link::clock::Clock as _;
use crate::link::id::DroneId;
use crate::mission::Plan;
use crate::skybrush_server::watch::{code_name, is_on_ground, warnings};
use crate::skybrush_server::{Client, ServerError, StartConfig, end_flight};

pub(in crate::cli) use dry::{dry_end, dry_fly};
pub(in crate::cli) use logs::{list, pull};

/// Distance of the fence's circle beyond the farthest corner, m.
const BEYOND_M: f64 = 10.0;
/// Shortest lead, s, as over MAVLink.
const LEAST_LEAD_S: f64 = 20.0;
/// Authorization after this is too late, s before the start.
const AUTHORIZE_BEFORE_S: f64 = 12.0;

/// A flight through a server.
struct Flight<'a> {
    /// The server.
    address: &'a str,
    folder: &'a FlightFolder,
    plan: &'a Plan,
    /// The server's names of the drones by slot.
    drones: &'a BTreeMap<u16, String>,
}

impl Flight<'_> {
    /// What a person types to end it.
    fn abort(&self) -> String {
        let Self { address, folder, .. } = self;
        format!("updraft fleet abort {} --connect skybrush://{address}", folder.0.shown())
    }
}

impl From<ServerError> for CommandError {
    fn from(error: ServerError) -> Self {
        Self::Failed(with_reasons(&error))
    }
}

fn connect(context: &Context, address: &str) -> Result<Client, CommandError> {
    let mut client = Client::connect(address, Arc::new(SystemClock::start()))?;
    context.say(&format!("{} at {address}", client.version()?));
    Ok(client)
}

/// The whole flight.
pub(in crate::cli) fn fly(
    context: &Context,
    address: &str,
    folder: &FlightFolder,
    plan: &Plan,
    lead: &LeadArgs,
    with_logs: bool,
    wait_s: f64,
) -> Result<(FlightOutput, Exit), CommandError> {
    needs_person(lead)?;
    if lead.lead < LEAST_LEAD_S {
        return Err(CommandError::Usage(format!(
            "a lead of {} s is not possible: give at least {LEAST_LEAD_S} s; the drones set their \
             home and arm in the last 10 s",
            lead.lead
        )));
    }
    let shows = Shows::of(plan)?;
    let mut client = connect(context, address)?;
    let drones = assign(context, &mut client, plan, wait_s)?;
    let flight = Flight { address, folder, plan, drones: &drones };
    let not_started = || {
        let drones = drones.iter().map(|(slot, drone)| (*slot, drone.clone(), Vec::new()));
        FlightOutput::no_go(&plan.name, drones.collect(), None)
    };
    let refused = shows.send(context, &mut client, &flight)?;
    if refused > 0 {
        context
            .insist(&format!("NO-GO: {refused} drones do not have the show; nothing was started"));
        return Ok((not_started(), Exit::Unsafe));
    }
    let ids: Vec<String> = drones.values().cloned().collect();
    let troubled = troubled(&client.status(&ids)?);
    for problem in &troubled {
        context.warn(problem);
    }
    if !troubled.is_empty() {
        context.insist("NO-GO: nothing was started; Skybrush Live tells more of these drones");
        return Ok((not_started(), Exit::Unsafe));
    }
    let Some(unix_s) = start(context, &mut client, &flight, lead)? else {
        return Err(CommandError::Unsafe("not authorized: the start was taken back".to_owned()));
    };
    context.say(&format!(
        "Authorized. Ctrl-C stops watching; `{}` sends everyone home",
        flight.abort()
    ));
    let watched = watch::watch(context, &mut client, &flight, unix_s)?;
    for id in &watched.in_the_air {
        context.warn(&format!("drone {id} has not been seen to land"));
    }
    let landed = drones.len() - watched.in_the_air.len();
    context.say(&format!("{landed} of {} drones have landed", drones.len()));
    let flown =
        if watched.in_the_air.is_empty() && !watched.alarms { Exit::Done } else { Exit::Losses };
    let mut output = not_started();
    output.outcome = FlightEnd::Flown;
    for drone in &mut output.drones {
        let up = watched.in_the_air.contains(&drone.drone);
        drone.outcome = if up { DroneEnd::NotSeenToLand } else { DroneEnd::Landed };
    }
    if !with_logs {
        return Ok((output, flown));
    }
    let wanted: Vec<(u16, String)> = drones.into_iter().collect();
    let brought = bring(context, &mut client, address, folder, plan, &wanted, &Wish::default())?;
    sum_up(context, &brought);
    output.logs.clone_from(&brought);
    if brought.iter().all(|row| row.state != "missing") {
        return Ok((output, flown));
    }
    let campaign = folder.0.shown();
    context.insist(&format!(
        "To try again: updraft logs pull {campaign} --connect skybrush://{address}"
    ));
    Ok((output, Exit::Losses))
}

/// The two steps of a start: its time, and its authorization; the Unix time, s, if a person or
/// `--yes` authorized it.
fn start(
    context: &Context,
    client: &mut Client,
    flight: &Flight<'_>,
    lead: &LeadArgs,
) -> Result<Option<i64>, CommandError> {
    let now_us = SystemClock::start().unix_us();
    let unix_s = (now_us / 1_000_000) as i64 + lead.lead.ceil() as i64;
    let mut start = StartConfig {
        unix_s: Some(unix_s),
        authorized: false,
        drones: flight.drones.values().cloned().collect(),
        duration_s: flight.plan.duration_ms as f64 / 1000.0,
    };
    client.set_start(&start)?;
    if !lead.yes {
        let answer = asked("Authorize the start? Type yes: ", || context.check_stop());
        if !matches!(answer, Ok(true)) {
            client.set_start(&StartConfig::none())?;
            return answer.map(|_| None);
        }
    }
    // A person may take their time.
    let left_s = unix_s as f64 - SystemClock::start().unix_us() as f64 * 1e-6;
    if left_s < AUTHORIZE_BEFORE_S {
        client.set_start(&StartConfig::none())?;
        return Err(CommandError::Usage(format!(
            "{left_s:.0} s before the start it is too late to authorize it: the drones set their \
             home and arm in the last 10 s; it was taken back, give a longer --lead"
        )));
    }
    start.authorized = true;
    if let Err(error) = client.set_start(&start) {
        let back = match client.set_start(&StartConfig::none()) {
            Ok(()) => "it was taken back".to_owned(),
            Err(_) => format!(
                "IT MAY BE AUTHORIZED all the same, and it could not be taken back: use Skybrush \
                 Live, or `{}`",
                flight.abort()
            ),
        };
        return Err(CommandError::Failed(format!(
            "the start was not authorized: {}\n  {back}",
            with_reasons(&error)
        )));
    }
    Ok(Some(unix_s))
}

fn stopped(context: &Context) -> bool {
    context.stop_flag().load(Ordering::SeqCst)
}

/// Drones that must not start, with why.
fn troubled(status: &BTreeMap<String, Value>) -> Vec<String> {
    let one = |(id, status): (&String, &Value)| {
        let codes = warnings(status);
        let text = |code: &u64| format!("{} (code {code})", code_name(*code));
        let texts: Vec<String> = codes.iter().map(text).collect();
        (!texts.is_empty()).then(|| format!("drone {id}: {}", texts.join(", ")))
    };
    status.iter().filter_map(one).collect()
}

/// Ends flights: those in the air return or land, the start is taken back when all are meant.
pub(in crate::cli) fn end(
    context: &Context,
    address: &str,
    only: Option<&BTreeSet<DroneId>>,
    action: Action,
) -> Result<Exit, CommandError> {
    let mut client = connect(context, address)?;
    let is_meant = |id: &String| {
        only.is_none_or(|only| id.parse().is_ok_and(|drone: DroneId| only.contains(&drone)))
    };
    let ids: Vec<String> = client.drones()?.into_iter().filter(is_meant).collect();
    // Who is not known to be on the ground is told to come down.
    let status = client.status(&ids)?;
    let (down, up): (Vec<String>, Vec<String>) =
        ids.into_iter().partition(|id| status.get(id).is_some_and(is_on_ground));
    let mut unsure = 0;
    if !up.is_empty() {
        let running = client.begin(&end_flight(&up, action == Action::Return))?;
        let done = client.finish(running, || !stopped(context))?;
        for id in &up {
            let text = match done.get(id) {
                Some(Ok(_)) if action == Action::Return => "returns".to_owned(),
                Some(Ok(_)) => "lands where it is".to_owned(),
                Some(Err(reason)) => format!("NOT CONFIRMED: {reason}"),
                None => "NOT CONFIRMED: the server says nothing of it".to_owned(),
            };
            if !matches!(done.get(id), Some(Ok(_))) {
                unsure += 1;
                context.warn(&format!("drone {id}: {text}"));
            }
            context.emit(&format!("drone {id}: {text}\n"))?;
        }
    }
    for id in &down {
        context.emit(&format!("drone {id}: on the ground\n"))?;
    }
    if only.is_none() {
        client.set_start(&StartConfig::none())?;
        context.emit("the start is taken back\n")?;
    } else if !down.is_empty() {
        context.warn("the start stays for drones on the ground: without --drones it is taken back");
    }
    Ok(if unsure == 0 { Exit::Done } else { Exit::Losses })
}
