//! The battery as the log has it: the vehicle's own (the effect `battery`), or, as AirSim has none,
//! one that only reports and does not act on the motors.

use crate::effects::Reading;
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
    own: Option<Reading>,
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
            own: None,
        }
    }

    /// Draws for `interval_s` at the rotors' present output: ideal power goes with thrust to 3/2.
    pub(super) fn draw(&mut self, plant: &Plant, interval_s: f64) {
        self.own = plant.battery();
        if let Some(own) = self.own {
            self.current_a = own.amps;
            self.used_as = own.used_ah * 3600.0;
            self.used_j += own.amps * own.volts * interval_s;
            return;
        }
        let load = (plant.rotors().total_output() / self.hover_output).max(0.0);
        self.current_a = 0.3 + self.hover_a * load * load.sqrt();
        self.used_as += self.current_a * interval_s;
        self.used_j += self.current_a * self.volts() * interval_s;
    }

    /// Voltage at rest, V.
    pub(super) fn resting_volts(&self) -> f64 {
        if let Some(own) = self.own {
            return own.resting_v;
        }
        FULL_V - (FULL_V - EMPTY_V) * (self.used_as / self.capacity_as).min(1.0)
    }

    /// Voltage under load, V.
    pub(super) fn volts(&self) -> f64 {
        if let Some(own) = self.own {
            return own.volts;
        }
        self.resting_volts() - RESISTANCE_OHM * self.current_a
    }

    /// Resistance, ohm.
    pub(super) fn resistance_ohm(&self) -> f64 {
        self.own.map_or(RESISTANCE_OHM, |own| own.resistance_ohm)
    }

    /// Charge of a full battery, As.
    fn capacity_as(&self) -> f64 {
        self.own.map_or(self.capacity_as, |own| own.capacity_ah * 3600.0)
    }

    /// State of the battery as the log has it.
    pub(super) fn reading(&self) -> Reading {
        let capacity_as = self.capacity_as();
        Reading {
            volts: self.volts(),
            resting_v: self.resting_volts(),
            amps: self.current_a,
            used_ah: self.used_as / 3600.0,
            charge: self.own.map_or(1.0 - self.used_as / capacity_as, |own| own.charge),
            capacity_ah: capacity_as / 3600.0,
            resistance_ohm: self.resistance_ohm(),
            compensated: self.own.is_some_and(|own| own.compensated),
        }
    }

    /// Charge left, percent.
    pub(super) fn remaining_percent(&self) -> f64 {
        let capacity_as = self.capacity_as();
        (100.0 * (1.0 - self.used_as / capacity_as)).clamp(0.0, 100.0)
    }
}
