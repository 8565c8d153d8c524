//! Sets the time of a start, and authorizes it as a second, deliberate step.
//!
//! A start packet has no address: it is broadcast once a second, and everyone who hears it obeys.
//! Whether a drone has taken it is read from its status packets. Times are the vehicles' own:
//! GPS seconds of the week, from their own clocks.

use std::collections::{BTreeMap, BTreeSet};

use super::messages::start_packet;
use super::telemetry::{SILENT_AFTER, Telemetry};
use crate::base::time::{GpsTime, WEEK_S};
use crate::link::clock::{Micros, S};
use crate::link::frame::MavMessage;
use crate::link::id::DroneId;
use crate::numeric::upper_median;
use crate::protocol::show::{CLEAR_TIME, LEAVE_TIME, StartConfig, flag};

/// Options for setting a start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StartOptions {
    /// Time from the decision to the start, s of the vehicles' clocks.
    pub lead_s: f64,
    /// Time of the start, whole seconds; replaces the lead.
    pub at: Option<GpsTime>,
    /// Largest difference allowed between the clocks, s.
    pub clock_spread_s: f64,
    /// Latest time for an authorization, s before the start: the firmware sets its home 10 s and
    /// arms 8 s before take-off.
    pub authorize_before_s: f64,
}

impl Default for StartOptions {
    fn default() -> Self {
        Self { lead_s: 30.0, at: None, clock_spread_s: 1.0, authorize_before_s: 12.0 }
    }
}

/// Shortest lead, s: it leaves time for both steps and for the firmware's own.
pub const LEAST_LEAD_S: f64 = 20.0;
/// Longest lead, s: a start is not set for days. The firmware reads times of the past half week as
/// passed.
pub const MOST_LEAD_S: f64 = 12.0 * 3600.0;

/// Reason why a start is not set or not authorized.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum StartRefusal {
    /// There are no drones to start.
    #[error("there is no drone to start")]
    NoDrones,
    /// The lead is too short or too long.
    #[error(
        "a lead of {lead_s} s is not possible: give {LEAST_LEAD_S} to {MOST_LEAD_S} s; the \
         drones set their home and arm in the last 10 s"
    )]
    Lead {
        /// Lead that was asked for, s.
        lead_s: f64,
    },
    /// The clocks of drones are not known or do not agree.
    #[error("{text}")]
    Clocks {
        /// Description of the problem, with the drones.
        text: String,
    },
    /// Some drones do not have the start time.
    #[error("not authorized: {} without the start time: {}", count(.late), names(.late))]
    Late {
        /// Those drones, and the start that each reports instead.
        late: Vec<(DroneId, Readback)>,
    },
    /// The time left is too short to authorize the start.
    #[error(
        "not authorized: {left_s:.0} s are left to the start, {needed_s:.0} s are needed; it is cancelled and no drone \
         takes off: start again (--lead gives more time)"
    )]
    TooLate {
        /// Time left to the start, s.
        left_s: f64,
        /// Time that an authorization needs, s.
        needed_s: f64,
    },
}

fn count(late: &[(DroneId, Readback)]) -> String {
    if late.len() == 1 { "1 drone is".to_owned() } else { format!("{} drones are", late.len()) }
}

fn names(late: &[(DroneId, Readback)]) -> String {
    let name = |(drone, readback): &(DroneId, Readback)| format!("{drone} ({readback})");
    late.iter().map(name).collect::<Vec<_>>().join(", ")
}

/// Agreement of the vehicles' clocks.
#[derive(Clone, Debug, PartialEq)]
pub enum ClockSpread {
    /// The clocks agree, within the limit.
    Agree {
        /// GPS time of the vehicles now, the median, ms since the GPS epoch.
        gps_ms: f64,
        /// Greatest rate of a clock, seconds of the vehicle per second of the station.
        rate: f64,
    },
    /// The clocks do not agree, or some are not known.
    Apart {
        /// Description of the problem, with the drones and the remedy.
        text: String,
        /// Drones whose clocks differ or are not known.
        drones: Vec<DroneId>,
    },
}

/// Compares the clocks of these vehicles at time `now`.
pub fn clocks(
    telemetry: &Telemetry,
    drones: &BTreeSet<DroneId>,
    most_apart_s: f64,
    now: Micros,
) -> ClockSpread {
    let list =
        |drones: &[DroneId]| drones.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ");
    let mut known = Vec::new();
    let mut unknown = Vec::new();
    let mut rate = 1.0_f64;
    for drone in drones {
        let clock = telemetry.get(*drone).map(|of| &of.clock);
        let fresh = clock.filter(|clock| clock.age(now).is_some_and(|age| age <= 2 * SILENT_AFTER));
        match fresh.and_then(|clock| Some((clock.gps_ms(now)?, clock.rate()))) {
            Some((gps_ms, of)) => {
                known.push((gps_ms, *drone));
                rate = rate.max(of);
            }
            None => unknown.push(*drone),
        }
    }
    if !unknown.is_empty() {
        let text = format!(
            "the GPS time of drones {} is not known: wait for their GPS, or switch them off",
            list(&unknown)
        );
        return ClockSpread::Apart { text, drones: unknown };
    }
    known.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (Some(first), Some(last)) = (known.first(), known.last()) else {
        return ClockSpread::Apart { text: StartRefusal::NoDrones.to_string(), drones: vec![] };
    };
    let middle = known[known.len() / 2].0;
    if last.0 - first.0 <= most_apart_s * 1000.0 {
        return ClockSpread::Agree { gps_ms: middle, rate };
    }
    let off: Vec<DroneId> = known
        .iter()
        .filter(|(gps_ms, _)| (gps_ms - middle).abs() > most_apart_s * 500.0)
        .map(|(_, drone)| *drone)
        .collect();
    let text = format!(
        "the clocks differ by {:.1} s (drones {}), {most_apart_s} s are allowed: they would not \
         start together; restart these drones",
        (last.0 - first.0) / 1000.0,
        list(&off)
    );
    ClockSpread::Apart { text, drones: off }
}

/// Start as a drone's status reports it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Readback {
    /// No fresh status of the drone has been heard.
    Silent,
    /// The drone has no start time.
    NoTime,
    /// The drone has another start time: GPS second of week.
    OtherTime(i32),
    /// The drone has the start time, and is not authorized.
    Set,
    /// The drone has the start time and is authorized.
    Authorized,
}

impl std::fmt::Display for Readback {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Silent => f.write_str("not heard"),
            Self::NoTime => f.write_str("no start time"),
            Self::OtherTime(tow) => write!(f, "start time {tow}"),
            Self::Set => f.write_str("not authorized"),
            Self::Authorized => f.write_str("authorized"),
        }
    }
}

/// StartPhase of a start, which decides what is broadcast.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StartPhase {
    /// Time of the start, without an authorization.
    Announced,
    /// Time and authorization of the start.
    Authorized,
    /// Neither a time nor an authorization.
    Cancelled,
}

/// A start: what to broadcast and when, and which drones have taken it.
#[derive(Clone, Debug)]
pub struct Start {
    drones: BTreeSet<DroneId>,
    at_gps_ms: i64,
    options: StartOptions,
    phase: StartPhase,
    next: Micros,
    /// Another station has set it: it is not repeated, only taken back.
    attached: bool,
    /// Its time is known.
    known: bool,
}

impl Start {
    /// A start that another station has authorized, at this time if it is known.
    pub fn attached(drones: BTreeSet<DroneId>, at: Option<GpsTime>) -> Self {
        let options = StartOptions { at, ..StartOptions::default() };
        let (phase, next) = (StartPhase::Authorized, 0);
        // A start that is not known is over.
        let at_gps_ms = at.map_or(0, GpsTime::total_ms);
        let known = at.is_some();
        Self { drones, at_gps_ms, options, phase, next, attached: true, known }
    }

    /// Whether the start time is known; that of another station's start may not be.
    pub fn is_known(&self) -> bool {
        self.known
    }

    /// Sets a start the given lead ahead. Nothing is authorized by it.
    ///
    /// # Errors
    ///
    /// If the lead is out of range, or the clocks are not known or do not agree.
    pub fn announce(
        drones: BTreeSet<DroneId>,
        telemetry: &Telemetry,
        options: StartOptions,
        now: Micros,
    ) -> Result<Self, StartRefusal> {
        if drones.is_empty() {
            return Err(StartRefusal::NoDrones);
        }
        match clocks(telemetry, &drones, options.clock_spread_s, now) {
            ClockSpread::Apart { text, .. } => Err(StartRefusal::Clocks { text }),
            ClockSpread::Agree { gps_ms, .. } => {
                let lead_s = options
                    .at
                    .map_or(options.lead_s, |at| (at.total_ms() as f64 - gps_ms) / 1000.0);
                if !(LEAST_LEAD_S..=MOST_LEAD_S).contains(&lead_s) {
                    return Err(StartRefusal::Lead { lead_s });
                }
                let second = options.at.map_or_else(
                    || ((gps_ms / 1000.0) + lead_s).ceil() as i64,
                    |at| at.total_ms().div_euclid(1000),
                );
                let at_gps_ms = second * 1000;
                let (phase, next) = (StartPhase::Announced, 0);
                let (attached, known) = (false, true);
                Ok(Self { drones, at_gps_ms, options, phase, next, attached, known })
            }
        }
    }

    /// GPS time of show time 0.
    pub fn time(&self) -> Option<GpsTime> {
        GpsTime::from_total_ms(self.at_gps_ms)
    }

    /// Start as the firmware has it: GPS second of week.
    pub fn second_of_week(&self) -> i32 {
        (self.at_gps_ms / 1000).rem_euclid(i64::from(WEEK_S)) as i32
    }

    /// Drones that are to start.
    pub fn drones(&self) -> &BTreeSet<DroneId> {
        &self.drones
    }

    /// Present phase of the start.
    pub fn phase(&self) -> StartPhase {
        self.phase
    }

    /// Time left to the start by the vehicles' clocks, s (negative after it); `None` without a
    /// clock.
    pub fn left_s(&self, telemetry: &Telemetry, now: Micros) -> Option<f64> {
        self.gps_ms(telemetry, now).map(|gps_ms| (self.at_gps_ms as f64 - gps_ms) / 1000.0)
    }

    fn gps_ms(&self, telemetry: &Telemetry, now: Micros) -> Option<f64> {
        let clock = |drone: &DroneId| telemetry.get(*drone)?.clock.gps_ms(now);
        upper_median(self.drones.iter().filter_map(clock).collect())
    }

    fn rate(&self, telemetry: &Telemetry) -> f64 {
        let rate = |drone: &DroneId| telemetry.get(*drone).map_or(1.0, |of| of.clock.rate());
        self.drones.iter().map(rate).fold(1.0, f64::max)
    }

    /// Start as each drone reports it, by status packets that are fresh.
    pub fn readback(&self, telemetry: &Telemetry, now: Micros) -> BTreeMap<DroneId, Readback> {
        let of = |drone: &DroneId| {
            let status = telemetry.get(*drone).and_then(|known| known.status);
            let fresh = status.filter(|(at, _)| now.saturating_sub(*at) <= SILENT_AFTER);
            match fresh {
                None => Readback::Silent,
                Some((_, status)) if status.start_tow_s < 0 => Readback::NoTime,
                Some((_, status)) if status.start_tow_s != self.second_of_week() => {
                    Readback::OtherTime(status.start_tow_s)
                }
                Some((_, status)) if status.has(flag::AUTHORIZED) => Readback::Authorized,
                Some(_) => Readback::Set,
            }
        };
        self.drones.iter().map(|drone| (*drone, of(drone))).collect()
    }

    /// Drones that have not taken what is broadcast, each with what it reports instead.
    pub fn late(&self, telemetry: &Telemetry, now: Micros) -> Vec<(DroneId, Readback)> {
        let taken = |readback| match self.phase {
            StartPhase::Announced => matches!(readback, Readback::Set | Readback::Authorized),
            StartPhase::Authorized => readback == Readback::Authorized,
            StartPhase::Cancelled => readback == Readback::NoTime,
        };
        let all = self.readback(telemetry, now).into_iter();
        all.filter(|(_, readback)| !taken(*readback)).collect()
    }

    /// Checks that there is time left to authorize the start. For drones that the station itself
    /// flies, and which hear nothing of the start, this is the only condition.
    ///
    /// # Errors
    ///
    /// [`StartRefusal::TooLate`], also if the clocks are not known or the start was cancelled.
    pub fn check_time(&self, telemetry: &Telemetry, now: Micros) -> Result<(), StartRefusal> {
        let needed_s = self.options.authorize_before_s;
        let left_s = self.left_s(telemetry, now).unwrap_or(0.0);
        if left_s < needed_s || self.phase == StartPhase::Cancelled {
            return Err(StartRefusal::TooLate { left_s, needed_s });
        }
        Ok(())
    }

    /// Authorizes the start: the second step, on a person's command.
    ///
    /// # Errors
    ///
    /// If a drone does not have the start time, or too little time is left.
    pub fn authorize(&mut self, telemetry: &Telemetry, now: Micros) -> Result<(), StartRefusal> {
        self.check_time(telemetry, now)?;
        let late = self.late(telemetry, now);
        if !late.is_empty() {
            return Err(StartRefusal::Late { late });
        }
        self.phase = StartPhase::Authorized;
        self.next = now;
        Ok(())
    }

    /// Withdraws time and authorization. The withdrawal must be broadcast until [`Start::late`] is
    /// empty.
    pub fn cancel(&mut self, now: Micros) {
        self.phase = StartPhase::Cancelled;
        self.next = now;
    }

    /// Packet that is broadcast in the present phase.
    pub fn packet(&self) -> MavMessage {
        let start_tow_s = self.second_of_week();
        start_packet(&match self.phase {
            StartPhase::Announced => {
                StartConfig { start_tow_s, authorization: 0, countdown_ms: LEAVE_TIME }
            }
            StartPhase::Authorized => {
                StartConfig { start_tow_s, authorization: 1, countdown_ms: LEAVE_TIME }
            }
            StartPhase::Cancelled => {
                StartConfig { start_tow_s: CLEAR_TIME, authorization: 0, countdown_ms: CLEAR_TIME }
            }
        })
    }

    /// The packet to broadcast, if it is due: once a second of the vehicles' time, and never after
    /// the start, when a start time would be taken for next week's.
    pub fn due(&mut self, telemetry: &Telemetry, now: Micros) -> Option<MavMessage> {
        if now < self.next {
            return None;
        }
        let over = || self.left_s(telemetry, now).is_some_and(|left_s| left_s <= 0.0);
        if self.phase != StartPhase::Cancelled && (self.attached || over()) {
            // Nothing more is sent, unless it is taken back.
            self.next = now + S;
            return None;
        }
        self.next = now + (S as f64 / self.rate(telemetry).max(1.0)) as Micros;
        Some(self.packet())
    }

    /// Time at which [`Start::due`] wants to be called again, us.
    pub fn next(&self) -> Micros {
        self.next
    }
}
