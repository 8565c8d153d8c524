//! Outcome of a flight, drone by drone, and the fate of the logs, for other programs.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Serialize;

use super::bring::{Brought, LogState};
use super::crew::{Crew, Ended};
use super::preflight::PreflightOutput;
use crate::link::id::DroneId;
use crate::link::net::Net as _;

/// What `updraft fly --json` prints.
#[derive(Serialize, JsonSchema)]
pub(crate) struct FlyOutput {
    /// Format name and version: `updraft.fly/1`.
    schema: &'static str,
    /// The flights, in the order they were flown.
    flights: Vec<FlightOutput>,
}

impl FlyOutput {
    pub(crate) fn new(flights: Vec<FlightOutput>) -> Self {
        Self { schema: "updraft.fly/1", flights }
    }
}

/// How a flight ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub(crate) enum FlightEnd {
    /// A check failed: nothing was started.
    NoGo,
    /// It was flown; the drones' outcomes say how.
    Flown,
    /// It was authorized, but no drone was seen in the air.
    NotFlown,
}

/// One flight.
#[derive(Serialize, JsonSchema)]
pub(crate) struct FlightOutput {
    /// Name of the flight.
    pub(crate) flight: String,
    /// How it ended.
    pub(crate) outcome: FlightEnd,
    /// The table before the start; absent: it was not come to, or the drones are virtual or behind
    /// Skybrush Server.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) preflight: Option<PreflightOutput>,
    /// The drones, in slot order.
    pub(crate) drones: Vec<DroneOutput>,
    /// Their logs, in slot order; empty: they were left on the drones.
    pub(crate) logs: Vec<LogOutput>,
}

/// How a drone's flight ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub(crate) enum DroneEnd {
    /// It was not started.
    NotStarted,
    /// It has landed and is disarmed.
    Landed,
    /// It was ordered down from another terminal and has landed.
    OrderedDown,
    /// It has restarted in the air, and its motors stand still.
    RestartedInTheAir,
    /// It is on the ground, and was never seen in the air.
    NeverTookOff,
    /// It has not been seen to land.
    NotSeenToLand,
}

/// One drone of a flight.
#[derive(Serialize, JsonSchema)]
pub(crate) struct DroneOutput {
    /// Number of the slot.
    pub(crate) slot: u16,
    /// The drone: its system id or network:system, or the server's name of it.
    pub(crate) drone: String,
    /// How its flight ended.
    pub(crate) outcome: DroneEnd,
    /// Why it was not started, or what gave an alarm in the air.
    pub(crate) reasons: Vec<String>,
}

/// One drone's log.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub(crate) struct LogOutput {
    /// Number of the slot.
    pub(crate) slot: u16,
    /// The drone; absent: nobody stands there, or a virtual one that is gone.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) drone: Option<String>,
    /// `pulled`, `there` (it had come before) or `missing`.
    #[schemars(with = "String")]
    pub(crate) state: LogState,
    /// Bytes that came.
    pub(crate) bytes: u64,
    /// Why it is missing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) reason: Option<String>,
}

impl From<&Brought> for LogOutput {
    fn from(brought: &Brought) -> Self {
        Self {
            slot: brought.slot,
            drone: brought.drone.map(|drone| drone.to_string()),
            state: brought.state,
            bytes: brought.bytes,
            reason: brought.reason.clone(),
        }
    }
}

impl LogOutput {
    /// Whether there is no whole log.
    pub(crate) fn is_missing(&self) -> bool {
        self.state == LogState::Missing
    }

    /// Of a log that had come before.
    pub(crate) fn there(slot: u16) -> Self {
        Self { slot, drone: None, state: LogState::There, bytes: 0, reason: None }
    }
}

impl FlightOutput {
    /// Of a flight that nobody has started.
    pub(crate) fn no_go(
        flight: &str,
        drones: Vec<(u16, String, Vec<String>)>,
        preflight: Option<PreflightOutput>,
    ) -> Self {
        let drone = |(slot, drone, reasons)| DroneOutput {
            slot,
            drone,
            outcome: DroneEnd::NotStarted,
            reasons,
        };
        Self {
            flight: flight.to_owned(),
            outcome: FlightEnd::NoGo,
            preflight,
            drones: drones.into_iter().map(drone).collect(),
            logs: Vec::new(),
        }
    }

    /// Of a flight that a crew has watched.
    pub(crate) fn flown(
        crew: &Crew<'_>,
        alarms: &BTreeMap<DroneId, Vec<String>>,
        preflight: Option<PreflightOutput>,
    ) -> Self {
        let ordered = crew.net.ordered_down();
        let nobody =
            crew.table.drones.iter().all(|line| crew.ended(line.drone) == Ended::NeverTookOff);
        let drones = crew.table.drones.iter().map(|line| DroneOutput {
            slot: line.slot,
            drone: line.drone.to_string(),
            outcome: match crew.ended(line.drone) {
                ended if !ended.is_down() => DroneEnd::NotSeenToLand,
                Ended::Fell => DroneEnd::RestartedInTheAir,
                _ if ordered.contains_key(&line.drone) => DroneEnd::OrderedDown,
                Ended::NeverTookOff => DroneEnd::NeverTookOff,
                _ => DroneEnd::Landed,
            },
            reasons: alarms.get(&line.drone).cloned().unwrap_or_default(),
        });
        Self {
            flight: crew.plan.name.clone(),
            outcome: if nobody { FlightEnd::NotFlown } else { FlightEnd::Flown },
            preflight,
            drones: drones.collect(),
            logs: Vec::new(),
        }
    }
}

/// A drone's logs, or why they are not known.
#[derive(Serialize, JsonSchema)]
pub(crate) struct ListRow {
    pub(crate) drone: String,
    /// None: no slot is near.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) slot: Option<u16>,
    pub(crate) logs: Vec<ListedLog>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) reason: Option<String>,
}

/// A log on a drone.
#[derive(Serialize, JsonSchema)]
pub(crate) struct ListedLog {
    pub(crate) number: u16,
    pub(crate) bytes: u64,
    /// 0: the autopilot had no clock.
    pub(crate) unix_s: u32,
}
