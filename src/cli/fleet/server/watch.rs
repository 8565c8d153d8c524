//! Watching a show through the server, second by second.

use std::sync::Arc;
use std::time::Duration;

use serde::Serialize;

use super::{Flight, stopped};
use crate::cli::clock::SystemClock;
use crate::cli::context::Context;
use crate::cli::exit::{CommandError, with_reasons};
use crate::fleet::journal::{Entry, Journal};
use crate::link::clock::{Clock as _, Micros, S};
use crate::skybrush_server::watch::{Event, Monitor};
use crate::skybrush_server::{Client, ServerError};

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

/// How a watched flight ended.
pub(super) struct Watched {
    /// The server's names of drones that have not been seen to land.
    pub(super) in_the_air: Vec<String>,
    /// Something was told that a person must look at.
    pub(super) alarms: bool,
}

/// Watches until everyone has landed, or should have. A server that goes away is waited for: the
/// drones fly on without it.
pub(super) fn watch(
    context: &Context,
    client: &mut Client,
    flight: &Flight<'_>,
    start_unix_s: i64,
) -> Result<Watched, CommandError> {
    let clock = SystemClock::start();
    let ids: Vec<String> = flight.drones.values().cloned().collect();
    let low = 100.0 * flight.plan.limits.endurance_reserve;
    let mut monitor = Monitor::new(ids.iter().cloned(), low, clock.now());
    let mut journal = Journal::open(&flight.folder.0)?;
    let end_s = start_unix_s as f64 + flight.plan.duration_ms as f64 / 1000.0 + AFTER_S;
    let mut alarms = false;
    let mut away = false;
    let mut next = 0;
    loop {
        if stopped(context) {
            context.insist(&format!(
                "Nobody watches any more; the drones fly on by themselves. `{}` sends them home; \
                 Skybrush Live and their remote controls do, too",
                flight.abort()
            ));
            return Err(CommandError::Interrupted);
        }
        let unix_us = clock.unix_us();
        if monitor.is_over() || unix_us as f64 * 1e-6 > end_s {
            let in_the_air = monitor.in_the_air().into_iter().map(str::to_owned).collect();
            return Ok(Watched { in_the_air, alarms });
        }
        if clock.now() < next {
            std::thread::sleep(NAP);
            continue;
        }
        next = clock.now() + EVERY;
        match status(client, &ids, flight.address, away) {
            Err(error) => {
                if !away {
                    alarms = true;
                    context.warn(&format!(
                        "{}\n  The drones fly on by themselves, but nobody sees them until the \
                         server is back; keep their remote controls at hand",
                        with_reasons(&error)
                    ));
                }
                away = true;
            }
            Ok(status) => {
                if away {
                    context.insist("The server is back");
                }
                away = false;
                let started = unix_us as i64 / 1_000_000 > start_unix_s;
                for (id, event) in monitor.look(clock.now(), started, &status) {
                    let line = Line { server_drone: &id, event: &event };
                    journal.write(&Entry { unix_us, drone: None, event: &line })?;
                    if event.is_alarm() {
                        alarms = true;
                        context.warn(&format!("drone {id}: {event}"));
                    } else {
                        context.say(&format!("drone {id}: {event}"));
                    }
                }
            }
        }
    }
}

fn status(
    client: &mut Client,
    ids: &[String],
    address: &str,
    away: bool,
) -> Result<std::collections::BTreeMap<String, serde_json::Value>, ServerError> {
    if away {
        *client = Client::connect(address, Arc::new(SystemClock::start()))?;
    }
    client.status(ids)
}
