//! First conversation with a vehicle: it asks for the firmware's version and for regular reports of
//! the clock.
//!
//! Vehicles of the show firmware say nothing of their clock unasked (all stream rates are 0), and
//! without it no start time can be set.

use super::messages::command_long;
use crate::link::clock::{Micros, S};
use crate::link::conversation::{Conversation, Step};
use crate::link::frame::{MavMessage, dialect};
use crate::link::id::DroneId;
use dialect::MavCmd;

const SYSTEM_TIME: f32 = 2.0;
const AUTOPILOT_VERSION: f32 = 148.0;
/// The vehicle tells its time so often, us of its own clock.
const TIME_EVERY_US: f32 = 1e6;
/// Greeted so often before it is left alone.
const TRIES: u32 = 10;

/// Answers of a vehicle to a greeting.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Greeted {
    /// Whether the vehicle reports its time.
    pub clock: bool,
    /// Whether the vehicle has reported its firmware's version.
    pub version: bool,
}

/// Conversation that asks for the clock and the version, until both come or it gives up.
#[derive(Clone, Debug)]
pub struct Greet {
    drone: DroneId,
    heard: Greeted,
    tries: u32,
    to_send: Vec<MavMessage>,
    next: Micros,
}

impl Greet {
    /// Asks a vehicle for its clock and its version.
    pub fn new(drone: DroneId) -> Self {
        Self { drone, heard: Greeted::default(), tries: 0, to_send: Vec::new(), next: 0 }
    }
}

fn ask(drone: DroneId, command: MavCmd, first: f32, second: f32) -> MavMessage {
    command_long(drone, command, [first, second, 0.0, 0.0, 0.0, 0.0, 0.0], 0)
}

/// Message that asks a vehicle to report its time regularly: one that has restarted has forgotten
/// the request.
pub fn ask_time(drone: DroneId) -> MavMessage {
    ask(drone, MavCmd::MAV_CMD_SET_MESSAGE_INTERVAL, SYSTEM_TIME, TIME_EVERY_US)
}

/// Messages from which the air is told: attitude, position with velocity, outputs.
const AIR: [f32; 3] = [30.0, 33.0, 36.0];

/// Messages that ask a vehicle for attitude, position and outputs every so often; 0: as it does by itself.
pub fn ask_air(drone: DroneId, every: Micros) -> [MavMessage; 3] {
    AIR.map(|id| ask(drone, MavCmd::MAV_CMD_SET_MESSAGE_INTERVAL, id, every as f32))
}

impl Conversation for Greet {
    type Done = Greeted;

    fn on_message(&mut self, _now: Micros, message: &MavMessage) {
        match message {
            MavMessage::SYSTEM_TIME(_) => self.heard.clock = true,
            MavMessage::AUTOPILOT_VERSION(_) => self.heard.version = true,
            _ => {}
        }
    }

    fn poll(&mut self, now: Micros) -> Step<Greeted> {
        if let Some(message) = self.to_send.pop() {
            return Step::send(message);
        }
        // Asked for at least once: a clock that is heard already may be told at another rate.
        let done = self.tries > 0 && self.heard.clock && self.heard.version;
        if done || (self.tries >= TRIES && now >= self.next) {
            return Step::Done(self.heard);
        }
        if now < self.next {
            return Step::Wait(self.next);
        }
        if !self.heard.version {
            let command = MavCmd::MAV_CMD_REQUEST_MESSAGE;
            self.to_send.push(ask(self.drone, command, AUTOPILOT_VERSION, 0.0));
        }
        self.to_send.push(ask_time(self.drone));
        self.tries += 1;
        self.next = now + S;
        Step::Wait(now)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DRONE: DroneId = DroneId { network: 0, system: 1 };

    /// Number of messages sent until it waits, and until when.
    fn round(greet: &mut Greet, now: Micros) -> Result<(usize, Micros), Greeted> {
        let mut sent = 0;
        loop {
            match greet.poll(now) {
                Step::Send(_) => sent += 1,
                Step::Wait(until) if until > now => return Ok((sent, until)),
                Step::Wait(_) => {}
                Step::Done(done) => return Err(done),
            }
        }
    }

    #[test]
    fn a_vehicle_is_asked_every_second_and_not_for_what_it_has_told() {
        let mut greet = Greet::new(DRONE);
        let clock = MavMessage::SYSTEM_TIME(dialect::SYSTEM_TIME_DATA::default());
        greet.on_message(0, &clock);
        assert_eq!(round(&mut greet, 0), Ok((2, S)), "the clock may be told at another rate");
        assert_eq!(round(&mut greet, S / 2), Ok((0, S)));
        assert_eq!(round(&mut greet, S), Ok((2, 2 * S)), "the version is still unknown");
        let version = MavMessage::AUTOPILOT_VERSION(dialect::AUTOPILOT_VERSION_DATA::default());
        greet.on_message(S, &version);
        assert_eq!(round(&mut greet, S), Err(Greeted { clock: true, version: true }));
    }

    #[test]
    fn a_vehicle_that_does_not_answer_is_left_alone_after_ten_seconds() {
        let mut greet = Greet::new(DRONE);
        for second in 0..u64::from(TRIES) {
            assert_eq!(round(&mut greet, second * S), Ok((2, (second + 1) * S)));
        }
        let end = u64::from(TRIES) * S;
        assert!(round(&mut greet, end - 1).is_ok(), "the last answer may still come");
        assert_eq!(round(&mut greet, end), Err(Greeted::default()));
    }
}
