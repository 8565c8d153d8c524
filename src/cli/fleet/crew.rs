//! What a station does with a fleet, step by step: the steps of `fly` and of `fleet`.

mod attach;
mod down;
mod end;
mod ends;
mod eyes;
mod guided;
mod identity;
mod keep;
mod load;
mod start;
mod stubborn;
mod troubles;

pub(in crate::cli) use self::attach::Found;
pub(in crate::cli) use self::ends::Ended;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::atomic::Ordering;

use serde::Serialize;

use crate::base::file::FileError;
use crate::campaign::FlightFolder;
use crate::campaign::start::StartRecord;
use crate::cli::context::Context;
use crate::cli::exit::CommandError;
use crate::cli::fleet::interrupt::Choice;
use crate::fleet::gate::Gate;
use crate::fleet::greet::{Greet, ask_time};
use crate::fleet::journal::{Entry, Journal};
use crate::fleet::log_protocol::LogProtocolError;
use crate::fleet::log_protocol::list::{Entry as LogOnDrone, LogList};
use crate::fleet::preflight::{Known, Limits, Preflight, preflight};
use crate::fleet::slots::{FleetTable, SlotProblem, check_stands, picture, propose};
use crate::fleet::telemetry::Telemetry;
use crate::link::clock::{Clock as _, MS, Micros, S};
use crate::link::conversation::{Conversation, Observer, Progress as Share, run_all};
use crate::link::error::Refusal;
use crate::link::id::DroneId;
use crate::link::net::{Net, Received};
use crate::mission::Plan;
use crate::show::Show;
use crate::workflow::clock::SystemClock;

/// Conversations at once per network: short ones do not disturb each other.
const AT_ONCE: usize = 64;
/// Drones are listened to for so long after the last of them was heard, to judge their links.
const SETTLE: Micros = 4 * S;

/// A fleet, its flight, and what is known of both.
#[expect(clippy::struct_excessive_bools, reason = "each is a way in which a flight is another")]
pub(in crate::cli) struct Crew<'a> {
    context: &'a Context,
    /// The links, behind the gate: everything that is sent to drones goes through it.
    pub(in crate::cli) net: Gate<'a>,
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
    /// Troubles of the links that were told.
    told: BTreeSet<String>,
    /// Virtual drones that are gone after this flight: nobody waits for people, and nothing is kept
    /// of them but their logs.
    pub(in crate::cli) is_virtual: bool,
    /// Virtual drones with which people practise: everything that happens is told, as in the field.
    pub(in crate::cli) tells_all: bool,
    /// The station flies the drones by streaming targets; nobody needs the show mode.
    pub(in crate::cli) is_guided: bool,
    /// The start that was authorized and written down.
    begun: Option<StartRecord>,
    /// What the drones do when this program is interrupted in flight.
    pub(in crate::cli) on_interrupt: Choice,
    /// Why messages were held back in the step that was last.
    held: BTreeMap<DroneId, String>,
    /// Drones that were seen in the air.
    flew: BTreeSet<DroneId>,
    /// Drones that have restarted there, and were not seen to fly on.
    fell: BTreeSet<DroneId>,
    /// The flight was on its way before this program looked.
    attached: bool,
}

/// Listens to all, and looks for Ctrl-C.
struct Ears<'a> {
    telemetry: &'a mut Telemetry,
    context: &'a Context,
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
        self.context.stop_flag().load(Ordering::SeqCst)
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
    pub(in crate::cli) fn new(
        context: &'a Context,
        net: &'a mut dyn Net,
        folder: &'a FlightFolder,
        plan: &'a Plan,
    ) -> Self {
        Self {
            context,
            net: Gate::new(net, plan),
            folder,
            show: plan.to_show(),
            plan,
            telemetry: Telemetry::default(),
            table: FleetTable::new([]),
            known: Known::default(),
            clock: SystemClock::start(),
            told: BTreeSet::new(),
            is_virtual: false,
            tells_all: false,
            is_guided: false,
            begun: None,
            on_interrupt: Choice::Return,
            held: BTreeMap::new(),
            flew: BTreeSet::new(),
            fell: BTreeSet::new(),
            attached: false,
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
            return Err(CommandError::Nothing(nobody(wait_s)));
        }
        Ok(())
    }

    /// Runs one conversation per drone.
    fn all<C: Conversation>(
        &mut self,
        conversations: BTreeMap<DroneId, C>,
        at_once: usize,
    ) -> Result<BTreeMap<DroneId, C::Done>, CommandError> {
        let telemetry = &mut self.telemetry;
        let (done, held) = (BTreeSet::new(), BTreeMap::new());
        let mut ears = Ears { telemetry, context: self.context, done, held };
        let done = run_all(&mut self.net, conversations, at_once, &mut ears)?;
        self.held = ears.held;
        self.context.check_stop()?;
        Ok(done)
    }

    /// The drones of the table.
    fn drones(&self) -> BTreeSet<DroneId> {
        self.table.drones.iter().map(|line| line.drone).collect()
    }

    /// Asks for clocks and versions.
    pub(in crate::cli) fn greet(&mut self) -> Result<(), CommandError> {
        let conversations =
            self.telemetry.drones.keys().map(|drone| (*drone, Greet::new(*drone))).collect();
        self.all(conversations, AT_ONCE)?;
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
        self.net.set_fleet(self.drones());
        if problems.is_empty() {
            return Ok(true);
        }
        self.context.insist(&picture(self.plan, &self.telemetry, now));
        for problem in &problems {
            self.context.warn(&problem.to_string());
        }
        Ok(false)
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
    pub(in crate::cli) fn list_logs(
        &mut self,
    ) -> Result<BTreeMap<DroneId, Result<Vec<LogOnDrone>, String>>, CommandError> {
        let conversations =
            self.drones().into_iter().map(|drone| (drone, LogList::new(drone, 20 * S))).collect();
        let listed = self.all(conversations, AT_ONCE)?;
        let words = |error: LogProtocolError| crate::cli::exit::with_reasons(&error);
        Ok(listed.into_iter().map(|(drone, list)| (drone, list.map_err(words))).collect())
    }

    /// Listens for a moment. An order to end the flight ends the command, too.
    pub(in crate::cli) fn idle(&mut self) -> Result<(), CommandError> {
        while let Some(received) = self.net.recv(self.net.now() + 20 * MS)? {
            self.telemetry.on_message(self.net.now(), &received);
        }
        self.context.check_stop()?;
        self.not_ordered_down()
    }

    /// Refuses to go on towards a start when somebody has ordered drones down.
    pub(in crate::cli) fn not_ordered_down(&self) -> Result<(), CommandError> {
        if self.net.ordered_down().is_empty() {
            return Ok(());
        }
        Err(CommandError::Unsafe(
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
    pub(in crate::cli) fn ending<T>(
        &mut self,
        ended: Result<T, CommandError>,
    ) -> Result<T, CommandError> {
        if self.context.check_stop().is_ok() {
            self.finish_orders()?;
        }
        ended
    }

    fn note(&mut self, step: &str, text: Option<String>) -> Result<(), CommandError> {
        self.note_each(step, text, &BTreeMap::new())
    }

    /// Writes down what became of each drone in a step.
    fn note_each(
        &mut self,
        step: &str,
        text: Option<String>,
        drones: &BTreeMap<DroneId, String>,
    ) -> Result<(), CommandError> {
        if self.is_virtual {
            return Ok(());
        }
        Ok(write_note(self.folder, self.clock, &Note { step, text, drones: outcomes(drones) })?)
    }

    /// The same where a disk that is full must not stand in the way: warns then.
    fn try_note(&mut self, step: &str, drones: &BTreeMap<DroneId, String>) {
        if let Err(error) = self.note_each(step, None, drones) {
            self.context.warn(&format!("not in the journal: {error}"));
        }
    }
}

/// What is said when nobody is heard.
pub(in crate::cli) fn nobody(wait_s: f64) -> String {
    format!("no drone was heard within {wait_s:.0} s: are they on, and is --connect right?")
}

fn outcomes(drones: &BTreeMap<DroneId, String>) -> Vec<NoteOf<'_>> {
    drones.iter().map(|(drone, outcome)| NoteOf { drone: *drone, outcome }).collect()
}

fn write_note(
    folder: &FlightFolder,
    clock: SystemClock,
    event: &Note<'_>,
) -> Result<(), FileError> {
    let entry = Entry { unix_us: clock.unix_us(), drone: None, event };
    Journal::open(&folder.0)?.write(&entry)
}

/// Writes into the journal what became of drones in a step.
pub(super) fn write_outcomes(
    folder: &FlightFolder,
    clock: SystemClock,
    step: &str,
    drones: &BTreeMap<DroneId, String>,
) -> Result<(), FileError> {
    write_note(folder, clock, &Note { step, text: None, drones: outcomes(drones) })
}
