//! What `updraft fly --json` prints: one object, however the flight ended.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Serialize;

use super::fleet::bring::Brought;
use super::fleet::crew::{Crew, Ended};
use super::fleet::tables::PreflightOutput;
use crate::link::id::DroneId;
use crate::link::net::Net as _;

/// What `updraft fly --json` prints.
#[derive(Serialize, JsonSchema)]
pub(in crate::cli) struct FlyOutput {
    /// Format name and version: `updraft.fly/1`.
    schema: &'static str,
    /// The flights, in the order they were flown.
    flights: Vec<FlightOutput>,
}

impl FlyOutput {
    pub(in crate::cli) fn new(flights: Vec<FlightOutput>) -> Self {
        Self { schema: "updraft.fly/1", flights }
    }
}

/// How a flight ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub(in crate::cli) enum FlightEnd {
    /// A check failed: nothing was started.
    NoGo,
    /// It was flown; the drones' outcomes say how.
    Flown,
    /// It was authorized, but no drone was seen in the air.
    NotFlown,
}

/// One flight.
#[derive(Serialize, JsonSchema)]
pub(in crate::cli) struct FlightOutput {
    /// Name of the flight.
    pub(in crate::cli) flight: String,
    /// How it ended.
    pub(in crate::cli) outcome: FlightEnd,
    /// The table before the start; absent: it was not come to, or the drones are virtual or behind
    /// Skybrush Server.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(in crate::cli) preflight: Option<PreflightOutput>,
    /// The drones, in slot order.
    pub(in crate::cli) drones: Vec<DroneOutput>,
    /// Their logs, in slot order; empty: they were left on the drones.
    pub(in crate::cli) logs: Vec<LogOutput>,
}

/// How a drone's flight ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub(in crate::cli) enum DroneEnd {
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
pub(in crate::cli) struct DroneOutput {
    /// Number of the slot.
    pub(in crate::cli) slot: u16,
    /// The drone: its system id or network:system, or the server's name of it.
    pub(in crate::cli) drone: String,
    /// How its flight ended.
    pub(in crate::cli) outcome: DroneEnd,
    /// Why it was not started, or what gave an alarm in the air.
    pub(in crate::cli) reasons: Vec<String>,
}

/// One drone's log.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub(in crate::cli) struct LogOutput {
    /// Number of the slot.
    pub(in crate::cli) slot: u16,
    /// The drone; absent: nobody stands there, or a virtual one that is gone.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(in crate::cli) drone: Option<String>,
    /// `pulled`, `there` (it had come before) or `missing`.
    pub(in crate::cli) state: &'static str,
    /// Bytes that came.
    pub(in crate::cli) bytes: u64,
    /// Why it is missing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(in crate::cli) reason: Option<String>,
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
    /// Of a log that had come before.
    pub(in crate::cli) fn there(slot: u16) -> Self {
        Self { slot, drone: None, state: "there", bytes: 0, reason: None }
    }
}

impl FlightOutput {
    /// Of a flight that nobody has started.
    pub(in crate::cli) fn no_go(
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
    pub(in crate::cli) fn flown(
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
