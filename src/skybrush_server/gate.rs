//! Check whether a drone behind the server may be started: as over its own link, as far as the
//! server reports its state. Missing information counts against the drone.

use super::state::{ShowClock, State};
use super::watch::{FIRST_WARNING, code_name, is_down};

/// Stage of a start, which decides what a drone's state must be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// The drone is about to be given a show: it must be on the ground.
    Grounded,
    /// The drone has its show; no start time is set yet.
    Ready,
    /// This start time (Unix, s) must be set and not yet authorized.
    Set(i64),
    /// This start time (Unix, s) must be set and authorized: the drone counts down.
    Authorized(i64),
}

/// Least quality of position and battery with which a drone may start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Needs {
    /// Fewest satellites that its position is to be based on.
    pub satellites: u64,
    /// Largest estimated error of the horizontal position, m.
    pub h_acc_m: f64,
    /// Least charge, % of a full battery, where the server reports it.
    pub battery_percent: f64,
}

/// Obstacle to the start of a drone whose arming checks fail; the server keeps their reasons apart
/// ([`Client::arming_checks`](super::Client::arming_checks)).
pub const FAILS_ARMING_CHECKS: &str = "fails its arming checks";

/// The server's words of a drone that waits for its authorization ...
const NOT_AUTHORIZED: &str = "Not authorized to start";
/// ... of one that waits for a start time, ...
const NO_START_TIME: &str = "Start time not set";
/// ... of one that has flown, and waits again as soon as it gets a new start time, ...
const LANDED: &str = "Landed";
/// ... and of one that counts down.
const COUNTS_DOWN: [&str; 2] = ["Countdown to show start", "Waiting for takeoff time"];

/// A clock that is read off a status is so old, and so coarse, at most, s.
const CLOCK_S: f64 = 3.0;
/// Time zones differ by multiples of this, s: the server's need not be ours.
const ZONES_S: i64 = 900;

/// Reasons why a drone must not go on, one clause each; empty if it may. `now_unix_s` is the time
/// of the drone's state.
pub fn obstacles(state: &State, step: Step, now_unix_s: f64, needs: &Needs) -> Vec<String> {
    let has = |code| state.codes.contains(&code);
    let aloft = if has(4) {
        Some("is still initializing: wait")
    } else if has(9) {
        Some("sleeps: wake it up in Skybrush Live")
    } else if has(8) && matches!(step, Step::Authorized(_)) {
        // It arms by itself in the last seconds.
        None
    } else if has(8) {
        Some("has its motors running: disarm it")
    } else if !is_down(&state.codes) {
        Some("is not known to be on the ground")
    } else {
        None
    };
    let mut found: Vec<String> = aloft.map(str::to_owned).into_iter().collect();
    if step == Step::Grounded {
        return found;
    }
    for code in state.codes.iter().filter(|code| **code >= FIRST_WARNING) {
        found.push(format!("has: {} (code {code})", code_name(*code)));
    }
    if has(3) {
        found.push(FAILS_ARMING_CHECKS.to_owned());
    }
    match state.fix {
        None => found.push("does not report its GPS".to_owned()),
        Some(0..3) => found.push("has no 3D GPS fix yet".to_owned()),
        Some(_) => {}
    }
    if let Some(count) = state.satellites.filter(|count| *count < needs.satellites) {
        found.push(format!("sees {count} satellites only: wait"));
    }
    if let Some(h_acc_m) = state.h_acc_m.filter(|h_acc_m| *h_acc_m > needs.h_acc_m) {
        found.push(format!("knows its place to {h_acc_m:.1} m only: wait"));
    }
    if let Some(percent) = state.battery_percent.filter(|it| *it < needs.battery_percent) {
        let needed = needs.battery_percent;
        found.push(format!(
            "has {percent:.0} % charge, the flight needs {needed:.0} %: change battery"
        ));
    }
    if !state.is_make_believe() {
        found.extend(of_show_mode(state, step, now_unix_s));
    }
    found
}

/// Mode, stage, show and start time.
fn of_show_mode(state: &State, step: Step, now_unix_s: f64) -> Option<String> {
    let mode = state.mode.as_str();
    if !state.is_in_show_mode() {
        if mode.is_empty() {
            let silent = "does not report its flight mode: is it heard, and does it have show \
                          firmware?";
            return Some(silent.to_owned());
        }
        // The server tells the number of a mode that it has no name for: "mode 5".
        let word = if mode.starts_with("mode ") { "" } else { "mode " };
        return Some(format!(
            "is not in show mode, but in {word}{mode}: switch it to show mode (its remote control, or \
             Skybrush Live)"
        ));
    }
    let Some(show) = &state.show else {
        return Some("reports nothing about its show: it sends no show status".to_owned());
    };
    let text = show.text.as_str();
    let counts_down = COUNTS_DOWN.contains(&text);
    let says = || Some(format!("says \"{text}\""));
    match step {
        Step::Grounded => None,
        Step::Ready if [NO_START_TIME, NOT_AUTHORIZED, LANDED].contains(&text) => None,
        Step::Ready if counts_down => {
            Some("is authorized to start already: take the start back first".to_owned())
        }
        Step::Ready => match text {
            "" => Some("is not in show mode, though it is in mode show: restart it".to_owned()),
            "No show data" => Some("has no show: upload it".to_owned()),
            _ => says(),
        },
        Step::Set(unix_s) => match text {
            NOT_AUTHORIZED => clock_obstacle(show.clock, unix_s, now_unix_s),
            NO_START_TIME => Some("has not taken the start time".to_owned()),
            _ if counts_down => Some("is authorized to start already".to_owned()),
            _ => says(),
        },
        Step::Authorized(unix_s) if counts_down => clock_obstacle(show.clock, unix_s, now_unix_s),
        Step::Authorized(_) if text == NOT_AUTHORIZED => {
            Some("has not taken the authorization".to_owned())
        }
        Step::Authorized(_) => says(),
    }
}

fn clock_obstacle(clock: ShowClock, unix_s: i64, now_unix_s: f64) -> Option<String> {
    let agrees = match clock {
        ShowClock::Unset => return Some("has no start time".to_owned()),
        ShowClock::At(of_day_s) => (unix_s - of_day_s).rem_euclid(ZONES_S) == 0,
        ShowClock::Elapsed(elapsed_s) => {
            (unix_s as f64 + elapsed_s as f64 - now_unix_s).abs() <= CLOCK_S
        }
    };
    (!agrees).then(|| "has another start time than the one that was set".to_owned())
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
    use std::fmt::Write as _;

    use super::super::state::ShowLine;
    use super::*;

    const NEEDS: Needs = Needs { satellites: 8, h_acc_m: 2.5, battery_percent: 50.0 };
    const START: i64 = 1_795_143_600;

    fn drone(line: &str) -> State {
        State {
            mode: "show".to_owned(),
            codes: BTreeSet::from([1]),
            show: ShowLine::parse(line),
            fix: Some(6),
            satellites: Some(10),
            h_acc_m: Some(0.3),
            battery_v: Some(12.4),
            battery_percent: None,
        }
    }

    fn of(state: &State, step: Step) -> String {
        obstacles(state, step, START as f64 - 25.0, &NEEDS).join("; ")
    }

    #[test]
    fn a_drone_that_waits_passes_each_step_only_with_what_that_step_needs() {
        let lines = [
            "[---:--:--] Start time not set",
            "[---:--:--] Landed",
            "[-00:00:25] Not authorized to start",
            "[@23:00:00] Not authorized to start",
            "[@23:00:01] Not authorized to start",
            "[-00:00:40] Not authorized to start",
            "[-00:00:24] Countdown to show start",
            "[-00:00:04] Countdown to show start",
            "[---:--:--] ",
            "[---:--:--] No show data",
            "[-00:00:25] Not at takeoff position",
            "[-00:00:25] Geofence not set",
            "[-00:00:25] Initializing...",
            "[---:--:--] Authorized without start time",
        ];
        let steps = [Step::Ready, Step::Set(START), Step::Authorized(START)];
        let mut said = String::new();
        for line in lines {
            for (name, step) in ["ready", "set", "authorized"].iter().zip(steps) {
                let why = of(&drone(line), step);
                let why = if why.is_empty() { "goes on" } else { &why };
                let _ = writeln!(said, "{line} | {name}: {why}");
            }
        }
        insta::assert_snapshot!(said);
    }

    #[test]
    fn whatever_is_wrong_or_not_told_is_in_the_way() {
        let good = drone("[---:--:--] Start time not set");
        assert_eq!(of(&good, Step::Ready), "");
        let mut said = String::new();
        let mut with = |change: &dyn Fn(&mut State)| {
            let mut state = good.clone();
            change(&mut state);
            let _ = writeln!(said, "{}", of(&state, Step::Ready));
        };
        with(&|state| state.mode = "rth".to_owned());
        with(&|state| state.mode = "mode 5".to_owned());
        with(&|state| state.mode = String::new());
        with(&|state| state.show = None);
        with(&|state| state.codes = BTreeSet::new());
        with(&|state| state.codes = BTreeSet::from([4]));
        with(&|state| state.codes = BTreeSet::from([1, 3]));
        with(&|state| state.codes = BTreeSet::from([8]));
        with(&|state| state.codes = BTreeSet::from([9]));
        with(&|state| state.codes = BTreeSet::from([1, 133]));
        with(&|state| state.fix = None);
        with(&|state| state.fix = Some(2));
        with(&|state| state.satellites = Some(7));
        with(&|state| state.h_acc_m = Some(3.0));
        with(&|state| state.battery_percent = Some(40.0));
        with(&|state| *state = State::default());
        insta::assert_snapshot!(said);
    }

    /// The server has no names for the modes of a firmware that it does not know yet.
    #[test]
    fn the_number_of_the_show_mode_is_the_show_mode() {
        let by_number = |mode: &str, line: &str| State { mode: mode.to_owned(), ..drone(line) };
        let waits = "[-00:00:25] Not authorized to start";
        assert_eq!(of(&by_number("mode 127", waits), Step::Set(START)), "");
        assert!(of(&by_number("mode 12", waits), Step::Set(START)).contains("but in mode 12:"));
        assert!(of(&by_number("mode ", waits), Step::Set(START)).contains("is not in show mode"));
        assert_eq!(of(&by_number("mode 127", "[---:--:--] Landed"), Step::Ready), "");
    }

    #[test]
    fn the_servers_own_virtual_drones_tell_nothing_of_a_show_and_may_fly() {
        let state = State { mode: "mission".to_owned(), show: None, ..drone("") };
        assert_eq!(of(&state, Step::Authorized(START)), "");
        let state = State { mode: "stab".to_owned(), show: None, ..drone("") };
        assert!(of(&state, Step::Ready).contains("is not in show mode"));
    }
}
