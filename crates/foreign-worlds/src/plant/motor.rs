//! A direct-current motor with its controller.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A motor: back-EMF, winding resistance, no-load current. Its controller gives it a share of the supply.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Motor {
    /// Speed per voltage without load, rad/s/V; its inverse is the torque per current, N m/A.
    pub speed_radps_per_v: f64,
    /// Resistance of windings and controller, ohm.
    pub resistance_ohm: f64,
    /// Current without load, A.
    pub no_load_a: f64,
    /// Voltage of full command, V.
    pub supply_v: f64,
    /// Moment of inertia of rotor and propeller, kg m².
    pub inertia_kgm2: f64,
}

impl Motor {
    /// Current at a torque, A.
    pub fn current_a(&self, torque_nm: f64) -> f64 {
        torque_nm * self.speed_radps_per_v + self.no_load_a
    }

    /// Command that holds a speed against a torque.
    pub fn command_for(&self, speed_radps: f64, torque_nm: f64) -> f64 {
        let volts =
            speed_radps / self.speed_radps_per_v + self.resistance_ohm * self.current_a(torque_nm);
        volts / self.supply_v
    }

    /// Angular acceleration under a command against a torque, rad/s².
    pub fn acceleration(&self, command: f64, speed_radps: f64, torque_nm: f64) -> f64 {
        let back_v = speed_radps / self.speed_radps_per_v;
        let current_a = (command * self.supply_v - back_v) / self.resistance_ohm;
        let driving_nm = (current_a - self.no_load_a) / self.speed_radps_per_v;
        (driving_nm - torque_nm) / self.inertia_kgm2
    }

    /// Electrical power at a speed and torque, W.
    pub fn power_w(&self, speed_radps: f64, torque_nm: f64) -> f64 {
        let volts = self.command_for(speed_radps, torque_nm) * self.supply_v;
        volts * self.current_a(torque_nm)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_steady_command_does_not_accelerate() {
        let motor = Motor {
            speed_radps_per_v: 233.0,
            resistance_ohm: 0.22,
            no_load_a: 0.44,
            supply_v: 7.9,
            inertia_kgm2: 2e-6,
        };
        let command = motor.command_for(840.0, 8.7e-3);
        assert!(motor.acceleration(command, 840.0, 8.7e-3).abs() < 1e-6);
        // By hand: 840/233 V + 0.22 ohm (8.7e-3 * 233 A + 0.44 A).
        assert!((command * 7.9 - 4.148).abs() < 1e-3, "{}", command * 7.9);
        assert!(motor.acceleration(command + 0.01, 840.0, 8.7e-3) > 0.0);
    }
}
