//! State of one drone as the server reports it (UAV-INF).

use std::collections::BTreeSet;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use serde_json::Value;

use super::watch::codes;
use crate::protocol::show::SHOW_MODE;

/// State of a drone as the server sees it; `None` where the server does not report it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct State {
    /// Flight mode, in the server's words.
    pub mode: String,
    /// States and errors, by the server's numbers; see [`super::watch::code_name`].
    pub codes: BTreeSet<u64>,
    /// Report of the show mode, if the drone sends one.
    pub show: Option<ShowLine>,
    /// Type of the GPS fix; a height is known from 3 on.
    pub fix: Option<u64>,
    /// Number of satellites in use.
    pub satellites: Option<u64>,
    /// Estimated horizontal accuracy of the position, m.
    pub h_acc_m: Option<f64>,
    /// Battery voltage, V.
    pub battery_v: Option<f64>,
    /// Battery charge, %; the server reports it where the autopilot's own figure can be relied on.
    pub battery_percent: Option<f64>,
}

impl State {
    /// Reads the state from a status of UAV-INF.
    pub fn of(status: &Value) -> Self {
        let number = |pointer| status.pointer(pointer).and_then(Value::as_f64);
        let whole = |pointer| status.pointer(pointer).and_then(Value::as_u64);
        let line = status.get("debug").and_then(Value::as_str).unwrap_or_default();
        let line = STANDARD.decode(line).unwrap_or_default();
        Self {
            mode: status.get("mode").and_then(Value::as_str).unwrap_or_default().to_owned(),
            codes: codes(status),
            show: ShowLine::parse(&String::from_utf8_lossy(&line)),
            fix: whole("/gps/0"),
            satellites: whole("/gps/1"),
            h_acc_m: number("/gps/2").map(|mm| mm / 1000.0),
            battery_v: number("/battery/0").map(|decivolts| decivolts / 10.0),
            battery_percent: number("/battery/1"),
        }
    }

    /// Whether the drone is in show mode.
    pub fn is_in_show_mode(&self) -> bool {
        is_show_mode(&self.mode)
    }

    /// Whether this is one of the server's own virtual drones: it flies whatever it was sent, in a
    /// mode that a show drone never has, and reports nothing about it.
    pub fn is_make_believe(&self) -> bool {
        self.mode == "mission" && self.show.is_none()
    }
}

/// Whether the server's word for a flight mode is the show mode: it tells numbers of modes that it has
/// no name for, as long as it has not found out which firmware a drone has.
pub(super) fn is_show_mode(mode: &str) -> bool {
    mode == "show" || mode.strip_prefix("mode ").is_some_and(|it| it.parse() == Ok(SHOW_MODE))
}

/// Report of a drone in show mode about its show, as Skybrush Live displays it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ShowLine {
    /// Start of the show, by the drone's own clock.
    pub clock: ShowClock,
    /// Obstacle to the start, or present stage of the show, in the drone's words; empty outside
    /// show mode.
    pub text: String,
}

/// Start of a drone's show, as the drone reports it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ShowClock {
    /// The drone has no start time.
    Unset,
    /// Time of day of the start, s, in the server's time zone.
    At(i64),
    /// Seconds since the start of the show; negative before the start.
    Elapsed(i64),
}

impl ShowLine {
    /// Reads `[@12:34:56] Not authorized to start`, `[-00:00:12] ...` or `[---:--:--] ...`; `None`
    /// for anything else.
    pub fn parse(line: &str) -> Option<Self> {
        let (clock, text) = line.strip_prefix('[')?.split_once(']')?;
        let clock = match clock.split_at_checked(1)? {
            ("-", "--:--:--") => ShowClock::Unset,
            ("@", time) => ShowClock::At(seconds(time)?),
            ("-", time) => ShowClock::Elapsed(-seconds(time)?),
            (_, time) => ShowClock::Elapsed(seconds(time)?),
        };
        Some(Self { clock, text: text.trim().to_owned() })
    }
}

/// A time of day such as `12:34:56`, in seconds.
fn seconds(time: &str) -> Option<i64> {
    let mut parts = time.split(':').map(str::parse::<u16>);
    let mut part = || Some(i64::from(parts.next()?.ok()?));
    Some(part()? * 3600 + part()? * 60 + part()?)
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn a_status_is_understood() {
        let debug = STANDARD.encode("[@09:08:07] Not authorized to start");
        let state = State::of(&json!({
            "mode": "show", "errors": [1, 3], "debug": debug, "gps": [6, 12, 300, 400],
            "battery": [124, 80],
        }));
        let show = state.show.clone().unwrap();
        assert_eq!(show.clock, ShowClock::At(9 * 3600 + 8 * 60 + 7));
        assert_eq!(show.text, "Not authorized to start");
        assert_eq!((state.fix, state.satellites, state.h_acc_m), (Some(6), Some(12), Some(0.3)));
        assert_eq!((state.battery_v, state.battery_percent), (Some(12.4), Some(80.0)));
        assert!(!state.is_make_believe());
        assert!(State::of(&json!({ "mode": "mission", "debug": "" })).is_make_believe());
        let nothing = State::of(&json!({ "battery": [null, null], "gps": [], "debug": null }));
        assert_eq!(nothing, State::default());
    }

    #[test]
    fn lines_of_the_show_mode_are_read() {
        let parsed = |line| ShowLine::parse(line).map(|line| (line.clock, line.text));
        let is = |clock, text: &str| Some((clock, text.to_owned()));
        assert_eq!(parsed("[---:--:--] Landed"), is(ShowClock::Unset, "Landed"));
        assert_eq!(parsed("[---:--:--] "), is(ShowClock::Unset, ""));
        assert_eq!(parsed("[-00:00:12] Countdown"), is(ShowClock::Elapsed(-12), "Countdown"));
        assert_eq!(
            parsed("[ 00:01:00] Performing show"),
            is(ShowClock::Elapsed(60), "Performing show")
        );
        for line in
            ["", "Landed", "[", "[]", "[@", "[@] x", "[@1:2] x", "[\u{e9}1:2:3] x", "[@a:b:c]"]
        {
            let line = ShowLine::parse(line);
            assert!(
                line.as_ref().is_none_or(|line| line.clock == ShowClock::Elapsed(3723)),
                "{line:?}"
            );
        }
    }
}
