//! Bringing logs home through the server, several drones at once.
//!
//! A log is listed, downloaded, and listed again: it counts when it has still the size that came.
//! Whether it is of the flight is asked of the log itself, as over a drone's own link.

mod choose;
mod one;
mod place;
mod settle;

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::time::Duration;

use self::one::One;
use crate::base::file::create_folder;
use crate::base::plain::Shown as _;
use crate::base::time::GpsTime;
use crate::campaign::FlightFolder;
use crate::campaign::start::{StartRecord, other_starts};
use crate::fleet::logs::manifest::{LogFlight, Shelf};
use crate::link::clock::{Micros, S};
use crate::mission::Plan;
use crate::skybrush_server::{Client, Foreman, Job, Outcome, list_logs};
use crate::workflow::clock::Spent;
use crate::workflow::error::{WorkflowError, with_reasons};
use crate::workflow::fleet::bring::{LogState, Wish};
use crate::workflow::fleet::output::LogOutput;
use crate::workflow::host::Host;
use crate::workflow::made_by;
use crate::workflow::words;

/// A word to who waits.
const SAY_EVERY: Micros = 10 * S;

/// Brings logs of these slots and the server's names of their drones.
pub(super) fn bring(
    host: &dyn Host,
    client: &mut Client,
    address: &str,
    folder: &FlightFolder,
    plan: &Plan,
    wanted: &[(u16, String)],
    wish: &Wish,
) -> Result<Vec<LogOutput>, WorkflowError> {
    create_folder(&folder.logs())?;
    let shelf = Shelf::open(&folder.logs(), &made_by())?;
    let start = StartRecord::read(folder)?;
    let mut puller = Puller {
        host,
        address,
        wish,
        shelf,
        ones: BTreeMap::new(),
        error: None,
        shares: BTreeMap::new(),
        begun: host.clock().now(),
        said: 0,
        other_starts: if start.is_none() { other_starts(folder) } else { Vec::new() },
    };
    for (slot, id) in wanted {
        let path = folder.log(*slot, plan.slots.len());
        let file = path.file_name().map(|name| name.to_string_lossy().into_owned());
        let flight = start.as_ref().map(|start| LogFlight::wanted(start, *slot));
        let mut one = One::new(*slot, file.unwrap_or_default(), flight);
        puller.look(&mut one)?;
        puller.ones.insert(id.clone(), one);
    }
    puller.settle(client)?;
    let jobs: Vec<Job> =
        puller.ones.iter().filter(|(_, one)| !one.over).map(|(id, _)| list_logs(id)).collect();
    let broke = client.work(jobs, wish.at_once, &mut puller).err();
    if let Some(error) = puller.error {
        return Err(error);
    }
    host.check_stop()?;
    let broke = broke.map(|error| with_reasons(&error));
    if let Some(broke) = &broke {
        host.warn(broke);
    }
    let rows: Vec<LogOutput> = wanted
        .iter()
        .filter_map(|(slot, id)| {
            let one = puller.ones.get(id)?;
            let open =
                || broke.clone().unwrap_or_else(|| "the server did not report on it".to_owned());
            let reason = one.failure.clone().or_else(|| (!one.over).then(open));
            let state = match &reason {
                Some(_) => LogState::Missing,
                None if one.pulled == 0 => LogState::There,
                None => LogState::Pulled,
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
    puller.say_moved();
    puller.say_newer();
    for one in puller.ones.values() {
        if let Some(unchecked) = &one.unchecked {
            host.warn(&format!("slot {}: {unchecked}", one.slot));
        }
    }
    for row in &rows {
        if let (Some(reason), Some(drone)) = (&row.reason, &row.drone) {
            host.warn(&format!("no log of drone {drone} (slot {}): {reason}", row.slot));
        }
    }
    Ok(rows)
}

struct Puller<'a> {
    host: &'a dyn Host,
    address: &'a str,
    wish: &'a Wish,
    shelf: Shelf,
    ones: BTreeMap<String, One>,
    /// The campaign's folder cannot be written.
    error: Option<WorkflowError>,
    shares: BTreeMap<String, f64>,
    begun: Micros,
    said: u64,
    /// Starts of the campaign's other flights, where none of this one was written down.
    other_starts: Vec<(String, GpsTime)>,
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
        let spent = self.host.clock().now().saturating_sub(self.begun);
        let periods = spent / SAY_EVERY;
        if periods > self.said {
            self.said = periods;
            let over = self.ones.values().filter(|one| one.over).count();
            let parts: Vec<String> = self
                .shares
                .iter()
                .map(|(id, share)| format!("{id} {:.0} %", share * 100.0))
                .collect();
            let parts =
                if parts.is_empty() { String::new() } else { format!("; {}", parts.join(", ")) };
            self.host.say(&format!(
                "downloading logs: {over} of {} drones done after {}{parts}",
                self.ones.len(),
                Spent(Duration::from_micros(spent)),
            ));
        }
    }

    fn stop(&mut self) -> bool {
        self.host.is_stopped() || self.error.is_some()
    }
}

impl Puller<'_> {
    /// Says which logs of earlier flights made room.
    fn say_moved(&self) {
        let mut folders: BTreeMap<PathBuf, usize> = BTreeMap::new();
        for path in self.ones.values().flat_map(|one| &one.moved) {
            *folders.entry(path.parent().unwrap_or(path).to_owned()).or_default() += 1;
        }
        for (folder, count) in folders {
            self.host.say(&format!(
                "Moved {} of an earlier flight to {}",
                words::count(count, "log"),
                folder.shown()
            ));
        }
    }

    /// Names the drones that have newer logs than those of this flight: somebody may want them.
    fn say_newer(&self) {
        let newer = self.ones.iter().filter_map(|(drone, one)| Some((drone, one.newer?)));
        let newer: BTreeSet<String> =
            newer.map(|(drone, number)| format!("{drone} (log {number})")).collect();
        if !newer.is_empty() {
            let newer: Vec<String> = newer.into_iter().collect();
            self.host.warn(&format!(
                "there are newer logs than those of this flight, which were left on the drones: \
                 {}; `updraft logs pull --log newest` downloads them",
                newer.join(", ")
            ));
        }
    }
}
