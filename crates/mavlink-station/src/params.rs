//! Conversations about parameters: read some, read all, set with read-back.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use super::command::Patience;
use super::messages::{chars, param_list, param_read, param_read_index, param_set};
use crate::link::clock::{Micros, S};
use crate::link::conversation::{Conversation, Progress, Step};
use crate::link::error::Refusal;
use crate::link::frame::MavMessage;
use crate::link::id::DroneId;

/// Requests on their way at once.
const AT_ONCE: usize = 6;
/// ArduPilot has about 1,350 parameters; more than this is no answer of it.
const MOST: u16 = 8_192;

/// Whether two values of a parameter are equal, as far as a 32-bit float can tell.
pub fn same(value: f32, wanted: f32) -> bool {
    value == wanted || (value - wanted).abs() <= wanted.abs() * 1e-6
}

#[derive(Clone, Copy, Debug, Default)]
struct Open {
    next: Micros,
    tries: u32,
    /// For sets: the vehicle has echoed the value, and is asked for it once more.
    echoed: bool,
}

/// Conversation that reads parameters by name. Its result has those that answered: the firmware
/// does not answer for names it does not have, so that an absent name is either missing or unheard.
#[derive(Clone, Debug)]
pub struct ReadParams {
    drone: DroneId,
    patience: Patience,
    waiting: VecDeque<String>,
    open: BTreeMap<String, Open>,
    total: u64,
    values: BTreeMap<String, f32>,
}

impl ReadParams {
    /// Reads the parameters of these names.
    pub fn new(drone: DroneId, names: impl IntoIterator<Item = String>) -> Self {
        let waiting: VecDeque<String> = names.into_iter().collect();
        let total = waiting.len() as u64;
        let (open, values) = (BTreeMap::new(), BTreeMap::new());
        Self { drone, patience: Patience::default(), waiting, open, total, values }
    }

    /// Sets how often and for how long a request is repeated.
    #[must_use]
    pub fn with_patience(self, patience: Patience) -> Self {
        Self { patience, ..self }
    }
}

impl Conversation for ReadParams {
    type Done = BTreeMap<String, f32>;

    fn on_message(&mut self, _now: Micros, message: &MavMessage) {
        let MavMessage::PARAM_VALUE(value) = message else { return };
        let name = chars(&value.param_id[..]);
        if self.open.remove(&name).is_some() {
            self.values.insert(name, value.param_value);
        }
    }

    fn poll(&mut self, now: Micros) -> Step<Self::Done> {
        while self.open.len() < AT_ONCE {
            let Some(name) = self.waiting.pop_front() else { break };
            self.open.insert(name, Open::default());
        }
        let (patience, drone) = (self.patience, self.drone);
        self.open.retain(|_, open| open.tries < patience.tries || now < open.next);
        for (name, open) in &mut self.open {
            if now >= open.next {
                open.tries += 1;
                open.next = now + patience.every;
                return Step::send(param_read(drone, name));
            }
        }
        if self.open.is_empty() && self.waiting.is_empty() {
            return Step::Done(std::mem::take(&mut self.values));
        }
        Step::Wait(self.open.values().map(|open| open.next).min().unwrap_or(now))
    }

    fn progress(&self) -> Progress {
        Progress { done: self.values.len() as u64, total: self.total }
    }
}

/// Error of setting a parameter.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SetError {
    /// The vehicle does not answer, or does not have the parameter.
    #[error(
        "no answer when {name} is set to {wanted}: the firmware has no such parameter, or the \
         radio does not reach the drone"
    )]
    Silent {
        /// Name of the parameter.
        name: String,
        /// Value that was to be set.
        wanted: f32,
    },
    /// The vehicle keeps another value.
    #[error("{name} is {is} after it was set to {wanted}: the drone does not take the value")]
    NotTaken {
        /// Name of the parameter.
        name: String,
        /// Value that was to be set.
        wanted: f32,
        /// Value that the vehicle keeps.
        is: f32,
    },
    /// The value was not sent, because the vehicle must not be touched.
    #[error("{name} was not set to {wanted}: {why}")]
    Refused {
        /// Name of the parameter.
        name: String,
        /// Value that was to be set.
        wanted: f32,
        /// Reason why it was not sent, as a clause.
        why: String,
    },
}

/// Conversation that sets parameters one after another, each read back before the next; it ends at
/// the first that fails.
#[derive(Clone, Debug)]
pub struct SetParams {
    drone: DroneId,
    patience: Patience,
    values: VecDeque<(String, f32)>,
    open: Open,
    last: Option<f32>,
    total: u64,
}

impl SetParams {
    /// Sets these parameters, in this order.
    pub fn new(drone: DroneId, values: impl IntoIterator<Item = (String, f32)>) -> Self {
        let values: VecDeque<_> = values.into_iter().collect();
        let total = values.len() as u64;
        let patience = Patience::default();
        Self { drone, patience, values, open: Open::default(), last: None, total }
    }

    /// Sets how often and for how long a value is sent.
    #[must_use]
    pub fn with_patience(self, patience: Patience) -> Self {
        Self { patience, ..self }
    }

    /// Whether the next value was sent, so that the vehicle may have taken it.
    pub fn was_sent(&self) -> bool {
        self.open.tries > 2
    }
}

impl Conversation for SetParams {
    type Done = Result<(), SetError>;

    fn on_message(&mut self, now: Micros, message: &MavMessage) {
        let MavMessage::PARAM_VALUE(value) = message else { return };
        let Some((name, wanted)) = self.values.front() else { return };
        if self.open.tries == 0 || chars(&value.param_id[..]) != *name {
            return;
        }
        self.last = Some(value.param_value);
        if !same(value.param_value, *wanted) {
            // Sent before the vehicle heard of it, or not taken: set again, in its time.
            self.open.echoed = false;
        } else if self.open.echoed {
            self.values.pop_front();
            self.open = Open::default();
            self.last = None;
        } else {
            self.open.echoed = true;
            self.open.next = now;
        }
    }

    fn poll(&mut self, now: Micros) -> Step<Self::Done> {
        let Some((name, wanted)) = self.values.front() else { return Step::Done(Ok(())) };
        if now < self.open.next {
            return Step::Wait(self.open.next);
        }
        // An echo is followed by one question that is not a try of its own.
        if self.open.tries >= 2 * self.patience.tries {
            let (name, wanted) = (name.clone(), *wanted);
            return Step::Done(Err(match self.last {
                Some(is) if !same(is, wanted) => SetError::NotTaken { name, wanted, is },
                _ => SetError::Silent { name, wanted },
            }));
        }
        self.open.tries += if self.open.echoed { 1 } else { 2 };
        self.open.next = now + self.patience.every;
        Step::send(if self.open.echoed {
            param_read(self.drone, name)
        } else {
            param_set(self.drone, name, *wanted)
        })
    }

    fn refused(&mut self, refusal: &Refusal) -> Option<Self::Done> {
        let (name, wanted) = self.values.front().cloned()?;
        Some(Err(SetError::Refused { name, wanted, why: refusal.why.clone() }))
    }

    fn progress(&self) -> Progress {
        Progress { done: self.total - self.values.len() as u64, total: self.total }
    }
}

/// Error of reading all parameters: the list is incomplete.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "only {got} of {total} parameters arrived: bring the drone nearer to the radio and try \
         again"
)]
pub struct ListError {
    /// Number of parameters that came.
    pub got: usize,
    /// Number of parameters that the vehicle has; 0 if none came at all.
    pub total: u16,
}

/// Conversation that reads all parameters: the stream first, then those it lost, one by one.
#[derive(Clone, Debug)]
pub struct ListParams {
    drone: DroneId,
    patience: Patience,
    total: u16,
    indices: BTreeSet<u16>,
    values: BTreeMap<String, f32>,
    open: BTreeMap<u16, Open>,
    list: Open,
}

/// The stream counts as ended when nothing has come for so long.
const STREAM_GAP: Micros = 2 * S;

impl ListParams {
    /// Reads all parameters of a vehicle.
    pub fn new(drone: DroneId) -> Self {
        Self {
            drone,
            patience: Patience::default(),
            total: 0,
            indices: BTreeSet::new(),
            values: BTreeMap::new(),
            open: BTreeMap::new(),
            list: Open::default(),
        }
    }
}

impl Conversation for ListParams {
    type Done = Result<BTreeMap<String, f32>, ListError>;

    fn on_message(&mut self, now: Micros, message: &MavMessage) {
        let MavMessage::PARAM_VALUE(value) = message else { return };
        // The answer to a request by name has no number.
        if value.param_index == u16::MAX || value.param_count > MOST {
            return;
        }
        self.total = value.param_count;
        if value.param_index < self.total {
            self.indices.insert(value.param_index);
            self.open.remove(&value.param_index);
            self.values.insert(chars(&value.param_id[..]), value.param_value);
            self.list.next = now + STREAM_GAP;
        }
    }

    fn poll(&mut self, now: Micros) -> Step<Self::Done> {
        let whole = self.total > 0 && self.indices.len() == usize::from(self.total);
        if whole {
            return Step::Done(Ok(std::mem::take(&mut self.values)));
        }
        let failed = ListError { got: self.indices.len(), total: self.total };
        if self.total == 0 {
            if now < self.list.next {
                return Step::Wait(self.list.next);
            }
            if self.list.tries >= self.patience.tries {
                return Step::Done(Err(failed));
            }
            self.list.tries += 1;
            self.list.next = now + STREAM_GAP;
            return Step::send(param_list(self.drone));
        }
        if now < self.list.next && self.open.is_empty() {
            return Step::Wait(self.list.next);
        }
        for index in 0..self.total {
            if self.open.len() >= AT_ONCE {
                break;
            }
            if !self.indices.contains(&index) {
                self.open.entry(index).or_default();
            }
        }
        for (index, open) in &mut self.open {
            if now >= open.next {
                if open.tries >= self.patience.tries {
                    return Step::Done(Err(failed));
                }
                open.tries += 1;
                open.next = now + self.patience.every;
                return Step::send(param_read_index(self.drone, *index));
            }
        }
        Step::Wait(self.open.values().map(|open| open.next).min().unwrap_or(now))
    }

    fn progress(&self) -> Progress {
        Progress { done: self.indices.len() as u64, total: self.total.into() }
    }
}
