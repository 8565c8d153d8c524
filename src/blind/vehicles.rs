//! Vehicles of a blind flight: the known one that the search is given, and the true one.

use super::error::BlindError;
use super::scenario::{Base, Scenario};
use crate::effects::Reference;
use crate::vehicle::{Vehicle, library};

/// Spread of thrust between drones that the known vehicle states.
pub(super) const KNOWN_THRUST_SPREAD: f64 = 0.016;
/// Spread of the inflow between drones that the known vehicle states.
const KNOWN_INFLOW_SPREAD: f64 = 0.06;
/// Inflow of the base that is AirSim's with it.
const KNOWN_INFLOW_SHARE: f64 = 0.3;
/// What is left of the pixel's effects in its known base.
const PIXEL_KEEPS: [&str; 2] = ["rotor-inflow", "parasitic-drag"];
/// A drone whose motors were run warm is warm from the start: within this time constant, s.
const WARM_S: f64 = 1.0;

impl Base {
    /// Known vehicle, which is handed to the search.
    ///
    /// # Errors
    ///
    /// If a built-in vehicle is not valid.
    pub fn known(self) -> Result<Vehicle, BlindError> {
        let mut vehicle = library::builtin(self.vehicle_name())?;
        vehicle.effects.retain(|name, _| PIXEL_KEEPS.contains(&name.as_str()));
        if self == Self::Inflow {
            set(&mut vehicle, "rotor-inflow", "inflow_share", KNOWN_INFLOW_SHARE);
        }
        if self != Self::Airsim {
            set(&mut vehicle, "rotor-inflow", "spread", KNOWN_INFLOW_SPREAD);
        }
        set(&mut vehicle, "thrust-spread", "sd", KNOWN_THRUST_SPREAD);
        Ok(vehicle)
    }

    /// Name of the built-in vehicle that the base is made from.
    pub fn vehicle_name(self) -> &'static str {
        match self {
            Self::Airsim | Self::Inflow => "airsim-generic-quad",
            Self::Pixel => "pixel",
        }
    }
}

/// Switches an effect on and sets one parameter.
pub(super) fn set(vehicle: &mut Vehicle, effect: &str, parameter: &str, value: f64) {
    let table = vehicle.effects.entry(effect.to_owned()).or_default();
    table.on = true;
    table.parameters.insert(parameter.to_owned(), value);
}

/// Vehicle that a slot truly flies: each drone has a copy of its own, as its battery and its warmth
/// are its own.
///
/// # Errors
///
/// If a built-in vehicle is not valid.
pub fn true_vehicle(scenario: &Scenario, slot: u16) -> Result<Vehicle, BlindError> {
    let mut vehicle = scenario.cell.base.known()?;
    let rest = &scenario.nuisance;
    set(&mut vehicle, "thrust-spread", "sd", rest.thrust_spread);
    if scenario.cell.base != Base::Airsim {
        set(&mut vehicle, "rotor-inflow", "spread", rest.inflow_spread);
    }
    let battery = &rest.battery;
    let index = usize::from(slot.saturating_sub(1));
    let charge = rest.charges.get(index).copied().unwrap_or(1.0);
    let reported = [
        ("cells", battery.cells),
        ("capacity_ah", battery.capacity_ah),
        ("resistance_ohm", battery.resistance_ohm),
        ("initial_charge", charge),
        ("compensated", 0.0),
        // It is reported and does not act, unless it is what is hidden.
        ("exponent", 0.0),
    ];
    for (name, value) in reported {
        set(&mut vehicle, "battery", name, value);
    }
    for hidden in scenario.hidden.iter().filter(|hidden| !hidden.foreign) {
        for (name, value) in &hidden.parameters {
            set(&mut vehicle, &hidden.effect, name, *value);
        }
        if hidden.effect == "motor-thermal" && rest.warm.contains(&slot) {
            set(&mut vehicle, "motor-thermal", "time_s", WARM_S);
        }
    }
    Ok(vehicle)
}

/// Power of the battery in hover over its nominal voltage, A.
pub(super) fn hover_a(vehicle: &Vehicle, cells: f64) -> f64 {
    Reference::of(vehicle).hover_w() / (cells * 3.85)
}
