//! Bringing logs home: `logs pull` and the end of `fly`.

mod bar;
mod shares;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use serde::Serialize;

use self::bar::Bar;
use super::connect::run_number;
use super::tables::time_of_day;
use crate::base::file::create_folder;
use crate::base::plain::Shown as _;
use crate::base::time::GpsTime;
use crate::campaign::FlightFolder;
use crate::campaign::origin::{LogOrigin, logs_in};
use crate::campaign::start::{StartRecord, earlier_folders, other_starts};
use crate::cli::clock::SystemClock;
use crate::cli::context::Context;
use crate::cli::exit::{CommandError, with_reasons};
use crate::cli::simulate::made_by;
use crate::cli::words;
use crate::fleet::logs::manifest::{LogFlight, Shelf};
use crate::fleet::logs::one::{OneOptions, Which};
use crate::fleet::logs::pull::{Outcome, PullError, PullOptions, Wanted, pull};
use crate::fleet::slots::{Assignment, FLEET_FILE, FleetTable};
use crate::flight::identity::{SAME_START_S, later_s};
use crate::link::clock::{Clock as _, Micros, S};
use crate::link::id::DroneId;
use crate::link::net::Net;
use crate::mission::Plan;

/// What is wanted of the drones' logs.
#[derive(Clone, Debug)]
pub(in crate::cli) struct Wish {
    pub(in crate::cli) which: Which,
    pub(in crate::cli) again: bool,
    pub(in crate::cli) most_bytes: u64,
    /// Bytes per second and network; none: what it carries.
    pub(in crate::cli) rate: Option<f64>,
    pub(in crate::cli) at_once: usize,
    pub(in crate::cli) patience_s: f64,
    /// A drone that was never heard is given up after so long, s.
    pub(in crate::cli) wait_s: f64,
    /// Waits for the disk.
    pub(in crate::cli) is_durable: bool,
    /// Says nothing: the caller tells what is missing.
    pub(in crate::cli) quiet: bool,
    /// Into which of the flight's folders.
    pub(in crate::cli) origin: LogOrigin,
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

/// What became of a drone's log, for `--json`.
#[derive(Clone, Debug, Serialize)]
pub(in crate::cli) struct Brought {
    pub(in crate::cli) slot: u16,
    /// None: nobody is known to stand there.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(in crate::cli) drone: Option<DroneId>,
    /// `pulled`, `there` or `missing`.
    pub(in crate::cli) state: &'static str,
    pub(in crate::cli) bytes: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(in crate::cli) reason: Option<String>,
    /// Why what is there could not be compared with what the drone has.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(in crate::cli) unchecked: Option<String>,
}

impl Brought {
    /// In a sentence why there is no log; `None`: there is one.
    pub(in crate::cli) fn loss(&self) -> Option<String> {
        let reason = self.reason.as_deref().unwrap_or("unknown");
        let slot = self.slot;
        (self.state == "missing").then(|| match (self.drone, self.bytes) {
            (None, _) => format!("no log of slot {slot}: {reason}"),
            (Some(drone), 0) => format!("no log of drone {drone} (slot {slot}): {reason}"),
            // Its beginning came, or older logs.
            (Some(drone), _) => format!("not all of drone {drone} (slot {slot}): {reason}"),
        })
    }
}

/// Says which logs of earlier flights made room.
fn say_moved(context: &Context, outcomes: &BTreeMap<DroneId, Outcome>) {
    let mut folders: BTreeMap<PathBuf, usize> = BTreeMap::new();
    for done in outcomes.values().filter_map(Outcome::done) {
        for path in &done.moved {
            *folders.entry(path.parent().unwrap_or(path).to_owned()).or_default() += 1;
        }
    }
    for (folder, count) in folders {
        context.say(&format!(
            "Moved {} of an earlier flight to {}",
            words::count(count, "log"),
            folder.shown()
        ));
    }
}

/// Names the earlier starts whose logs never came home: they may still be on the drones.
fn say_left_behind(context: &Context, logs: &Path) {
    let shelf = Shelf::open(logs, "").ok();
    let entries = shelf.iter().flat_map(|shelf| &shelf.manifest.logs);
    // Those that were asked for by `--log` lie among the older ones.
    let began: Vec<GpsTime> =
        entries.filter_map(|entry| entry.flight.as_ref()?.gps_start).collect();
    for (number, folder) in earlier_folders(logs).unwrap_or_default() {
        let Ok(Some(record)) = StartRecord::read_in(&folder) else { continue };
        let is_of = |began: &GpsTime| later_s(*began, record.start).abs() <= SAME_START_S;
        if logs_in(&folder).is_empty() && !began.iter().any(is_of) {
            context.say(&format!(
                "No log of flight {number} ({}) has been downloaded: they may still be on the \
                 drones (`updraft logs pull --log all`)",
                time_of_day(record.start)
            ));
        }
    }
}

/// Names the drones that have newer logs than those of this flight: somebody may want them.
fn say_newer(context: &Context, outcomes: &BTreeMap<DroneId, Outcome>) {
    let newer = outcomes.iter().filter_map(|(drone, outcome)| {
        let number = outcome.done()?.newer?;
        Some(format!("{drone} (log {number})"))
    });
    let newer: Vec<String> = newer.collect();
    if !newer.is_empty() {
        context.warn(&format!(
            "{} newer logs than those of this flight, which were left where they are: drones {}; \
             `updraft logs pull --log newest` downloads them",
            if newer.len() == 1 { "one drone has" } else { "some drones have" },
            newer.join(", ")
        ));
    }
}

/// Brings the logs of the table's drones into the flight's folder.
pub(in crate::cli) fn bring(
    context: &Context,
    net: &mut dyn Net,
    folder: &FlightFolder,
    plan: &Plan,
    table: &FleetTable,
    wish: &Wish,
) -> Result<Vec<Brought>, CommandError> {
    let quiet = wish.quiet;
    let at = match wish.origin {
        LogOrigin::Real => folder.logs_of(LogOrigin::Real),
        LogOrigin::Simulated => folder.simulated_at(),
    };
    create_folder(&at.folder)?;
    let count = plan.slots.len();
    let file = |slot: u16| {
        let path = folder.log(slot, count);
        path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned())
    };
    let start = StartRecord::read_in(&at.folder)?;
    let flight = |slot: u16| start.as_ref().map(|start| LogFlight::wanted(start, slot));
    let other_starts = if start.is_none() { other_starts(folder) } else { Vec::new() };
    // Who flew a slot was written down at its start; the table may have changed since.
    let flew = |line: &Assignment| {
        let record = start.as_ref().filter(|_| wish.which == Which::Flight)?;
        let drone: DroneId = record.drone(line.slot)?.drone.parse().ok()?;
        (drone != line.drone).then_some(drone)
    };
    for line in table.drones.iter().filter(|_| !quiet) {
        if let Some(drone) = flew(line) {
            context.warn(&format!(
                "slot {} was flown by drone {drone}; {} says {} now: the log of drone {drone} \
                 belongs to the flight",
                line.slot, FLEET_FILE, line.drone
            ));
        }
    }
    let wanted: Vec<Wanted> = table
        .drones
        .iter()
        .map(|line| Wanted {
            drone: flew(line).unwrap_or(line.drone),
            slot: line.slot,
            file: file(line.slot),
            flight: flight(line.slot),
        })
        .collect();
    let options = PullOptions {
        each: OneOptions {
            which: wish.which,
            patience: (wish.patience_s * S as f64) as Micros,
            wait: (wish.wait_s * S as f64) as Micros,
            most_size: wish.most_bytes,
            again: wish.again,
            is_durable: wish.is_durable,
            start_number: run_number(),
            unix_s: SystemClock::start().unix_us() / 1_000_000,
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
    let mut bar = Bar::new(context, absent, quiet);
    let outcomes =
        pull(net, &at.folder, &wanted, &options, &mut bar).map_err(|error| match error {
            PullError::Shelf(error) => CommandError::from(error),
            error => CommandError::Failed(with_reasons(&error)),
        })?;
    bar.finish();
    let brought: Vec<Brought> = wanted
        .iter()
        .map(|wanted| {
            let (state, bytes, reason, unchecked) = match outcomes.get(&wanted.drone) {
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
                        (Some(_), _) => "missing",
                        (None, true) => "there",
                        (None, false) => "pulled",
                    };
                    (state, bytes, reason, done.unchecked.clone())
                }
                Some(Outcome::Stopped) | None => {
                    ("missing", 0, Some("interrupted".to_owned()), None)
                }
            };
            let (slot, drone) = (wanted.slot, Some(wanted.drone));
            Brought { slot, drone, state, bytes, reason, unchecked }
        })
        .collect();
    if !quiet {
        say_moved(context, &outcomes);
        say_left_behind(context, &at.folder);
        say_newer(context, &outcomes);
    }
    let unchecked = brought
        .iter()
        .filter(|one| one.state == "there")
        .filter_map(|one| Some((one.drone?, one.slot, one.unchecked.as_ref()?)));
    for (drone, slot, why) in unchecked.filter(|_| !quiet) {
        context.warn(&format!(
            "the log of drone {drone} (slot {slot}) is here, but was not compared with the \
             drone's: {why}"
        ));
    }
    for loss in brought.iter().filter_map(Brought::loss).filter(|_| !quiet) {
        context.warn(&loss);
    }
    let bytes: u64 = brought.iter().map(|one| one.bytes).sum();
    let state = |state: &str| brought.iter().filter(|one| one.state == state).count();
    let say = |text: &str| {
        if !quiet {
            context.say(text);
        }
    };
    say(&format!(
        "Downloaded {} of {} logs, {:.1} MB in {}{}",
        state("pulled") + state("there"),
        brought.len(),
        bytes as f64 / 1e6,
        bar.watch,
        match state("there") {
            0 => String::new(),
            there => format!(" ({there} already here)"),
        }
    ));
    context.check_stop()?;
    Ok(brought)
}
