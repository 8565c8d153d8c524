//! Parameters that must hold for a flight that is to be analysed and survived, and why.
//!
//! They are read and compared; they are changed only when that is allowed, what was changed is
//! written down with its old value, and can be put back.

use std::collections::{BTreeMap, VecDeque};

use super::changes::Change;
use super::command::Patience;
use super::params::{ReadParams, SetError, SetParams, same};
use crate::link::clock::Micros;
use crate::link::conversation::{Conversation, Progress, Step};
use crate::link::error::Refusal;
use crate::link::frame::MavMessage;
use crate::link::id::DroneId;
use crate::link::station::STATION;
use crate::mission::Plan;

/// Condition on the value of a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Wanted {
    /// Exactly this value.
    Is(f32),
    /// At least this value.
    AtLeast(f32),
    /// At most this value.
    AtMost(f32),
    /// A bit mask in which these bits are set, whatever the rest.
    HasBits(u32),
    /// A bit mask in which these bits are clear, whatever the rest.
    LacksBits(u32),
}

impl Wanted {
    /// Whether a value meets the condition.
    pub fn holds(self, value: f32) -> bool {
        match self {
            Self::Is(wanted) => same(value, wanted),
            Self::AtLeast(least) => value >= least,
            Self::AtMost(most) => value <= most,
            Self::HasBits(bits) => value as u32 & bits == bits,
            Self::LacksBits(bits) => value as u32 & bits == 0,
        }
    }

    /// Nearest value that meets the condition.
    pub fn mend(self, value: f32) -> f32 {
        match self {
            Self::Is(wanted) => wanted,
            Self::AtLeast(least) => value.max(least),
            Self::AtMost(most) => value.min(most),
            Self::HasBits(bits) => (value as u32 | bits) as f32,
            Self::LacksBits(bits) => (value as u32 & !bits) as f32,
        }
    }
}

impl std::fmt::Display for Wanted {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Is(value) => write!(f, "be {value}"),
            Self::AtLeast(value) => write!(f, "be {value} or more"),
            Self::AtMost(value) => write!(f, "be {value} or less"),
            Self::HasBits(bits) => write!(f, "have all bits of {bits}"),
            Self::LacksBits(bits) => write!(f, "have no bit of {bits}"),
        }
    }
}

/// A parameter that must hold.
#[derive(Clone, Debug, PartialEq)]
pub struct Requirement {
    /// Name of the parameter.
    pub name: &'static str,
    /// Condition on its value.
    pub wanted: Wanted,
    /// Reason, as the end of the sentence "LOG_FILE_DSRMROT must be 1: every flight ...".
    pub why: &'static str,
}

/// LOG_BITMASK: attitude, GPS, control tuning, navigation tuning, battery, rotor outputs, motors.
const LOG_BITS: u32 = 1 << 1 | 1 << 2 | 1 << 4 | 1 << 5 | 1 << 9 | 1 << 10 | 1 << 17;
/// A return climbs to at most so much below the top of the fence, m.
const FENCE_GAP_M: f64 = 5.0;

/// Parameters that a plan requires of a vehicle, without those of the fence, which
/// [`super::fence::Fence::params`] gives.
pub fn requirements(plan: &Plan, show_firmware: bool) -> Vec<Requirement> {
    let require = |name, wanted, why| Requirement { name, wanted, why };
    let mut all = vec![
        require("LOG_FILE_DSRMROT", Wanted::Is(1.0), "every flight gets a log of its own"),
        require("LOG_BACKEND_TYPE", Wanted::HasBits(1), "the log is written to the SD card"),
        require(
            "LOG_BITMASK",
            Wanted::HasBits(LOG_BITS),
            "the analysis needs rotor outputs, attitude, position and battery in the log",
        ),
        require("FENCE_ENABLE", Wanted::Is(1.0), "no show is flown without a fence"),
        require("FS_CRASH_CHECK", Wanted::Is(1.0), "motors stop after a crash"),
        require(
            "FS_EKF_ACTION",
            Wanted::AtLeast(1.0),
            "a drone that does not know where it is must land",
        ),
        require(
            "BATT_FS_LOW_ACT",
            Wanted::AtLeast(1.0),
            "a drone with an empty battery must come down on its own",
        ),
        require(
            "RTL_ALT",
            Wanted::AtMost(((plan.fence.max_altitude_m - FENCE_GAP_M) * 100.0) as f32),
            "a return must stay below the top of the fence (cm)",
        ),
        require("RTL_ALT_FINAL", Wanted::Is(0.0), "a return ends on the ground"),
        require("ARMING_CHECK", Wanted::AtLeast(1.0), "no drone starts unchecked"),
    ];
    if show_firmware {
        all.extend([
            require("SHOW_CTRL_RATE", Wanted::AtLeast(10.0), "the trajectory is followed at 10 Hz"),
            require("SHOW_CTRL_MODE", Wanted::HasBits(1), "velocity feed-forward is on"),
            require("SHOW_VEL_FF_GAIN", Wanted::Is(1.0), "commanded speeds are flown in full"),
            require("SHOW_SYNC_MODE", Wanted::Is(1.0), "all drones start by GPS time"),
            require(
                "SHOW_TAKEOFF_ERR",
                Wanted::AtMost(3.0),
                "a drone on a wrong place must not take off",
            ),
        ]);
    } else {
        all.extend([
            require(
                "GUID_TIMEOUT",
                Wanted::AtMost(3.0),
                "a drone that hears no targets any more must stop",
            ),
            require(
                "FS_GCS_ENABLE",
                Wanted::AtLeast(1.0),
                "a drone that is flown by the station must return when it loses it",
            ),
            require(
                "SYSID_MYGCS",
                Wanted::Is(STATION.system as f32),
                "a drone misses only the station that this names, and this program is 254",
            ),
        ]);
    }
    all
}

/// A parameter that does not meet its requirement.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// Requirement that is not met.
    pub requirement: Requirement,
    /// Present value; `None` if the drone did not report it.
    pub is: Option<f32>,
}

impl std::fmt::Display for Difference {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Requirement { name, wanted, why } = &self.requirement;
        match self.is {
            Some(is) => write!(f, "{name} is {is}, it must {wanted}: {why}"),
            None => write!(
                f,
                "{name} cannot be read (it must {wanted}): the firmware has no such \
                 parameter, or the radio does not reach the drone"
            ),
        }
    }
}

impl Difference {
    /// Present value and condition in words, without the reason: an item of a list.
    pub fn brief(&self) -> String {
        let Requirement { name, wanted, .. } = &self.requirement;
        match self.is {
            Some(is) => format!("{name} is {is}, it must {wanted}"),
            None => format!("{name} cannot be read, it must {wanted}"),
        }
    }
}

/// State of a vehicle's parameters against the requirements.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Standing {
    /// Requirements that are still not met.
    pub wrong: Vec<Difference>,
    /// Changes that were made, also when something went wrong afterwards.
    pub changed: Vec<Change>,
    /// Reason why a change failed, if one did.
    pub failed: Option<SetError>,
    /// Values that were read, by name.
    pub values: BTreeMap<String, f32>,
}

impl Standing {
    /// Sentence about the parameters that could not be corrected.
    pub fn complaint(&self) -> String {
        let failed = self.failed.iter().map(ToString::to_string);
        let wrong: Vec<String> = failed.chain(self.wrong.iter().map(ToString::to_string)).collect();
        format!("not all parameters could be set: {}", wrong.join("; "))
    }

    /// Whether all requirements are met.
    pub fn is_right(&self) -> bool {
        self.wrong.is_empty() && self.failed.is_none()
    }
}

#[derive(Clone, Debug)]
enum Phase {
    Read(ReadParams),
    Set(VecDeque<(Difference, f32)>, Option<SetParams>),
    Over,
}

/// Reads what is required and, if allowed, mends it.
#[derive(Clone, Debug)]
pub struct CheckParams {
    drone: DroneId,
    requirements: Vec<Requirement>,
    may_change: bool,
    patience: Patience,
    phase: Phase,
    standing: Standing,
}

impl CheckParams {
    /// Checks these requirements; with `may_change` corrects the parameters that do not meet them.
    pub fn new(drone: DroneId, requirements: Vec<Requirement>, may_change: bool) -> Self {
        let patience = Patience { tries: 8, ..Patience::default() };
        let names = requirements.iter().map(|requirement| requirement.name.to_owned());
        let read = ReadParams::new(drone, names).with_patience(patience);
        let (phase, standing) = (Phase::Read(read), Standing::default());
        Self { drone, requirements, may_change, patience, phase, standing }
    }

    fn compare(&mut self, values: BTreeMap<String, f32>) {
        let mut to_mend = VecDeque::new();
        for requirement in &self.requirements {
            let is = values.get(requirement.name).copied();
            if is.is_some_and(|is| requirement.wanted.holds(is)) {
                continue;
            }
            let difference = Difference { requirement: requirement.clone(), is };
            match is {
                Some(is) if self.may_change => {
                    to_mend.push_back((difference, requirement.wanted.mend(is)));
                }
                _ => self.standing.wrong.push(difference),
            }
        }
        self.standing.values = values;
        self.phase = Phase::Set(to_mend, None);
    }
}

impl Conversation for CheckParams {
    type Done = Standing;

    fn on_message(&mut self, now: Micros, message: &MavMessage) {
        match &mut self.phase {
            Phase::Read(read) => read.on_message(now, message),
            Phase::Set(_, Some(set)) => set.on_message(now, message),
            Phase::Set(_, None) | Phase::Over => {}
        }
    }

    fn poll(&mut self, now: Micros) -> Step<Standing> {
        loop {
            match &mut self.phase {
                Phase::Read(read) => match read.poll(now) {
                    Step::Send(message) => return Step::Send(message),
                    Step::Wait(until) => return Step::Wait(until),
                    Step::Done(values) => self.compare(values),
                },
                Phase::Set(to_mend, set) => {
                    let Some((difference, value)) = to_mend.front() else {
                        self.phase = Phase::Over;
                        continue;
                    };
                    let name = difference.requirement.name;
                    let patience = self.patience;
                    let set = set.get_or_insert_with(|| {
                        SetParams::new(self.drone, [(name.to_owned(), *value)])
                            .with_patience(patience)
                    });
                    match set.poll(now) {
                        Step::Send(message) => return Step::Send(message),
                        Step::Wait(until) => return Step::Wait(until),
                        Step::Done(done) => {
                            let was = difference.is.unwrap_or(*value);
                            // A set without an answer may have worked: it is written down, too.
                            let change = Change { name: name.to_owned(), was, now: *value };
                            self.standing.changed.push(change);
                            self.standing.values.insert(name.to_owned(), *value);
                            if let Err(error) = done {
                                self.standing.values.insert(name.to_owned(), was);
                                // A drone that answers is asked for the others; one that does not
                                // is not waited for once more.
                                let silent = matches!(error, SetError::Silent { .. });
                                self.standing.failed.get_or_insert(error);
                                let tried = if silent { to_mend.len() } else { 1 };
                                let left = to_mend.drain(..tried).map(|(difference, _)| difference);
                                self.standing.wrong.extend(left);
                            } else {
                                to_mend.pop_front();
                            }
                            if let Phase::Set(_, set) = &mut self.phase {
                                *set = None;
                            }
                        }
                    }
                }
                Phase::Over => return Step::Done(std::mem::take(&mut self.standing)),
            }
        }
    }

    fn refused(&mut self, refusal: &Refusal) -> Option<Standing> {
        if let Phase::Set(to_mend, set) = &mut self.phase {
            if let Some((difference, wanted)) = to_mend.front() {
                // Sent before, it may have worked: that is written down, too.
                if let (Some(was), true) =
                    (difference.is, set.as_ref().is_some_and(SetParams::was_sent))
                {
                    let name = difference.requirement.name.to_owned();
                    self.standing.changed.push(Change { name, was, now: *wanted });
                }
                let (name, wanted) = (difference.requirement.name.to_owned(), *wanted);
                let failed = SetError::Refused { name, wanted, why: refusal.why.clone() };
                self.standing.failed.get_or_insert(failed);
            }
            self.standing.wrong.extend(to_mend.drain(..).map(|(difference, _)| difference));
        }
        Some(std::mem::take(&mut self.standing))
    }

    fn progress(&self) -> Progress {
        match &self.phase {
            Phase::Read(read) => read.progress(),
            Phase::Set(..) | Phase::Over => {
                let total = self.requirements.len() as u64;
                Progress { done: total, total }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::frame::dialect::PARAM_VALUE_DATA;

    const DRONE: DroneId = DroneId { network: 0, system: 1 };

    fn require(name: &'static str) -> Requirement {
        Requirement { name, wanted: Wanted::AtLeast(1.0), why: "it must" }
    }

    /// Talks to a drone whose parameters are all 0 and that takes no value for `stubborn`; for
    /// `deaf` it does not answer to being set at all.
    fn standing(stubborn: &str, deaf: &str) -> Standing {
        let mut values: BTreeMap<String, f32> =
            ["A", "B", "C"].into_iter().map(|name| (name.to_owned(), 0.0)).collect();
        let all = ["A", "B", "C"].map(require).to_vec();
        let (mut check, mut now) = (CheckParams::new(DRONE, all, true), 0);
        for _ in 0..10_000 {
            let name = match check.poll(now) {
                Step::Done(standing) => return standing,
                Step::Wait(until) => {
                    now = until;
                    continue;
                }
                Step::Send(message) => match *message {
                    MavMessage::PARAM_REQUEST_READ(read) => {
                        super::super::messages::chars(&read.param_id[..])
                    }
                    MavMessage::PARAM_SET(set) => {
                        let name = super::super::messages::chars(&set.param_id[..]);
                        if name == deaf {
                            continue;
                        }
                        if name != stubborn {
                            values.insert(name.clone(), set.param_value);
                        }
                        name
                    }
                    _ => continue,
                },
            };
            let param_value = values[&name];
            let param_id = name.as_str().into();
            let answer = PARAM_VALUE_DATA { param_value, param_id, ..PARAM_VALUE_DATA::default() };
            check.on_message(now, &MavMessage::PARAM_VALUE(answer));
        }
        panic!("it does not end");
    }

    #[test]
    fn what_a_drone_does_not_take_is_said_and_the_rest_is_set() {
        let standing = standing("A", "");
        assert!(!standing.is_right());
        assert_eq!(standing.values["A"].to_bits(), 0.0_f32.to_bits());
        assert_eq!(standing.values["C"].to_bits(), 1.0_f32.to_bits(), "the others are set");
        let complaint = standing.complaint();
        assert!(complaint.contains("A is 0 after it was set to 1"), "{complaint}");
        assert!(!complaint.contains("C is"), "{complaint}");
    }

    #[test]
    fn a_drone_that_does_not_answer_to_a_set_has_all_that_is_left_named() {
        let complaint = standing("", "B").complaint();
        assert!(complaint.contains("no answer when B is set to 1"), "{complaint}");
        assert!(complaint.contains("C is 0, it must be 1 or more"), "{complaint}");
    }
}
