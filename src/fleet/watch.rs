//! Watch over a running show: where every drone is against its trajectory, and what goes wrong.
//!
//! A [`Monitor`] takes all messages, keeps the [`Telemetry`], and tells [`Event`]s in the order
//! in which they become known. It does nothing on its own: aborting is a person's decision.

use std::collections::{BTreeMap, VecDeque};

use serde::{Deserialize, Serialize};

use super::messages::mode_name;
use super::off_course::{Change, Course, Moment};
use super::preflight::charge_needed;
use super::slots::{FleetTable, geodetic};
use super::telemetry::{Drone, Telemetry};
use crate::base::frame::ShowFrame;
use crate::link::clock::{MS, Micros, S};
use crate::link::conversation::Observer;
use crate::link::frame::MavMessage;
use crate::link::id::DroneId;
use crate::link::net::Received;
use crate::mission::Plan;
use crate::protocol::show::{Stage, flag};

/// Limits at which events are reported.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Distance from the trajectory at which a drone is far, m; in and after steps of velocity it
    /// may be further away.
    pub far_m: f64,
    /// Silence at which a drone is reported, us. It counts while the station listens: one that is
    /// held up hears no drone.
    pub silent: Micros,
    /// Charge below which a drone is reported once, %; by default the plan's landing reserve.
    pub battery_percent: f64,
}

impl Limits {
    /// Limits for a plan: three metres (as in the firmware itself), three seconds, the plan's
    /// reserve.
    pub fn of(plan: &Plan) -> Self {
        let battery_percent = 100.0 * plan.limits.endurance_reserve;
        Self { far_m: 3.0, silent: 3 * S, battery_percent }
    }
}

/// Event in the flight of one drone.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "snake_case")]
pub enum Event {
    /// The drone has entered another stage of the show.
    Stage {
        /// Number of the stage in the firmware.
        number: u8,
        /// Name of the stage, for people.
        stage: String,
    },
    /// The drone has changed to another flight mode.
    Mode {
        /// Name of the flight mode.
        mode: String,
    },
    /// The drone was armed or disarmed.
    Armed {
        /// Whether it is armed now.
        armed: bool,
    },
    /// The drone was switched off and on, or its autopilot has failed and restarted.
    Restarted {
        /// Whether it was in the air then.
        in_the_air: bool,
    },
    /// The drone has not been heard for too long.
    Silent {
        /// Time since it was last heard, s.
        seconds: u64,
    },
    /// The drone is heard again.
    HeardAgain,
    /// The drone is far from its trajectory.
    Far {
        /// Distance from the trajectory, m.
        distance_m: f64,
        /// Show time of the drone, s.
        show_s: f64,
    },
    /// The drone is near its trajectory again.
    NearAgain,
    /// The battery is low.
    BatteryLow {
        /// Remaining charge, %.
        percent: u8,
    },
    /// The drone has left its fence.
    FenceBreached,
    /// The drone sends a text of weight.
    Says {
        /// Severity of the text in MAVLink: 0 emergency ... 3 error, 4 warning.
        severity: u8,
        /// Text of the message.
        text: String,
    },
}

impl Event {
    /// Whether a person must look at the event at once.
    pub fn is_alarm(&self) -> bool {
        match self {
            Self::Silent { .. }
            | Self::Far { .. }
            | Self::BatteryLow { .. }
            | Self::Restarted { in_the_air: true }
            | Self::FenceBreached => true,
            Self::Says { severity, .. } => *severity <= 3,
            Self::Stage { number, .. } => Stage::from_number(*number) == Stage::Error,
            _ => false,
        }
    }
}

impl std::fmt::Display for Event {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Stage { stage, .. } => f.write_str(stage),
            Self::Mode { mode } => write!(f, "flight mode {mode}"),
            Self::Armed { armed: true } => f.write_str("armed"),
            Self::Armed { armed: false } => f.write_str("disarmed"),
            Self::Restarted { in_the_air: true } => f.write_str("restarted in the air"),
            Self::Restarted { in_the_air: false } => f.write_str("restarted"),
            Self::Silent { seconds } => write!(f, "not heard for {seconds} s"),
            Self::HeardAgain => f.write_str("heard again"),
            Self::Far { distance_m, show_s } => {
                write!(f, "{distance_m:.1} m from its trajectory at {show_s:.1} s")
            }
            Self::NearAgain => f.write_str("near its trajectory again"),
            Self::BatteryLow { percent } => write!(f, "battery low: {percent} %"),
            Self::FenceBreached => f.write_str("has left its fence"),
            Self::Says { text, .. } => write!(f, "says: {text}"),
        }
    }
}

/// An event, with its time and its drone.
#[derive(Clone, Debug, PartialEq)]
pub struct Told {
    /// Time at which it became known, us.
    pub at: Micros,
    /// Identifier of the drone.
    pub drone: DroneId,
    /// Event, as it was observed.
    pub event: Event,
}

/// State of one drone's flight at present.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Flying {
    /// Show time by the drone's own clock, s.
    pub show_s: Option<f64>,
    /// Distance from the trajectory, m, while the drone performs.
    pub distance_m: Option<f64>,
    /// Whether the drone has flown and is on the ground again, or never will fly.
    pub over: bool,
    /// Whether the drone was seen in the air.
    pub flew: bool,
    /// Whether the drone has restarted in the air, and was not seen to fly on: it has not landed,
    /// but come down.
    pub fell: bool,
}

#[expect(clippy::struct_excessive_bools, reason = "what was told, each on its own")]
struct Watched {
    slot: u16,
    course: Course,
    flying: Flying,
    /// How long the station had listened when it was heard last.
    heard: Micros,
    stage: Option<Stage>,
    mode: Option<u32>,
    armed: Option<bool>,
    was_armed: bool,
    /// Restarts that were told.
    restarts: u32,
    /// Whether it was in the air when its board's time was heard last.
    was_in_the_air: bool,
    /// When it has restarted last.
    restarted: Micros,
    /// Since when its motors have stood still.
    disarmed: Option<Micros>,
    silent: bool,
    low: bool,
    breached: bool,
    texts: u64,
}

/// Events kept until they are taken; the oldest go first.
const MOST_EVENTS: usize = 10_000;
/// Drones are looked at so often.
const LOOK: Micros = 100 * MS;
/// A station that looks again later than this was held up for the rest of the time.
const LISTENS: Micros = S;
/// How well a position's time is known by the drone's own board, s.
const BOARD_DOUBT_S: f64 = 0.2;
/// How well it is known by its arrival, s: what links delay, and how old the clock's reading is.
const ARRIVAL_DOUBT_S: f64 = 1.0;
/// Simulators do not keep their rate: the share of the time since the clock's reading that is not
/// known.
const RATE_DOUBT: f64 = 0.5;
/// Nobody takes off later than this after the time at which it should; see the firmware's window.
const TOO_LATE_S: f64 = 30.0;
/// A drone that is guided from the ground has joined its trajectory so long after the take-off:
/// its motors take a while to spin up, s.
const CLIMB_S: f64 = 8.0;

/// Monitor of a show: messages in, events out.
pub struct Monitor {
    /// Telemetry of every vehicle, including those that are not watched.
    pub telemetry: Telemetry,
    frame: ShowFrame,
    limits: Limits,
    start_gps_ms: Option<i64>,
    watched: BTreeMap<DroneId, Watched>,
    told: VecDeque<Told>,
    next: Micros,
    /// The first look.
    begun: Option<Micros>,
    /// When it was called last, and how long it has listened.
    called: Option<Micros>,
    listened: Micros,
}

impl Monitor {
    /// A monitor of the drones of a table, each against its slot's trajectory. `telemetry` is what
    /// is already known of them.
    pub fn new(plan: &Plan, table: &FleetTable, telemetry: Telemetry, limits: Limits) -> Self {
        let watched = table.drones.iter().filter_map(|line| {
            let trajectory = plan.trajectory(plan.slot(line.slot)?);
            let known = telemetry.get(line.drone);
            let texts = known.map_or(0, |of| of.texts_said);
            let restarts = known.map_or(0, |of| of.restarts);
            let watched = Watched {
                slot: line.slot,
                course: Course::new(trajectory),
                flying: Flying::default(),
                heard: 0,
                stage: None,
                mode: None,
                armed: None,
                was_armed: false,
                restarts,
                was_in_the_air: false,
                restarted: 0,
                disarmed: None,
                silent: false,
                low: false,
                breached: false,
                texts,
            };
            Some((line.drone, watched))
        });
        Self {
            frame: plan.site.frame(),
            limits,
            start_gps_ms: None,
            watched: watched.collect(),
            told: VecDeque::new(),
            next: 0,
            begun: None,
            called: None,
            listened: 0,
            telemetry,
        }
    }

    /// Sets the instant of show time 0, ms since the GPS epoch; `None` removes it.
    pub fn set_start(&mut self, start_gps_ms: Option<i64>) {
        self.start_gps_ms = start_gps_ms;
    }

    /// Takes the events since the last call.
    pub fn take_events(&mut self) -> Vec<Told> {
        self.told.drain(..).collect()
    }

    /// State of each watched drone's flight.
    pub fn flying(&self) -> impl Iterator<Item = (DroneId, Flying)> {
        self.watched.iter().map(|(drone, watched)| (*drone, watched.flying))
    }

    /// Slot of each watched drone.
    pub fn slots(&self) -> impl Iterator<Item = (DroneId, u16)> {
        self.watched.iter().map(|(drone, watched)| (*drone, watched.slot))
    }

    /// Whether every drone has flown and is on the ground again, or never will take off. A silent
    /// drone counts as flying until it should have landed.
    pub fn is_over(&self) -> bool {
        self.watched.values().all(|watched| watched.flying.over)
    }

    /// The time in which it listened goes on.
    fn listen(&mut self, now: Micros) {
        let passed = now.saturating_sub(self.called.unwrap_or(now));
        self.listened += passed.min(LISTENS);
        self.called = Some(now);
    }

    /// Looks where a drone says that it is.
    fn place(&mut self, now: Micros, drone: DroneId) {
        let Self { telemetry, watched, told, limits, frame, start_gps_ms, .. } = self;
        let (Some(watched), Some(of)) = (watched.get_mut(&drone), telemetry.drones.get(&drone))
        else {
            return;
        };
        if let Some(event) = watched.distance(of, limits, frame, *start_gps_ms) {
            if told.len() >= MOST_EVENTS {
                told.pop_front();
            }
            told.push_back(Told { at: now, drone, event });
        }
    }

    fn look(&mut self, now: Micros) {
        self.next = now + LOOK;
        let begun = *self.begun.get_or_insert(now);
        // By the clocks of those that are heard.
        let show_s = self.watched.values().filter_map(|of| of.flying.show_s).reduce(f64::max);
        let Self { telemetry, watched, told, limits, start_gps_ms, listened, .. } = self;
        for (drone, watched) in watched {
            let mut tell = |event| {
                if told.len() >= MOST_EVENTS {
                    told.pop_front();
                }
                told.push_back(Told { at: now, drone: *drone, event });
            };
            match telemetry.drones.get(drone) {
                Some(of) => {
                    let of_all = (*start_gps_ms, show_s);
                    watched.look((now, *listened), of, limits, of_all, &mut tell);
                }
                None => watched.miss(now.saturating_sub(begun), limits, show_s, &mut tell),
            }
        }
    }
}

impl Observer for Monitor {
    fn on_message(&mut self, now: Micros, received: &Received) {
        self.listen(now);
        self.telemetry.on_message(now, received);
        let of = self.telemetry.drones.get(&received.from);
        if let (Some(watched), Some(of)) = (self.watched.get_mut(&received.from), of) {
            watched.heard = self.listened;
            if let Some(event) = watched.restart(now, of, &received.message) {
                let drone = received.from;
                if self.told.len() >= MOST_EVENTS {
                    self.told.pop_front();
                }
                self.told.push_back(Told { at: now, drone, event });
            }
        }
        if matches!(received.message, MavMessage::GLOBAL_POSITION_INT(_)) {
            self.place(now, received.from);
        }
        if now >= self.next {
            self.look(now);
        }
    }

    fn stop(&mut self, now: Micros) -> bool {
        self.listen(now);
        if now >= self.next {
            self.look(now);
        }
        false
    }
}

/// Above home by so much a drone is in the air, m.
const IN_THE_AIR_M: f64 = 0.5;
/// A drone whose motors have stopped in the air is given so long to say where it is.
const PLACELESS: Micros = 15 * S;
/// A drone that is silent is waited for until so long after it should have landed, s.
const SILENT_UNTIL_S: f64 = 60.0;

/// Whether a drone is in the air by what it has said last.
fn is_in_the_air(of: &Drone) -> bool {
    let flies = of.status.is_some_and(|(_, status)| status.stage.is_flying());
    let high = of.position.is_some_and(|(_, at)| at.above_home_m > IN_THE_AIR_M);
    flies || (of.is_armed() == Some(true) && high)
}

impl Watched {
    /// Takes note of whether it is in the air, and whether it has restarted there.
    fn restart(&mut self, now: Micros, of: &Drone, message: &MavMessage) -> Option<Event> {
        let restarted = of.restarts != self.restarts;
        let flies = is_in_the_air(of);
        if !restarted {
            // What the old boot has said says nothing of the new.
            let fresh = |at: Option<Micros>| at.is_none_or(|at| at > self.restarted);
            let flies = flies
                && (self.restarted == 0
                    || of.armed.is_some_and(|(at, armed)| armed && at > self.restarted)
                        && fresh(of.status.map(|(at, _)| at)));
            self.flying.flew |= flies;
            self.flying.fell &= !flies;
        }
        // What else it says may be of the new boot, before its board's time is.
        let tells_time =
            matches!(message, MavMessage::GLOBAL_POSITION_INT(_) | MavMessage::SYSTEM_TIME(_));
        if !tells_time {
            return None;
        }
        let in_the_air = std::mem::replace(&mut self.was_in_the_air, flies && !restarted);
        if !restarted {
            return None;
        }
        (self.restarts, self.restarted) = (of.restarts, now);
        self.flying.fell |= in_the_air;
        Some(Event::Restarted { in_the_air })
    }

    /// Nothing was ever heard of it, for so long.
    fn miss(
        &mut self,
        silence: Micros,
        limits: &Limits,
        show_s: Option<f64>,
        tell: &mut dyn FnMut(Event),
    ) {
        if silence > limits.silent && !self.silent {
            self.silent = true;
            tell(Event::Silent { seconds: silence / S });
        }
        let end_s = self.course.trajectory().duration_ms() as f64 / 1000.0;
        // Without anybody's clock it is waited for as long as a flight takes.
        let show_s = show_s.unwrap_or(silence as f64 * 1e-6);
        self.flying.over = show_s > end_s + SILENT_UNTIL_S;
    }

    fn look(
        &mut self,
        (now, listened): (Micros, Micros),
        of: &Drone,
        limits: &Limits,
        (start_gps_ms, fleet_s): (Option<i64>, Option<f64>),
        tell: &mut dyn FnMut(Event),
    ) {
        self.states(of, tell);
        let silent = listened.saturating_sub(self.heard) > limits.silent;
        if silent != self.silent {
            self.silent = silent;
            let seconds = now.saturating_sub(of.heard) / S;
            tell(if silent { Event::Silent { seconds } } else { Event::HeardAgain });
        }
        if let Some((_, health)) = of.health
            && let Some(percent) = health.battery_percent
            && f64::from(percent) < limits.battery_percent
            && !self.low
        {
            self.low = true;
            tell(Event::BatteryLow { percent });
        }
        let gps_ms = of.clock.gps_ms(now);
        self.flying.show_s =
            start_gps_ms.zip(gps_ms).map(|(start, gps_ms)| (gps_ms - start as f64) / 1000.0);
        if !performs(of) {
            self.flying.distance_m = None;
        }
        // A flight whose start nobody knows is over for a drone that has landed.
        self.flying.over = match start_gps_ms {
            None => {
                self.was_armed && self.armed == Some(false) || now.saturating_sub(of.heard) > 60 * S
            }
            // One that has restarted may never know the time again.
            Some(_) => self.over(self.flying.show_s.or(fleet_s)),
        };
        // Motors that stop in the air: whether that was a landing or a restart, its next place says.
        let stopped = *match self.armed {
            Some(false) => self.disarmed.get_or_insert(now),
            _ => self.disarmed.insert(now),
        };
        if self.was_in_the_air && self.armed == Some(false) && !self.silent {
            let placeless = now >= stopped + PLACELESS;
            let high = of.position.is_some_and(|(_, at)| at.above_home_m > IN_THE_AIR_M);
            self.flying.over &= placeless;
            self.flying.fell |= placeless && high;
        }
    }

    fn states(&mut self, of: &Drone, tell: &mut dyn FnMut(Event)) {
        if let Some((_, status)) = of.status {
            if self.stage.is_some_and(|stage| stage != status.stage) {
                let stage = status.stage.to_string();
                tell(Event::Stage { number: status.stage.number(), stage });
            }
            self.stage = Some(status.stage);
            let breached = status.has(flag::FENCE_BREACHED);
            if breached && !self.breached {
                tell(Event::FenceBreached);
            }
            self.breached = breached;
        }
        if let Some((_, mode)) = of.mode {
            if self.mode.is_some_and(|old| old != mode) {
                tell(Event::Mode { mode: mode_name(mode) });
            }
            self.mode = Some(mode);
        }
        if let Some((_, armed)) = of.armed {
            if self.armed.is_some_and(|old| old != armed) {
                tell(Event::Armed { armed });
            }
            self.armed = Some(armed);
            self.was_armed |= armed;
        }
        let new = (of.texts_said - self.texts.min(of.texts_said)) as usize;
        self.texts = of.texts_said;
        for text in of.texts.iter().skip(of.texts.len().saturating_sub(new)) {
            if text.severity <= 4 {
                tell(Event::Says { severity: text.severity, text: text.text.clone() });
            }
        }
    }

    /// Where it is against where it should have been when it measured that.
    fn distance(
        &mut self,
        of: &Drone,
        limits: &Limits,
        frame: &ShowFrame,
        start_gps_ms: Option<i64>,
    ) -> Option<Event> {
        self.flying.distance_m = None;
        let ((arrived, position), start) = of.position.zip(start_gps_ms)?;
        let on_board = of.clock.gps_ms_on_board(position.boot_ms);
        let by_arrival = || {
            let age_s = of.clock.age(arrived)? as f64 / 1e6;
            let rate = of.clock.rate();
            let drift_s = if rate == 1.0 { 0.0 } else { RATE_DOUBT * rate * age_s };
            Some((of.clock.gps_ms(arrived)?, ARRIVAL_DOUBT_S + drift_s))
        };
        let (gps_ms, doubt_s) =
            on_board.map(|gps_ms| (gps_ms, BOARD_DOUBT_S)).or_else(by_arrival)?;
        let show_s = (gps_ms - start as f64) / 1000.0;
        let end_s = self.course.trajectory().duration_ms() as f64 / 1000.0;
        // The show firmware tells when it has joined its trajectory; without it, time does.
        let told = of.status.is_some_and(|(_, status)| status.stage == Stage::Performing);
        let joined = told || show_s > self.wait_s() + CLIMB_S;
        if !performs(of) || show_s < 0.0 || show_s > end_s || !joined {
            return None;
        }
        let mut place = frame.from_geodetic(geodetic(&position));
        // Heights are above home, wherever the vehicle believes the sea to be.
        place.z = position.above_home_m + self.course.trajectory().start_m.z;
        let at = Moment { show_s, doubt_s };
        let (distance_m, change) = self.course.look(place, at, limits.far_m)?;
        self.flying.distance_m = Some(distance_m);
        Some(match change? {
            Change::Far => Event::Far { distance_m, show_s },
            Change::Near => Event::NearAgain,
        })
    }

    fn over(&self, show_s: Option<f64>) -> bool {
        if self.armed == Some(true) && !self.silent {
            return false;
        }
        let Some(show_s) = show_s else { return false };
        let end_s = self.course.trajectory().duration_ms() as f64 / 1000.0;
        match self.stage {
            _ if self.silent => show_s > end_s + SILENT_UNTIL_S,
            _ if self.was_armed => show_s > 0.0,
            Some(Stage::Landed | Stage::Error) => show_s > 0.0,
            _ => show_s > TOO_LATE_S + self.wait_s(),
        }
    }

    /// Until then a drone of a later group stands on the ground, s.
    fn wait_s(&self) -> f64 {
        let trajectory = self.course.trajectory();
        let first = trajectory.pieces().find(|piece| piece.end_m() != trajectory.start_m);
        first.map_or(0.0, |piece| piece.start_ms as f64 / 1000.0)
    }
}

/// Whether it flies its trajectory.
fn performs(of: &Drone) -> bool {
    match of.status.map(|(_, status)| status.stage) {
        Some(stage) if stage != Stage::Off => stage == Stage::Performing,
        // Without show mode, or not in it: while it is guided.
        _ => {
            let mode = of.mode.map(|(_, mode)| mode);
            of.is_armed() == Some(true) && mode == Some(super::messages::GUIDED)
        }
    }
}

/// Landing reserve of a plan, and the charge that its flight needs, %: for tables.
pub fn charge(plan: &Plan) -> (f64, f64) {
    (100.0 * plan.limits.endurance_reserve, charge_needed(plan))
}
