//! Watch of a show through the server, second by second.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use serde::Serialize;

use super::ServedFlight;
use super::down::{LEFT, interrupted};
use super::start::{Started, take_back};
use crate::fleet::journal::{Entry, Journal};
use crate::link::clock::{Micros, S};
use crate::skybrush_server::watch::{Event, Monitor};
use crate::skybrush_server::{Client, ServerError};
use crate::workflow::ending::Ending;
use crate::workflow::error::{WorkflowError, with_reasons};
use crate::workflow::fleet::interrupt::{Choice, Interrupt};
use crate::workflow::fleet::output::DroneEnd;
use crate::workflow::host::Host;

/// A flight is watched for so long after the show, s: landing, and some time to spare.
const AFTER_S: f64 = 90.0;
/// The server is asked so often.
const EVERY: Micros = S;
/// Longest time without a look at Ctrl-C.
const NAP: Duration = Duration::from_millis(100);

/// An event as the journal has it.
#[derive(Serialize)]
struct Line<'a> {
    server_drone: &'a str,
    #[serde(flatten)]
    event: &'a Event,
}

/// That a flight was taken over, as the journal has it.
#[derive(Serialize)]
struct Note {
    step: &'static str,
    text: String,
}

/// Writes into the journal that a flight was taken over.
pub(super) fn attached(
    host: &dyn Host,
    flight: &ServedFlight<'_>,
    start_unix_s: i64,
) -> Result<(), WorkflowError> {
    let note = Note { step: "attached", text: format!("start at {start_unix_s} (Unix)") };
    let unix_us = host.clock().unix_us();
    let mut journal = Journal::open(&flight.folder.0)?;
    Ok(journal.write(&Entry { unix_us, drone: None, event: &note })?)
}

/// How a watched flight ended.
pub(super) struct Watched {
    /// The server's names of drones that have not been seen to land.
    in_the_air: Vec<String>,
    /// Those of drones that never left the ground.
    not_flown: Vec<String>,
    /// Those of drones that were on the ground when the watch began, after the start.
    found_down: Vec<String>,
    /// Drones that have left the show, and for which flight mode.
    left: BTreeMap<String, String>,
    /// Somebody else took the start back before it came.
    pub(super) taken_back: bool,
    /// Something was told that a person must look at.
    alarms: bool,
}

impl Watched {
    fn of(monitor: &Monitor, alarms: bool) -> Self {
        let names = |those: Vec<&str>| those.into_iter().map(str::to_owned).collect();
        Self {
            in_the_air: names(monitor.in_the_air()),
            not_flown: names(monitor.not_flown()),
            found_down: names(monitor.found_down()),
            left: monitor.left_the_show(),
            taken_back: false,
            alarms,
        }
    }

    /// How a drone's flight ended.
    pub(super) fn end_of(&self, drone: &str) -> DroneEnd {
        let is_in = |those: &[String]| those.iter().any(|it| it == drone);
        if is_in(&self.in_the_air) {
            DroneEnd::NotSeenToLand
        } else if is_in(&self.not_flown) {
            DroneEnd::NotStarted
        } else {
            DroneEnd::Landed
        }
    }

    /// Says how it ended, with names; and the exit code of it.
    pub(super) fn tell(&self, host: &dyn Host, flight: &ServedFlight<'_>) -> Ending {
        if self.taken_back {
            host.insist("The start was cancelled elsewhere: no drone takes off");
            return Ending::NoGo;
        }
        for id in &self.not_flown {
            host.warn(&format!("drone {id} did not take off"));
        }
        for id in &self.in_the_air {
            host.warn(&format!("drone {id} has not been seen to land"));
        }
        for id in &self.found_down {
            host.warn(&format!(
                "drone {id} was on the ground when this watch began: its log will show whether \
                 it flew"
            ));
        }
        for (id, mode) in &self.left {
            host.warn(&format!("drone {id} left the show before its end (flight mode {mode})"));
        }
        let all = flight.drones.len();
        let others = self.in_the_air.len() + self.not_flown.len() + self.found_down.len();
        let landed = all.saturating_sub(others);
        host.say(&format!("{landed} of {all} drones have landed"));
        if !self.in_the_air.is_empty() {
            host.insist(&format!(
                "STILL IN THE AIR, as far as the server reports: {}; `{}` sends them home; so do \
                 Skybrush Live and their remote controls",
                self.in_the_air.join(", "),
                flight.abort()
            ));
        }
        let quiet = others == 0 && self.left.is_empty() && !self.alarms;
        if quiet { Ending::Done } else { Ending::Losses }
    }
}

/// Watches until everyone has landed, or should have; the start is cleared then, so that nobody
/// takes off by it again. A server that goes away is waited for: the drones fly on without it.
pub(super) fn watch(
    host: &dyn Host,
    client: &mut Client,
    flight: &ServedFlight<'_>,
    started: Started,
    on_interrupt: Choice,
) -> Result<Watched, WorkflowError> {
    let Started { unix_s, begun, attached } = started;
    host.set_in_flight(Some(LEFT));
    let watched = look_on(host, client, flight, unix_s, attached, on_interrupt);
    host.set_in_flight(None);
    let is_before = host.clock().unix_us() / 1_000_000 < unix_s.max(0) as u64;
    let is_over = match &watched {
        Ok(watched) => {
            if watched.taken_back {
                begun.withdraw(host, flight.folder);
            }
            true
        }
        // Nobody watches: before the start that means that nobody takes off.
        Err(error) if is_before || matches!(error, WorkflowError::Interrupted) => {
            begun.withdraw(host, flight.folder);
            true
        }
        Err(_) => false,
    };
    if is_over && let Err(error) = take_back(host, client, flight) {
        host.warn(&format!(
            "the start is still authorized on the server, as it could not be cleared ({error}): \
             clear it in Skybrush Live before the drones are switched on again"
        ));
    }
    match watched {
        Err(WorkflowError::Interrupted) => {
            Err(WorkflowError::Stopped("stopped: the start was cancelled; no drone takes off"))
        }
        other => other,
    }
}

fn look_on(
    host: &dyn Host,
    client: &mut Client,
    flight: &ServedFlight<'_>,
    start_unix_s: i64,
    attached: bool,
    on_interrupt: Choice,
) -> Result<Watched, WorkflowError> {
    let mut interrupt = Interrupt::new(host, on_interrupt);
    let clock = Arc::clone(host.clock());
    let ids: Vec<String> = flight.drones.values().cloned().collect();
    let low = 100.0 * flight.plan.limits.endurance_reserve;
    let mut monitor = Monitor::new(ids.iter().cloned(), low, clock.now());
    if attached {
        monitor.attach();
    }
    let mut journal = Journal::open(&flight.folder.0)?;
    let show_end_s = start_unix_s as f64 + flight.plan.duration_ms as f64 / 1000.0;
    // Who is in the air long after the show is watched for as long.
    let end_s = show_end_s.max(clock.unix_us() as f64 * 1e-6) + AFTER_S;
    let mut alarms = false;
    let mut away = false;
    let mut unwritten = false;
    let mut next = 0;
    loop {
        let unix_us = clock.unix_us();
        let unix_s = unix_us as f64 * 1e-6;
        if host.is_stopped() && unix_s < start_unix_s as f64 {
            return Err(WorkflowError::Interrupted);
        }
        if let Some(choice) = interrupt.poll(clock.now()) {
            return Err(interrupted(host, client, flight, choice));
        }
        let over = monitor.is_over()
            || unix_s > show_end_s && !away && monitor.all_are_down()
            || unix_s > end_s;
        if over {
            return Ok(Watched::of(&monitor, alarms));
        }
        if clock.now() < next {
            clock.pause(NAP);
            continue;
        }
        next = clock.now() + EVERY;
        match status(host, client, &ids, flight.address, away) {
            Err(error) => {
                if !away {
                    alarms = true;
                    host.warn(&format!(
                        "{}\n  The drones fly on by themselves, but cannot be seen until the \
                         server is back; keep their remote controls at hand",
                        with_reasons(&error)
                    ));
                }
                away = true;
            }
            Ok(status) => {
                if away {
                    host.insist("The server is back");
                }
                away = false;
                if unix_s < start_unix_s as f64 && is_taken_back(client) {
                    return Ok(Watched { taken_back: true, ..Watched::of(&monitor, alarms) });
                }
                let started = unix_us as i64 / 1_000_000 > start_unix_s;
                for (id, event) in monitor.look(clock.now(), started, &status) {
                    let line = Line { server_drone: &id, event: &event };
                    // A full disk must not end the watch over drones in the air.
                    if let Err(error) = journal.write(&Entry { unix_us, drone: None, event: &line })
                        && !std::mem::replace(&mut unwritten, true)
                    {
                        host.warn(&format!("{error}; the flight is still being watched"));
                    }
                    if event.is_alarm() {
                        alarms = true;
                        host.warn(&format!("drone {id}: {event}"));
                    } else {
                        host.say(&format!("drone {id}: {event}"));
                    }
                }
            }
        }
    }
}

/// Whether the server has no authorized start any more: `fleet abort` and Skybrush Live take it
/// back. What the server does not answer is looked at with the next status.
fn is_taken_back(client: &mut Client) -> bool {
    matches!(client.authorized(), Ok(None))
}

fn status(
    host: &dyn Host,
    client: &mut Client,
    ids: &[String],
    address: &str,
    away: bool,
) -> Result<BTreeMap<String, serde_json::Value>, ServerError> {
    if away {
        *client = Client::connect(address, Arc::clone(host.clock()))?;
    }
    client.status(ids)
}
