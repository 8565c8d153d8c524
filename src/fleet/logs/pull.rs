//! Retrieval of many drones' logs at once.

use std::cell::RefCell;
use std::collections::{BTreeMap, VecDeque};
use std::path::Path;
use std::rc::Rc;

use super::manifest::{LogFlight, Shelf};
use super::one::{OneDone, OneOptions, PullOne};
use super::pace::Pace;
use crate::campaign::CampaignError;
use crate::fleet::budget::Budget;
use crate::fleet::load::LinkLoad;
use crate::link::clock::{MS, Micros, S};
use crate::link::conversation::{Conversation as _, Observer, Step};
use crate::link::error::NetError;
use crate::link::id::DroneId;
use crate::link::net::Net;

/// A drone that has been silent for so long holds no other drone back.
const SILENT: Micros = 5 * S;
/// The stop request is looked at so often, at least.
const LOOK: Micros = 100 * MS;

/// A drone whose logs are wanted.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Wanted {
    /// Identifier of the drone.
    pub drone: DroneId,
    /// Slot of the drone in the plan.
    pub slot: u16,
    /// Name of the slot's log file: `07.BIN`.
    pub file: String,
    /// Flight that the log must be of; `None` if no start was recorded.
    pub flight: Option<LogFlight>,
}

/// Options for pulling logs from many drones.
#[derive(Clone, Debug)]
pub struct PullOptions {
    /// Options for each drone.
    pub each: OneOptions,
    /// Largest number of drones of a network that are pulled from at once.
    pub at_once: usize,
    /// Data rate to ask of each network, bytes per second; `None`: all that it carries.
    pub bytes_per_s: Option<f64>,
    /// Program and version, for the manifest.
    pub made_by: String,
}

/// Error that keeps all logs from being pulled.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PullError {
    /// The link has failed.
    #[error(transparent)]
    Net(#[from] NetError),
    /// The folder's manifest is not valid.
    #[error(transparent)]
    Shelf(#[from] CampaignError),
}

/// Outcome of pulling a drone's logs.
#[derive(Clone, Debug)]
pub enum Outcome {
    /// The log was brought home, now, earlier, or partly; see [`OneDone::failure`].
    Done(OneDone),
    /// The run was stopped before the drone's logs were home.
    Stopped,
}

impl Outcome {
    /// Details of the outcome, if the run was not stopped before.
    pub fn done(&self) -> Option<&OneDone> {
        match self {
            Self::Done(done) => Some(done),
            Self::Stopped => None,
        }
    }
}

/// Pulls logs into the folder `logs`. Problems of one drone are in its own outcome.
///
/// # Errors
/// When the link is gone, or the folder's manifest cannot be read.
pub fn pull(
    net: &mut dyn Net,
    logs: &Path,
    wanted: &[Wanted],
    options: &PullOptions,
    observer: &mut dyn Observer,
) -> Result<BTreeMap<DroneId, Outcome>, PullError> {
    let shelf = Rc::new(RefCell::new(Shelf::open(logs, &options.made_by)?));
    let outcomes = pull_onto(&shelf, net, wanted, options, observer);
    if options.each.is_durable {
        shelf.borrow().settle();
    }
    Ok(outcomes?)
}

fn pull_onto(
    shelf: &Rc<RefCell<Shelf>>,
    net: &mut dyn Net,
    wanted: &[Wanted],
    options: &PullOptions,
    observer: &mut dyn Observer,
) -> Result<BTreeMap<DroneId, Outcome>, NetError> {
    let mut outcomes: BTreeMap<DroneId, Outcome> = BTreeMap::new();
    let mut lanes: BTreeMap<u16, Lane> = BTreeMap::new();
    for one in wanted {
        let lane = lanes.entry(one.drone.network).or_insert_with(|| Lane::new(options));
        let each = options.each.clone();
        let shelf = Rc::clone(shelf);
        let conversation =
            PullOne::new(one.drone, one.slot, &one.file, shelf, each, lane.budget.clone())
                .of_flight(one.flight.clone())
                .on_link(&lane.load);
        lane.waiting.push_back((one.drone, conversation));
        outcomes.insert(one.drone, Outcome::Stopped);
    }
    loop {
        let now = net.now();
        if observer.stop(now) {
            lanes.values().try_for_each(|lane| lane.free(net))?;
            return Ok(outcomes);
        }
        for lane in lanes.values_mut() {
            lane.start(now);
            let due: Vec<DroneId> = lane.due(now).collect();
            for drone in due {
                lane.advance(net, drone, &mut outcomes, observer)?;
            }
        }
        if lanes.values().all(Lane::is_over) {
            return Ok(outcomes);
        }
        let next = lanes.values().filter_map(Lane::wakes).min().unwrap_or(now);
        let until = next.clamp(now, now + LOOK);
        let mut wait = until;
        while let Some(received) = net.recv(wait)? {
            let now = net.now();
            observer.on_message(now, &received);
            let lane = lanes.get_mut(&received.from.network);
            if let Some(lane) = lane
                && let Some(running) = lane.running.get_mut(&received.from)
            {
                running.conversation.on_message(now, &received.message);
                lane.advance(net, received.from, &mut outcomes, observer)?;
            }
            wait = now;
            if now >= until {
                break;
            }
        }
    }
}

/// Downloads in one network, and their pace.
struct Lane {
    waiting: VecDeque<(DroneId, PullOne)>,
    running: BTreeMap<DroneId, Running>,
    pace: Pace,
    budget: Option<Budget>,
    load: LinkLoad,
    /// New bytes of drones that are done.
    bytes: u64,
}

struct Running {
    conversation: PullOne,
    wakes: Micros,
    started: Micros,
}

impl Lane {
    fn new(options: &PullOptions) -> Self {
        Self {
            waiting: VecDeque::new(),
            running: BTreeMap::new(),
            pace: Pace::new(options.at_once),
            budget: options.bytes_per_s.map(Budget::new),
            load: LinkLoad::default(),
            bytes: 0,
        }
    }

    /// Ends what drones send: nobody listens any more, and they do not arm meanwhile.
    fn free(&self, net: &mut dyn Net) -> Result<(), NetError> {
        for (drone, running) in &self.running {
            if let Some(end) = running.conversation.farewell() {
                // It has no answer.
                net.send(*drone, &end)?;
                net.send(*drone, &end)?;
            }
        }
        Ok(())
    }

    fn is_over(&self) -> bool {
        self.waiting.is_empty() && self.running.is_empty()
    }

    fn wakes(&self) -> Option<Micros> {
        self.running.values().map(|running| running.wakes).min()
    }

    fn due(&self, now: Micros) -> impl Iterator<Item = DroneId> + '_ {
        self.running.iter().filter(move |(_, one)| one.wakes <= now).map(|(drone, _)| *drone)
    }

    fn start(&mut self, now: Micros) {
        let is_busy = |one: &&Running| {
            !one.conversation.is_idle()
                && now < one.conversation.heard().unwrap_or(one.started).max(one.started) + SILENT
        };
        let mut busy = self.running.values().filter(is_busy).count();
        let bytes: u64 = self.running.values().map(|one| one.conversation.new_bytes()).sum();
        self.pace.look(now, self.bytes + bytes, busy);
        for running in self.running.values_mut() {
            running.conversation.share(busy > 1);
        }
        while busy < self.pace.at_once() {
            let Some((drone, conversation)) = self.waiting.pop_front() else { return };
            self.running.insert(drone, Running { conversation, wakes: now, started: now });
            busy += 1;
        }
    }

    fn advance(
        &mut self,
        net: &mut dyn Net,
        drone: DroneId,
        outcomes: &mut BTreeMap<DroneId, Outcome>,
        observer: &mut dyn Observer,
    ) -> Result<(), NetError> {
        let Some(running) = self.running.get_mut(&drone) else { return Ok(()) };
        loop {
            match running.conversation.poll(net.now()) {
                Step::Send(message) => net.send(drone, &message)?,
                Step::Wait(until) => {
                    running.wakes = until;
                    observer.on_progress(drone, running.conversation.progress(), false);
                    return Ok(());
                }
                Step::Done(done) => {
                    observer.on_progress(drone, running.conversation.progress(), true);
                    self.bytes += running.conversation.new_bytes();
                    outcomes.insert(drone, Outcome::Done(done));
                    self.running.remove(&drone);
                    return Ok(());
                }
            }
        }
    }
}
