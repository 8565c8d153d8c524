//! Progress of a show as the server sees it: states, errors and batteries of its drones (UAV-INF).

use std::collections::{BTreeMap, BTreeSet};

use serde::Serialize;
use serde_json::Value;

use super::state::{State, is_show_mode};
use crate::link::clock::{Micros, S};

/// Codes below are states of a healthy drone.
pub(super) const FIRST_WARNING: u64 = 64;
const ON_GROUND: u64 = 1;
const LANDED: u64 = 7;
const MOTORS_RUN: u64 = 8;
/// The server forgets drones that are silent for so long.
const SILENT: Micros = 5 * S;

/// Meaning of the server's number for a state or an error, for people.
pub fn code_name(code: u64) -> &'static str {
    match code {
        1 => "on the ground",
        2 => "its logging is off",
        3 => "pre-arm check running",
        4 => "initializing",
        5 => "take-off",
        6 => "landing",
        7 => "landed",
        8 => "motors running on the ground",
        9 => "sleeping",
        63 => "returning home",
        64 => "its disk is nearly full",
        65 => "no remote control",
        66 => "battery low",
        67 => "its clock is not synchronised",
        68 => "far from its take-off position",
        69 => "its mission is not set up",
        71 => "near its fence",
        73 => "its motors are disarmed for good (safety switch)",
        74 => "it must be rebooted",
        75 => "far from where it should be",
        128 => "no communication with the autopilot",
        131 => "pre-arm check failed",
        133 => "GPS error",
        134 => "battery error",
        137 => "configuration error",
        142 => "motor controller error",
        193 => "magnetometer broken",
        194 => "gyroscope broken",
        195 => "accelerometer broken",
        196 => "barometer broken",
        197 => "GPS broken",
        198 => "motor broken",
        199 => "battery critical",
        201 => "has left its fence",
        205 => "its autopilot did not start",
        207 => "crashed",
        other => of_group(other),
    }
}

/// Codes without words of their own, by how bad they are.
fn of_group(code: u64) -> &'static str {
    match code {
        0..64 => "unknown state",
        64..128 => "warning",
        128..192 => "error",
        192.. => "critical error",
    }
}

/// Codes of a drone's status.
pub fn codes(status: &Value) -> BTreeSet<u64> {
    let list = status.get("errors").and_then(Value::as_array);
    list.into_iter().flatten().filter_map(Value::as_u64).collect()
}

/// Codes of a drone's status that keep it from flying.
pub fn warnings(status: &Value) -> BTreeSet<u64> {
    codes(status).into_iter().filter(|code| *code >= FIRST_WARNING).collect()
}

/// Whether a drone is on the ground for certain.
pub fn is_on_ground(status: &Value) -> bool {
    is_down(&codes(status))
}

/// Whether these are codes of a drone that is on the ground for certain.
pub(super) fn is_down(codes: &BTreeSet<u64>) -> bool {
    codes.contains(&ON_GROUND) || codes.contains(&LANDED)
}

/// Change in the state of a drone.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "event", rename_all = "snake_case")]
#[non_exhaustive]
pub enum Event {
    /// The drone has changed to another flight mode.
    Mode {
        /// Name of the flight mode, as the server has it.
        mode: String,
    },
    /// The drone has entered a state, or has an error.
    Code {
        /// The server's number of the state or error.
        code: u64,
    },
    /// An error has gone.
    CodeGone {
        /// The server's number of the error.
        code: u64,
    },
    /// The battery is low.
    BatteryLow {
        /// Remaining charge, %.
        percent: f64,
    },
    /// The server has heard nothing of it for too long.
    Silent {
        /// Time since the server last heard from the drone, s.
        seconds: u64,
    },
    /// The server hears from the drone again.
    HeardAgain,
}

impl Event {
    /// Whether a person must look at it at once.
    pub fn is_alarm(&self) -> bool {
        match self {
            Self::Code { code } => *code >= FIRST_WARNING,
            Self::BatteryLow { .. } | Self::Silent { .. } => true,
            _ => false,
        }
    }
}

impl std::fmt::Display for Event {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Mode { mode } => write!(f, "flight mode {mode}"),
            Self::Code { code } if *code < FIRST_WARNING => f.write_str(code_name(*code)),
            Self::Code { code } => write!(f, "{} (code {code})", code_name(*code)),
            Self::CodeGone { code } => write!(f, "no longer: {} (code {code})", code_name(*code)),
            Self::BatteryLow { percent } => write!(f, "battery low: {percent:.0} %"),
            Self::Silent { seconds } => write!(f, "not heard by the server for {seconds} s"),
            Self::HeardAgain => f.write_str("heard again"),
        }
    }
}

#[derive(Debug, Default)]
#[expect(clippy::struct_excessive_bools, reason = "each is told of by itself")]
struct Watched {
    mode: Option<String>,
    codes: Option<BTreeSet<u64>>,
    low: bool,
    silent: bool,
    timestamp: Option<Value>,
    heard: Micros,
    /// Off the ground since the start.
    flown: bool,
    landed: bool,
    /// On the ground when it was heard last.
    down: bool,
    /// Another station has watched it before.
    attached: bool,
    /// On the ground when it was seen first, after the start.
    found_down: bool,
    /// The flight mode for which it left the show mode in the air.
    left: Option<String>,
}

/// Monitor of a show: it takes statuses and returns events, and does no input or output of its own.
#[derive(Debug)]
pub struct Monitor {
    battery_percent: f64,
    drones: BTreeMap<String, Watched>,
}

impl Monitor {
    /// A monitor of these drones. A drone whose charge falls below `battery_percent` is reported once.
    pub fn new(
        drones: impl IntoIterator<Item = String>,
        battery_percent: f64,
        now: Micros,
    ) -> Self {
        let watched = |id| (id, Watched { heard: now, ..Watched::default() });
        Self { battery_percent, drones: drones.into_iter().map(watched).collect() }
    }

    /// Prepares for a flight that may have begun before: drones found on the ground may have landed.
    pub fn attach(&mut self) {
        for watched in self.drones.values_mut() {
            watched.attached = true;
        }
    }

    /// Takes the statuses of the drones and returns what has changed, by drone. `started`: the start
    /// has passed, so that a drone that is down has flown.
    pub fn look(
        &mut self,
        now: Micros,
        started: bool,
        status: &BTreeMap<String, Value>,
    ) -> Vec<(String, Event)> {
        let mut told = Vec::new();
        for (id, watched) in &mut self.drones {
            let mut tell = |event| told.push((id.clone(), event));
            watched.hearing(now, status.get(id), &mut tell);
            if let Some(status) = status.get(id) {
                watched.states(status, self.battery_percent, started, &mut tell);
            }
        }
        told
    }

    /// Whether every drone has landed after the start.
    pub fn is_over(&self) -> bool {
        self.drones.values().all(|watched| watched.landed || watched.is_found_down())
    }

    /// Whether no drone is in the air, as far as the server reports.
    pub fn all_are_down(&self) -> bool {
        self.drones.values().all(|watched| watched.landed || watched.stayed_down())
    }

    /// Drones that have flown, or may have, and have not been seen to land.
    pub fn in_the_air(&self) -> Vec<&str> {
        self.named(|watched| !watched.landed && !watched.stayed_down())
    }

    /// Drones that have not left the ground.
    pub fn not_flown(&self) -> Vec<&str> {
        self.named(|watched| !watched.landed && watched.stayed_down() && !watched.is_found_down())
    }

    /// Drones that were on the ground when the watch over a flight in progress began, and still
    /// are.
    pub fn found_down(&self) -> Vec<&str> {
        self.named(Watched::is_found_down)
    }

    /// Drones that have left the show mode in the air, with the flight mode they changed to.
    pub fn left_the_show(&self) -> BTreeMap<String, String> {
        let left = |(id, watched): (&String, &Watched)| Some((id.clone(), watched.left.clone()?));
        self.drones.iter().filter_map(left).collect()
    }

    fn named(&self, which: impl Fn(&Watched) -> bool) -> Vec<&str> {
        let those = self.drones.iter().filter(|(_, watched)| which(watched));
        those.map(|(id, _)| id.as_str()).collect()
    }
}

impl Watched {
    /// It never left the ground, and is heard to be there.
    fn stayed_down(&self) -> bool {
        self.down && !self.flown && !self.silent
    }

    fn is_found_down(&self) -> bool {
        self.found_down && !self.landed && self.stayed_down()
    }

    /// A drone that is gone has no status, or one that does not get newer.
    fn hearing(&mut self, now: Micros, status: Option<&Value>, tell: &mut dyn FnMut(Event)) {
        if let Some(status) = status {
            let timestamp = status.get("timestamp");
            if timestamp.is_none() || timestamp != self.timestamp.as_ref() {
                self.timestamp = timestamp.cloned();
                self.heard = now;
            }
        }
        let silence = now.saturating_sub(self.heard);
        let silent = silence > SILENT;
        if silent != self.silent {
            self.silent = silent;
            let seconds = silence / S;
            tell(if silent { Event::Silent { seconds } } else { Event::HeardAgain });
        }
    }

    fn states(
        &mut self,
        status: &Value,
        battery_percent: f64,
        started: bool,
        tell: &mut dyn FnMut(Event),
    ) {
        let is_first = self.codes.is_none();
        if let Some(mode) = status.get("mode").and_then(Value::as_str) {
            let was_in_show = self.mode.as_deref().is_some_and(is_show_mode);
            let flies = started && !self.landed && (self.flown || !is_on_ground(status));
            if was_in_show && !is_show_mode(mode) && flies {
                self.left.get_or_insert(mode.to_owned());
            }
            if self.mode.as_deref().is_some_and(|old| old != mode) {
                tell(Event::Mode { mode: mode.to_owned() });
            }
            self.mode = Some(mode.to_owned());
        }
        let now = codes(status);
        // The states of the first look are where it stands; its errors were looked at before.
        let before = self.codes.replace(now.clone()).unwrap_or_else(|| now.clone());
        for code in now.difference(&before) {
            tell(Event::Code { code: *code });
        }
        for code in before.difference(&now).filter(|code| **code >= FIRST_WARNING) {
            tell(Event::CodeGone { code: *code });
        }
        let percent = status.pointer("/battery/1").and_then(Value::as_f64);
        if let Some(percent) = percent.filter(|percent| *percent < battery_percent)
            && !self.low
        {
            self.low = true;
            tell(Event::BatteryLow { percent });
        }
        // Not every driver of the server says that a drone has landed: those of ArduPilot are on
        // the ground again.
        let runs = now.contains(&MOTORS_RUN);
        if is_first && self.attached && started && is_on_ground(status) {
            // The show mode says who has flown; who has left it says nothing.
            let says_landed = State::of(status).show.is_some_and(|show| show.text == "Landed");
            self.flown |= says_landed;
            self.found_down = !says_landed;
        }
        self.flown |= started && !is_on_ground(status) && !runs;
        self.landed = started && (now.contains(&LANDED) || self.flown && now.contains(&ON_GROUND));
        self.down = is_on_ground(status);
    }
}

#[cfg(test)]
mod tests {
    use base64::Engine as _;
    use base64::engine::general_purpose::STANDARD;
    use serde_json::json;

    use super::*;

    fn look(monitor: &mut Monitor, second: u64, started: bool, status: Value) -> Vec<String> {
        let status = BTreeMap::from([("01".to_owned(), status)]);
        let told = monitor.look(second * S, started, &status);
        told.iter().map(|(id, event)| format!("{id} {event} {}", event.is_alarm())).collect()
    }

    #[test]
    fn a_flight_is_told_and_its_end_is_seen() {
        let mut monitor = Monitor::new(["01".to_owned()], 25.0, 0);
        let status = |mode: &str, codes: &[u64], percent: f64, time: u64| json!({ "mode": mode, "errors": codes, "battery": [123, percent], "timestamp": time });
        let nothing: [&str; 0] = [];
        // Landed from the flight before.
        assert_eq!(look(&mut monitor, 0, false, status("stab", &[7], 90.0, 0)), nothing);
        assert!(!monitor.is_over());
        let told = look(&mut monitor, 1, false, status("show", &[1], 90.0, 1));
        assert_eq!(told, ["01 flight mode show false", "01 on the ground false"]);
        let told = look(&mut monitor, 2, true, status("show", &[5, 75], 24.0, 2));
        assert_eq!(
            told,
            [
                "01 take-off false",
                "01 far from where it should be (code 75) true",
                "01 battery low: 24 % true"
            ]
        );
        let told = look(&mut monitor, 3, true, status("show", &[], 23.0, 3));
        assert_eq!(told, ["01 no longer: far from where it should be (code 75) false"]);
        let told = look(&mut monitor, 9, true, status("show", &[], 23.0, 3));
        assert_eq!(told, ["01 not heard by the server for 6 s true"]);
        assert_eq!(monitor.in_the_air(), ["01"]);
        let told = look(&mut monitor, 10, true, status("land", &[7], 23.0, 4));
        assert_eq!(told, ["01 heard again false", "01 flight mode land false", "01 landed false"]);
        assert!(monitor.is_over());
        // One whose driver does not tell its landing; on the ground it waits for the start.
        let mut other = Monitor::new(["01".to_owned()], 25.0, 0);
        for (second, code, over) in [(0, 1, false), (1, 8, false), (2, 5, false), (3, 1, true)] {
            look(&mut other, second, true, status("show", &[code], 90.0, second));
            assert_eq!(other.is_over(), over, "{second}");
        }
        // One that was found on the ground by who came late, and one that says that it has flown.
        let landed = STANDARD.encode("[ 00:01:00] Landed");
        for (debug, found) in [("", &["01"][..]), (&landed, &[])] {
            let mut late = Monitor::new(["01".to_owned()], 25.0, 0);
            late.attach();
            let status = |mode: &str, codes: &[u64], time: u64| json!({ "mode": mode, "errors": codes, "debug": debug, "timestamp": time });
            look(&mut late, 1, true, status("show", &[1], 1));
            assert_eq!(late.found_down(), found);
            assert!(late.is_over());
            assert_eq!((late.not_flown().len(), late.in_the_air().len()), (0, 0));
            look(&mut late, 2, true, status("show", &[5], 2));
            assert_eq!(late.in_the_air(), ["01"]);
            assert_eq!(late.left_the_show(), BTreeMap::new());
            look(&mut late, 3, true, status("rth", &[63], 3));
            look(&mut late, 4, true, status("rth", &[1], 4));
            assert!(late.is_over() && late.found_down().is_empty());
            assert_eq!(late.left_the_show()["01"], "rth");
        }
        // One that the server does not know any more.
        let told = monitor.look(16 * S, true, &BTreeMap::new());
        assert_eq!(told, [("01".to_owned(), Event::Silent { seconds: 6 })]);
    }
}
