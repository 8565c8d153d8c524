//! Law of a rotor from command to thrust, and what follows from a rotor's coefficients.

use std::f64::consts::{PI, TAU};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Airframe;

/// Density for which thrust and power coefficients are stated, kg/m³.
const REFERENCE_DENSITY: f64 = 1.225;
/// Rotors of every vehicle.
const ROTORS: f64 = 4.0;

/// How a rotor's command (0..1, linear in the pulse) becomes thrust: `[airframe.rotor]`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "law", rename_all = "kebab-case")]
pub enum RotorLaw {
    /// AirSim's: thrust is linear in the command.
    #[default]
    Linear,
    /// The command is the share of the supply's voltage that a brushless motor gets; thrust is
    /// quadratic in the speed that it reaches.
    Motor(MotorLaw),
}

impl RotorLaw {
    /// Whether this is AirSim's law, which vehicle files need not state.
    pub fn is_linear(&self) -> bool {
        *self == Self::Linear
    }
}

/// A brushless motor at a fixed supply; the battery effect varies the supply.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MotorLaw {
    /// Voltage at the motor controllers for which the vehicle's hover is stated, V.
    pub supply_v: f64,
    /// Speed per voltage without load, rev/min per V.
    pub kv_rpm_per_v: f64,
    /// Resistance of one motor with its controller and leads, ohm.
    pub resistance_ohm: f64,
    /// Current of one motor without load, A.
    pub no_load_a: f64,
}

impl MotorLaw {
    /// Back-EMF per speed and torque per current, V s/rad = N m/A.
    pub fn constant(&self) -> f64 {
        60.0 / (TAU * self.kv_rpm_per_v)
    }
}

impl Airframe {
    /// Thrust of one rotor over its squared speed at the reference density, N s²/rad².
    pub fn thrust_factor(&self) -> f64 {
        self.thrust_coefficient * REFERENCE_DENSITY * self.rotor_diameter_m.powi(4) / (TAU * TAU)
    }

    /// Torque of one rotor over its squared speed at the reference density, N m s²/rad².
    pub fn torque_factor(&self) -> f64 {
        self.power_coefficient * REFERENCE_DENSITY * self.rotor_diameter_m.powi(5)
            / (TAU * TAU * TAU)
    }

    /// Area of all rotor discs, m².
    pub fn disc_area_m2(&self) -> f64 {
        ROTORS * PI / 4.0 * self.rotor_diameter_m.powi(2)
    }

    /// Ideal power over power in hover (figure of merit): the share of the torque that makes the
    /// induced flow.
    pub fn figure_of_merit(&self) -> f64 {
        self.thrust_coefficient.powf(1.5) * (2.0 / PI).sqrt() / self.power_coefficient
    }
}

#[cfg(test)]
mod tests {
    use crate::vehicle::library::builtin;

    #[test]
    fn coefficients_give_airsims_thrust_and_torque() {
        let frame = builtin("airsim-generic-quad").unwrap().airframe;
        let speed = frame.max_rpm * std::f64::consts::TAU / 60.0;
        assert!((frame.thrust_factor() * speed * speed - 4.179_446).abs() < 1e-6);
        assert!((frame.torque_factor() * speed * speed - 0.055_562).abs() < 1e-6);
        assert!((0.5..0.9).contains(&frame.figure_of_merit()));
    }
}
