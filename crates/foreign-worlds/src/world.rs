//! A world: all that a flight is flown with, but the targets.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::air::AirSettings;
use crate::battery::BatterySettings;
use crate::hidden::{Acting, HiddenEffect};
use crate::noise::NoiseSettings;
use crate::plant::Plant;
use crate::telemetry::TelemetrySettings;

/// A world.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct World {
    /// Seed of all that is random in it.
    pub seed: u64,
    /// Rotors and body of the mean drone.
    pub plant: Plant,
    /// Standard deviation of the drones' thrust, relative.
    pub thrust_spread: f64,
    /// The air.
    pub air: AirSettings,
    /// Batteries.
    pub battery: BatterySettings,
    /// Noise of the logs.
    pub noise: NoiseSettings,
    /// Hidden effects.
    pub hidden: Vec<HiddenEffect>,
    /// Telemetry of the motors' controllers. Absent: logs have none, and the battery's current without errors.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub telemetry: Option<TelemetrySettings>,
}

impl World {
    /// Hidden effects, started on one drone; kinds that are not known are left out.
    pub fn acting(&self) -> Vec<Box<dyn Acting>> {
        self.hidden.iter().filter_map(HiddenEffect::start).collect()
    }
}
