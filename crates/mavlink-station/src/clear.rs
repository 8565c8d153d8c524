//! Conversation that clears the show of a vehicle.

use super::messages::command_long;
use crate::link::clock::{Micros, S};
use crate::link::conversation::{Conversation, Step};
use crate::link::frame::{MavMessage, dialect};
use crate::link::id::DroneId;
use crate::protocol::show::{FROM_DRONE, Status, flag};
use dialect::{MavCmd, MavResult};

/// Status packets so soon after an answer may have been sent before it.
const SETTLE: Micros = S;
/// Clearing is repeated so often.
const CLEAR_TRIES: u32 = 20;

/// Error of clearing a show: it was not confirmed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "clearing the show was not confirmed: switch the drone off, or bring it nearer and try again"
)]
pub struct NotCleared;

/// Conversation that clears the show of a vehicle, until its status reports that none is loaded.
#[derive(Clone, Debug)]
pub struct Clear {
    drone: DroneId,
    tries: u32,
    next: Micros,
    accepted: Option<Micros>,
    cleared: bool,
}

impl Clear {
    /// Clears the show of a vehicle, including one that an interrupted upload left behind.
    pub fn new(drone: DroneId) -> Self {
        Self { drone, tries: 0, next: 0, accepted: None, cleared: false }
    }
}

impl Conversation for Clear {
    type Done = Result<(), NotCleared>;

    fn on_message(&mut self, now: Micros, message: &MavMessage) {
        match message {
            MavMessage::COMMAND_ACK(ack)
                if ack.command == MavCmd::MAV_CMD_USER_1
                    && ack.result == MavResult::MAV_RESULT_ACCEPTED
                    && self.tries > 0 =>
            {
                self.accepted.get_or_insert(now);
            }
            // An answer to an earlier reload looks the same: the status decides.
            MavMessage::DATA16(data) if data.mavtype == FROM_DRONE => {
                let length = usize::from(data.len).min(data.data.len());
                let loaded = Status::from_data(&data.data[..length]).has(flag::LOADED);
                let settled = self.accepted.is_some_and(|at| now >= at + SETTLE);
                self.cleared |= settled && !loaded;
            }
            _ => {}
        }
    }

    fn poll(&mut self, now: Micros) -> Step<Self::Done> {
        if self.cleared {
            return Step::Done(Ok(()));
        }
        if now < self.next {
            return Step::Wait(self.next);
        }
        if self.tries >= CLEAR_TRIES {
            return Step::Done(Err(NotCleared));
        }
        self.tries += 1;
        self.next = now + S;
        let params = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        Step::send(command_long(self.drone, MavCmd::MAV_CMD_USER_1, params, 0))
    }
}
