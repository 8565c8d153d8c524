//! Ends a flight: every drone returns or lands, now.
//!
//! One conversation per drone, all at once (give [`ALL_AT_ONCE`] to
//! [`run_all`](crate::link::conversation::run_all)): each says so every 200 ms until its drone's own
//! heartbeat confirms it. A drone that is not flying has its start taken back instead. Nothing
//! else is sent meanwhile.

use serde::{Deserialize, Serialize};

use super::messages::{GUIDED, LAND, RTL, set_mode, start_packet};
use super::telemetry::Drone;
use crate::link::clock::{MS, Micros, S};
use crate::link::conversation::{Conversation, Step};
use crate::link::frame::{MavMessage, dialect};
use crate::link::id::DroneId;
use crate::protocol::show::{CLEAR_TIME, FROM_DRONE, Stage, StartConfig, Status, flag};
use dialect::{MavCmd, MavModeFlag, MavResult};

/// Concurrency for `run_all` in which no drone waits for another.
pub const ALL_AT_ONCE: usize = usize::MAX;
/// Time between repetitions of the order, us.
const EVERY: Micros = 200 * MS;
/// Repeated for so long.
const GIVE_UP: Micros = 120 * S;
/// What is heard sooner may have been sent before the abort.
const SETTLE: Micros = S;
/// What was known of a drone that is older than its latest word by more says nothing.
const KNOWN_WITHIN: Micros = 3 * S;
/// The show firmware's status comes within this.
const STATUS_WITHIN: Micros = 3 * S;
/// A drone that returns or lands is told for so long more that it has no start any more: an authorization
/// that stays stands in the way of its next flight.
const CLEARED_WITHIN: Micros = 5 * S;
/// A return that is refused so often becomes a landing.
const REFUSALS: u32 = 3;

/// Action that ends the flight of a drone in the air.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Action {
    /// Return to the place of the take-off, and land there.
    Return,
    /// Land at the present place.
    Land,
}

impl Action {
    /// Number of ArduCopter's flight mode for the action.
    pub fn mode(self) -> u32 {
        match self {
            Self::Return => RTL,
            Self::Land => LAND,
        }
    }
}

/// Outcome of an abort for one drone.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Aborted {
    /// The drone's heartbeat confirms this action; after a refused return it is the landing.
    Confirmed(Action),
    /// The drone was not flying, and has no start time any more.
    Grounded,
    /// Nothing was confirmed: the drone may fly on.
    Unconfirmed {
        /// Number of times that the order was sent.
        told: u32,
    },
    /// Nothing was confirmed in time, and the caller has stopped waiting; a running station goes on
    /// sending the order.
    StillTold {
        /// Time since the first order, s.
        seconds: u64,
    },
    /// The drone was never heard, so that no order reaches it.
    Unheard,
}

impl Aborted {
    /// Whether the drone itself has confirmed the outcome.
    pub fn is_confirmed(self) -> bool {
        matches!(self, Self::Confirmed(_) | Self::Grounded)
    }
}

impl std::fmt::Display for Aborted {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Confirmed(Action::Return) => f.write_str("returns"),
            Self::Confirmed(Action::Land) => f.write_str("lands"),
            Self::Grounded => f.write_str("on the ground, its start is taken back"),
            Self::Unconfirmed { told } => {
                write!(f, "NOT CONFIRMED after {told} tries: use its remote control")
            }
            Self::StillTold { seconds } => write!(
                f,
                "NOT CONFIRMED within {seconds} s: use its remote control; the running station goes on \
                 telling it"
            ),
            Self::Unheard => {
                f.write_str("NOT HEARD, so nothing was sent to it: use its remote control")
            }
        }
    }
}

/// Conversation that aborts the flight of one drone.
#[derive(Clone, Debug)]
pub struct Abort {
    drone: DroneId,
    action: Action,
    /// A drone that is not heard within this is given up.
    heard_within: Micros,
    heard: bool,
    begun: Option<Micros>,
    next: Micros,
    /// The second of the two messages of a round is still to be sent.
    cancel_next: bool,
    armed: Option<bool>,
    mode: Option<u32>,
    status: Option<Status>,
    /// A heartbeat and a status that were surely sent after the first word of the abort.
    grounded: bool,
    quiet: Option<bool>,
    /// Since when it does what it was told.
    obeys: Option<Micros>,
    told: u32,
    refusals: u32,
}

impl Abort {
    /// Aborts the flight of a drone. `known` is what was heard of it until now: a drone that stands
    /// disarmed is not taken out of its mode. It cannot fly before its next heartbeats, as arming
    /// comes eight seconds before the take-off.
    pub fn new(drone: DroneId, action: Action, known: Option<&Drone>) -> Self {
        let heard = known.is_some();
        let known = known.filter(|known| {
            let old = |at: Micros| known.heard.saturating_sub(at) > KNOWN_WITHIN;
            !known.armed.is_some_and(|(at, _)| old(at))
                && !known.status.is_some_and(|(at, _)| old(at))
        });
        let armed = known.and_then(Drone::is_armed);
        let status = known.and_then(|known| known.status).map(|(_, status)| status);
        Self {
            drone,
            action,
            heard_within: GIVE_UP,
            heard,
            begun: None,
            next: 0,
            cancel_next: false,
            armed,
            mode: None,
            status,
            grounded: false,
            quiet: None,
            obeys: None,
            told: 0,
            refusals: 0,
        }
    }

    /// Gives up on a drone that has never been heard, and is not heard within this time, us.
    #[must_use]
    pub fn heard_within(self, heard_within: Micros) -> Self {
        Self { heard_within, ..self }
    }

    /// Number of times that the order was sent.
    pub fn told(&self) -> u32 {
        self.told
    }

    /// Armed, but not in the air: there it lands at once, where a return might not disarm. Kept,
    /// as leaving the show ends its stages.
    fn decide(&mut self) {
        if self.armed == Some(false) && self.mode == Some(GUIDED) {
            self.action = Action::Land;
        }
        let on_ground = |status: Status| {
            matches!(status.stage, Stage::Init | Stage::WaitForStart | Stage::Landed)
        };
        if self.status.is_some_and(on_ground) {
            self.action = Action::Land;
        }
    }

    fn outcome(&mut self, now: Micros, begun: Micros) -> Option<Aborted> {
        let obeys = self.armed == Some(true) && self.mode == Some(self.action.mode());
        let since = if obeys { *self.obeys.get_or_insert(now) } else { now };
        if !obeys {
            self.obeys = None;
        }
        match (self.armed, self.mode) {
            (Some(true), _) if obeys => {
                // Without show mode it has no start.
                let cleared = self.status.is_none() || self.quiet == Some(true);
                (cleared || now >= since + CLEARED_WITHIN)
                    .then_some(Aborted::Confirmed(self.action))
            }
            (Some(false), mode) if self.grounded && mode != Some(GUIDED) => {
                // Without show mode there is no status to wait for.
                let stock = self.status.is_none() && now >= begun + STATUS_WITHIN;
                (stock || self.quiet == Some(true)).then_some(Aborted::Grounded)
            }
            _ => None,
        }
    }
}

impl Conversation for Abort {
    type Done = Aborted;

    fn on_message(&mut self, now: Micros, message: &MavMessage) {
        self.heard = true;
        let Some(begun) = self.begun else { return };
        let after = now >= begun + SETTLE;
        match message {
            MavMessage::HEARTBEAT(beat) => {
                let armed = MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED;
                self.armed = Some(beat.base_mode.contains(armed));
                self.grounded = after && self.armed == Some(false);
                self.mode = Some(beat.custom_mode);
            }
            MavMessage::DATA16(data) if data.mavtype == FROM_DRONE => {
                let length = usize::from(data.len).min(data.data.len());
                let status = Status::from_data(&data.data[..length]);
                self.status = Some(status);
                let quiet = !status.has(flag::AUTHORIZED) && status.start_tow_s < 0;
                self.quiet = after.then_some(quiet);
            }
            MavMessage::COMMAND_ACK(ack)
                if ack.command == MavCmd::MAV_CMD_DO_SET_MODE
                    && ack.result != MavResult::MAV_RESULT_ACCEPTED =>
            {
                self.refusals += 1;
                if self.refusals >= REFUSALS {
                    // A drone that does not know where it is cannot return; it can land.
                    self.action = Action::Land;
                }
            }
            _ => {}
        }
    }

    fn poll(&mut self, now: Micros) -> Step<Aborted> {
        let begun = *self.begun.get_or_insert(now);
        self.decide();
        if let Some(outcome) = self.outcome(now, begun) {
            return Step::Done(outcome);
        }
        if self.cancel_next {
            self.cancel_next = false;
            let start =
                StartConfig { start_tow_s: CLEAR_TIME, authorization: 0, countdown_ms: CLEAR_TIME };
            return Step::send(start_packet(&start));
        }
        if now < self.next {
            return Step::Wait(self.next);
        }
        if now >= begun + GIVE_UP {
            return Step::Done(Aborted::Unconfirmed { told: self.told });
        }
        if !self.heard && now >= begun + self.heard_within {
            return Step::Done(Aborted::Unheard);
        }
        self.next = now + EVERY;
        self.told += 1;
        self.cancel_next = true;
        // A drone on the ground stays in its mode; before it is known, both are said. But one that
        // waits in GUIDED is taken from the station that is about to fly it.
        if self.obeys.is_some() || self.armed == Some(false) && self.mode != Some(GUIDED) {
            return self.poll(now);
        }
        let confirmation = self.told.min(255) as u8 - 1;
        Step::send(set_mode(self.drone, self.action.mode(), confirmation))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn beat() -> MavMessage {
        MavMessage::HEARTBEAT(dialect::HEARTBEAT_DATA {
            custom_mode: RTL,
            base_mode: MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED,
            ..Default::default()
        })
    }

    fn status(flags: u8, start_tow_s: i32) -> MavMessage {
        let status =
            Status { stage: Stage::ReturnToLaunch, flags, start_tow_s, ..Status::from_data(&[]) };
        MavMessage::DATA16(dialect::DATA16_DATA {
            mavtype: FROM_DRONE,
            len: Status::LENGTH,
            data: status.to_data(),
        })
    }

    /// What is sent until it waits, or how it ends.
    fn round(abort: &mut Abort, now: Micros) -> Result<Vec<MavMessage>, Aborted> {
        let mut sent = Vec::new();
        loop {
            match abort.poll(now) {
                Step::Send(message) => sent.push(*message),
                Step::Wait(_) => return Ok(sent),
                Step::Done(done) => return Err(done),
            }
        }
    }

    #[test]
    fn a_drone_that_returns_is_told_on_until_it_has_no_start() {
        for gives_up in [false, true] {
            let mut abort = Abort::new(DroneId { network: 0, system: 1 }, Action::Return, None);
            let done = Err(Aborted::Confirmed(Action::Return));
            assert_eq!(
                round(&mut abort, 0).unwrap().len(),
                2,
                "the mode, and that there is no start"
            );
            abort.on_message(2 * S, &beat());
            abort.on_message(2 * S, &status(flag::AUTHORIZED, 443_029));
            let sent = round(&mut abort, 2 * S).unwrap();
            // It is not put into its mode again.
            assert!(matches!(sent[..], [MavMessage::DATA16(_)]), "{sent:?}");
            if gives_up {
                assert_eq!(
                    round(&mut abort, 2 * S + CLEARED_WITHIN),
                    done,
                    "that it returns is more"
                );
            } else {
                abort.on_message(3 * S, &status(0, -1));
                assert_eq!(round(&mut abort, 3 * S), done);
            }
        }
    }

    #[test]
    fn a_drone_that_is_heard_but_does_not_obey_is_told_five_times_a_second_for_two_minutes() {
        let mut abort = Abort::new(DroneId { network: 0, system: 1 }, Action::Land, None);
        let mut now = 0;
        let end = loop {
            match round(&mut abort, now) {
                // It returns, which is not what it was told.
                Ok(_) => abort.on_message(now, &beat()),
                Err(end) => break end,
            }
            now += EVERY;
        };
        assert_eq!((now, end), (120 * S, Aborted::Unconfirmed { told: 600 }));
    }

    #[test]
    fn a_drone_that_was_never_heard_is_given_up_when_the_caller_says_so() {
        let drone = DroneId { network: 0, system: 1 };
        let mut abort = Abort::new(drone, Action::Land, None).heard_within(10 * S);
        for now in (0..10 * S).step_by(EVERY as usize) {
            assert_eq!(round(&mut abort, now).unwrap().len(), 2);
        }
        assert_eq!(round(&mut abort, 10 * S), Err(Aborted::Unheard));
    }

    #[test]
    fn a_return_that_is_refused_three_times_becomes_a_landing() {
        let mut abort = Abort::new(DroneId { network: 0, system: 1 }, Action::Return, None);
        let refused = MavMessage::COMMAND_ACK(dialect::COMMAND_ACK_DATA {
            command: MavCmd::MAV_CMD_DO_SET_MODE,
            result: MavResult::MAV_RESULT_FAILED,
            ..Default::default()
        });
        let mode = |sent: &[MavMessage]| match &sent[0] {
            MavMessage::COMMAND_LONG(long) => long.param2 as u32,
            other => panic!("{other:?}"),
        };
        for second in 0..3 {
            assert_eq!(mode(&round(&mut abort, second * S).unwrap()), RTL, "{second}");
            abort.on_message(second * S, &refused);
        }
        assert_eq!(mode(&round(&mut abort, 3 * S).unwrap()), LAND);
    }
}
