//! Retrieval of logs over the drones' links: the selection, the pull, and its report.

mod shares;
mod tell;
mod watch;

use std::collections::BTreeSet;

use schemars::JsonSchema;
use serde::Serialize;

use self::watch::Watching;
use super::links::run_number;
use crate::base::file::create_folder;
use crate::campaign::FlightFolder;
use crate::campaign::origin::LogOrigin;
use crate::campaign::start::{StartRecord, other_starts};
use crate::fleet::logs::manifest::LogFlight;
use crate::fleet::logs::one::{OneOptions, Which};
use crate::fleet::logs::pull::{Outcome, PullError, PullOptions, Wanted, pull};
use crate::fleet::slots::{Assignment, FLEET_FILE, FleetTable};
use crate::link::clock::{Micros, S};
use crate::link::id::DroneId;
use crate::link::net::Net;
use crate::live::view::Step;
use crate::mission::Plan;
use crate::workflow::clock::Stopwatch;
use crate::workflow::error::{WorkflowError, with_reasons};
use crate::workflow::host::{Host, News};
use crate::workflow::made_by;

/// What is wanted of the drones' logs.
#[derive(Clone, Debug)]
pub(crate) struct Wish {
    pub(crate) which: Which,
    pub(crate) again: bool,
    pub(crate) most_bytes: u64,
    /// Bytes per second and network; none: what it carries.
    pub(crate) rate: Option<f64>,
    pub(crate) at_once: usize,
    pub(crate) patience_s: f64,
    /// A drone that was never heard is given up after so long, s.
    pub(crate) wait_s: f64,
    /// Waits for the disk.
    pub(crate) is_durable: bool,
    /// Says nothing: the caller tells what is missing.
    pub(crate) quiet: bool,
    /// Into which of the flight's folders.
    pub(crate) origin: LogOrigin,
}

impl Default for Wish {
    fn default() -> Self {
        Self {
            which: Which::Flight,
            again: false,
            most_bytes: 2 << 30,
            rate: None,
            at_once: 12,
            patience_s: 60.0,
            wait_s: 60.0,
            is_durable: true,
            quiet: false,
            origin: LogOrigin::Real,
        }
    }
}

/// Where a drone's log is in the end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub(crate) enum LogState {
    /// It came.
    Pulled,
    /// It had come before.
    There,
    /// It did not come, or not whole.
    Missing,
}

/// What became of a drone's log.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub(crate) struct Brought {
    pub(crate) slot: u16,
    /// None: nobody is known to stand there.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) drone: Option<DroneId>,
    pub(crate) state: LogState,
    pub(crate) bytes: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) reason: Option<String>,
    /// Why what is there could not be compared with what the drone has.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) unchecked: Option<String>,
}

impl Brought {
    /// Whether there is no whole log.
    pub(crate) fn is_missing(&self) -> bool {
        self.state == LogState::Missing
    }

    /// In a sentence why there is no log; `None`: there is one.
    pub(crate) fn loss(&self) -> Option<String> {
        let reason = self.reason.as_deref().unwrap_or("unknown");
        let slot = self.slot;
        self.is_missing().then(|| match (self.drone, self.bytes) {
            (None, _) => format!("no log of slot {slot}: {reason}"),
            (Some(drone), 0) => format!("no log of drone {drone} (slot {slot}): {reason}"),
            // Its beginning came, or older logs.
            (Some(drone), _) => format!("not all of drone {drone} (slot {slot}): {reason}"),
        })
    }
}

/// Brings the logs of the table's drones into the flight's folder.
pub(crate) fn bring(
    host: &dyn Host,
    net: &mut dyn Net,
    folder: &FlightFolder,
    plan: &Plan,
    table: &FleetTable,
    wish: &Wish,
) -> Result<Vec<Brought>, WorkflowError> {
    host.news(&News::Step(Step::Logs, "Waiting for the logs of all drones".to_owned()));
    let quiet = wish.quiet;
    let at = match wish.origin {
        LogOrigin::Real => folder.logs_of(LogOrigin::Real),
        LogOrigin::Simulated => folder.simulated_at(),
    };
    create_folder(&at.folder)?;
    let start = StartRecord::read_in(&at.folder)?;
    let wanted = wanted(host, folder, plan, table, start.as_ref(), wish);
    let other_starts = if start.is_none() { other_starts(folder) } else { Vec::new() };
    let options = PullOptions {
        each: OneOptions {
            which: wish.which,
            patience: (wish.patience_s * S as f64) as Micros,
            wait: (wish.wait_s * S as f64) as Micros,
            most_size: wish.most_bytes,
            again: wish.again,
            is_durable: wish.is_durable,
            start_number: run_number(host),
            unix_s: host.clock().unix_us() / 1_000_000,
            other_starts,
            ..OneOptions::default()
        },
        at_once: wish.at_once,
        bytes_per_s: wish.rate,
        made_by: made_by(),
    };
    let heard: BTreeSet<DroneId> = net.heard().into_iter().collect();
    let absent = wanted.iter().filter(|one| !heard.contains(&one.drone));
    let absent = absent.map(|one| (one.drone, one.slot)).collect();
    let mut watching = Watching::new(host, absent, quiet);
    let watch = Stopwatch::start(host);
    let outcomes =
        pull(net, &at.folder, &wanted, &options, &mut watching).map_err(|error| match error {
            PullError::Shelf(error) => WorkflowError::from(error),
            error => WorkflowError::Failed(with_reasons(&error)),
        })?;
    watching.finish();
    let brought: Vec<Brought> = wanted
        .iter()
        .map(|wanted| Brought::of(wanted.slot, wanted.drone, outcomes.get(&wanted.drone)))
        .collect();
    if !quiet {
        tell::all(host, &at.folder, &outcomes, &brought);
        tell::sum(host, &brought, &watch);
    }
    host.check_stop()?;
    Ok(brought)
}

/// Which drone's log goes into which file. Who flew a slot was written down at its start; the table may
/// have changed since.
fn wanted(
    host: &dyn Host,
    folder: &FlightFolder,
    plan: &Plan,
    table: &FleetTable,
    start: Option<&StartRecord>,
    wish: &Wish,
) -> Vec<Wanted> {
    let count = plan.slots.len();
    let file = |slot: u16| {
        let path = folder.log(slot, count);
        path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned())
    };
    let flight = |slot: u16| start.map(|start| LogFlight::wanted(start, slot));
    let flew = |line: &Assignment| {
        let record = start.filter(|_| wish.which == Which::Flight)?;
        let drone: DroneId = record.drone(line.slot)?.drone.parse().ok()?;
        (drone != line.drone).then_some(drone)
    };
    for line in table.drones.iter().filter(|_| !wish.quiet) {
        if let Some(drone) = flew(line) {
            host.warn(&format!(
                "slot {} was flown by drone {drone}; {} says {} now: the log of drone {drone} \
                 belongs to the flight",
                line.slot, FLEET_FILE, line.drone
            ));
        }
    }
    table
        .drones
        .iter()
        .map(|line| Wanted {
            drone: flew(line).unwrap_or(line.drone),
            slot: line.slot,
            file: file(line.slot),
            flight: flight(line.slot),
        })
        .collect()
}

impl Brought {
    /// By what came of the pull.
    fn of(slot: u16, drone: DroneId, outcome: Option<&Outcome>) -> Self {
        let (state, bytes, reason, unchecked) = match outcome {
            Some(Outcome::Done(done)) => {
                let bytes = done.pulled.iter().map(|entry| entry.size_bytes).sum();
                let reason = done.failure.as_ref().map(|failure| {
                    let kept = match failure.kept_bytes {
                        0 => String::new(),
                        bytes => format!(" ({:.1} MB are kept)", bytes as f64 / 1e6),
                    };
                    format!("{}; {}{kept}", failure.reason, failure.advice)
                });
                let there = done.pulled.is_empty() && !done.there.is_empty();
                let state = match (&reason, there) {
                    (Some(_), _) => LogState::Missing,
                    (None, true) => LogState::There,
                    (None, false) => LogState::Pulled,
                };
                (state, bytes, reason, done.unchecked.clone())
            }
            Some(Outcome::Stopped) | None => {
                (LogState::Missing, 0, Some("interrupted".to_owned()), None)
            }
        };
        Self { slot, drone: Some(drone), state, bytes, reason, unchecked }
    }
}
