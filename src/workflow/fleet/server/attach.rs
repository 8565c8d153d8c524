//! `fleet watch` through a server: takes over a flight whose station is gone.

use std::collections::{BTreeMap, BTreeSet};

use super::identity::Begun;
use super::start::Started;
use super::watch::{attached, watch};
use super::{ServedFlight, bring_home, connect};
use crate::base::plain::Shown as _;
use crate::campaign::FlightFolder;
use crate::campaign::start::{Flying, StartRecord};
use crate::link::clock::S;
use crate::mission::Plan;
use crate::skybrush_server::watch::is_on_ground;
use crate::skybrush_server::{Authorized, Client};
use crate::workflow::ending::Ending;
use crate::workflow::error::WorkflowError;
use crate::workflow::fleet::interrupt::Choice;
use crate::workflow::host::Host;
use crate::workflow::words::time_of_day;

/// How often the server is asked whether it knows the drones.
const EVERY: std::time::Duration = std::time::Duration::from_millis(500);
/// A start that was written down is that of the flight in the air if it is no longer ago, s.
const NEAR_S: i64 = 12 * 3600;
/// The server has whole seconds.
const SAME_S: i64 = 1;

/// The latest start of a folder, if it went through a server.
fn recorded(folder: &FlightFolder) -> Result<StartRecord, WorkflowError> {
    let path = StartRecord::path(folder);
    let Some(record) = StartRecord::read(folder)? else {
        return Err(WorkflowError::Nothing(format!(
            "{} does not exist, so it is not known which drone flies which slot: no flight was \
             started from this folder. `updraft fleet status` shows which drones are heard, \
             `updraft fleet abort` needs no record",
            path.shown()
        )));
    };
    if record.flying != Flying::SkybrushServer {
        return Err(WorkflowError::Usage(format!(
            "{} describes a flight over the drones' own links: give those with --connect",
            path.shown()
        )));
    }
    Ok(record)
}

/// Attaches to the flight that `logs/start.json` speaks of, watches it to its end, and brings its logs.
pub(crate) fn take_over(
    host: &dyn Host,
    address: &str,
    folder: &FlightFolder,
    plan: &Plan,
    wait_s: f64,
    on_interrupt: Choice,
    with_logs: bool,
) -> Result<Ending, WorkflowError> {
    let record = recorded(folder)?;
    let drones: BTreeMap<u16, String> =
        record.drones.iter().map(|drone| (drone.slot, drone.drone.clone())).collect();
    let mut client = connect(host, address)?;
    let flight = ServedFlight { address, folder, plan, drones: &drones };
    let recorded_s = record.start.to_unix_ms().div_euclid(1000);
    let authorized = client.authorized()?;
    if let Some(other) = authorized.filter(|it| !is_of(*it, recorded_s)) {
        let when = match other {
            Authorized::At(_) => "at another time",
            Authorized::Anyhow => "without a time",
        };
        return Err(WorkflowError::Unsafe(format!(
            "the start that is authorized on this server is not that of {}, but one {when}: nothing \
             was done. Watch it from the folder that it was started from, or in Skybrush Live; `{}` \
             ends it",
            StartRecord::path(folder).shown(),
            flight.abort()
        )));
    }
    let up = heard(host, &mut client, &drones, wait_s)?;
    let now_s = (host.clock().unix_us() / S) as i64;
    if authorized.is_none() && up.is_empty() {
        return Err(WorkflowError::Nothing(
            "no drone is in the air, and no start is authorized on the server: fly with `updraft \
             fly`, or download the logs of a finished flight with `updraft logs pull`"
                .to_owned(),
        ));
    }
    if authorized.is_none() && (now_s - recorded_s).abs() > NEAR_S {
        return Err(WorkflowError::Unsafe(format!(
            "drones {} are in the air, but not by the start of {}, which was {} h ago: nothing was \
             done; `{}` sends them home",
            up.join(", "),
            StartRecord::path(folder).shown(),
            (now_s - recorded_s) / 3600,
            flight.abort()
        )));
    }
    host.say(&format!("Watching: the start is {}", time_of_day(record.start)));
    attached(host, &flight, recorded_s)?;
    let started = Started { unix_s: recorded_s, begun: Begun::of(record), attached: true };
    let watched = watch(host, &mut client, &flight, started, on_interrupt)?;
    let exit = watched.tell(host, &flight);
    if !with_logs || watched.taken_back {
        return Ok(exit);
    }
    Ok(bring_home(host, &mut client, &flight, exit)?.1)
}

fn is_of(authorized: Authorized, recorded_s: i64) -> bool {
    matches!(authorized, Authorized::At(unix_s) if (unix_s - recorded_s).abs() <= SAME_S)
}

/// Waits until the server knows these drones, or so long; who of them is not known to be on the
/// ground. Those that it does not know are watched all the same: they are said not to be heard.
fn heard(
    host: &dyn Host,
    client: &mut Client,
    drones: &BTreeMap<u16, String>,
    wait_s: f64,
) -> Result<Vec<String>, WorkflowError> {
    let clock = host.clock();
    let until = clock.now() + (wait_s * S as f64) as u64;
    let wanted: BTreeSet<&String> = drones.values().collect();
    loop {
        let known: Vec<String> =
            client.drones()?.into_iter().filter(|id| wanted.contains(id)).collect();
        if known.len() >= wanted.len() || clock.now() >= until {
            if known.is_empty() {
                return Err(WorkflowError::Nothing(
                    "the server knows none of the drones of logs/start.json".to_owned(),
                ));
            }
            let status = client.status(&known)?;
            let is_up = |id: &String| !status.get(id).is_some_and(is_on_ground);
            return Ok(known.into_iter().filter(is_up).collect());
        }
        if host.is_stopped() {
            return Err(WorkflowError::Interrupted);
        }
        clock.pause(EVERY);
    }
}
