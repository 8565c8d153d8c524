//! A net on which orders of other processes are carried out, whatever the station is doing.

use std::collections::{BTreeMap, BTreeSet};

use super::abort::{Abort, Aborted, Action};
use super::orders::{ANSWER_SCHEMA, Answer, Inbox, OrderFrom, Taken};
use super::telemetry::Telemetry;
use crate::link::clock::{MS, Micros, S};
use crate::link::conversation::{Conversation as _, Observer as _, Step};
use crate::link::error::NetError;
use crate::link::frame::MavMessage;
use crate::link::id::DroneId;
use crate::link::net::{Net, Received};
use crate::link::traffic::Traffic;

/// Orders are looked for so often.
const LOOK: Micros = 500 * MS;
/// A station that flies has heard its drones long ago: the others are not waited for.
const HEARD_WITHIN: Micros = 4 * S;

/// News of orders, for the people at the station.
#[derive(Clone, Debug, PartialEq)]
pub enum Notice {
    /// An order has arrived.
    Ordered {
        /// Action that was ordered.
        action: Action,
        /// Drones that are to carry it out.
        drones: Vec<DroneId>,
        /// Where it was given.
        from: OrderFrom,
    },
    /// The order has ended for a drone.
    Done {
        /// Action that was ordered.
        action: Action,
        /// Drone that carried it out, or did not.
        drone: DroneId,
        /// Outcome of the action.
        done: Aborted,
    },
    /// The answer to the order could not be written; the order is carried out all the same.
    NoAnswer {
        /// Reason why the answer could not be written.
        reason: String,
    },
}

struct Open {
    taken: Taken,
    answer: Answer,
}

/// A net that sends drones home or lands them when another process orders it, beside all other
/// traffic through it. The [gate](super::gate) before it asks which drones were ordered down, and
/// holds back whatever would make such a drone fly again.
pub struct OrderHandler<'a> {
    net: &'a mut dyn Net,
    inbox: Option<Inbox>,
    tell: Box<dyn FnMut(&Notice) + 'a>,
    /// The drones of the flight, as far as they are known: an order to everyone is for them, too,
    /// heard or not.
    fleet: Box<dyn Fn() -> BTreeSet<DroneId> + 'a>,
    telemetry: Telemetry,
    next_look: Micros,
    open: Vec<Open>,
    running: BTreeMap<DroneId, (Abort, Action, Micros)>,
    ordered: BTreeSet<DroneId>,
}

impl<'a> OrderHandler<'a> {
    /// Wraps a net. `inbox` is where orders come from, if any can.
    pub fn new(net: &'a mut dyn Net, inbox: Option<Inbox>, tell: impl FnMut(&Notice) + 'a) -> Self {
        Self {
            net,
            inbox,
            tell: Box::new(tell),
            fleet: Box::new(BTreeSet::new),
            telemetry: Telemetry::default(),
            next_look: 0,
            open: Vec::new(),
            running: BTreeMap::new(),
            ordered: BTreeSet::new(),
        }
    }

    /// Adds the drones of a flight, as they are known when an order comes: those that are not heard
    /// are named in the answer, too.
    #[must_use]
    pub fn with_fleet(mut self, fleet: impl Fn() -> BTreeSet<DroneId> + 'a) -> Self {
        self.fleet = Box::new(fleet);
        self
    }

    fn look(&mut self, now: Micros) {
        if now < self.next_look {
            return;
        }
        self.next_look = now + LOOK;
        let orders = self.inbox.as_mut().map(Inbox::take).unwrap_or_default();
        for taken in orders {
            let (action, from) = (taken.order.action, taken.order.from);
            let drones: BTreeSet<DroneId> = match &taken.order.drones {
                Some(drones) => drones.iter().copied().collect(),
                None => self.net.heard().into_iter().chain((self.fleet)()).collect(),
            };
            let drones: Vec<DroneId> = drones.into_iter().collect();
            (self.tell)(&Notice::Ordered { action, drones: drones.clone(), from });
            for drone in &drones {
                let abort = Abort::new(*drone, action, self.telemetry.get(*drone));
                self.running.insert(*drone, (abort.heard_within(HEARD_WITHIN), action, 0));
                self.ordered.insert(*drone);
            }
            let drones = drones.into_iter().map(|drone| (drone, None)).collect();
            let answer = Answer { schema: ANSWER_SCHEMA.to_owned(), beat: 0, drones };
            self.open.push(Open { taken, answer });
        }
        self.answer();
    }

    /// Writes down how far the orders are.
    fn answer(&mut self) {
        for open in &mut self.open {
            open.answer.beat += 1;
            if let Err(error) = open.taken.answer(&open.answer) {
                (self.tell)(&Notice::NoAnswer { reason: error.to_string() });
            }
        }
        self.open.retain(|open| !open.answer.is_over());
    }

    /// Lets the ends of flights go on.
    fn advance(&mut self, now: Micros) {
        let mut ended = Vec::new();
        for (drone, (abort, action, next)) in &mut self.running {
            if now < *next {
                continue;
            }
            loop {
                match abort.poll(now) {
                    // It is repeated: what cannot be sent now may be sent in a moment.
                    Step::Send(message) => drop(self.net.send(*drone, &message)),
                    Step::Wait(until) => {
                        *next = until;
                        break;
                    }
                    Step::Done(done) => {
                        ended.push((*drone, *action, done));
                        break;
                    }
                }
            }
        }
        if ended.is_empty() {
            return;
        }
        for (drone, action, done) in ended {
            self.running.remove(&drone);
            (self.tell)(&Notice::Done { action, drone, done });
            for open in &mut self.open {
                for (of, answer) in &mut open.answer.drones {
                    if *of == drone {
                        answer.get_or_insert(done);
                    }
                }
            }
        }
        // At once: a station that has nothing more to do ends, and is not asked for messages again.
        self.answer();
    }

    fn hear(&mut self, received: &Received) {
        let now = self.net.now();
        self.telemetry.on_message(now, received);
        if let Some((abort, _, next)) = self.running.get_mut(&received.from) {
            abort.on_message(now, &received.message);
            *next = now;
        }
    }
}

impl Drop for OrderHandler<'_> {
    /// Who waits for an answer is told what was not confirmed when the station ended.
    fn drop(&mut self) {
        for open in &mut self.open {
            for (drone, answer) in &mut open.answer.drones {
                let told = self.running.get(drone).map_or(0, |(abort, ..)| abort.told());
                answer.get_or_insert(Aborted::Unconfirmed { told });
            }
        }
        self.answer();
    }
}

impl Net for OrderHandler<'_> {
    fn now(&self) -> Micros {
        self.net.now()
    }

    fn recv(&mut self, until: Micros) -> Result<Option<Received>, NetError> {
        loop {
            let now = self.net.now();
            self.look(now);
            self.advance(now);
            let due = self.running.values().map(|(_, _, next)| *next).min();
            let next = until.min(self.next_look).min(due.unwrap_or(until));
            if let Some(received) = self.net.recv(next)? {
                self.hear(&received);
                return Ok(Some(received));
            }
            if self.net.now() >= until {
                return Ok(None);
            }
        }
    }

    fn send(&mut self, to: DroneId, message: &MavMessage) -> Result<(), NetError> {
        self.net.send(to, message)
    }

    fn broadcast(&mut self, message: &MavMessage) -> Result<(), NetError> {
        self.net.broadcast(message)
    }

    fn heard(&self) -> Vec<DroneId> {
        self.net.heard()
    }

    fn traffic(&self) -> BTreeMap<u16, Traffic> {
        self.net.traffic()
    }

    fn doubled(&self) -> BTreeSet<DroneId> {
        self.net.doubled()
    }

    fn ordered_down(&self) -> BTreeMap<DroneId, bool> {
        self.ordered.iter().map(|drone| (*drone, self.running.contains_key(drone))).collect()
    }
}
