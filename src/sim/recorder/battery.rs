//! A battery for the log: AirSim has none, so this one only reports and does not act on the motors.

use crate::sim::flight::STEP_S;
use crate::sim::plant::rotor::Rotors;
use crate::sim::plant::{GRAVITY, Plant};
use crate::vehicle::Vehicle;

/// Full and empty open-circuit voltage of three lithium cells, V.
const FULL_V: f64 = 12.6;
const EMPTY_V: f64 = 10.5;
const RESISTANCE_OHM: f64 = 0.02;
/// Electrical efficiency of thrust at hover: current of a 1 kg quadrotor of this size, A/kg.
const HOVER_A_PER_KG: f64 = 11.0;

/// State of the battery.
#[derive(Clone, Copy, Debug)]
pub(super) struct Battery {
    hover_output: f64,
    hover_a: f64,
    capacity_as: f64,
    /// Current, A.
    pub(super) current_a: f64,
    /// Charge used, As.
    pub(super) used_as: f64,
    /// Energy used, J.
    pub(super) used_j: f64,
}

impl Battery {
    pub(super) fn new(vehicle: &Vehicle) -> Self {
        let mass_kg = vehicle.airframe.mass_kg;
        let max_thrust_n = Rotors::new(&vehicle.airframe, STEP_S).max_thrust_n();
        let hover_a = HOVER_A_PER_KG * mass_kg;
        Self {
            hover_output: mass_kg * GRAVITY / max_thrust_n,
            hover_a,
            capacity_as: hover_a * vehicle.limits.endurance_s,
            current_a: 0.0,
            used_as: 0.0,
            used_j: 0.0,
        }
    }

    /// Draws for `interval_s` at the rotors' present output: ideal power goes with thrust to 3/2.
    pub(super) fn draw(&mut self, plant: &Plant, interval_s: f64) {
        let load = plant.rotors().total_output() / self.hover_output;
        self.current_a = 0.3 + self.hover_a * load.max(0.0).powf(1.5);
        self.used_as += self.current_a * interval_s;
        self.used_j += self.current_a * self.volts() * interval_s;
    }

    /// Voltage at rest, V.
    pub(super) fn resting_volts(&self) -> f64 {
        FULL_V - (FULL_V - EMPTY_V) * (self.used_as / self.capacity_as).min(1.0)
    }

    /// Voltage under load, V.
    pub(super) fn volts(&self) -> f64 {
        self.resting_volts() - RESISTANCE_OHM * self.current_a
    }

    /// Resistance, ohm.
    pub(super) fn resistance_ohm() -> f64 {
        RESISTANCE_OHM
    }

    /// Charge left, percent.
    pub(super) fn remaining_percent(&self) -> f64 {
        (100.0 * (1.0 - self.used_as / self.capacity_as)).clamp(0.0, 100.0)
    }
}
