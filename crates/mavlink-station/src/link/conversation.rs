//! Sans-IO conversations with drones, and [`run_all`], which runs many at once.
//!
//! A [`Conversation`] has no socket, clock or thread, so that it runs the same on a radio and on a
//! simulated link that drops, delays and repeats.

use std::collections::{BTreeMap, VecDeque};

use super::clock::{MS, Micros};
use super::error::{NetError, Refusal};
use super::frame::MavMessage;
use super::id::DroneId;
use super::net::{Net, Received};

/// Next action of a conversation.
#[derive(Debug)]
pub enum Step<T> {
    /// Send this message, and poll again.
    Send(Box<MavMessage>),
    /// Wait until this time, us, or until a message comes.
    Wait(Micros),
    /// The conversation has ended with this result.
    Done(T),
}

impl<T> Step<T> {
    /// The action of sending a message.
    pub fn send(message: MavMessage) -> Self {
        Self::Send(Box::new(message))
    }
}

/// Progress of a conversation, in its own units (bytes, items, steps).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Progress {
    /// Units that are done.
    pub done: u64,
    /// Units in total; 0 if not known yet.
    pub total: u64,
}

/// A sans-IO conversation with one drone.
///
/// ```
/// use std::collections::BTreeMap;
///
/// use mavlink_station::link::frame::MavMessage;
/// use mavlink_station::simulated::{files::FileVehicle, lossy, storage::MemoryStorage};
/// use mavlink_station::{Conversation, DroneId, Micros, NoObserver, S, Step, run_all};
///
/// /// Waits for the heartbeat of a vehicle, for 5 s.
/// #[derive(Default)]
/// struct Await(bool);
///
/// impl Conversation for Await {
///     type Done = bool;
///
///     fn on_message(&mut self, _now: Micros, message: &MavMessage) {
///         self.0 |= matches!(message, MavMessage::HEARTBEAT(_));
///     }
///
///     fn poll(&mut self, now: Micros) -> Step<bool> {
///         if self.0 || now >= 5 * S { Step::Done(self.0) } else { Step::Wait(5 * S) }
///     }
/// }
///
/// let [here, gone] = [1, 2].map(|system| DroneId { network: 0, system });
/// let vehicle = FileVehicle::new(MemoryStorage::default(), "/APM/LOGS", 0.0);
/// let vehicles = BTreeMap::from([(here, vehicle)]);
/// let mut net = lossy::LossyNet::new(vehicles, lossy::Faults::default(), 1);
/// let all = BTreeMap::from([here, gone].map(|drone| (drone, Await::default())));
/// let heard = run_all(&mut net, all, 10, &mut NoObserver)?;
/// assert_eq!(heard, BTreeMap::from([(here, true), (gone, false)]));
/// # Ok::<(), mavlink_station::link::error::NetError>(())
/// ```
pub trait Conversation {
    /// Result of the conversation; a failure is one of its values.
    type Done;

    /// Takes a message of the drone.
    fn on_message(&mut self, now: Micros, message: &MavMessage);

    /// Next action at time `now`. Called until the conversation waits or has ended, and again after
    /// each message and at the time it waits for.
    fn poll(&mut self, now: Micros) -> Step<Self::Done>;

    /// Takes notice that one of its messages was refused for good, because the drone's state does
    /// not allow it; returns the result with which the conversation ends, or `None` to be absent
    /// from the results.
    fn refused(&mut self, refusal: &Refusal) -> Option<Self::Done> {
        let _ = refusal;
        None
    }

    /// Present progress of the conversation.
    fn progress(&self) -> Progress {
        Progress::default()
    }
}

/// Observer of running conversations, which may end them.
pub trait Observer {
    /// Called for a message from any drone, including those without a conversation.
    fn on_message(&mut self, now: Micros, received: &Received) {
        let _ = (now, received);
    }

    /// Called, often, when a conversation has progressed or ended.
    fn on_progress(&mut self, drone: DroneId, progress: Progress, over: bool) {
        let _ = (drone, progress, over);
    }

    /// Called when a message was held back.
    fn on_refused(&mut self, drone: DroneId, refusal: &Refusal) {
        let _ = (drone, refusal);
    }

    /// Whether to end the run now, with the results so far.
    fn stop(&mut self, now: Micros) -> bool {
        let _ = now;
        false
    }
}

/// An observer that does nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoObserver;

impl Observer for NoObserver {}

/// The stop request is looked at so often, at least.
const LOOK: Micros = 100 * MS;

/// Runs conversations, at most `at_once` per network at the same time, and the rest in order after
/// them. Those that a stopped run did not finish, and those that were refused, are absent from the
/// result.
///
/// # Errors
///
/// If the net fails; results so far are lost then.
pub fn run_all<C: Conversation>(
    net: &mut dyn Net,
    conversations: BTreeMap<DroneId, C>,
    at_once: usize,
    observer: &mut dyn Observer,
) -> Result<BTreeMap<DroneId, C::Done>, NetError> {
    let mut waiting: BTreeMap<u16, VecDeque<(DroneId, C)>> = BTreeMap::new();
    for (drone, conversation) in conversations {
        waiting.entry(drone.network).or_default().push_back((drone, conversation));
    }
    let mut running: BTreeMap<DroneId, (C, Micros)> = BTreeMap::new();
    let mut finished = BTreeMap::new();
    loop {
        let now = net.now();
        if observer.stop(now) {
            return Ok(finished);
        }
        for (network, queue) in &mut waiting {
            let busy = running.keys().filter(|drone| drone.network == *network).count();
            for (drone, conversation) in
                queue.drain(..queue.len().min(at_once.max(1) - busy.min(at_once.max(1))))
            {
                running.insert(drone, (conversation, now));
            }
        }
        if running.is_empty() {
            return Ok(finished);
        }
        let due: Vec<DroneId> = running
            .iter()
            .filter(|(_, (_, until))| *until <= now)
            .map(|(drone, _)| *drone)
            .collect();
        let mut ended = false;
        for drone in due {
            ended |= advance(net, drone, &mut running, &mut finished, observer)?;
        }
        if ended {
            continue;
        }
        let next = running.values().map(|(_, until)| *until).min().unwrap_or(now);
        let until = next.min(now + LOOK);
        // Everything that is there is taken before time is looked at again.
        let mut wait = until;
        while let Some(received) = net.recv(wait)? {
            let now = net.now();
            observer.on_message(now, &received);
            if let Some((conversation, _)) = running.get_mut(&received.from) {
                conversation.on_message(now, &received.message);
                if advance(net, received.from, &mut running, &mut finished, observer)? {
                    break;
                }
            }
            wait = now;
            if now >= until {
                break;
            }
        }
    }
}

/// Lets one conversation do what it can; whether it ended.
fn advance<C: Conversation>(
    net: &mut dyn Net,
    drone: DroneId,
    running: &mut BTreeMap<DroneId, (C, Micros)>,
    finished: &mut BTreeMap<DroneId, C::Done>,
    observer: &mut dyn Observer,
) -> Result<bool, NetError> {
    let Some((conversation, until)) = running.get_mut(&drone) else { return Ok(false) };
    loop {
        match conversation.poll(net.now()) {
            Step::Send(message) => match net.send(drone, &message) {
                Ok(()) => {}
                Err(NetError::Refused(refusal)) => {
                    observer.on_refused(drone, &refusal);
                    // What may be sent in a moment is as good as lost on the radio.
                    if refusal.for_now {
                        continue;
                    }
                    let done = conversation.refused(&refusal);
                    observer.on_progress(drone, conversation.progress(), true);
                    running.remove(&drone);
                    finished.extend(done.map(|done| (drone, done)));
                    return Ok(true);
                }
                Err(error) => return Err(error),
            },
            Step::Wait(time) => {
                *until = time;
                observer.on_progress(drone, conversation.progress(), false);
                return Ok(false);
            }
            Step::Done(done) => {
                observer.on_progress(drone, conversation.progress(), true);
                running.remove(&drone);
                finished.insert(drone, done);
                return Ok(true);
            }
        }
    }
}
