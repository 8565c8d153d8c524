//! Bringing logs home through the server, several drones at once.

use std::collections::BTreeMap;
use std::path::Path;

use super::stopped;
use crate::base::file::{create_folder, write_whole};
use crate::campaign::FlightFolder;
use crate::cli::clock::{Stopwatch, SystemClock};
use crate::cli::context::Context;
use crate::cli::exit::{CommandError, with_reasons};
use crate::cli::fleet::bring::Wish;
use crate::cli::fly_output::LogOutput;
use crate::cli::simulate::made_by;
use crate::fleet::logs::manifest::{AtHome, ManifestEntry, Method, Shelf, Verified};
use crate::fleet::logs::one::Which;
use crate::fleet::logs::part::sums_of;
use crate::link::clock::Clock as _;
use crate::log::Log;
use crate::mission::Plan;
use crate::skybrush_server::{
    Client, Foreman, Job, LogEntry, Outcome, fetch_log, list_logs, log_bytes, log_entries,
};

/// How often a log is asked for: it may still grow, and a drone may miss a word.
const TRIES: u32 = 3;
/// A word to who waits, s.
const SAY_EVERY_S: u64 = 10;

/// Brings logs of these slots and the server's names of their drones.
pub(super) fn bring(
    context: &Context,
    client: &mut Client,
    address: &str,
    folder: &FlightFolder,
    plan: &Plan,
    wanted: &[(u16, String)],
    wish: &Wish,
) -> Result<Vec<LogOutput>, CommandError> {
    create_folder(&folder.logs())?;
    let shelf = Shelf::open(&folder.logs(), &made_by())?;
    let watch = Stopwatch::start();
    let mut puller = Puller {
        context,
        address,
        wish,
        shelf,
        ones: BTreeMap::new(),
        error: None,
        shares: BTreeMap::new(),
        watch,
        said: 0,
    };
    for (slot, id) in wanted {
        let path = folder.log(*slot, plan.slots.len());
        let file = path.file_name().map(|name| name.to_string_lossy().into_owned());
        let mut one = One::new(*slot, file.unwrap_or_default());
        puller.look(&mut one);
        puller.ones.insert(id.clone(), one);
    }
    let jobs: Vec<Job> =
        puller.ones.iter().filter(|(_, one)| !one.over).map(|(id, _)| list_logs(id)).collect();
    let broke = client.work(jobs, wish.at_once, &mut puller).err();
    if let Some(error) = puller.error {
        return Err(error);
    }
    context.check_stop()?;
    let broke = broke.map(|error| with_reasons(&error));
    if let Some(broke) = &broke {
        context.warn(broke);
    }
    let rows: Vec<LogOutput> = wanted
        .iter()
        .filter_map(|(slot, id)| {
            let one = puller.ones.get(id)?;
            let open = || broke.clone().unwrap_or_else(|| "nothing was said of it".to_owned());
            let reason = one.failure.clone().or_else(|| (!one.over).then(open));
            let state = match &reason {
                Some(_) => "missing",
                None if one.pulled == 0 => "there",
                None => "pulled",
            };
            Some(LogOutput {
                slot: *slot,
                drone: Some(id.clone()),
                state,
                bytes: one.bytes,
                reason,
            })
        })
        .collect();
    for row in &rows {
        if let (Some(reason), Some(drone)) = (&row.reason, &row.drone) {
            context.warn(&format!("no log of drone {drone} (slot {}): {reason}", row.slot));
        }
    }
    Ok(rows)
}

/// A log that is to come.
struct Target {
    file: String,
    log: LogEntry,
    tries: u32,
    /// What came, but not with the size that was listed.
    came: Option<Vec<u8>>,
}

/// A drone's logs.
struct One {
    slot: u16,
    /// Name of the newest log's file.
    file: String,
    /// How often they were listed in vain.
    lists: u32,
    /// What is to come, the next last.
    targets: Vec<Target>,
    listed: bool,
    pulled: usize,
    bytes: u64,
    failure: Option<String>,
    over: bool,
}

impl One {
    fn new(slot: u16, file: String) -> Self {
        Self {
            slot,
            file,
            lists: 0,
            targets: Vec::new(),
            listed: false,
            pulled: 0,
            bytes: 0,
            failure: None,
            over: false,
        }
    }

    fn fail(&mut self, reason: impl Into<String>) -> Option<Job> {
        self.failure = Some(reason.into());
        self.over = true;
        None
    }
}

struct Puller<'a> {
    context: &'a Context,
    address: &'a str,
    wish: &'a Wish,
    shelf: Shelf,
    ones: BTreeMap<String, One>,
    /// The campaign's folder cannot be written.
    error: Option<CommandError>,
    shares: BTreeMap<String, f64>,
    watch: Stopwatch,
    said: u64,
}

impl Foreman for Puller<'_> {
    fn over(&mut self, drone: &str, outcome: Outcome) -> Option<Job> {
        self.shares.remove(drone);
        let mut one = self.ones.remove(drone)?;
        let next = self.after(drone, &mut one, outcome);
        one.over |= next.is_none();
        self.ones.insert(drone.to_owned(), one);
        next
    }

    fn progress(&mut self, drone: &str, share: f64) {
        if share > 0.0 {
            self.shares.insert(drone.to_owned(), share);
        }
        let periods = self.watch.elapsed().as_secs() / SAY_EVERY_S;
        if periods > self.said {
            self.said = periods;
            let over = self.ones.values().filter(|one| one.over).count();
            let parts: Vec<String> = self
                .shares
                .iter()
                .map(|(id, share)| format!("{id} {:.0} %", share * 100.0))
                .collect();
            self.context.say(&format!(
                "bringing logs home: {over} of {} drones done after {}; {}",
                self.ones.len(),
                self.watch,
                parts.join(", ")
            ));
        }
    }

    fn stop(&mut self) -> bool {
        stopped(self.context) || self.error.is_some()
    }
}

impl Puller<'_> {
    /// Whether anything has to be asked at all.
    fn look(&self, one: &mut One) {
        if self.wish.again {
            return;
        }
        match self.shelf.at_home(&one.file) {
            AtHome::Foreign => {
                one.fail(format!(
                    "{} is there, but the manifest does not know it; move the file away, or bring \
                     the log again in its place (--again)",
                    one.file
                ));
            }
            AtHome::Intact(entry) if entry.incomplete.is_none() => {
                one.over = match self.wish.which {
                    Which::Flight | Which::Newest => true,
                    Which::Number(number) => entry.boot == Some(number),
                    Which::All => false,
                };
            }
            // What is damaged, or only a beginning, comes again.
            _ => {}
        }
    }

    fn after(&mut self, drone: &str, one: &mut One, outcome: Outcome) -> Option<Job> {
        if !one.listed {
            return match outcome.and_then(|value| log_entries(&value)) {
                Ok(logs) => {
                    one.listed = true;
                    self.choose(drone, one, logs)
                }
                Err(reason) => {
                    one.lists += 1;
                    // A drone may have missed a word.
                    if one.lists < TRIES && !is_final(&reason) {
                        return Some(list_logs(drone));
                    }
                    one.fail(advised(&reason))
                }
            };
        }
        let mut target = one.targets.pop()?;
        let bytes = match target.came.take() {
            // It was listed once more.
            Some(bytes) => {
                let size = outcome.and_then(|value| log_entries(&value)).ok().and_then(|logs| {
                    logs.into_iter().find(|log| log.id == target.log.id).map(|log| log.size)
                });
                target.log.size = size.unwrap_or(target.log.size);
                bytes
            }
            None => match outcome.and_then(|value| log_bytes(&value)) {
                Ok(bytes) => {
                    if bytes.len() as u64 != target.log.size && target.tries < TRIES {
                        target.came = Some(bytes);
                        one.targets.push(target);
                        return Some(list_logs(drone));
                    }
                    bytes
                }
                Err(reason) if target.tries < TRIES && !is_final(&reason) => {
                    return Some(fetch(drone, one, target));
                }
                Err(reason) => return one.fail(advised(&reason)),
            },
        };
        let (size, came) = (target.log.size, bytes.len() as u64);
        if size != came {
            if target.tries < TRIES {
                return Some(fetch(drone, one, target));
            }
            return one.fail(format!(
                "log {} was listed with {size} bytes, but {came} came: it may still be written; \
                 try again when the drone is disarmed",
                target.log.id
            ));
        }
        // The server tells no checksum: a log is taken when it can be read.
        if let Some(reason) = Log::from_bytes(bytes.clone()).why_not_a_log() {
            let id = &target.log.id;
            return one.fail(format!("what came as log {id} is no DataFlash log: {reason}"));
        }
        if let Err(error) = self.publish(drone, one.slot, &target, &bytes) {
            self.error = Some(error);
            return one.fail("it could not be written");
        }
        one.pulled += 1;
        one.bytes += came;
        next(drone, one)
    }

    /// Which of a drone's logs are to come.
    fn choose(&self, drone: &str, one: &mut One, mut logs: Vec<LogEntry>) -> Option<Job> {
        logs.sort_by_key(number);
        let Some(newest) = logs.last().map(number) else {
            return one.fail("the server lists no ArduPilot log of it");
        };
        let known: Vec<String> = logs.iter().map(|log| log.id.clone()).collect();
        let which = self.wish.which;
        logs.retain(|log| match which {
            Which::Flight | Which::Newest => number(log) == newest,
            Which::Number(wanted) => number(log) == wanted,
            Which::All => true,
        });
        if logs.is_empty() {
            let known = known.join(", ");
            return one.fail(format!(
                "the drone has no such log, only {known}; choose one of them (--log)"
            ));
        }
        for log in logs {
            let file = if which == Which::All && number(&log) != newest {
                format!("older/{}-{:08}.BIN", one.file.trim_end_matches(".BIN"), number(&log))
            } else {
                one.file.clone()
            };
            if !self.wish.again && self.is_there(&file, &self.source(drone, &log)) {
                continue;
            }
            if log.size > self.wish.most_bytes {
                return one.fail(format!(
                    "log {} has {} bytes, and at most {} are allowed; allow more (--max-size), if \
                     that is its size",
                    log.id, log.size, self.wish.most_bytes
                ));
            }
            one.targets.push(Target { file, log, tries: 0, came: None });
        }
        next(drone, one)
    }

    fn is_there(&self, file: &str, source: &str) -> bool {
        self.shelf.entry(file).is_some_and(|entry| {
            entry.source == source && has_size(&self.shelf.path(file), entry.size_bytes)
        })
    }

    fn source(&self, drone: &str, log: &LogEntry) -> String {
        format!("skybrush://{} drone {drone} log {}", self.address, log.id)
    }

    fn publish(
        &mut self,
        drone: &str,
        slot: u16,
        target: &Target,
        bytes: &[u8],
    ) -> Result<(), CommandError> {
        let path = self.shelf.path(&target.file);
        if let Some(folder) = path.parent() {
            create_folder(folder)?;
        }
        if matches!(self.shelf.at_home(&target.file), AtHome::Damaged(_)) {
            self.shelf.set_aside(&target.file, "damaged")?;
        }
        let sums = sums_of(bytes);
        // The entry is first: a file without one would be anybody's.
        self.shelf.add(ManifestEntry {
            file: target.file.clone(),
            slot,
            drone: None,
            boot: target.log.id.parse().ok(),
            source: self.source(drone, &target.log),
            size_bytes: sums.size,
            sha256: sums.sha256,
            method: Method::SkybrushServer,
            method_reason: None,
            verified: Verified::Size,
            incomplete: None,
            attempts: target.tries,
            at_unix_s: SystemClock::start().unix_us() / 1_000_000,
            flight: None,
        })?;
        write_whole(&path, bytes)?;
        Ok(())
    }
}

/// The next log of a drone, if there is one to come.
fn next(drone: &str, one: &mut One) -> Option<Job> {
    let target = one.targets.pop()?;
    Some(fetch(drone, one, target))
}

fn fetch(drone: &str, one: &mut One, mut target: Target) -> Job {
    target.tries += 1;
    let job = fetch_log(drone, &target.log.id);
    one.targets.push(target);
    job
}

fn number(log: &LogEntry) -> u32 {
    log.id.parse().unwrap_or(0)
}

fn has_size(path: &Path, bytes: u64) -> bool {
    std::fs::metadata(path).is_ok_and(|about| about.len() == bytes)
}

/// Whether it is of no use to ask once more.
fn is_final(reason: &str) -> bool {
    let reason = reason.to_lowercase();
    reason.contains("no such uav") || reason.contains("another log download")
}

/// The server's words, with what to do where that is known.
fn advised(reason: &str) -> String {
    if reason.contains("Another log download") {
        return format!(
            "{reason} (by Skybrush Live, or a program that was killed): try again when it is over"
        );
    }
    if reason.contains("timed out") {
        return format!("{reason}: is it switched on and disarmed?");
    }
    reason.to_owned()
}
