//! Vehicles of a blind flight: the known one that the search is given, and the true one.

use super::error::BlindError;
use super::scenario::{Base, BatteryTruth, Scenario};
use super::worlds;
use crate::effects::select::set;
use crate::effects::{Reference, Role};
use crate::vehicle::{Vehicle, library};

/// Spread of thrust between drones that the known vehicle states.
pub(super) const KNOWN_THRUST_SPREAD: f64 = 0.016;
/// Spread of the inflow between drones that the known vehicle states.
const KNOWN_INFLOW_SPREAD: f64 = 0.06;
/// Inflow of the base that is AirSim's with it.
const KNOWN_INFLOW_SHARE: f64 = 0.3;
/// The effects of a built-in vehicle that are left in its known base: those with such a parameter.
const KEEPS: [Role; 2] = [Role::InflowShare, Role::BodyDragTop];
/// A drone whose motors were run warm is warm from the start: within this time constant, s.
const WARM_S: f64 = 1.0;

impl Base {
    /// Base that is made from a built-in vehicle as it is; `None`: there is none of this name.
    pub fn of_vehicle(name: &str) -> Option<Self> {
        [Self::Airsim, Self::Pixel, Self::Phantom4, Self::Sitl]
            .into_iter()
            .find(|base| base.vehicle_name() == name)
    }

    /// Whether the known vehicle has an inflow, and with it a spread of the inflow.
    fn has_inflow(self) -> bool {
        !matches!(self, Self::Airsim | Self::Sitl)
    }

    /// Number of cells in series of the battery that the logs report.
    pub(super) fn battery_cells(self) -> f64 {
        match self {
            Self::Pixel => 2.0,
            Self::Airsim | Self::Inflow | Self::Sitl => 3.0,
            Self::Phantom4 => 4.0,
        }
    }

    /// Known vehicle, which is handed to the search.
    ///
    /// # Errors
    ///
    /// If a built-in vehicle is not valid.
    pub fn known(self) -> Result<Vehicle, BlindError> {
        let mut vehicle = library::builtin(self.vehicle_name())?;
        vehicle.effects.retain(|name, _| KEEPS.iter().any(|role| role.is_of(name)));
        if self == Self::Inflow {
            Role::InflowShare.set(&mut vehicle, KNOWN_INFLOW_SHARE);
        }
        if self.has_inflow() {
            Role::InflowSpread.set(&mut vehicle, KNOWN_INFLOW_SPREAD);
        }
        Role::ThrustSpread.set(&mut vehicle, KNOWN_THRUST_SPREAD);
        Ok(vehicle)
    }

    /// Name of the built-in vehicle that the base is made from.
    pub fn vehicle_name(self) -> &'static str {
        match self {
            Self::Airsim | Self::Inflow => "airsim-generic-quad",
            Self::Pixel => "pixel",
            Self::Phantom4 => "phantom4",
            Self::Sitl => "arducopter-sitl",
        }
    }
}

/// Vehicle that a slot truly flies: each drone has a copy of its own, as its battery and its warmth
/// are its own.
///
/// # Errors
///
/// If a built-in vehicle is not valid.
pub fn true_vehicle(scenario: &Scenario, slot: u16) -> Result<Vehicle, BlindError> {
    if let Some(world) = &scenario.world {
        // No file is a foreign plant with what is hidden: the known one is the nearest.
        return Ok(worlds::known::vehicle(world, &scenario.cell)?.vehicle);
    }
    let mut vehicle = scenario.cell.base.known()?;
    let rest = &scenario.nuisance;
    Role::ThrustSpread.set(&mut vehicle, rest.thrust_spread);
    if scenario.cell.base.has_inflow() {
        Role::InflowSpread.set(&mut vehicle, rest.inflow_spread);
    }
    let battery = &rest.battery;
    let index = usize::from(slot.saturating_sub(1));
    let charge = rest.charges.get(index).copied().unwrap_or(1.0);
    report_battery(&mut vehicle, battery, charge);
    for hidden in scenario.hidden.iter().filter(|hidden| !hidden.foreign) {
        for (name, value) in &hidden.parameters {
            set(&mut vehicle, &hidden.effect, name, *value);
        }
        if Role::WarmUpTime.is_of(&hidden.effect) && rest.warm.contains(&slot) {
            Role::WarmUpTime.set(&mut vehicle, WARM_S);
        }
    }
    Ok(vehicle)
}

/// Gives a vehicle a battery that its log reports and that does not act, unless it is what is hidden.
pub(super) fn report_battery(vehicle: &mut Vehicle, battery: &BatteryTruth, charge: f64) {
    Role::BatteryCells.set(vehicle, battery.cells);
    Role::BatteryCapacity.set(vehicle, battery.capacity_ah);
    Role::BatteryResistance.set(vehicle, battery.resistance_ohm);
    Role::BatteryCharge.set(vehicle, charge);
    Role::BatteryCompensated.set(vehicle, 0.0);
    Role::BatterySag.set(vehicle, 0.0);
}

/// Power of the battery in hover over its nominal voltage, A.
pub(super) fn hover_a(vehicle: &Vehicle, cells: f64) -> f64 {
    Reference::of(vehicle).hover_w() / (cells * 3.85)
}
