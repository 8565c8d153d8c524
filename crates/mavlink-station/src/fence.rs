//! Conversation that puts a fence on a vehicle: an inclusion polygon and a top, sent, read back and
//! compared.
//!
//! It is never switched off: whoever loads a fence leaves one behind, the old or the new.

use super::command::Patience;
use super::messages::{fence_ack, fence_corner, fence_count, fence_list, fence_request};
use super::params::{SetError, SetParams};
use crate::link::clock::{Micros, S};
use crate::link::conversation::{Conversation, Progress, Step};
use crate::link::error::Refusal;
use crate::link::frame::{MavMessage, dialect};
use crate::link::id::DroneId;
use dialect::{MavCmd, MavMissionResult, MavMissionType};

/// FENCE_TYPE for a fence with altitude (1) and polygon (4).
pub const FENCE_TYPE: f32 = 5.0;
/// FENCE_ACTION for returning home, or landing where that is impossible.
pub const FENCE_ACTION: f32 = 1.0;
/// Fence in the form in which vehicles get it.
#[derive(Clone, Debug, PartialEq)]
pub struct Fence {
    /// Corners of the polygon: latitude and longitude, 1e-7 degrees.
    pub corners_1e7: Vec<(i32, i32)>,
    /// Top of the fence, m above home.
    pub top_m: f64,
}

impl Fence {
    /// Parameters of the fence, in the order in which they are set: switched on last.
    pub fn params(&self) -> Vec<(String, f32)> {
        [
            ("FENCE_ALT_MAX", self.top_m as f32),
            ("FENCE_ACTION", FENCE_ACTION),
            ("FENCE_TYPE", FENCE_TYPE),
            ("FENCE_ENABLE", 1.0),
        ]
        .map(|(name, value)| (name.to_owned(), value))
        .to_vec()
    }
}

/// Degrees as MAVLink has them, in 1e-7 degrees, rounded to nearest.
pub fn degrees_1e7(degrees: f64) -> i32 {
    (degrees * 1e7).round() as i32
}

/// Error of putting a fence on a vehicle.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FenceError {
    /// The drone does not answer.
    #[error(
        "no answer while the fence is {doing}: bring the drone nearer to the radio and try again"
    )]
    Silent {
        /// Step during which it fell silent.
        doing: &'static str,
    },
    /// The vehicle refuses the fence.
    #[error("the drone refuses the fence: {reason}")]
    Refused {
        /// Reason for the refusal, in words.
        reason: String,
    },
    /// The fence read back differs from the one that was sent.
    #[error("the fence on the drone is not the one that was sent: {difference}; try again")]
    Different {
        /// First difference between the two fences.
        difference: String,
    },
    /// The fence was not sent, because the drone must not be touched.
    #[error("the fence was not sent, as {why}")]
    Held {
        /// Reason why it must not be touched, as a clause.
        why: String,
    },
    /// A parameter of the fence could not be set.
    #[error("the fence is not set up")]
    Param(#[source] SetError),
}

/// The fence is sent so often at most when another is read back.
const ROUNDS: u32 = 3;
/// While uploading the vehicle asks for what it lacks, so that silence means a lost end.
const UPLOAD_SILENCE: Micros = 3 * S;

#[derive(Clone, Debug)]
enum Phase {
    Send,
    Count,
    Read,
    Acknowledge,
    Params(SetParams),
}

/// The corners are on the drone by now: a radio that is silent for half a minute is waited for
/// rather than a whole upload given up.
const PARAMS: Patience = Patience { every: S, tries: 30 };

/// Conversation that puts a fence on a vehicle and reads it back.
#[derive(Clone, Debug)]
pub struct PutFence {
    drone: DroneId,
    fence: Fence,
    patience: Patience,
    phase: Phase,
    tries: u32,
    next: Micros,
    wanted: Option<u16>,
    /// All corners were sent: if the vehicle's word for it is lost, reading them tells.
    all_sent: bool,
    /// What the vehicle said against it last; it may still take it.
    objection: Option<String>,
    rounds: u32,
    read: Vec<(i32, i32)>,
    failed: Option<FenceError>,
}

impl PutFence {
    /// Puts this fence on a vehicle.
    pub fn new(drone: DroneId, fence: Fence) -> Self {
        Self {
            drone,
            fence,
            patience: Patience::default(),
            phase: Phase::Send,
            tries: 0,
            next: 0,
            wanted: None,
            all_sent: false,
            objection: None,
            rounds: 0,
            read: Vec::new(),
            failed: None,
        }
    }

    fn go(&mut self, phase: Phase) {
        self.phase = phase;
        self.tries = 0;
        self.next = 0;
    }

    fn on_ack(&mut self, result: MavMissionResult) {
        if !matches!(self.phase, Phase::Send) || self.tries == 0 {
            return;
        }
        match result {
            MavMissionResult::MAV_MISSION_ACCEPTED => self.go(Phase::Count),
            // A repeated corner, or another station's upload that ends: ours may go on.
            MavMissionResult::MAV_MISSION_OPERATION_CANCELLED
            | MavMissionResult::MAV_MISSION_INVALID_SEQUENCE
            | MavMissionResult::MAV_MISSION_DENIED
            | MavMissionResult::MAV_MISSION_ERROR => self.objection = Some(words(result)),
            other => self.failed = Some(FenceError::Refused { reason: words(other) }),
        }
    }

    /// Sent again a few times: a repeated message of an earlier attempt may have crossed it.
    fn differs(&mut self, difference: String) {
        self.rounds += 1;
        if self.rounds < ROUNDS {
            self.all_sent = false;
            self.go(Phase::Send);
        } else {
            self.failed = Some(FenceError::Different { difference });
        }
    }

    fn on_count(&mut self, count: u16) {
        if !matches!(self.phase, Phase::Count) || self.tries == 0 {
            return;
        }
        let sent = self.fence.corners_1e7.len();
        if usize::from(count) == sent {
            self.read.clear();
            self.go(Phase::Read);
        } else {
            self.differs(format!("it has {count} corners, not {sent}"));
        }
    }

    fn on_item(&mut self, item: &dialect::MISSION_ITEM_INT_DATA) {
        if !matches!(self.phase, Phase::Read) || usize::from(item.seq) != self.read.len() {
            return;
        }
        let wanted = self.fence.corners_1e7[self.read.len()];
        let inclusion = MavCmd::MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION;
        if item.command != inclusion || (item.x, item.y) != wanted {
            self.differs(format!(
                "corner {} is {} {} ({:?}), not {} {}",
                item.seq + 1,
                item.x,
                item.y,
                item.command,
                wanted.0,
                wanted.1
            ));
            return;
        }
        self.read.push(wanted);
        self.tries = 0;
        self.next = 0;
        if self.read.len() == self.fence.corners_1e7.len() {
            self.go(Phase::Acknowledge);
        }
    }

    fn doing(&self) -> &'static str {
        if matches!(self.phase, Phase::Send) { "sent" } else { "read back" }
    }
}

fn words(result: MavMissionResult) -> String {
    format!("{result:?}").trim_start_matches("MAV_MISSION_").to_lowercase().replace('_', " ")
}

impl Conversation for PutFence {
    type Done = Result<(), FenceError>;

    fn on_message(&mut self, now: Micros, message: &MavMessage) {
        let fence = MavMissionType::MAV_MISSION_TYPE_FENCE;
        match message {
            #[expect(deprecated, reason = "ArduPilot asks with either form")]
            MavMessage::MISSION_REQUEST(r) if r.mission_type == fence => self.wanted = Some(r.seq),
            MavMessage::MISSION_REQUEST_INT(r) if r.mission_type == fence => {
                self.wanted = Some(r.seq);
            }
            MavMessage::MISSION_ACK(ack) if ack.mission_type == fence => self.on_ack(ack.mavtype),
            MavMessage::MISSION_COUNT(c) if c.mission_type == fence => self.on_count(c.count),
            MavMessage::MISSION_ITEM_INT(item) if item.mission_type == fence => self.on_item(item),
            _ => {
                if let Phase::Params(params) = &mut self.phase {
                    params.on_message(now, message);
                }
            }
        }
    }

    fn refused(&mut self, refusal: &Refusal) -> Option<Self::Done> {
        Some(Err(FenceError::Held { why: refusal.why.clone() }))
    }

    fn poll(&mut self, now: Micros) -> Step<Self::Done> {
        loop {
            if let Some(failed) = self.failed.take() {
                return Step::Done(Err(failed));
            }
            let drone = self.drone;
            let count = self.fence.corners_1e7.len() as u16;
            if let Some(seq) = self.wanted.take()
                && matches!(self.phase, Phase::Send)
                && let Some(corner) = self.fence.corners_1e7.get(usize::from(seq))
            {
                self.next = now + UPLOAD_SILENCE;
                self.all_sent |= seq + 1 == count;
                return Step::send(fence_corner(drone, seq, count, *corner));
            }
            if let Phase::Params(params) = &mut self.phase {
                return match params.poll(now) {
                    Step::Send(message) => Step::Send(message),
                    Step::Wait(until) => Step::Wait(until),
                    Step::Done(done) => Step::Done(done.map_err(FenceError::Param)),
                };
            }
            if let Phase::Acknowledge = self.phase {
                let params = SetParams::new(drone, self.fence.params()).with_patience(PARAMS);
                self.phase = Phase::Params(params);
                return Step::send(fence_ack(drone));
            }
            if now < self.next {
                return Step::Wait(self.next);
            }
            if matches!(self.phase, Phase::Send) && self.all_sent {
                self.go(Phase::Count);
            }
            if self.tries >= self.patience.tries {
                return Step::Done(Err(match self.objection.take() {
                    Some(reason) => FenceError::Refused { reason },
                    None => FenceError::Silent { doing: self.doing() },
                }));
            }
            self.tries += 1;
            self.next = now + self.patience.every;
            match self.phase {
                Phase::Send => {
                    self.next = now + UPLOAD_SILENCE;
                    return Step::send(fence_count(drone, count));
                }
                Phase::Count => return Step::send(fence_list(drone)),
                Phase::Read => return Step::send(fence_request(drone, self.read.len() as u16)),
                Phase::Acknowledge | Phase::Params(_) => {}
            }
        }
    }

    fn progress(&self) -> Progress {
        let total = self.fence.corners_1e7.len() as u64;
        Progress { done: self.read.len() as u64, total }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DRONE: DroneId = DroneId { network: 0, system: 1 };

    fn fence() -> Fence {
        Fence { corners_1e7: vec![(1, 2), (3, 4), (5, 6)], top_m: 40.0 }
    }

    fn ack(result: MavMissionResult) -> MavMessage {
        MavMessage::MISSION_ACK(dialect::MISSION_ACK_DATA {
            mavtype: result,
            mission_type: MavMissionType::MAV_MISSION_TYPE_FENCE,
            ..Default::default()
        })
    }

    fn counts(count: u16) -> MavMessage {
        MavMessage::MISSION_COUNT(dialect::MISSION_COUNT_DATA {
            count,
            mission_type: MavMissionType::MAV_MISSION_TYPE_FENCE,
            ..Default::default()
        })
    }

    /// The next message, or how it ends.
    fn next(put: &mut PutFence, now: Micros) -> Result<MavMessage, Result<(), FenceError>> {
        match put.poll(now) {
            Step::Send(message) => Ok(*message),
            Step::Done(done) => Err(done),
            Step::Wait(until) => panic!("it waits until {until}"),
        }
    }

    #[test]
    fn another_fence_on_the_drone_is_overwritten_twice_and_then_reported() {
        let mut put = PutFence::new(DRONE, fence());
        for round in 1..=ROUNDS {
            let now = u64::from(round) * 100 * S;
            let announced = next(&mut put, now).unwrap();
            assert!(matches!(&announced, MavMessage::MISSION_COUNT(count) if count.count == 3));
            put.on_message(now, &ack(MavMissionResult::MAV_MISSION_ACCEPTED));
            let asked = next(&mut put, now).unwrap();
            assert!(matches!(asked, MavMessage::MISSION_REQUEST_LIST(_)), "{asked:?}");
            put.on_message(now, &counts(4));
        }
        let failed = next(&mut put, 1_000 * S).unwrap_err().unwrap_err();
        assert_eq!(
            failed,
            FenceError::Different { difference: "it has 4 corners, not 3".to_owned() }
        );
    }

    #[test]
    fn a_corner_that_is_read_back_elsewhere_is_noticed() {
        let mut put = PutFence::new(DRONE, fence());
        next(&mut put, 0).unwrap();
        put.on_message(0, &ack(MavMissionResult::MAV_MISSION_ACCEPTED));
        next(&mut put, 0).unwrap();
        put.on_message(0, &counts(3));
        for (seq, x) in [(0, 1), (1, 33)] {
            let asked = next(&mut put, 0).unwrap();
            assert!(
                matches!(&asked, MavMessage::MISSION_REQUEST_INT(request) if request.seq == seq),
                "{asked:?}"
            );
            put.on_message(
                0,
                &MavMessage::MISSION_ITEM_INT(dialect::MISSION_ITEM_INT_DATA {
                    seq,
                    x,
                    y: x + 1,
                    command: MavCmd::MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION,
                    mission_type: MavMissionType::MAV_MISSION_TYPE_FENCE,
                    ..Default::default()
                }),
            );
        }
        let again = next(&mut put, 0).unwrap();
        assert!(matches!(again, MavMessage::MISSION_COUNT(_)), "it is sent again: {again:?}");
    }

    #[test]
    fn a_refusal_is_told_in_the_vehicles_words_and_silence_is_not() {
        for (result, told) in [
            (MavMissionResult::MAV_MISSION_NO_SPACE, "no space"),
            (MavMissionResult::MAV_MISSION_INVALID, "invalid"),
        ] {
            let mut put = PutFence::new(DRONE, fence());
            next(&mut put, 0).unwrap();
            put.on_message(0, &ack(result));
            let failed = next(&mut put, 0).unwrap_err();
            assert_eq!(failed, Err(FenceError::Refused { reason: told.to_owned() }));
        }
        let mut put = PutFence::new(DRONE, fence());
        let tries = u64::from(Patience::default().tries);
        for try_ in 0..tries {
            next(&mut put, try_ * UPLOAD_SILENCE).unwrap();
        }
        let failed = next(&mut put, tries * UPLOAD_SILENCE).unwrap_err();
        assert_eq!(failed, Err(FenceError::Silent { doing: "sent" }));
    }
}
