//! Flights through a running Skybrush Server.

mod attach;
mod bring;
mod down;
mod dry;
mod gate;
mod identity;
mod load;
mod logs;
mod options;
mod rows;
mod standing;
mod start;
mod steps;
mod upload;
mod watch;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::sync::atomic::Ordering;

use self::bring::bring;
use self::down::{NOT_CONFIRMED, bring_down};
use self::gate::gate;
use self::load::{load, patience};
use self::rows::sum_up;
use self::standing::assign;
use self::upload::Shows;
use super::bring::Wish;
use super::start::{LeadArgs, needs_person};
use crate::base::plain::Shown as _;
use crate::campaign::FlightFolder;
use crate::cli::context::Context;
use crate::cli::exit::{CommandError, Exit};
use crate::cli::fly_output::{FlightEnd, FlightOutput, LogOutput};
use crate::fleet::abort::Action;
use crate::link::id::DroneId;
use crate::mission::Plan;
use crate::skybrush_server::gate::Step;
use crate::skybrush_server::{Client, StartConfig};

pub(in crate::cli) use attach::take_over;
pub(in crate::cli) use dry::{dry_end, dry_fly, dry_look, dry_upload};
pub(in crate::cli) use logs::{list, pull};
pub(in crate::cli) use options::{of_air, refuse};
pub(in crate::cli) use steps::{preflight, status, upload};

/// Distance of the fence's circle beyond the farthest corner, m.
const BEYOND_M: f64 = 10.0;

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

fn connect(context: &Context, address: &str) -> Result<Client, CommandError> {
    let mut client = Client::connect(address, Arc::clone(context.clock()))?;
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
    let shows = Shows::of(plan)?;
    let mut client = connect(context, address)?;
    let drones = assign(context, &mut client, plan, wait_s)?;
    let flight = Flight { address, folder, plan, drones: &drones };
    let not_started = |mut reasons: BTreeMap<String, String>| {
        let drones = drones.iter().map(|(slot, drone)| {
            (*slot, drone.clone(), reasons.remove(drone).into_iter().collect())
        });
        FlightOutput::no_go(&plan.name, drones.collect(), None)
    };
    if let Err(refused) = load(context, &mut client, &flight, &shows, wait_s)? {
        context.insist(&format!(
            "NO-GO: {} of {} drones do not have the show; nothing was started",
            refused.len(),
            drones.len()
        ));
        return Ok((not_started(refused), Exit::Unsafe));
    }
    let table = gate(context, &mut client, &flight, Step::Ready, patience(wait_s))?;
    if context.json {
        context.say(&table.to_string());
    } else {
        context.print(&table.to_string())?;
    }
    if !table.go() {
        context.insist("NO-GO: nothing was started; Skybrush Live tells more of these drones");
        let reasons = table.rows.iter().map(|row| (row.drone.clone(), row.no_go.join(", ")));
        return Ok((not_started(reasons.collect()), Exit::Unsafe));
    }
    let started = start::start(context, &mut client, &flight, lead)?;
    context.say(&format!(
        "Authorized. Ctrl-C asks whether the drones land, return or fly on (without a terminal: \
         --on-interrupt, by default they return); `{}` sends everyone home",
        flight.abort()
    ));
    let watched =
        watch::watch(context, &mut client, &flight, started, lead.interrupt.on_interrupt)?;
    let exit = watched.tell(context, &flight);
    if watched.taken_back {
        return Ok((not_started(BTreeMap::new()), Exit::Unsafe));
    }
    let flown = exit;
    let mut output = not_started(BTreeMap::new());
    output.outcome = FlightEnd::Flown;
    for drone in &mut output.drones {
        drone.outcome = watched.end_of(&drone.drone);
    }
    if !with_logs {
        return Ok((output, flown));
    }
    let exit;
    (output.logs, exit) = bring_home(context, &mut client, &flight, flown)?;
    Ok((output, exit))
}

/// Brings the logs of a flight that ended so.
fn bring_home(
    context: &Context,
    client: &mut Client,
    flight: &Flight<'_>,
    flown: Exit,
) -> Result<(Vec<LogOutput>, Exit), CommandError> {
    let Flight { address, folder, plan, drones } = flight;
    let wanted: Vec<(u16, String)> = drones.iter().map(|(slot, id)| (*slot, id.clone())).collect();
    let brought = bring(context, client, address, folder, plan, &wanted, &Wish::default())?;
    sum_up(context, &brought);
    if brought.iter().all(|row| row.state != "missing") {
        return Ok((brought, flown));
    }
    let campaign = folder.0.shown();
    context.insist(&format!(
        "To try again: updraft logs pull {campaign} --connect skybrush://{address}"
    ));
    Ok((brought, Exit::Losses))
}

fn stopped(context: &Context) -> bool {
    context.stop_flag().load(Ordering::SeqCst)
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
    let down = bring_down(&mut client, ids, action, &|| !stopped(context))?;
    for (id, text) in &down.told {
        if text.starts_with(NOT_CONFIRMED) {
            context.warn(&format!("drone {id}: {text}"));
        }
        context.emit(&format!("drone {id}: {text}\n"))?;
    }
    for id in &down.on_ground {
        context.emit(&format!("drone {id}: on the ground\n"))?;
    }
    if only.is_none() {
        client.set_start(&StartConfig::none())?;
        context.emit("the start is taken back\n")?;
    } else if !down.on_ground.is_empty() {
        context.warn("the start stays for drones on the ground: without --drones it is taken back");
    }
    Ok(if down.unsure == 0 { Exit::Done } else { Exit::Losses })
}
