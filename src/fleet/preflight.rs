//! The table before a start: for each drone all that must be right, and go or no-go in words that
//! crews know.
//!
//! What is not known is not taken for good: a drone that does not report something is no-go.

use std::collections::{BTreeMap, BTreeSet};

use super::required::{Difference, Standing};
use super::slots::{self, FleetTable, SlotProblem, geodetic};
use super::start::{ClockSpread, clocks};
use super::telemetry::{Drone, SILENT_AFTER, Telemetry};
use crate::base::layout;
use crate::base::names::{listed, ranges};
use crate::link::clock::Micros;
use crate::link::id::DroneId;
use crate::mission::Plan;
use crate::protocol::show::{Stage, flag, preflight};

/// Least quality with which a drone may start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Fewest satellites that its position is to be based on.
    pub satellites: u8,
    /// Largest estimated error of the horizontal position, m.
    pub h_acc_m: f64,
    /// Least share of messages that must arrive, 0 to 1.
    pub link_quality: f64,
    /// Largest difference allowed between the clocks, s.
    pub clock_spread_s: f64,
    /// Whether the station flies all drones by streaming, so that none needs the show mode.
    pub guided: bool,
}

impl Default for Limits {
    fn default() -> Self {
        Self { satellites: 8, h_acc_m: 2.5, link_quality: 0.6, clock_spread_s: 1.0, guided: false }
    }
}

/// Knowledge about the fleet that telemetry does not give.
#[derive(Clone, Debug, Default)]
pub struct Known {
    /// Drones whose upload of this flight's show ended well; others may carry an old show.
    pub loaded: BTreeSet<DroneId>,
    /// Drones whose fence was read back, as not every drone's status reports it.
    pub fenced: BTreeSet<DroneId>,
    /// State of the drones' parameters; those that are not in it were not asked.
    pub params: BTreeMap<DroneId, Standing>,
}

/// The link of a drone that is not heard.
const SILENT: &str = "silent";

/// One checked property of a drone.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Cell {
    /// Text of the cell.
    pub text: String,
    /// Reason why the drone must not start; `None` if the cell is good.
    pub no_go: Option<String>,
}

/// Headings of the cells of a [`Row`], in their order.
pub const COLUMNS: [&str; 11] = [
    "link", "firmware", "show", "origin", "position", "GPS", "prearm", "battery", "fence", "start",
    "params",
];

/// A row of the preflight table: one drone.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Row {
    /// Slot that the drone flies.
    pub slot: u16,
    /// Identifier of the drone.
    pub drone: DroneId,
    /// Checked properties of the drone, in the order of [`COLUMNS`].
    pub cells: Vec<Cell>,
}

impl Row {
    /// Whether the drone may fly.
    pub fn go(&self) -> bool {
        self.cells.iter().all(|cell| cell.no_go.is_none())
    }
}

/// The preflight table of a fleet.
#[derive(Clone, Debug, PartialEq)]
pub struct Preflight {
    /// Rows of the drones, by slot.
    pub rows: Vec<Row>,
    /// Problems that concern more than one drone, one sentence each.
    pub fleet: Vec<String>,
}

impl Preflight {
    /// Whether the fleet may start: there are drones, and nothing is no-go.
    pub fn go(&self) -> bool {
        !self.rows.is_empty() && self.fleet.is_empty() && self.rows.iter().all(Row::go)
    }
}

fn good(text: impl Into<String>) -> Cell {
    Cell { text: text.into(), no_go: None }
}

fn bad(text: impl Into<String>, why: impl Into<String>) -> Cell {
    Cell { text: text.into(), no_go: Some(why.into()) }
}

/// Charge that a flight needs, % of a full battery: for its duration, and the reserve that the
/// vehicle's limits demand.
pub fn charge_needed(plan: &Plan) -> f64 {
    let flight_s = plan.duration_ms as f64 / 1000.0;
    let limits = &plan.limits;
    100.0 * (flight_s / limits.endurance_s.max(1.0) + limits.endurance_reserve)
}

/// Makes the preflight table of a fleet at time `now`.
pub fn preflight(
    plan: &Plan,
    table: &FleetTable,
    telemetry: &Telemetry,
    known: &Known,
    limits: &Limits,
    now: Micros,
) -> Preflight {
    let problems = slots::check_stands(plan, table, telemetry, now);
    let mut fleet: Vec<String> = problems
        .iter()
        .filter(|problem| of_drone(problem).is_none())
        .map(ToString::to_string)
        .collect();
    let drones: BTreeSet<DroneId> = table.drones.iter().map(|line| line.drone).collect();
    if let ClockSpread::Apart { text, .. } = clocks(telemetry, &drones, limits.clock_spread_s, now)
    {
        fleet.push(text);
    }
    let silent = Drone::default();
    let rows = table
        .drones
        .iter()
        .map(|line| {
            let known_of = telemetry.get(line.drone).unwrap_or(&silent);
            let stand = problems.iter().find(|problem| of_drone(problem) == Some(line.drone));
            let look = Look { plan, limits, now, drone: line.drone, of: known_of, known };
            Row { slot: line.slot, drone: line.drone, cells: look.cells(line.slot, stand) }
        })
        .collect();
    Preflight { rows, fleet }
}

/// Problems that belong into a drone's own row.
fn of_drone(problem: &SlotProblem) -> Option<DroneId> {
    match problem {
        SlotProblem::NoPosition { drone, .. }
        | SlotProblem::WrongSlot { drone, .. }
        | SlotProblem::TooFar { drone, .. } => Some(*drone),
        _ => None,
    }
}

struct Look<'a> {
    plan: &'a Plan,
    limits: &'a Limits,
    now: Micros,
    drone: DroneId,
    of: &'a Drone,
    known: &'a Known,
}

impl Look<'_> {
    fn cells(&self, slot: u16, stand: Option<&SlotProblem>) -> Vec<Cell> {
        vec![
            self.link(),
            self.firmware(),
            self.show(),
            self.origin(),
            self.position(slot, stand),
            self.gps(),
            self.prearm(),
            self.battery(),
            self.fence(),
            self.start(),
            self.params(),
        ]
    }

    /// Nothing of the show mode is asked of it.
    fn is_guided(&self) -> bool {
        self.limits.guided || self.of.has_show_firmware() == Some(false)
    }

    /// A value that is fresh enough to be believed.
    fn fresh<T: Copy>(&self, value: Option<(Micros, T)>) -> Option<T> {
        let (at, value) = value?;
        (self.now.saturating_sub(at) <= SILENT_AFTER).then_some(value)
    }

    fn link(&self) -> Cell {
        if self.of.heard == 0 && self.of.mode.is_none() {
            return bad(SILENT, "was never heard: is it on?");
        }
        let silent = self.now.saturating_sub(self.of.heard);
        if silent > SILENT_AFTER {
            return bad(SILENT, format!("has been silent for {} s", silent / 1_000_000));
        }
        match self.of.link_quality() {
            None => bad("?", "is not heard for long enough to judge its link: wait a few seconds"),
            Some(quality) if quality < self.limits.link_quality => {
                let percent = quality * 100.0;
                let why = format!("only {percent:.0} % of its messages arrive: look at its radio");
                bad(format!("{percent:.0}%"), why)
            }
            Some(quality) => good(format!("{:.0}%", quality * 100.0)),
        }
    }

    fn firmware(&self) -> Cell {
        let text = self.of.version.map_or_else(
            || if self.of.status.is_some() { "show".to_owned() } else { "?".to_owned() },
            |version| version.to_string(),
        );
        match self.of.has_show_firmware() {
            None => bad(text, "does not say which firmware it has"),
            Some(false) if !self.limits.guided => {
                bad(text, "has no show firmware: fly all with --guided, or leave it out")
            }
            Some(_) => good(text),
        }
    }

    fn show(&self) -> Cell {
        if self.is_guided() {
            return good("guided");
        }
        let Some(status) = self.fresh(self.of.status) else {
            return bad("?", "sends no show status");
        };
        if !status.has(flag::LOADED) {
            return bad("none", "has no show data: upload the show");
        }
        if !self.known.loaded.contains(&self.drone) {
            return bad("old?", "carries a show that was not uploaded now: upload the show");
        }
        good("loaded")
    }

    fn origin(&self) -> Cell {
        if self.is_guided() {
            return good("-");
        }
        match self.fresh(self.of.status) {
            None => bad("?", "sends no show status"),
            Some(status) if !status.has(flag::ORIGIN_SET) => {
                bad("none", "origin not set: upload the show")
            }
            Some(status) if !status.has(flag::ORIENTATION_SET) => {
                bad("no orientation", "orientation not set: upload the show")
            }
            Some(status) if status.preflight & preflight::NOT_CONFIGURED != 0 => {
                bad("refused", "says that show, origin or orientation are missing")
            }
            Some(_) => good("set"),
        }
    }

    fn position(&self, slot: u16, problem: Option<&SlotProblem>) -> Cell {
        let frame = self.plan.site.frame();
        let home = self.plan.slot(slot).map(|slot| slot.home_m);
        let distance_m = self.of.position.zip(home).map(|((_, position), home)| {
            let at = frame.from_geodetic(geodetic(&position));
            (at.x - home[0]).hypot(at.y - home[1])
        });
        let far = |m: f64| if m < 1000.0 { format!("{m:.1} m") } else { "far".to_owned() };
        let text = distance_m.map_or_else(|| "?".to_owned(), far);
        if let Some(problem) = problem {
            return bad(text, problem.to_string());
        }
        let away = preflight::NOT_AT_TAKEOFF;
        match self.fresh(self.of.status).filter(|_| !self.is_guided()) {
            Some(status) if status.preflight & away != 0 => {
                bad(text, "is not at its take-off position, it says: is the origin right?")
            }
            _ => good(text),
        }
    }

    fn gps(&self) -> Cell {
        let Some(gps) = self.fresh(self.of.gps) else { return bad("?", "does not report its GPS") };
        let accuracy = gps.h_acc_m.map_or(String::new(), |m| format!(" {m:.1} m"));
        let text = format!("{} sats{accuracy}", gps.satellites);
        let no_time = self.fresh(self.of.status).is_some_and(|s| s.has(flag::NO_GPS_TIME));
        if gps.fix < 3 {
            bad("no fix", "has no 3D GPS fix yet")
        } else if gps.satellites < self.limits.satellites {
            let why = format!("sees {} satellites only: wait", gps.satellites);
            bad(text, why)
        } else if gps.h_acc_m.is_some_and(|m| m > self.limits.h_acc_m) {
            bad(text, format!("knows its place to{accuracy} only: wait"))
        } else if no_time {
            bad(text, "has an invalid GPS timestamp: wait for the time")
        } else if self.of.clock.gps_ms(self.now).is_none() {
            bad(text, "does not report its GPS time")
        } else {
            good(text)
        }
    }

    fn prearm(&self) -> Cell {
        if self.of.is_armed() == Some(true) {
            return bad(
                "armed",
                "is armed, and may be flying: `updraft fleet abort` ends its flight",
            );
        }
        match self.fresh(self.of.health).and_then(|health| health.prearm_ok) {
            None => bad("?", "does not report its arming checks"),
            Some(true) => good("ok"),
            Some(false) => {
                let reason = self.of.prearm_reason().unwrap_or("it has not said why yet");
                bad("fails", format!("fails its arming checks: {reason}"))
            }
        }
    }

    fn battery(&self) -> Cell {
        let Some(health) = self.fresh(self.of.health) else {
            return bad("?", "does not report its battery");
        };
        let volts = health.battery_v.map_or(String::new(), |v| format!(" {v:.1} V"));
        let needed = charge_needed(self.plan);
        match health.battery_percent {
            None => bad(format!("?{volts}"), "does not know its battery's charge"),
            Some(percent) if f64::from(percent) < needed => bad(
                format!("{percent}%{volts}"),
                format!("has {percent} % charge, the flight needs {needed:.0} %: change battery"),
            ),
            Some(percent) => good(format!("{percent}%{volts}")),
        }
    }

    fn fence(&self) -> Cell {
        match self.fresh(self.of.status) {
            Some(status) if status.has(flag::FENCE_BREACHED) => {
                bad("breached", "is outside of its fence: is the origin right?")
            }
            Some(status) if !status.has(flag::FENCE_ON) => {
                bad("off", "geofence not set: upload the show")
            }
            Some(_) => good("on"),
            None if self.is_guided() && self.known.fenced.contains(&self.drone) => good("on"),
            None => bad("?", "does not report its fence: put it there again"),
        }
    }

    fn start(&self) -> Cell {
        let status = self.fresh(self.of.status);
        if self.is_guided() && status.is_none() {
            return good("-");
        }
        let Some(status) = status else { return bad("?", "sends no show status") };
        if status.has(flag::AUTHORIZED) {
            return bad("authorized", "is authorized to start already: cancel the start first");
        }
        if status.has(flag::START_SET) && status.start_tow_s >= 0 {
            return bad(
                format!("at {}", status.start_tow_s),
                "has a start time already: cancel the start first",
            );
        }
        match status.stage {
            _ if self.is_guided() => good("-"),
            Stage::WaitForStart => good("waiting"),
            Stage::Landed => bad("landed", "has flown: restart it, or leave and enter show mode"),
            Stage::Off => bad("off", "is not in show mode: upload the show"),
            Stage::Error => bad("error", "is in an error: restart it"),
            stage => bad(stage.to_string(), format!("is not waiting for a start ({stage})")),
        }
    }

    fn params(&self) -> Cell {
        match self.known.params.get(&self.drone) {
            None => bad("?", "its parameters were not checked"),
            Some(standing) => match standing.wrong.as_slice() {
                [] if standing.failed.is_some() => bad("failed", "a parameter was not set"),
                [] if standing.changed.is_empty() => good("ok"),
                [] => good(format!("{} changed", standing.changed.len())),
                [one] => bad("1 wrong", one.to_string()),
                several => {
                    let all: Vec<String> = several.iter().map(Difference::brief).collect();
                    let count = several.len();
                    bad(
                        format!("{count} wrong"),
                        format!("{count} parameters are wrong: {}", all.join("; ")),
                    )
                }
            },
        }
    }
}

/// Reasons of drones, each once, with all drones that it is true of: `drones 1-12 and 14 (slots 1-13): no GPS`.
pub(crate) fn by_reason(reasons: &[(String, u16, &str)]) -> Vec<String> {
    let mut alike: Vec<(&str, Vec<&str>, Vec<u64>)> = Vec::new();
    for (drone, slot, why) in reasons {
        match alike.iter_mut().find(|(known, ..)| known == why) {
            Some((_, drones, slots)) => {
                drones.push(drone);
                slots.push(u64::from(*slot));
            }
            None => alike.push((why, vec![drone], vec![u64::from(*slot)])),
        }
    }
    let line = |(why, drones, mut slots): (&str, Vec<&str>, Vec<u64>)| {
        slots.sort_unstable();
        let (drone, slot) = if slots.len() > 1 { ("drones", "slots") } else { ("drone", "slot") };
        format!("{drone} {} ({slot} {}): {why}", listed(drones), ranges(&slots))
    };
    alike.into_iter().map(line).collect()
}

impl std::fmt::Display for Preflight {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mut lines: Vec<Vec<String>> = Vec::new();
        lines.push(["slot", "drone"].iter().chain(&COLUMNS).map(ToString::to_string).collect());
        for row in &self.rows {
            let mut line = vec![row.slot.to_string(), row.drone.to_string()];
            line.extend(row.cells.iter().map(|cell| {
                let mark = if cell.no_go.is_some() { "!" } else { "" };
                format!("{}{mark}", cell.text)
            }));
            lines.push(line);
        }
        for line in layout::aligned(&lines) {
            writeln!(f, "{line}")?;
        }
        let mut reasons = Vec::new();
        for row in &self.rows {
            // Of a silent drone nothing else is known either.
            let silent = row.cells.first().is_some_and(|cell| cell.text == SILENT);
            let shown = if silent { 1 } else { row.cells.len() };
            for why in row.cells.iter().take(shown).filter_map(|cell| cell.no_go.as_deref()) {
                reasons.push((row.drone.to_string(), row.slot, why));
            }
        }
        for line in by_reason(&reasons) {
            writeln!(f, "NO-GO {line}")?;
        }
        for why in &self.fleet {
            writeln!(f, "NO-GO: {why}")?;
        }
        let (ready, all) = (self.rows.iter().filter(|row| row.go()).count(), self.rows.len());
        match self.fleet.len() {
            0 if self.go() => writeln!(f, "GO: {ready} of {all} drones are ready"),
            // Each drone may be fine by itself and the fleet as a whole still must not start.
            wrong if wrong > 0 && ready == all => writeln!(
                f,
                "NO-GO: each of the {all} drones is ready, but {} wrong with the fleet as a whole",
                if wrong == 1 { "one thing is".to_owned() } else { format!("{wrong} things are") }
            ),
            _ => writeln!(f, "NO-GO: {ready} of {all} drones are ready"),
        }
    }
}
