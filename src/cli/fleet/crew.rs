//! What a station does with a fleet, step by step: the steps of `fly` and of `fleet`.

mod eyes;
mod guided;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::atomic::Ordering;

use serde::Serialize;

use self::eyes::Eyes;
use super::connect::run_number;
use crate::base::crc::ap_crc32;
use crate::base::file::read_whole;
use crate::base::time::GpsTime;
use crate::campaign::FlightFolder;
use crate::cli::clock::SystemClock;
use crate::cli::context::Context;
use crate::cli::exit::CommandError;
use crate::cli::words;
use crate::fleet::abort::{ALL_AT_ONCE, Abort, Aborted, Action};
use crate::fleet::fence::Fence;
use crate::fleet::ftp::Caller;
use crate::fleet::ftp::sum::Sum;
use crate::fleet::greet::Greet;
use crate::fleet::journal::{Entry, Journal};
use crate::fleet::log_protocol::LogProtocolError;
use crate::fleet::log_protocol::list::{Entry as LogOnDrone, LogList};
use crate::fleet::preflight::{Known, Limits, Preflight, preflight};
use crate::fleet::required::{Changes, CheckParams, requirements};
use crate::fleet::slots::{FleetTable, SlotProblem, check_stands, picture, propose};
use crate::fleet::start::{Start, StartOptions};
use crate::fleet::telemetry::{Drone, Telemetry};
use crate::fleet::upload::{Load, Upload};
use crate::fleet::watch::{self, Monitor};
use crate::link::clock::{Clock as _, MS, Micros, S};
use crate::link::drive::{Machine, Progress as Share, Watch, drive};
use crate::link::error::NetError;
use crate::link::id::DroneId;
use crate::link::net::{Net, Received};
use crate::mission::Plan;
use crate::protocol::show::SHOW_FILE;
use crate::show::Show;

/// Conversations at once per network: short ones do not disturb each other.
const AT_ONCE: usize = 64;
/// Uploads at once per network.
const UPLOADS_AT_ONCE: usize = 16;
/// Virtual drones have set their flags by then, and no radio holds older packets back.
const SETTLE_VIRTUAL: Micros = 100 * MS;
/// Largest show file, bytes.
const MOST_SKYB: u64 = 1 << 20;
/// Drones are listened to for so long after the last of them was heard, to judge their links.
const SETTLE: Micros = 4 * S;

impl From<NetError> for CommandError {
    fn from(error: NetError) -> Self {
        Self::Failed(crate::cli::exit::with_reasons(&error))
    }
}

/// A fleet, its flight, and what is known of both.
pub(in crate::cli) struct Crew<'a> {
    context: &'a Context,
    /// The links.
    pub(in crate::cli) net: &'a mut dyn Net,
    /// Where the flight's files are.
    pub(in crate::cli) folder: &'a FlightFolder,
    /// The flight.
    pub(in crate::cli) plan: &'a Plan,
    show: Show,
    /// What is known of the drones.
    pub(in crate::cli) telemetry: Telemetry,
    /// Which drone flies which slot.
    pub(in crate::cli) table: FleetTable,
    known: Known,
    clock: SystemClock,
    /// Virtual drones that are gone after this flight: nobody waits for people, and nothing is kept
    /// of them but their logs.
    pub(in crate::cli) is_virtual: bool,
    /// The station flies the drones by streaming targets; nobody needs the show mode.
    pub(in crate::cli) is_guided: bool,
}

/// Listens to all, and looks for Ctrl-C.
struct Ears<'a> {
    telemetry: &'a mut Telemetry,
    context: &'a Context,
    done: BTreeSet<DroneId>,
}

impl Watch for Ears<'_> {
    fn on_message(&mut self, now: Micros, received: &Received) {
        self.telemetry.on_message(now, received);
    }

    fn on_progress(&mut self, drone: DroneId, _: Share, over: bool) {
        if over {
            self.done.insert(drone);
        }
    }

    fn stop(&mut self, _: Micros) -> bool {
        self.context.stop_flag().load(Ordering::SeqCst)
    }
}

/// A line of the journal.
#[derive(Serialize)]
struct Note<'a> {
    step: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    text: Option<String>,
}

impl<'a> Crew<'a> {
    pub(in crate::cli) fn new(
        context: &'a Context,
        net: &'a mut dyn Net,
        folder: &'a FlightFolder,
        plan: &'a Plan,
    ) -> Self {
        Self {
            context,
            net,
            folder,
            show: Show::of_plan(plan),
            plan,
            telemetry: Telemetry::default(),
            table: FleetTable::new([]),
            known: Known::default(),
            clock: SystemClock::start(),
            is_virtual: false,
            is_guided: false,
        }
    }

    /// Listens until as many drones as the plan has slots say where they are, or for `wait_s`.
    pub(in crate::cli) fn listen(&mut self, wait_s: f64) -> Result<(), CommandError> {
        let slots = self.plan.slots.len();
        let until = self.net.now() + (wait_s * 1e6) as Micros;
        let settle = if self.is_virtual { 500 * MS } else { SETTLE };
        let mut complete = None;
        loop {
            self.context.check_stop()?;
            let now = self.net.now();
            let ready = self.telemetry.drones.values().filter(|drone| {
                let here = |place: crate::base::frame::Geodetic| {
                    place.lat_deg != 0.0 || place.lon_deg != 0.0
                };
                drone.position.is_some_and(|(_, position)| here(position.place))
                    && drone.mode.is_some()
            });
            if ready.count() >= slots && complete.is_none() {
                complete = Some(now);
            }
            if complete.is_some_and(|since| now >= since + settle) || now >= until {
                break;
            }
            if let Some(received) = self.net.recv(now + 100 * MS)? {
                self.telemetry.on_message(self.net.now(), &received);
            }
        }
        if self.telemetry.drones.is_empty() {
            return Err(CommandError::Nothing(format!(
                "no drone was heard within {wait_s:.0} s: are they on, and is --connect right?"
            )));
        }
        Ok(())
    }

    /// Runs one conversation per drone.
    fn all<M: Machine>(
        &mut self,
        machines: BTreeMap<DroneId, M>,
        at_once: usize,
    ) -> Result<BTreeMap<DroneId, M::Done>, CommandError> {
        let mut ears =
            Ears { telemetry: &mut self.telemetry, context: self.context, done: BTreeSet::new() };
        let done = drive(self.net, machines, at_once, &mut ears)?;
        self.context.check_stop()?;
        Ok(done)
    }

    /// The drones of the table.
    fn drones(&self) -> BTreeSet<DroneId> {
        self.table.drones.iter().map(|line| line.drone).collect()
    }

    /// Asks for clocks and versions.
    pub(in crate::cli) fn greet(&mut self) -> Result<(), CommandError> {
        let machines =
            self.telemetry.drones.keys().map(|drone| (*drone, Greet::new(*drone))).collect();
        self.all(machines, AT_ONCE)?;
        Ok(())
    }

    /// Finds which drone flies which slot: by the campaign's table, else by where they stand.
    /// Whether all is as it should be; problems are told.
    pub(in crate::cli) fn assign(&mut self, anew: bool) -> Result<bool, CommandError> {
        let now = self.net.now();
        let problems: Vec<SlotProblem> = if FleetTable::path(&self.folder.0).exists() && !anew {
            self.table = FleetTable::read(&self.folder.0)?;
            check_stands(self.plan, &self.table, &self.telemetry, now)
        } else {
            match propose(self.plan, &self.telemetry, now) {
                Ok(table) => {
                    if !self.is_virtual {
                        table.write(&self.folder.0)?;
                    }
                    self.table = table;
                    Vec::new()
                }
                Err(problems) => problems,
            }
        };
        if problems.is_empty() {
            return Ok(true);
        }
        self.context.insist(&picture(self.plan, &self.telemetry, now));
        for problem in &problems {
            self.context.warn(&problem.to_string());
        }
        Ok(false)
    }

    /// Reads the required parameters, and mends them if allowed. Whether they are right.
    pub(in crate::cli) fn params(&mut self, may_change: bool) -> Result<bool, CommandError> {
        let machines = self
            .drones()
            .into_iter()
            .map(|drone| {
                let show = self.telemetry.get(drone).and_then(Drone::has_show_firmware);
                let by_show = show.unwrap_or(true) && !self.is_guided;
                let required = requirements(self.plan, by_show);
                (drone, CheckParams::new(drone, required, may_change))
            })
            .collect();
        let standings = self.all(machines, AT_ONCE)?;
        let mut changes =
            if self.is_virtual { Changes::default() } else { Changes::read(&self.folder.0)? };
        let (mut changed, mut wrong) = (0, 0);
        for (drone, standing) in &standings {
            changes.add(*drone, &standing.changed);
            changed += standing.changed.len();
            wrong += usize::from(!standing.is_right());
        }
        if changed > 0 && !self.is_virtual {
            changes.write(&self.folder.0)?;
            self.context.say(&format!(
                "Changed {} on {}; `updraft fleet restore` puts them back",
                words::count(changed, "parameter"),
                words::count(standings.len(), "drone")
            ));
        }
        self.known.params.extend(standings);
        if wrong > 0 && !may_change {
            self.context.warn(&format!(
                "{} parameters that must be others; --set-params lets this program set them",
                if wrong == 1 { "1 drone has".to_owned() } else { format!("{wrong} drones have") }
            ));
        }
        Ok(wrong == 0)
    }

    /// What is put on a drone.
    fn load(&self, slot: u16, fence: &Fence) -> Result<Load, CommandError> {
        let path = self.folder.skyb(slot, self.plan.slots.len());
        let skyb = read_whole(&path, MOST_SKYB)?;
        Ok(Load { skyb, site: self.plan.site, fence: fence.clone() })
    }

    /// The plan's fence as drones get it.
    pub(in crate::cli) fn fence(&self) -> Result<Fence, CommandError> {
        Fence::of(self.plan, &self.show).map_err(|error| CommandError::Usage(error.to_string()))
    }

    /// The upload of each drone of the table.
    pub(in crate::cli) fn uploads(&self) -> Result<BTreeMap<DroneId, Upload>, CommandError> {
        let fence = self.fence()?;
        let number = run_number();
        self.table
            .drones
            .iter()
            .map(|line| {
                let load = self.load(line.slot, &fence)?;
                let upload = Upload::new(line.drone, load, number);
                let upload = if self.is_virtual { upload.settling(SETTLE_VIRTUAL) } else { upload };
                Ok((line.drone, upload))
            })
            .collect()
    }

    /// Loads the show onto every drone. The drones that refused, with their reasons.
    pub(in crate::cli) fn upload(&mut self) -> Result<BTreeMap<DroneId, String>, CommandError> {
        let uploads = self.uploads()?;
        let count = uploads.len();
        // Virtual drones share no radio.
        let at_once = if self.is_virtual { AT_ONCE } else { UPLOADS_AT_ONCE };
        let done = self.all(uploads, at_once)?;
        let mut refused = BTreeMap::new();
        let mut written = 0;
        for (drone, outcome) in done {
            match outcome {
                Ok(loaded) => {
                    written += usize::from(loaded.written);
                    self.known.loaded.insert(drone);
                    self.known.fenced.insert(drone);
                }
                Err(error) => {
                    let slot = self.table.slot_of(drone).unwrap_or(0);
                    self.context.warn(&format!("drone {drone} (slot {slot}): {error}"));
                    refused.insert(drone, error.to_string());
                }
            }
        }
        if !self.is_virtual {
            self.context.say(&format!(
                "Loaded {} of {count} drones ({written} written, the others had the file)",
                count - refused.len()
            ));
        }
        self.note("upload", Some(format!("{} refused", refused.len())))?;
        Ok(refused)
    }

    /// The table before a start.
    pub(in crate::cli) fn preflight(&mut self, wait_s: f64) -> Result<Preflight, CommandError> {
        let until = self.net.now() + (wait_s * 1e6) as Micros;
        loop {
            self.context.check_stop()?;
            let now = self.net.now();
            let found = preflight(
                self.plan,
                &self.table,
                &self.telemetry,
                &self.known,
                &Limits { guided: self.is_guided, ..Limits::default() },
                now,
            );
            if found.go() || now >= until {
                return Ok(found);
            }
            let next = now + 200 * MS;
            while let Some(received) = self.net.recv(next)? {
                self.telemetry.on_message(self.net.now(), &received);
            }
        }
    }

    /// Sets a start and waits until every drone has taken it.
    pub(in crate::cli) fn announce(
        &mut self,
        options: StartOptions,
    ) -> Result<Start, CommandError> {
        let refused =
            |error: crate::fleet::start::StartRefusal| CommandError::Failed(error.to_string());
        let mut start = Start::announce(self.drones(), &self.telemetry, options, self.net.now())
            .map_err(refused)?;
        self.until_taken(&mut start)?;
        Ok(start)
    }

    /// Authorizes a start that all have taken, and waits until all know.
    pub(in crate::cli) fn authorize(&mut self, start: &mut Start) -> Result<(), CommandError> {
        start
            .authorize(&self.telemetry, self.net.now())
            .map_err(|error| CommandError::Failed(error.to_string()))?;
        self.note("authorized", Some(format!("start at {}", start.second_of_week())))?;
        self.until_taken(start)
    }

    /// Broadcasts until all have taken it, or the time is up.
    fn until_taken(&mut self, start: &mut Start) -> Result<(), CommandError> {
        let until = self.net.now() + 10 * S;
        loop {
            let now = self.net.now();
            if let Some(packet) = start.due(&self.telemetry, now) {
                self.net.broadcast(&packet)?;
            }
            let late = start.late(&self.telemetry, now);
            if late.is_empty() {
                return Ok(());
            }
            if now >= until || self.context.stop_flag().load(Ordering::SeqCst) {
                self.cancel(start)?;
                self.context.check_stop()?;
                let names: Vec<String> =
                    late.iter().map(|(drone, what)| format!("drone {drone}: {what}")).collect();
                return Err(CommandError::Failed(format!(
                    "the start was cancelled, as not every drone has taken it ({}); try again",
                    names.join("; ")
                )));
            }
            let next = start.next().clamp(now + MS, now + 100 * MS);
            while let Some(received) = self.net.recv(next)? {
                self.telemetry.on_message(self.net.now(), &received);
            }
        }
    }

    /// Takes a start back, for as long as it takes everyone to hear it.
    pub(in crate::cli) fn cancel(&mut self, start: &mut Start) -> Result<(), CommandError> {
        start.cancel(self.net.now());
        for _ in 0..5 {
            self.net.broadcast(&start.packet())?;
            let until = self.net.now() + 200 * MS;
            while let Some(received) = self.net.recv(until)? {
                self.telemetry.on_message(self.net.now(), &received);
            }
        }
        self.note("cancelled", None)
    }

    /// Watches the show until everyone has landed. Drones whose flight gave an alarm.
    pub(in crate::cli) fn watch(
        &mut self,
        start: &mut Start,
    ) -> Result<BTreeMap<DroneId, Vec<String>>, CommandError> {
        let mut eyes = self.eyes(start.time().map(GpsTime::total_ms))?;
        let outcome = loop {
            let now = self.net.now();
            if let Some(packet) = start.due(eyes.telemetry(), now) {
                self.net.broadcast(&packet)?;
            }
            let next = start.next().clamp(now + MS, now + 100 * MS);
            if let Some(received) = self.net.recv(next)? {
                eyes.on_message(self.net.now(), &received);
            }
            eyes.stop(self.net.now());
            if eyes.is_over() {
                break Ok(());
            }
            if self.context.stop_flag().load(Ordering::SeqCst) {
                self.context.insist(
                    "Nobody watches any more; the drones fly on by themselves. `updraft fleet abort` \
                     sends them home, `updraft fleet land` lands them where they are",
                );
                break Err(CommandError::Interrupted);
            }
        };
        let alarms = self.close(eyes);
        outcome.and(alarms)
    }

    /// Watches a flight from here on.
    fn eyes(&mut self, start_gps_ms: Option<i64>) -> Result<Eyes<'a>, CommandError> {
        let telemetry = std::mem::take(&mut self.telemetry);
        let mut monitor =
            Monitor::new(self.plan, &self.table, telemetry, watch::Limits::of(self.plan));
        monitor.set_start(start_gps_ms);
        let journal = if self.is_virtual { None } else { Some(Journal::open(&self.folder.0)?) };
        Ok(Eyes::new(self.context, monitor, journal, self.clock))
    }

    /// What was seen: the drones whose flight gave an alarm.
    fn close(&mut self, eyes: Eyes<'_>) -> Result<BTreeMap<DroneId, Vec<String>>, CommandError> {
        let (telemetry, alarms) = eyes.close();
        self.telemetry = telemetry;
        Ok(alarms?)
    }

    /// For steps that follow an earlier upload: whether each drone's show file is the planned one.
    pub(in crate::cli) fn look_at_files(&mut self) -> Result<(), CommandError> {
        let (count, number) = (self.plan.slots.len(), run_number());
        let mut wanted = BTreeMap::new();
        let mut machines = BTreeMap::new();
        for line in &self.table.drones {
            let file = read_whole(&self.folder.skyb(line.slot, count), MOST_SKYB)?;
            wanted.insert(line.drone, ap_crc32(&file));
            let caller = Caller::new(line.drone, number);
            let sum = Sum::new(caller, SHOW_FILE, file.len() as u64, 10 * S);
            machines.insert(line.drone, sum);
        }
        let found = self.all(machines, AT_ONCE)?;
        let same = found.into_iter().filter(|(drone, sum)| sum.as_ref().ok() == wanted.get(drone));
        let same: Vec<DroneId> = same.map(|(drone, _)| drone).collect();
        self.known.loaded.extend(same.iter().copied());
        self.known.fenced.extend(same);
        Ok(())
    }

    /// The logs on every drone of the table; in words why not.
    pub(in crate::cli) fn list_logs(
        &mut self,
    ) -> Result<BTreeMap<DroneId, Result<Vec<LogOnDrone>, String>>, CommandError> {
        let machines =
            self.drones().into_iter().map(|drone| (drone, LogList::new(drone, 20 * S))).collect();
        let listed = self.all(machines, AT_ONCE)?;
        let words = |error: LogProtocolError| crate::cli::exit::with_reasons(&error);
        Ok(listed.into_iter().map(|(drone, list)| (drone, list.map_err(words))).collect())
    }

    /// Drones of the table that are down and disarmed.
    pub(in crate::cli) fn landed(&self) -> usize {
        let down = |drone: &DroneId| {
            self.telemetry.get(*drone).is_some_and(|of| of.is_armed() == Some(false))
        };
        self.drones().iter().filter(|drone| down(drone)).count()
    }

    /// Listens until these drones (or anyone, and a moment more) are heard.
    pub(in crate::cli) fn hear_anyone(
        &mut self,
        wait_s: f64,
        only: Option<&BTreeSet<DroneId>>,
    ) -> Result<(), CommandError> {
        let begun = self.net.now();
        let until = begun + (wait_s * 1e6) as Micros;
        loop {
            self.context.check_stop()?;
            let now = self.net.now();
            let heard: BTreeSet<DroneId> = self.net.heard().into_iter().collect();
            let enough = match only {
                Some(only) => only.is_subset(&heard),
                None => !heard.is_empty() && now >= begun + 1500 * MS,
            };
            if enough {
                return Ok(());
            }
            if now >= until {
                return if heard.is_empty() {
                    Err(CommandError::Nothing(
                        "no drone was heard: use their remote controls".to_owned(),
                    ))
                } else {
                    Ok(())
                };
            }
            if let Some(received) = self.net.recv(now + 50 * MS)? {
                self.telemetry.on_message(self.net.now(), &received);
            }
        }
    }

    /// Ends the flight of these drones (all: of everyone who is heard).
    pub(in crate::cli) fn abort(
        &mut self,
        only: Option<&BTreeSet<DroneId>>,
        action: Action,
    ) -> Result<BTreeMap<DroneId, Aborted>, CommandError> {
        let heard: BTreeSet<DroneId> =
            self.net.heard().into_iter().chain(self.telemetry.drones.keys().copied()).collect();
        let machines = only
            .unwrap_or(&heard)
            .iter()
            .map(|drone| (*drone, Abort::new(*drone, action, self.telemetry.get(*drone))))
            .collect();
        let done = self.all(machines, ALL_AT_ONCE)?;
        self.note("abort", Some(format!("{} drones", done.len())))?;
        Ok(done)
    }

    /// Puts back the parameters that were changed. Drones that did not take them.
    pub(in crate::cli) fn restore(&mut self) -> Result<Vec<DroneId>, CommandError> {
        let mut changes = Changes::read(&self.folder.0)?;
        let machines = changes.restore();
        let wanted: Vec<DroneId> = machines.keys().copied().collect();
        let done = self.all(machines, AT_ONCE)?;
        let mut left = Vec::new();
        for drone in wanted {
            match done.get(&drone) {
                Some(Ok(())) => changes.forget(drone),
                Some(Err(error)) => {
                    self.context.warn(&format!("drone {drone}: {error}"));
                    left.push(drone);
                }
                None => left.push(drone),
            }
        }
        changes.write(&self.folder.0)?;
        Ok(left)
    }

    fn note(&mut self, step: &str, text: Option<String>) -> Result<(), CommandError> {
        if self.is_virtual {
            return Ok(());
        }
        let event = Note { step, text };
        let entry = Entry { unix_us: self.clock.unix_us(), drone: None, event: &event };
        Ok(Journal::open(&self.folder.0)?.write(&entry)?)
    }
}
