//! The gate between this program and the drones behind a server: every drone is checked before each
//! step of a start, and none starts unless all are in the state that the step needs.

use std::collections::BTreeMap;
use std::fmt;
use std::time::Duration;

use schemars::JsonSchema;
use serde::Serialize;
use serde_json::Value;

use super::ServedFlight;
use crate::base::layout;
use crate::fleet::preflight::{Limits, by_reason, charge_needed};
use crate::link::clock::{Micros, S};
use crate::mission::Plan;
use crate::skybrush_server::Client;
use crate::skybrush_server::gate::{FAILS_ARMING_CHECKS, Needs, Step, obstacles};
use crate::skybrush_server::state::State;
use crate::workflow::error::WorkflowError;
use crate::workflow::host::Host;

/// How often the server is asked how the drones are.
const EVERY: Duration = Duration::from_millis(500);
/// What the server tells comes twice a second: a drone that is heard has said something new in
/// this time.
pub(super) const MOMENT: Micros = 4 * S;

/// What a drone needs for this plan.
fn needs(plan: &Plan) -> Needs {
    let limits = Limits::default();
    Needs {
        satellites: limits.satellites.into(),
        h_acc_m: limits.h_acc_m,
        battery_percent: charge_needed(plan),
    }
}

/// One drone at the gate.
pub(super) struct Row {
    pub(super) slot: u16,
    /// The server's name of it.
    pub(super) drone: String,
    state: State,
    /// Why it must not go on.
    pub(super) no_go: Vec<String>,
}

/// All of them.
pub(crate) struct Table {
    pub(super) rows: Vec<Row>,
}

impl Table {
    pub(crate) fn go(&self) -> bool {
        !self.rows.is_empty() && self.rows.iter().all(|row| row.no_go.is_empty())
    }

    /// Who is in the way, and why, in one line.
    pub(super) fn words(&self) -> String {
        let open = self.rows.iter().filter(|row| !row.no_go.is_empty());
        let words = open.map(|row| format!("drone {} {}", row.drone, row.no_go.join(", ")));
        words.collect::<Vec<_>>().join("; ")
    }

    /// For programs.
    pub(crate) fn output(&self) -> TableOutput {
        let drones = self.rows.iter().map(|row| RowOutput {
            slot: row.slot,
            drone: row.drone.clone(),
            go: row.no_go.is_empty(),
            cells: cells(&row.state).into(),
            no_go: row.no_go.clone(),
        });
        TableOutput {
            schema: "updraft.preflight/1",
            go: self.go(),
            columns: COLUMNS.into(),
            drones: drones.collect(),
            fleet: Vec::new(),
        }
    }
}

/// What `fleet preflight --json` prints of drones behind a server.
#[derive(Serialize, JsonSchema)]
pub(crate) struct TableOutput {
    schema: &'static str,
    go: bool,
    columns: Vec<&'static str>,
    drones: Vec<RowOutput>,
    fleet: Vec<String>,
}

#[derive(Serialize, JsonSchema)]
struct RowOutput {
    slot: u16,
    drone: String,
    go: bool,
    cells: Vec<String>,
    no_go: Vec<String>,
}

const COLUMNS: [&str; 4] = ["mode", "show", "GPS", "battery"];

/// What is shown of a drone, in the order of [`COLUMNS`].
pub(super) fn cells(state: &State) -> [String; 4] {
    let mode = if state.mode.is_empty() { "?" } else { &state.mode };
    let show = match &state.show {
        Some(show) if show.text.is_empty() => "off".to_owned(),
        Some(show) => show.text.clone(),
        None => "?".to_owned(),
    };
    let gps = match (state.fix, state.satellites) {
        (Some(3..), Some(count)) => format!("{count} sats"),
        (Some(3..), None) => "fix".to_owned(),
        (Some(_), _) => "no fix".to_owned(),
        (None, _) => "?".to_owned(),
    };
    let volts = state.battery_v.map(|volts| format!("{volts:.1} V"));
    let percent = state.battery_percent.map(|percent| format!("{percent:.0} %"));
    let battery: Vec<String> = percent.into_iter().chain(volts).collect();
    let battery = if battery.is_empty() { "?".to_owned() } else { battery.join(" ") };
    [mode.to_owned(), show, gps, battery]
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let head = ["slot", "drone"].into_iter().chain(COLUMNS).map(str::to_owned).collect();
        let mut lines: Vec<Vec<String>> = vec![head];
        lines.extend(self.rows.iter().map(|row| {
            let mut line = vec![row.slot.to_string(), row.drone.clone()];
            line.extend(cells(&row.state));
            line
        }));
        for line in layout::aligned(&lines) {
            writeln!(f, "{line}")?;
        }
        let mut reasons = Vec::new();
        for row in &self.rows {
            let each = row.no_go.iter().map(|why| (row.drone.clone(), row.slot, why.as_str()));
            reasons.extend(each);
        }
        for line in by_reason(&reasons) {
            writeln!(f, "NO-GO {line}")?;
        }
        let ready = self.rows.iter().filter(|row| row.no_go.is_empty()).count();
        let verdict = if self.go() { "GO" } else { "NO-GO" };
        writeln!(f, "{verdict}: {ready} of {} drones are ready", self.rows.len())
    }
}

/// Looks at all drones of a flight until they are as a step needs them, or so long.
pub(super) fn gate(
    host: &dyn Host,
    client: &mut Client,
    flight: &ServedFlight<'_>,
    step: Step,
    patience: Micros,
) -> Result<Table, WorkflowError> {
    let clock = host.clock();
    let until = clock.now() + patience.max(MOMENT);
    let ids: Vec<String> = flight.drones.values().cloned().collect();
    let first = client.status(&ids)?;
    let mut said = false;
    loop {
        // What was told before is not taken for what is.
        clock.pause(EVERY);
        if host.is_stopped() {
            return Err(WorkflowError::Interrupted);
        }
        let table = look(flight, &client.status(&ids)?, &first, step, clock.unix_us());
        let now = clock.now();
        if table.go() {
            return Ok(table);
        }
        if now >= until {
            return with_reasons_of_checks(client, host, table);
        }
        if !said && now + patience.max(MOMENT) >= until + 3 * S {
            said = true;
            let open = table.rows.iter().filter(|row| !row.no_go.is_empty()).count();
            host.say(&format!(
                "{} of {} drones are ready; waiting for the others ({})",
                table.rows.len() - open,
                table.rows.len(),
                table.words()
            ));
        }
    }
}

fn look(
    flight: &ServedFlight<'_>,
    status: &BTreeMap<String, Value>,
    first: &BTreeMap<String, Value>,
    step: Step,
    unix_us: u64,
) -> Table {
    let needs = needs(flight.plan);
    let unix_s = unix_us as f64 * 1e-6;
    let row = |(slot, drone): (&u16, &String)| {
        let told = status.get(drone);
        let state = told.map(State::of).unwrap_or_default();
        let time = |status: Option<&Value>| status.and_then(|it| it.get("timestamp")).cloned();
        let no_go = match told {
            None => vec!["is not known to the server (any more)".to_owned()],
            Some(_) if time(told).is_some() && time(told) == time(first.get(drone)) => {
                vec!["is not heard by the server".to_owned()]
            }
            Some(_) => obstacles(&state, step, unix_s, &needs),
        };
        Row { slot: *slot, drone: drone.clone(), state, no_go }
    };
    Table { rows: flight.drones.iter().map(row).collect() }
}

/// Arming checks that fail have reasons, which the server keeps apart.
fn with_reasons_of_checks(
    client: &mut Client,
    host: &dyn Host,
    mut table: Table,
) -> Result<Table, WorkflowError> {
    let fails = |why: &String| why == FAILS_ARMING_CHECKS;
    let open = table.rows.iter().filter(|row| row.no_go.iter().any(fails));
    let ids: Vec<String> = open.map(|row| row.drone.clone()).collect();
    if ids.is_empty() {
        return Ok(table);
    }
    // Without them the verdict is the same.
    let reasons = client.arming_checks(&ids, || !host.is_stopped()).unwrap_or_default();
    host.check_stop()?;
    for row in &mut table.rows {
        let Some(reason) = reasons.get(&row.drone) else { continue };
        for why in row.no_go.iter_mut().filter(|why| fails(why)) {
            *why = format!("{why}: {reason}");
        }
    }
    Ok(table)
}
