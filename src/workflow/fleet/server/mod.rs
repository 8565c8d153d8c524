//! Flights through a running Skybrush Server.

mod attach;
mod bring;
mod down;
mod dry;
mod gate;
mod identity;
mod load;
mod logs;
mod rows;
mod standing;
mod start;
mod steps;
mod upload;
mod watch;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use self::bring::bring;
use self::down::{Down, bring_down};
use self::gate::gate;
use self::load::{load, patience};
use self::rows::sum_up;
use self::standing::assign;
use self::upload::Shows;
use super::bring::Wish;
use super::output::{FlightEnd, FlightOutput, LogOutput};
use super::start::{Lead, needs_person};
use crate::base::plain::Shown as _;
use crate::campaign::FlightFolder;
use crate::fleet::abort::Action;
use crate::link::id::DroneId;
use crate::mission::Plan;
use crate::skybrush_server::gate::Step;
use crate::skybrush_server::{Client, StartConfig};
use crate::workflow::ending::Ending;
use crate::workflow::error::WorkflowError;
use crate::workflow::host::Host;

pub(crate) use self::attach::take_over;
pub(crate) use self::dry::{dry_end, dry_fly, dry_look, dry_upload};
pub(crate) use self::logs::{list, pull};
pub(crate) use self::steps::{Status, StatusRow, Uploaded, preflight, status, upload};

/// Distance of the fence's circle beyond the farthest corner, m.
const BEYOND_M: f64 = 10.0;

/// A flight through a server.
struct ServedFlight<'a> {
    /// The server.
    address: &'a str,
    folder: &'a FlightFolder,
    plan: &'a Plan,
    /// The server's names of the drones by slot.
    drones: &'a BTreeMap<u16, String>,
}

impl ServedFlight<'_> {
    /// What a person types to end it.
    fn abort(&self) -> String {
        let Self { address, folder, .. } = self;
        format!("updraft fleet abort {} --connect skybrush://{address}", folder.0.shown())
    }
}

fn connect(host: &dyn Host, address: &str) -> Result<Client, WorkflowError> {
    let mut client = Client::connect(address, Arc::clone(host.clock()))?;
    host.say(&format!("{} at {address}", client.version()?));
    Ok(client)
}

/// The whole flight.
pub(crate) fn fly(
    host: &dyn Host,
    address: &str,
    folder: &FlightFolder,
    plan: &Plan,
    lead: &Lead,
    with_logs: bool,
    wait_s: f64,
) -> Result<(FlightOutput, Ending), WorkflowError> {
    needs_person(host, lead)?;
    let shows = Shows::of(plan)?;
    let mut client = connect(host, address)?;
    let drones = assign(host, &mut client, plan, wait_s)?;
    let flight = ServedFlight { address, folder, plan, drones: &drones };
    let not_started = |mut reasons: BTreeMap<String, String>| {
        let drones = drones.iter().map(|(slot, drone)| {
            (*slot, drone.clone(), reasons.remove(drone).into_iter().collect())
        });
        FlightOutput::no_go(&plan.name, drones.collect(), None)
    };
    if let Err(refused) = load(host, &mut client, &flight, &shows, wait_s)? {
        host.insist(&format!(
            "NO-GO: {} of {} drones do not have the show; nothing was started",
            refused.len(),
            drones.len()
        ));
        return Ok((not_started(refused), Ending::NoGo));
    }
    let table = gate(host, &mut client, &flight, Step::Ready, patience(wait_s))?;
    host.show(&table.to_string()).map_err(WorkflowError::Output)?;
    if !table.go() {
        host.insist("NO-GO: nothing was started; Skybrush Live shows more about these drones");
        let reasons = table.rows.iter().map(|row| (row.drone.clone(), row.no_go.join(", ")));
        return Ok((not_started(reasons.collect()), Ending::NoGo));
    }
    let started = start::start(host, &mut client, &flight, lead)?;
    host.say(&format!(
        "Authorized. Ctrl-C asks whether the drones land, return or fly on (without a terminal: \
         --on-interrupt, by default they return); `{}` sends all drones home",
        flight.abort()
    ));
    let watched = watch::watch(host, &mut client, &flight, started, lead.on_interrupt)?;
    let exit = watched.tell(host, &flight);
    if watched.taken_back {
        return Ok((not_started(BTreeMap::new()), Ending::NoGo));
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
    (output.logs, exit) = bring_home(host, &mut client, &flight, flown)?;
    Ok((output, exit))
}

/// Brings the logs of a flight that ended so.
fn bring_home(
    host: &dyn Host,
    client: &mut Client,
    flight: &ServedFlight<'_>,
    flown: Ending,
) -> Result<(Vec<LogOutput>, Ending), WorkflowError> {
    let ServedFlight { address, folder, plan, drones } = flight;
    let wanted: Vec<(u16, String)> = drones.iter().map(|(slot, id)| (*slot, id.clone())).collect();
    let brought = bring(host, client, address, folder, plan, &wanted, &Wish::default())?;
    sum_up(host, &brought);
    if !brought.iter().any(LogOutput::is_missing) {
        return Ok((brought, flown));
    }
    let campaign = folder.0.shown();
    host.insist(&format!(
        "To try again: updraft logs pull {campaign} --connect skybrush://{address}"
    ));
    Ok((brought, Ending::Losses))
}

/// What became of an order to end flights.
pub(crate) struct EndedThrough {
    /// Who was told, what it answered, and whether it has confirmed the order.
    pub(crate) told: Vec<(String, String, bool)>,
    /// Who was on the ground already.
    pub(crate) on_ground: Vec<String>,
    client: Client,
}

impl EndedThrough {
    /// With losses if somebody has not confirmed it.
    pub(crate) fn ending(&self) -> Ending {
        Ending::of_losses(self.told.iter().any(|(_, _, confirmed)| !confirmed))
    }

    /// Takes the start back, for everyone.
    pub(crate) fn take_start_back(&mut self) -> Result<(), WorkflowError> {
        Ok(self.client.set_start(&StartConfig::none())?)
    }
}

/// Ends flights: those in the air return or land.
pub(crate) fn end(
    host: &dyn Host,
    address: &str,
    only: Option<&BTreeSet<DroneId>>,
    action: Action,
) -> Result<EndedThrough, WorkflowError> {
    let mut client = connect(host, address)?;
    let is_meant = |id: &String| {
        only.is_none_or(|only| id.parse().is_ok_and(|drone: DroneId| only.contains(&drone)))
    };
    let ids: Vec<String> = client.drones()?.into_iter().filter(is_meant).collect();
    let Down { told, on_ground } = bring_down(&mut client, ids, action, &|| !host.is_stopped())?;
    let told = told.into_iter().map(|(id, answer)| (id, answer.text, answer.confirmed)).collect();
    Ok(EndedThrough { told, on_ground, client })
}
