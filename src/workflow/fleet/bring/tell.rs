//! Report of a pull when it is over.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::{Brought, LogState};
use crate::base::plain::Shown as _;
use crate::base::time::GpsTime;
use crate::campaign::origin::logs_in;
use crate::campaign::start::{StartRecord, earlier_folders};
use crate::fleet::logs::manifest::Shelf;
use crate::fleet::logs::pull::Outcome;
use crate::flight::identity::{SAME_START_S, later_s};
use crate::link::id::DroneId;
use crate::workflow::clock::Stopwatch;
use crate::workflow::host::Host;
use crate::workflow::words::{self, time_of_day};

/// Tells everything but how long it took: what made room, what may be left on the drones, what could
/// not be compared, what is missing.
pub(super) fn all(
    host: &dyn Host,
    logs: &Path,
    outcomes: &BTreeMap<DroneId, Outcome>,
    brought: &[Brought],
) {
    say_moved(host, outcomes);
    say_left_behind(host, logs);
    say_newer(host, outcomes);
    let unchecked = brought
        .iter()
        .filter(|one| one.state == LogState::There)
        .filter_map(|one| Some((one.drone?, one.slot, one.unchecked.as_ref()?)));
    for (drone, slot, why) in unchecked {
        host.warn(&format!(
            "the log of drone {drone} (slot {slot}) is here, but was not compared with the \
             drone's: {why}"
        ));
    }
    for loss in brought.iter().filter_map(Brought::loss) {
        host.warn(&loss);
    }
}

/// How many logs are home, in a line.
pub(super) fn sum(host: &dyn Host, brought: &[Brought], watch: &Stopwatch) {
    let bytes: u64 = brought.iter().map(|one| one.bytes).sum();
    let state = |state: LogState| brought.iter().filter(|one| one.state == state).count();
    host.say(&format!(
        "Downloaded {} of {} logs, {:.1} MB in {watch}{}",
        state(LogState::Pulled) + state(LogState::There),
        brought.len(),
        bytes as f64 / 1e6,
        match state(LogState::There) {
            0 => String::new(),
            there => format!(" ({there} already here)"),
        }
    ));
}

/// Says which logs of earlier flights made room.
fn say_moved(host: &dyn Host, outcomes: &BTreeMap<DroneId, Outcome>) {
    let mut folders: BTreeMap<PathBuf, usize> = BTreeMap::new();
    for done in outcomes.values().filter_map(Outcome::done) {
        for path in &done.moved {
            *folders.entry(path.parent().unwrap_or(path).to_owned()).or_default() += 1;
        }
    }
    for (folder, count) in folders {
        host.say(&format!(
            "Moved {} of an earlier flight to {}",
            words::count(count, "log"),
            folder.shown()
        ));
    }
}

/// Names the earlier starts whose logs never came home: they may still be on the drones.
fn say_left_behind(host: &dyn Host, logs: &Path) {
    let shelf = Shelf::open(logs, "").ok();
    let entries = shelf.iter().flat_map(|shelf| &shelf.manifest.logs);
    // Those that were asked for by `--log` lie among the older ones.
    let began: Vec<GpsTime> =
        entries.filter_map(|entry| entry.flight.as_ref()?.gps_start).collect();
    for (number, folder) in earlier_folders(logs).unwrap_or_default() {
        let Ok(Some(record)) = StartRecord::read_in(&folder) else { continue };
        let is_of = |began: &GpsTime| later_s(*began, record.start).abs() <= SAME_START_S;
        if logs_in(&folder).is_empty() && !began.iter().any(is_of) {
            host.say(&format!(
                "No log of flight {number} ({}) has been downloaded: they may still be on the \
                 drones (`updraft logs pull --log all`)",
                time_of_day(record.start)
            ));
        }
    }
}

/// Names the drones that have newer logs than those of this flight: somebody may want them.
fn say_newer(host: &dyn Host, outcomes: &BTreeMap<DroneId, Outcome>) {
    let newer = outcomes.iter().filter_map(|(drone, outcome)| {
        let number = outcome.done()?.newer?;
        Some(format!("{drone} (log {number})"))
    });
    let newer: Vec<String> = newer.collect();
    if !newer.is_empty() {
        host.warn(&format!(
            "{} newer logs than those of this flight, which were left where they are: drones {}; \
             `updraft logs pull --log newest` downloads them",
            if newer.len() == 1 { "one drone has" } else { "some drones have" },
            newer.join(", ")
        ));
    }
}
