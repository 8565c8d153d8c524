//! Runs one conversation per drone, many at once.
//!
//! A conversation is a [`Machine`]: no sockets, no clock, no threads, so that it runs the same
//! on a radio and on a simulated link that drops, delays and repeats.

use std::collections::{BTreeMap, VecDeque};

use super::clock::{MS, Micros};
use super::error::{NetError, Refusal};
use super::frame::MavMessage;
use super::id::DroneId;
use super::net::{Net, Received};

/// What a machine wants next.
#[derive(Debug)]
pub enum Step<T> {
    /// Send this, and ask again.
    Send(Box<MavMessage>),
    /// Nothing until then, or until a message comes.
    Wait(Micros),
    /// It is over.
    Done(T),
}

impl<T> Step<T> {
    /// To send a message.
    pub fn send(message: MavMessage) -> Self {
        Self::Send(Box::new(message))
    }
}

/// How far a conversation is, in its own units (bytes, items, steps).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Progress {
    /// Done.
    pub done: u64,
    /// Of so many; 0 when not known yet.
    pub total: u64,
}

/// A conversation with one drone.
pub trait Machine {
    /// What it ends with; a failure is a value of it.
    type Done;

    /// A message of its drone has come.
    fn on_message(&mut self, now: Micros, message: &MavMessage);

    /// What to do now. Called until it waits or is done, and again after each message and at the
    /// time it waits for.
    fn poll(&mut self, now: Micros) -> Step<Self::Done>;

    /// A message of it was refused for good, as the drone's state does not allow it: what it ends
    /// with then; `None`: it is absent from the results.
    fn refused(&mut self, refusal: &Refusal) -> Option<Self::Done> {
        let _ = refusal;
        None
    }

    /// How far it is.
    fn progress(&self) -> Progress {
        Progress::default()
    }
}

/// Sees what goes on while machines run, and may end them.
pub trait Watch {
    /// A message has come from any drone, also those without a conversation.
    fn on_message(&mut self, now: Micros, received: &Received) {
        let _ = (now, received);
    }

    /// A conversation has gone on or ended. Called often.
    fn on_progress(&mut self, drone: DroneId, progress: Progress, over: bool) {
        let _ = (drone, progress, over);
    }

    /// A message was held back.
    fn on_refused(&mut self, drone: DroneId, refusal: &Refusal) {
        let _ = (drone, refusal);
    }

    /// Whether to end now, with what is done.
    fn stop(&mut self, now: Micros) -> bool {
        let _ = now;
        false
    }
}

/// Watches nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoWatch;

impl Watch for NoWatch {}

/// The stop request is looked at so often, at least.
const LOOK: Micros = 100 * MS;

/// Runs machines, at most `at_once` per network at the same time, the others in order after
/// them. What a stopped run did not finish, and what was refused, is absent from the result.
pub fn drive<M: Machine>(
    net: &mut dyn Net,
    machines: BTreeMap<DroneId, M>,
    at_once: usize,
    watch: &mut dyn Watch,
) -> Result<BTreeMap<DroneId, M::Done>, NetError> {
    let mut waiting: BTreeMap<u16, VecDeque<(DroneId, M)>> = BTreeMap::new();
    for (drone, machine) in machines {
        waiting.entry(drone.network).or_default().push_back((drone, machine));
    }
    let mut running: BTreeMap<DroneId, (M, Micros)> = BTreeMap::new();
    let mut finished = BTreeMap::new();
    loop {
        let now = net.now();
        if watch.stop(now) {
            return Ok(finished);
        }
        for (network, queue) in &mut waiting {
            let busy = running.keys().filter(|drone| drone.network == *network).count();
            for (drone, machine) in
                queue.drain(..queue.len().min(at_once.max(1) - busy.min(at_once.max(1))))
            {
                running.insert(drone, (machine, now));
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
            ended |= advance(net, drone, &mut running, &mut finished, watch)?;
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
            watch.on_message(now, &received);
            if let Some((machine, _)) = running.get_mut(&received.from) {
                machine.on_message(now, &received.message);
                if advance(net, received.from, &mut running, &mut finished, watch)? {
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

/// Lets one machine do what it can; whether it ended.
fn advance<M: Machine>(
    net: &mut dyn Net,
    drone: DroneId,
    running: &mut BTreeMap<DroneId, (M, Micros)>,
    finished: &mut BTreeMap<DroneId, M::Done>,
    watch: &mut dyn Watch,
) -> Result<bool, NetError> {
    let Some((machine, until)) = running.get_mut(&drone) else { return Ok(false) };
    loop {
        match machine.poll(net.now()) {
            Step::Send(message) => match net.send(drone, &message) {
                Ok(()) => {}
                Err(NetError::Refused(refusal)) => {
                    watch.on_refused(drone, &refusal);
                    // What may be sent in a moment is as good as lost on the radio.
                    if refusal.for_now {
                        continue;
                    }
                    let done = machine.refused(&refusal);
                    watch.on_progress(drone, machine.progress(), true);
                    running.remove(&drone);
                    finished.extend(done.map(|done| (drone, done)));
                    return Ok(true);
                }
                Err(error) => return Err(error),
            },
            Step::Wait(time) => {
                *until = time;
                watch.on_progress(drone, machine.progress(), false);
                return Ok(false);
            }
            Step::Done(done) => {
                watch.on_progress(drone, machine.progress(), true);
                running.remove(&drone);
                finished.insert(drone, done);
                return Ok(true);
            }
        }
    }
}
