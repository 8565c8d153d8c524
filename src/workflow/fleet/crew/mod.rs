//! Steps of a station with its fleet: those of `fly` and of `fleet`.

mod attach;
mod down;
mod end;
mod ends;
mod eyes;
mod guided;
mod hear;
mod identity;
mod keep;
mod load;
mod start;
mod stubborn;
mod troubles;

pub(crate) use self::attach::Found;
pub(crate) use self::ends::Ended;

use std::collections::{BTreeMap, BTreeSet};

use serde::Serialize;

use crate::base::file::FileError;
use crate::campaign::FlightFolder;
use crate::campaign::start::StartRecord;
use crate::fleet::gate::Gate;
use crate::fleet::greet::{Greet, ask_time};
use crate::fleet::journal::{Entry, Journal};
use crate::fleet::log_protocol::LogProtocolError;
use crate::fleet::log_protocol::list::{Entry as LogOnDrone, LogList};
use crate::fleet::preflight::{Known, Limits, Preflight, preflight};
use crate::fleet::slots::{FleetTable, SlotProblem, check_stands, picture, propose};
use crate::fleet::telemetry::Telemetry;
use crate::link::clock::{MS, Micros, S};
use crate::link::conversation::{Conversation, Observer, Progress as Share, run_all};
use crate::link::error::Refusal;
use crate::link::id::DroneId;
use crate::link::net::{Net, Received};
use crate::live::view::Step;
use crate::mission::Plan;
use crate::show::Show;
use crate::workflow::error::WorkflowError;
use crate::workflow::fleet::interrupt::Choice;
use crate::workflow::host::{Host, News};

/// Conversations at once per network: short ones do not disturb each other.
const AT_ONCE: usize = 64;
/// Drones are listened to for so long after the last of them was heard, to judge their links.
const SETTLE: Micros = 4 * S;

/// A fleet, its flight, and what is known of both.
#[expect(clippy::struct_excessive_bools, reason = "each is a way in which a flight is another")]
pub(crate) struct Crew<'a> {
    host: &'a dyn Host,
    /// The links, behind the gate: everything that is sent to drones goes through it.
    pub(crate) net: Gate<'a>,
    /// Where the flight's files are.
    pub(crate) folder: &'a FlightFolder,
    /// The flight.
    pub(crate) plan: &'a Plan,
    show: Show,
    /// What is known of the drones.
    pub(crate) telemetry: Telemetry,
    /// Which drone flies which slot.
    pub(crate) table: FleetTable,
    known: Known,
    /// Troubles of the links that were told.
    told: BTreeSet<String>,
    /// Virtual drones that are gone after this flight: nobody waits for people, and nothing is kept
    /// of them but their logs.
    pub(crate) is_virtual: bool,
    /// Virtual drones with which people practise: everything that happens is told, as in the field.
    pub(crate) tells_all: bool,
    /// The station flies the drones by streaming targets; nobody needs the show mode.
    pub(crate) is_guided: bool,
    /// The start that was authorized and written down.
    begun: Option<StartRecord>,
    /// What the drones do when this program is interrupted in flight.
    pub(crate) on_interrupt: Choice,
    /// Why messages were held back in the step that was last.
    held: BTreeMap<DroneId, String>,
    /// Drones that were seen in the air.
    flew: BTreeSet<DroneId>,
    /// Drones that have restarted there, and were not seen to fly on.
    fell: BTreeSet<DroneId>,
    /// Drones that another station has ordered down in this flight.
    pub(crate) ordered_before: BTreeSet<DroneId>,
    /// The flight was on its way before this program looked.
    attached: bool,
}

/// Listens to all, and looks for Ctrl-C.
struct Ears<'a> {
    telemetry: &'a mut Telemetry,
    host: &'a dyn Host,
    done: BTreeSet<DroneId>,
    held: BTreeMap<DroneId, String>,
}

impl Observer for Ears<'_> {
    fn on_message(&mut self, now: Micros, received: &Received) {
        self.telemetry.on_message(now, received);
    }

    fn on_progress(&mut self, drone: DroneId, _: Share, over: bool) {
        if over {
            self.done.insert(drone);
        }
    }

    fn on_refused(&mut self, drone: DroneId, refusal: &Refusal) {
        self.held.insert(drone, refusal.why.clone());
    }

    fn stop(&mut self, _: Micros) -> bool {
        self.host.is_stopped()
    }
}

/// A line of the journal.
#[derive(Serialize)]
struct Note<'a> {
    step: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    text: Option<String>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    drones: Vec<NoteOf<'a>>,
}

/// What became of a drone.
#[derive(Serialize)]
struct NoteOf<'a> {
    drone: DroneId,
    outcome: &'a str,
}

impl<'a> Crew<'a> {
    pub(crate) fn new(
        host: &'a dyn Host,
        net: &'a mut dyn Net,
        folder: &'a FlightFolder,
        plan: &'a Plan,
    ) -> Self {
        Self {
            host,
            net: Gate::new(net, plan),
            folder,
            show: plan.to_show(),
            plan,
            telemetry: Telemetry::default(),
            table: FleetTable::new([]),
            known: Known::default(),
            told: BTreeSet::new(),
            is_virtual: false,
            tells_all: false,
            is_guided: false,
            begun: None,
            on_interrupt: Choice::Return,
            held: BTreeMap::new(),
            flew: BTreeSet::new(),
            ordered_before: BTreeSet::new(),
            fell: BTreeSet::new(),
            attached: false,
        }
    }

    /// Listens until as many drones as the plan has slots say where they are, or for `wait_s`.
    pub(crate) fn listen(&mut self, wait_s: f64) -> Result<(), WorkflowError> {
        let slots = self.plan.slots.len();
        self.step(
            Step::Listening,
            &format!("Waiting for {slots} drones to say where they are, {wait_s:.0} s at most"),
        );
        let until = self.net.now() + (wait_s * 1e6) as Micros;
        let settle = if self.is_virtual { 500 * MS } else { SETTLE };
        let mut complete = None;
        loop {
            self.host.check_stop()?;
            let now = self.net.now();
            let ready = self.telemetry.drones.values().filter(|drone| {
                drone.position.is_some_and(|(_, position)| position.has_place())
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
        self.tell_troubles();
        if self.telemetry.drones.is_empty() {
            return Err(WorkflowError::Nothing(nobody(wait_s)));
        }
        Ok(())
    }

    /// Tells that a step has begun, and what is waited for.
    fn step(&self, step: Step, waits: &str) {
        self.host.news(&News::Step(step, waits.to_owned()));
    }

    /// Runs one conversation per drone.
    fn all<C: Conversation>(
        &mut self,
        conversations: BTreeMap<DroneId, C>,
        at_once: usize,
    ) -> Result<BTreeMap<DroneId, C::Done>, WorkflowError> {
        let telemetry = &mut self.telemetry;
        let (done, held) = (BTreeSet::new(), BTreeMap::new());
        let mut ears = Ears { telemetry, host: self.host, done, held };
        let done = run_all(&mut self.net, conversations, at_once, &mut ears)?;
        self.held = ears.held;
        self.host.check_stop()?;
        Ok(done)
    }

    /// The drones of the table.
    fn drones(&self) -> BTreeSet<DroneId> {
        self.table.drones.iter().map(|line| line.drone).collect()
    }

    /// Asks for clocks and versions.
    pub(crate) fn greet(&mut self) -> Result<(), WorkflowError> {
        self.step(Step::Greeting, "Waiting for every drone's clock and version");
        let conversations =
            self.telemetry.drones.keys().map(|drone| (*drone, Greet::new(*drone))).collect();
        self.all(conversations, AT_ONCE)?;
        Ok(())
    }

    /// Finds which drone flies which slot: by the campaign's table, else by where they stand.
    /// Whether all is as it should be; problems are told.
    pub(crate) fn assign(&mut self, anew: bool) -> Result<bool, WorkflowError> {
        self.step(Step::Assigning, "Finding which drone stands at which slot");
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
        self.net.set_fleet(self.drones());
        self.host.news(&News::Assigned(&self.table));
        if problems.is_empty() {
            return Ok(true);
        }
        self.host.insist(&picture(self.plan, &self.telemetry, now));
        for problem in &problems {
            self.host.warn(&problem.to_string());
        }
        Ok(false)
    }

    /// The table before a start.
    pub(crate) fn preflight(&mut self, wait_s: f64) -> Result<Preflight, WorkflowError> {
        self.step(
            Step::Preflight,
            &format!("Waiting for every drone to be ready, {wait_s:.0} s at most; then the start time is set"),
        );
        let until = self.net.now() + (wait_s * 1e6) as Micros;
        loop {
            self.host.check_stop()?;
            let now = self.net.now();
            let found = preflight(
                self.plan,
                &self.table,
                &self.telemetry,
                &self.known,
                &Limits { guided: self.is_guided, ..Limits::default() },
                now,
            );
            self.host.news(&News::Preflight(&found));
            if found.go() || now >= until {
                return Ok(found);
            }
            for drone in self.telemetry.timeless(now) {
                drop(self.net.send(drone, &ask_time(drone)));
            }
            let next = now + 200 * MS;
            while let Some(received) = self.net.recv(next)? {
                self.telemetry.on_message(self.net.now(), &received);
            }
        }
    }

    /// The logs on every drone of the table; in words why not.
    pub(crate) fn list_logs(
        &mut self,
    ) -> Result<BTreeMap<DroneId, Result<Vec<LogOnDrone>, String>>, WorkflowError> {
        let conversations =
            self.drones().into_iter().map(|drone| (drone, LogList::new(drone, 20 * S))).collect();
        let listed = self.all(conversations, AT_ONCE)?;
        let words = |error: LogProtocolError| crate::workflow::error::with_reasons(&error);
        Ok(listed.into_iter().map(|(drone, list)| (drone, list.map_err(words))).collect())
    }

    /// Listens for a moment. An order to end the flight ends the command, too.
    pub(crate) fn idle(&mut self) -> Result<(), WorkflowError> {
        while let Some(received) = self.net.recv(self.net.now() + 20 * MS)? {
            self.telemetry.on_message(self.net.now(), &received);
        }
        self.host.check_stop()?;
        self.not_ordered_down()
    }

    /// Refuses to go on towards a start when somebody has ordered drones down.
    pub(crate) fn not_ordered_down(&self) -> Result<(), WorkflowError> {
        if self.net.ordered_down().is_empty() {
            return Ok(());
        }
        Err(WorkflowError::Unsafe(
            "nothing was started: `fleet abort` or `fleet land` came from another terminal"
                .to_owned(),
        ))
    }

    /// What became of each drone of the table: refused for a reason, or fine.
    fn outcomes_of(
        &self,
        fine: impl Fn(&DroneId) -> String,
        bad: &BTreeMap<DroneId, String>,
    ) -> BTreeMap<DroneId, String> {
        let refused = |drone: DroneId| bad.get(&drone).map(|reason| format!("refused: {reason}"));
        let of = |drone: DroneId| (drone, refused(drone).unwrap_or_else(|| fine(&drone)));
        self.drones().into_iter().map(of).collect()
    }

    /// Ends a step: what another terminal has ordered meanwhile is carried out first, however the step
    /// has ended. Who was interrupted does not wait.
    pub(crate) fn ending<T>(
        &mut self,
        ended: Result<T, WorkflowError>,
    ) -> Result<T, WorkflowError> {
        if self.host.check_stop().is_ok() {
            self.finish_orders()?;
        }
        ended
    }

    fn note(&mut self, step: &str, text: Option<String>) -> Result<(), WorkflowError> {
        self.note_each(step, text, &BTreeMap::new())
    }

    /// Writes down what became of each drone in a step.
    fn note_each(
        &mut self,
        step: &str,
        text: Option<String>,
        drones: &BTreeMap<DroneId, String>,
    ) -> Result<(), WorkflowError> {
        if self.is_virtual {
            return Ok(());
        }
        Ok(write_note(self.host, self.folder, &Note { step, text, drones: outcomes(drones) })?)
    }

    /// Writes down what became of each drone, and only warns if that fails: a full disk must not stand in
    /// the way.
    fn try_note(&mut self, step: &str, drones: &BTreeMap<DroneId, String>) {
        if let Err(error) = self.note_each(step, None, drones) {
            self.host.warn(&format!("not in the journal: {error}"));
        }
    }
}

/// What is said when nobody is heard.
pub(crate) fn nobody(wait_s: f64) -> String {
    format!("no drone was heard within {wait_s:.0} s: are they on, and is --connect right?")
}

fn outcomes(drones: &BTreeMap<DroneId, String>) -> Vec<NoteOf<'_>> {
    drones.iter().map(|(drone, outcome)| NoteOf { drone: *drone, outcome }).collect()
}

fn write_note(host: &dyn Host, folder: &FlightFolder, event: &Note<'_>) -> Result<(), FileError> {
    let entry = Entry { unix_us: host.clock().unix_us(), drone: None, event };
    Journal::open(&folder.0)?.write(&entry)
}

/// Writes into the journal what became of drones in a step.
pub(super) fn write_outcomes(
    host: &dyn Host,
    folder: &FlightFolder,
    step: &str,
    drones: &BTreeMap<DroneId, String>,
) -> Result<(), FileError> {
    write_note(host, folder, &Note { step, text: None, drones: outcomes(drones) })
}
