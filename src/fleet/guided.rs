//! Conversation that flies a plan's trajectory with stock ArduCopter: the station streams targets
//! in GUIDED.
//!
//! A drone that is not heard any more is told to return, again and again: it may hear what is not
//! answered.
//!
//! The show firmware's law with the link in between: at 10 Hz, position and velocity of the
//! trajectory at the vehicle's own time. A pause of the stream of more than 3 s (GUID_TIMEOUT)
//! stops the vehicle where it is; if the station is lost it returns (FS_GCS_ENABLE).

use super::fence::degrees_1e7;
use super::messages::{GUIDED, GuidedTarget, LAND, RTL, command_long, position_target, set_mode};
use super::vehicle_clock::VehicleClock;
use crate::base::frame::ShowFrame;
use crate::link::clock::{MS, Micros, S};
use crate::link::conversation::{Conversation, Progress, Step};
use crate::link::error::Refusal;
use crate::link::frame::{MavMessage, dialect};
use crate::link::id::DroneId;
use crate::link::station::heartbeat;
use crate::show::Trajectory;
use crate::show::derive::{DeriveParams, Firmware, derive};
use dialect::{MavCmd, MavModeFlag, MavResult};

/// Time between targets, ms of the vehicle's time.
const TARGET_EVERY_MS: f64 = 100.0;
/// Mode and arming are asked for so long before the take-off, s.
const ARM_BEFORE_S: f64 = 8.0;
/// Given up when it is not in the air so long after its take-off time, s.
const TAKEOFF_WITHIN_S: f64 = 8.0;
/// Commands are repeated after this.
const REPEAT: Micros = S;
/// Share of the take-off altitude from which the trajectory is joined, as in the firmware.
const JOIN_AT: f64 = 0.7;
/// Without a heartbeat for so long the flight counts as lost.
const LOST: Micros = 30 * S;
/// A lost drone is told to return for so long.
const RECALL: Micros = 60 * S;

/// Guided flight of one drone: trajectory, start, and the drone's clock.
#[derive(Clone, Debug)]
pub struct GuidedFlight {
    /// Trajectory to fly, show frame.
    pub trajectory: Trajectory,
    /// Position and orientation of the show frame.
    pub frame: ShowFrame,
    /// Instant of show time 0, ms since the GPS epoch.
    pub start_gps_ms: i64,
    /// Heading to keep, rad clockwise from north; `None`: the heading at take-off.
    pub yaw_rad: Option<f64>,
    /// Clock of the drone, as far as its messages have told it.
    pub clock: VehicleClock,
}

/// Error of a guided flight.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum GuidedError {
    /// The trajectory cannot be flown.
    #[error("the trajectory cannot be flown: {reason}")]
    Trajectory {
        /// Reason why it cannot be flown.
        reason: String,
    },
    /// The GPS time of the drone is not known.
    #[error("the drone's GPS time is not known: wait for its GPS")]
    NoClock,
    /// The start time has passed before the drone could be armed.
    #[error("the start time has passed before the drone could be armed: set a new one")]
    TooLate,
    /// The drone does not arm or take off.
    #[error("the drone did not arm or take off in time and is not flown; it says: {said}")]
    NoTakeoff {
        /// Last message of the drone.
        said: String,
    },
    /// The drone left GUIDED: its pilot, an abort, its fence or a failsafe has taken over.
    #[error("the drone left GUIDED ({mode}) at {show_s} s: nothing more was sent to it")]
    TakenOver {
        /// Flight mode that the drone changed to.
        mode: String,
        /// Show time of the change, whole seconds.
        show_s: i64,
    },
    /// A message to the drone was held back.
    #[error("the drone is not flown any more: {why}")]
    Held {
        /// Reason why it is not flown any more, as a clause.
        why: String,
    },
    /// The drone is not heard any more, and nothing more is sent to it.
    #[error("the drone was lost at {show_s} s: nothing is heard of it any more; {then}")]
    Lost {
        /// Show time at which the link was lost, whole seconds.
        show_s: i64,
        /// Outcome of the attempt to bring it home.
        then: AfterLoss,
    },
}

/// Outcome for a drone whose link was lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AfterLoss {
    /// The drone stood or was landing; nothing was sent.
    LeftAlone,
    /// The drone was ordered to return, was heard again, and returns.
    Returns,
    /// The drone was ordered to return and has not answered.
    Silent,
}

impl std::fmt::Display for AfterLoss {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::LeftAlone => "it was on the ground or landing",
            Self::Returns => "it was told to return and has confirmed it",
            Self::Silent => {
                "it was told to return and has NOT CONFIRMED it: use its remote control"
            }
        })
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    /// Waits for the time to arm.
    Wait,
    /// Into GUIDED, then armed.
    Arm,
    /// Waits for the time to take off.
    Ready,
    /// Taking off.
    Takeoff,
    /// Following the trajectory.
    Stream,
    /// Landing.
    Land,
    /// Lost, and called home.
    Recall {
        /// Since when.
        since: Micros,
        /// Show time of the loss, whole s.
        lost_s: i64,
    },
}

/// Sans-IO state machine that flies one drone along its trajectory in GUIDED.
#[derive(Clone, Debug)]
pub struct Guided {
    drone: DroneId,
    flight: GuidedFlight,
    takeoff_alt_m: f64,
    takeoff_s: Option<f64>,
    /// Until then the drone stays at the take-off altitude, show time s.
    climbs_from_s: f64,
    refused: Option<String>,
    phase: Phase,
    next: Micros,
    /// Targets sent, for their time.
    targets: u64,
    armed: bool,
    mode: Option<u32>,
    /// It was in GUIDED: if it leaves that, somebody else has decided so.
    obeyed: bool,
    /// The next heartbeat for a simulator that runs faster than real time.
    next_beat: Micros,
    heard: Option<Micros>,
    above_home_m: f64,
    heading_deg: Option<f64>,
    boot_ms: u32,
    said: String,
    /// Why it lands before its time.
    failed: Option<GuidedError>,
}

impl Guided {
    /// Prepares the flight of a drone that stands on its slot, disarmed.
    pub fn new(drone: DroneId, flight: GuidedFlight) -> Self {
        let params = DeriveParams::default();
        let derived = derive(&flight.trajectory, Firmware::V44, &params);
        let refused = (!derived.valid).then(|| derived.reasons.join("; "));
        Self {
            drone,
            flight,
            takeoff_alt_m: params.takeoff_alt_m,
            takeoff_s: derived.takeoff_s,
            climbs_from_s: derived.reaches_takeoff_alt_s.unwrap_or(0.0),
            refused,
            phase: Phase::Wait,
            next: 0,
            targets: 0,
            armed: false,
            mode: None,
            obeyed: false,
            next_beat: 0,
            heard: None,
            above_home_m: 0.0,
            heading_deg: None,
            boot_ms: 0,
            said: "nothing".to_owned(),
            failed: None,
        }
    }

    fn show_s(&self, now: Micros) -> Option<f64> {
        let gps_ms = self.flight.clock.gps_ms(now)?;
        Some((gps_ms - self.flight.start_gps_ms as f64) / 1000.0)
    }

    /// Link time of a show time.
    fn at(&self, now: Micros, show_s: f64) -> Micros {
        let gps_ms = self.flight.start_gps_ms as f64 + show_s * 1000.0;
        self.flight.clock.link_time(now, gps_ms).unwrap_or(now + S)
    }

    fn command(&self, command: MavCmd, first: f32, last: f32) -> MavMessage {
        command_long(self.drone, command, [first, 0.0, 0.0, 0.0, 0.0, 0.0, last], 0)
    }

    /// The target at a show time. Until the trajectory has risen above the take-off altitude the
    /// drone stays there, as in the firmware.
    fn target(&self, show_s: f64) -> GuidedTarget {
        let trajectory = &self.flight.trajectory;
        let state = trajectory.state_at(show_s);
        let place = self.flight.frame.to_geodetic(state.position_m);
        let mut neu = self.flight.frame.to_neu(state.velocity_mps);
        let mut above_home_m = state.position_m.z - trajectory.start_m.z;
        if show_s < self.climbs_from_s {
            above_home_m = above_home_m.max(self.takeoff_alt_m);
            neu.z = 0.0;
        }
        let heading_rad = self.heading_deg.unwrap_or(0.0).to_radians();
        GuidedTarget {
            lat_1e7: degrees_1e7(place.lat_deg),
            lon_1e7: degrees_1e7(place.lon_deg),
            above_home_m,
            neu_mps: [neu.x, neu.y, neu.z],
            yaw_rad: self.flight.yaw_rad.unwrap_or(heading_rad),
        }
    }

    fn go(&mut self, phase: Phase, now: Micros) {
        self.phase = phase;
        self.next = now;
    }

    /// Not in GUIDED any more although it was told nothing else.
    fn taken_over(&self, show_s: f64) -> Option<GuidedError> {
        let mode = self.mode.filter(|mode| *mode != GUIDED)?;
        let mode = super::messages::mode_name(mode);
        Some(GuidedError::TakenOver { mode, show_s: show_s as i64 })
    }

    fn is_high(&self) -> bool {
        self.above_home_m >= JOIN_AT * self.takeoff_alt_m
    }

    fn end_s(&self) -> f64 {
        self.flight.trajectory.duration_ms() as f64 / 1000.0
    }

    fn fly(&mut self, now: Micros, show_s: f64, takeoff_s: f64) -> Step<Result<(), GuidedError>> {
        if let Phase::Recall { since, lost_s } = self.phase {
            return self.recall(now, since, lost_s);
        }
        // It may still be on the ground: `fleet abort` of another station takes it out of GUIDED.
        if self.phase != Phase::Land
            && self.obeyed
            && let Some(error) = self.taken_over(show_s)
        {
            return Step::Done(Err(error));
        }
        match self.phase {
            Phase::Wait => {
                let arm_s = takeoff_s - ARM_BEFORE_S;
                if show_s < arm_s {
                    return Step::Wait(self.at(now, arm_s).max(now + 1).min(now + S));
                }
                if show_s > takeoff_s {
                    return Step::Done(Err(GuidedError::TooLate));
                }
                self.go(Phase::Arm, now);
                Step::Wait(now)
            }
            Phase::Arm | Phase::Ready | Phase::Takeoff if show_s > takeoff_s + TAKEOFF_WITHIN_S => {
                // Whatever it was told before, it must not take off later.
                self.failed = Some(GuidedError::NoTakeoff { said: self.said.clone() });
                self.go(Phase::Land, now);
                Step::Wait(now)
            }
            Phase::Arm if self.armed && self.mode == Some(GUIDED) => {
                self.go(Phase::Ready, now);
                Step::Wait(now)
            }
            Phase::Arm => {
                self.next = now + REPEAT;
                if self.mode == Some(GUIDED) {
                    Step::send(self.command(MavCmd::MAV_CMD_COMPONENT_ARM_DISARM, 1.0, 0.0))
                } else {
                    Step::send(set_mode(self.drone, GUIDED, 0))
                }
            }
            Phase::Ready => {
                if show_s < takeoff_s {
                    return Step::Wait(self.at(now, takeoff_s).max(now + 1).min(now + S));
                }
                self.go(Phase::Takeoff, now);
                Step::Wait(now)
            }
            Phase::Takeoff => {
                let high = self.is_high();
                let wanted_m = self.flight.trajectory.state_at(show_s).position_m.z
                    - self.flight.trajectory.start_m.z;
                if high && wanted_m >= self.above_home_m {
                    self.go(Phase::Stream, now);
                    return Step::Wait(now);
                }
                if high {
                    // The trajectory has not come up to it yet.
                    self.next = now + 50 * MS;
                    return Step::Wait(self.next);
                }
                self.next = now + REPEAT;
                let altitude = self.takeoff_alt_m as f32;
                Step::send(self.command(MavCmd::MAV_CMD_NAV_TAKEOFF, 0.0, altitude))
            }
            Phase::Stream => {
                if show_s >= self.end_s() {
                    self.go(Phase::Land, now);
                    return Step::Wait(now);
                }
                let tick = (show_s * 1000.0 / TARGET_EVERY_MS).floor() + 1.0;
                self.next = self.at(now, tick * TARGET_EVERY_MS / 1000.0).max(now + MS);
                self.targets += 1;
                Step::send(position_target(self.drone, self.boot_ms, &self.target(show_s)))
            }
            Phase::Land if !self.armed => Step::Done(self.failed.take().map_or(Ok(()), Err)),
            Phase::Land => {
                self.next = now + REPEAT;
                if self.mode == Some(LAND) {
                    Step::Wait(self.next)
                } else if let Some(error) = self.taken_over(show_s) {
                    Step::Done(Err(self.failed.take().unwrap_or(error)))
                } else {
                    Step::send(set_mode(self.drone, LAND, 0))
                }
            }
            Phase::Recall { since, lost_s } => self.recall(now, since, lost_s),
        }
    }

    /// Tells a lost drone to return.
    fn recall(&mut self, now: Micros, since: Micros, lost_s: i64) -> Step<Result<(), GuidedError>> {
        let lost = |then| Step::Done(Err(GuidedError::Lost { show_s: lost_s, then }));
        let heard = self.heard.is_some_and(|at| at > since);
        if heard && (!self.armed || self.mode.is_some_and(|mode| mode != GUIDED)) {
            return lost(AfterLoss::Returns);
        }
        if now >= since + RECALL {
            return lost(AfterLoss::Silent);
        }
        self.next = now + REPEAT;
        Step::send(set_mode(self.drone, RTL, 0))
    }

    /// Nothing was heard for too long.
    fn lose(&mut self, now: Micros, show_s: f64) -> Step<Result<(), GuidedError>> {
        let lost_s = show_s as i64;
        if !self.armed || self.phase == Phase::Land {
            let then = AfterLoss::LeftAlone;
            return Step::Done(Err(GuidedError::Lost { show_s: lost_s, then }));
        }
        self.go(Phase::Recall { since: now, lost_s }, now);
        Step::Wait(now)
    }
}

impl Conversation for Guided {
    type Done = Result<(), GuidedError>;

    fn on_message(&mut self, now: Micros, message: &MavMessage) {
        match message {
            MavMessage::HEARTBEAT(beat) => {
                self.heard = Some(now);
                let armed = beat.base_mode.contains(MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED);
                if (self.mode, self.armed) != (Some(beat.custom_mode), armed) {
                    self.next = self.next.min(now);
                }
                self.mode = Some(beat.custom_mode);
                self.obeyed |= beat.custom_mode == GUIDED;
                self.armed = armed;
            }
            MavMessage::GLOBAL_POSITION_INT(at) => {
                self.boot_ms = at.time_boot_ms;
                self.above_home_m = f64::from(at.relative_alt) / 1000.0;
                if self.phase == Phase::Takeoff && self.is_high() {
                    self.next = self.next.min(now);
                }
                // The heading at arming is kept.
                if at.hdg != u16::MAX && matches!(self.phase, Phase::Wait | Phase::Arm) {
                    self.heading_deg = Some(f64::from(at.hdg) / 100.0);
                }
            }
            MavMessage::SYSTEM_TIME(time) => self.flight.clock.read(now, time.time_unix_usec),
            MavMessage::STATUSTEXT(text) => self.said = super::messages::chars(&text.text[..]),
            MavMessage::COMMAND_ACK(ack)
                if self.phase == Phase::Arm
                    && ack.command == MavCmd::MAV_CMD_COMPONENT_ARM_DISARM
                    && ack.result == MavResult::MAV_RESULT_ACCEPTED =>
            {
                // The heartbeat confirms; no need to ask again before the next one.
                self.next = self.next.max(now + S);
            }
            _ => {}
        }
    }

    fn poll(&mut self, now: Micros) -> Step<Self::Done> {
        if let Some(reason) = self.refused.take() {
            return Step::Done(Err(GuidedError::Trajectory { reason }));
        }
        let heard = *self.heard.get_or_insert(now);
        let (Some(show_s), Some(takeoff_s)) = (self.show_s(now), self.takeoff_s) else {
            if now >= heard + LOST {
                return Step::Done(Err(GuidedError::NoClock));
            }
            return Step::Wait(now + S);
        };
        if now >= heard + LOST && !matches!(self.phase, Phase::Recall { .. }) {
            return self.lose(now, show_s);
        }
        let rate = self.flight.clock.rate();
        if rate > 1.0 && now >= self.next_beat {
            // Its failsafe counts seconds of its own, the link's heartbeats are too far apart.
            self.next_beat = now + (S as f64 / rate) as Micros;
            return Step::send(heartbeat());
        }
        if now < self.next {
            return Step::Wait(self.next);
        }
        self.fly(now, show_s, takeoff_s)
    }

    fn refused(&mut self, refusal: &Refusal) -> Option<Self::Done> {
        Some(Err(self.failed.take().unwrap_or(GuidedError::Held { why: refusal.why.clone() })))
    }

    fn progress(&self) -> Progress {
        let total = self.flight.trajectory.duration_ms() / TARGET_EVERY_MS as u64;
        Progress { done: self.targets.min(total), total }
    }
}
