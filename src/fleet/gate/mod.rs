//! The one gate between a station and its drones: everything that is sent goes through it, and
//! each message passes, or is refused with its reason, by what it can do and by the state of the
//! drones that hear it.
//!
//! | class | disarmed | start authorized | armed, waiting | flying | not heard |
//! |---|---|---|---|---|---|
//! | harmless | passes | passes | passes | passes | passes |
//! | on the ground | passes | - | - | - | - |
//! | start (everyone) | passes | passes | passes | - | - |
//! | in flight | - | - | passes | passes | passes |
//! | emergency | passes | passes | passes | passes | passes |
//!
//! A drone whose heartbeat is missing or old counts as flying. What weakens a fence or a failsafe
//! below what the plan needs is sent to nobody unless every drone of the fleet is heard and
//! disarmed. A drone that was ordered down gets only what is harmless or ends its flight.

mod class;
mod protection;
mod state;

use std::collections::{BTreeMap, BTreeSet};

pub use self::class::{Class, class};
pub use self::protection::Protection;
use self::state::Seen;
pub use self::state::State;
use super::messages::text;
use crate::base::names::listed;
use crate::link::clock::Micros;
use crate::link::error::{NetError, Refusal};
use crate::link::frame::MavMessage;
use crate::link::id::DroneId;
use crate::link::net::{Net, Received};
use crate::link::traffic::Traffic;
use crate::mission::Plan;

/// A net that passes on only what the drones' states allow.
pub struct Gate<'a> {
    net: &'a mut dyn Net,
    protection: Protection,
    /// The drones of the flight, once they are known.
    fleet: Option<BTreeSet<DroneId>>,
    seen: BTreeMap<DroneId, Seen>,
}

/// Why a message is held back.
struct Why {
    words: String,
    for_now: bool,
}

impl<'a> Gate<'a> {
    /// Wraps a net for the flight of a plan.
    pub fn new(net: &'a mut dyn Net, plan: &Plan) -> Self {
        Self { net, protection: Protection::of(plan), fleet: None, seen: BTreeMap::new() }
    }

    /// Sets the drones of the fleet: each of them counts as flying until it is heard.
    pub fn set_fleet(&mut self, drones: BTreeSet<DroneId>) {
        self.fleet = Some(drones);
    }

    /// Parameters that protect the drones of this flight.
    pub fn protection(&self) -> &Protection {
        &self.protection
    }

    /// State of a drone, as far as orders are concerned.
    pub fn state(&self, drone: DroneId) -> State {
        self.seen.get(&drone).copied().unwrap_or_default().state(self.net.now())
    }

    /// State of a drone in words, as they follow its name.
    pub fn words(&self, drone: DroneId) -> String {
        self.seen.get(&drone).copied().unwrap_or_default().words(self.net.now())
    }

    /// Whether a drone's motors stand still, by a fresh heartbeat.
    pub fn is_disarmed(&self, drone: DroneId) -> bool {
        self.seen.get(&drone).is_some_and(|seen| seen.is_disarmed(self.net.now()))
    }

    /// Those of `drones` that are armed or may be flying, with their states in words; drones that
    /// are not heard are among them only with `unheard`.
    pub fn in_the_air(
        &self,
        drones: impl IntoIterator<Item = DroneId>,
        unheard: bool,
    ) -> BTreeMap<DroneId, String> {
        let may_fly = |drone: &DroneId| match self.state(*drone) {
            State::Ground | State::Waiting => false,
            State::Armed | State::Flying => true,
            State::Unheard => unheard,
        };
        drones.into_iter().filter(may_fly).map(|drone| (drone, self.words(drone))).collect()
    }

    /// Reason why the fleet may not be sure to stay on the ground, drone by drone; `None` if it is.
    /// Without knowing the fleet's drones it is never sure.
    pub fn not_grounded(&self) -> Option<String> {
        let Some(fleet) = &self.fleet else {
            return Some("it is not known which drones the fleet has".to_owned());
        };
        self.because(self.everyone(fleet), |state| state == State::Ground).map(|why| why.words)
    }

    /// These, and others that are heard; others that are gone hear nothing either.
    fn everyone(&self, fleet: &BTreeSet<DroneId>) -> BTreeSet<DroneId> {
        let now = self.net.now();
        let others = self.seen.iter().filter(|(_, seen)| seen.state(now) != State::Unheard);
        fleet.iter().chain(others.map(|(drone, _)| drone)).copied().collect()
    }

    /// Checks whether a message may be sent to a drone now (`None`: to all drones).
    ///
    /// # Errors
    ///
    /// The reason why it may not be sent.
    pub fn check(&self, to: Option<DroneId>, message: &MavMessage) -> Result<(), Refusal> {
        let held = |why: Why| {
            let Why { words, for_now } = why;
            Err(Refusal { to, what: text(message), why: words, for_now })
        };
        self.why_not(to, message).map_or(Ok(()), held)
    }

    fn why_not(&self, to: Option<DroneId>, message: &MavMessage) -> Option<Why> {
        let never = |words: &str| Some(Why { words: words.to_owned(), for_now: false });
        let Some(class) = class(message) else {
            return never("this program sends no such message");
        };
        if matches!(class, Class::Harmless | Class::Emergency) {
            return None;
        }
        let ordered = self.net.ordered_down();
        let is_ordered = match to {
            Some(drone) if class != Class::Start => ordered.contains_key(&drone),
            // It has no address: those who were ordered down would hear it, too.
            _ => !ordered.is_empty(),
        };
        if is_ordered {
            return never("it was ordered down");
        }
        match (class, to) {
            (Class::Start, _) => {
                let known = || self.seen.keys().copied().collect();
                let all = self.fleet.as_ref().map_or_else(known, |fleet| self.everyone(fleet));
                self.because(all, |state| {
                    matches!(state, State::Ground | State::Waiting | State::Armed)
                })
            }
            (_, None) => never("it is for one drone, not for everyone"),
            (Class::Flight, Some(drone)) => self.because([drone], |state| {
                matches!(state, State::Armed | State::Flying | State::Unheard)
            }),
            (_, Some(drone)) => {
                let own = self.because([drone], |state| state == State::Ground);
                own.or_else(|| {
                    let weakens = self.protection.is_weakened(message);
                    let words = self.not_grounded().filter(|_| weakens)?;
                    let words = format!("{words}, and no fence is weakened then");
                    Some(Why { words, for_now: false })
                })
            }
        }
    }

    /// The drones of these whose state is another; `None`: there is none.
    fn because(
        &self,
        drones: impl IntoIterator<Item = DroneId>,
        allowed: impl Fn(State) -> bool,
    ) -> Option<Why> {
        let now = self.net.now();
        let mut words: Vec<(String, Vec<DroneId>)> = Vec::new();
        let mut for_now = true;
        for drone in drones {
            let seen = self.seen.get(&drone).copied().unwrap_or_default();
            let state = seen.state(now);
            if !allowed(state) {
                let said = seen.words(now);
                match words.iter_mut().find(|(known, _)| *known == said) {
                    Some((_, drones)) => drones.push(drone),
                    None => words.push((said, vec![drone])),
                }
                // Disarmed: it was sent too soon.
                for_now &= match state {
                    State::Unheard => seen.was_heard(),
                    State::Ground | State::Waiting => true,
                    State::Armed | State::Flying => false,
                };
            }
        }
        let together = |(said, drones): &(String, Vec<DroneId>)| subject(drones, said);
        let words: Vec<String> = words.iter().map(together).collect();
        (!words.is_empty()).then(|| Why { words: words.join(", "), for_now })
    }
}

/// A sentence of which these drones are the subject; `said` follows the name of one.
fn subject(drones: &[DroneId], said: &str) -> String {
    if let [drone] = drones {
        return format!("drone {drone} {said}");
    }
    let names: Vec<String> = drones.iter().map(ToString::to_string).collect();
    let names = listed(names.iter().map(String::as_str));
    let (verb, rest) = said.split_once(' ').unwrap_or((said, ""));
    let verb = match verb {
        "is" => "are",
        "has" => "have",
        "was" => "were",
        other => other,
    };
    format!("drones {names} {verb} {rest}")
}

impl Net for Gate<'_> {
    fn now(&self) -> Micros {
        self.net.now()
    }

    fn recv(&mut self, until: Micros) -> Result<Option<Received>, NetError> {
        let received = self.net.recv(until)?;
        if let Some(received) = &received {
            let now = self.net.now();
            self.seen.entry(received.from).or_default().on_message(now, &received.message);
        }
        Ok(received)
    }

    fn send(&mut self, to: DroneId, message: &MavMessage) -> Result<(), NetError> {
        self.check(Some(to), message).map_err(NetError::Refused)?;
        self.net.send(to, message)
    }

    fn broadcast(&mut self, message: &MavMessage) -> Result<(), NetError> {
        self.check(None, message).map_err(NetError::Refused)?;
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
        self.net.ordered_down()
    }
}
