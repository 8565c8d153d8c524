//! AirSim's rotors: thrust and torque linear in the command, behind a first-order lag.
//!
//! AirSim's RotorActuator and RotorParams: no influence of the air's motion on the thrust.

use std::f64::consts::{FRAC_1_SQRT_2, TAU};

use nalgebra::Vector3;

use super::{LAYOUT, ROTORS, lag_gain};
use crate::effects::Change;
use crate::effects::reference::rotor_w;
use crate::sim::air::SEA_LEVEL_DENSITY;
use crate::sim::plant::Loads;
use crate::vehicle::{Airframe, RotorLaw};

/// The four rotors and their state.
#[derive(Clone, Copy, Debug)]
pub struct Linear {
    max_thrust_n: f64,
    max_torque_nm: f64,
    max_radps: f64,
    /// Distance of a rotor from the body's forward and left axes, m.
    offset_m: f64,
    /// Share of the way to the command that the filter goes in one step.
    gain: f64,
    filtered: [f64; ROTORS],
    /// What the thrust is computed from: the filter's state of one step ago.
    output: [f64; ROTORS],
}

impl Linear {
    /// Rotors at rest, for steps of `dt_s`.
    pub fn new(airframe: &Airframe, dt_s: f64) -> Self {
        let revolutions_per_s = airframe.max_rpm / 60.0;
        let pressure = REFERENCE_DENSITY * revolutions_per_s.powi(2);
        Self {
            max_thrust_n: airframe.thrust_coefficient
                * pressure
                * airframe.rotor_diameter_m.powi(4),
            max_torque_nm: airframe.power_coefficient
                * pressure
                * airframe.rotor_diameter_m.powi(5)
                / TAU,
            max_radps: airframe.max_rpm * TAU / 60.0,
            offset_m: airframe.arm_m * FRAC_1_SQRT_2,
            gain: lag_gain(airframe, dt_s),
            filtered: [0.0; ROTORS],
            output: [0.0; ROTORS],
        }
    }

    /// Changes the length of the steps.
    pub fn set_step(&mut self, airframe: &Airframe, dt_s: f64) {
        self.gain = lag_gain(airframe, dt_s);
    }

    /// Thrust of one rotor at full command and sea level, N.
    pub fn max_thrust_n(&self) -> f64 {
        self.max_thrust_n
    }

    /// Present speed of each rotor, rad/s.
    pub fn speeds_radps(&self) -> [f64; ROTORS] {
        self.output.map(|output| self.speed_radps(output))
    }

    /// Sum of the rotors' present outputs, 0..4, as shares of full thrust.
    #[inline]
    pub fn total_output(&self) -> f64 {
        self.output.iter().sum()
    }

    /// Adds thrust and torque at the present output.
    #[inline]
    pub fn add_loads(&self, density_ratio: f64, change: &Change, loads: &mut Loads) {
        let [mut thrust, mut roll, mut pitch, mut yaw] = [0.0; 4];
        for ((forward, left, turn), output) in LAYOUT.into_iter().zip(self.output) {
            thrust += output;
            roll += left * output;
            pitch -= forward * output;
            yaw += turn * output;
        }
        let thrust_n = self.max_thrust_n * density_ratio * change.thrust;
        loads.force_n.z += thrust * thrust_n;
        let lever = self.offset_m * thrust_n;
        // In this order, AirSim's own numbers come out to the last bit when nothing changes them.
        let yaw_nm = yaw * self.max_torque_nm * density_ratio * change.torque;
        loads.torque_nm += Vector3::new(roll * lever, pitch * lever, yaw_nm);
    }

    /// Thrust of all rotors in still air at their present output, N.
    pub fn thrust_n(&self, density_ratio: f64) -> f64 {
        self.total_output() * self.max_thrust_n * density_ratio
    }

    /// Electrical power at the present output, W.
    pub fn power_w(&self, density_ratio: f64, torque: f64) -> f64 {
        self.output
            .iter()
            .map(|output| {
                let torque_nm = output * self.max_torque_nm * density_ratio * torque;
                rotor_w(&RotorLaw::Linear, self.speed_radps(*output), torque_nm)
            })
            .sum()
    }

    /// Advances the rotors by one step towards `command` (0 to 1 of full thrust).
    #[inline]
    pub fn advance(&mut self, command: &[f64; ROTORS]) {
        self.output = self.filtered;
        for (state, command) in self.filtered.iter_mut().zip(command) {
            *state += self.gain * (command.clamp(0.0, 1.0) - *state);
        }
    }

    /// Rotor speed at this share of full thrust, rad/s.
    pub fn speed_radps(&self, output: f64) -> f64 {
        output.max(0.0).sqrt() * self.max_radps
    }

    /// Puts the rotors into the steady state of a command.
    pub fn settle(&mut self, command: &[f64; ROTORS]) {
        self.filtered = *command;
        self.output = *command;
    }
}

/// AirSim's rotor parameters are stated for 1.225 kg/m³, not for its own sea-level density.
const REFERENCE_DENSITY: f64 = 1.225;
const _: () = assert!((SEA_LEVEL_DENSITY - REFERENCE_DENSITY).abs() < 1e-4);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicle::library::builtin;

    fn rotors() -> Linear {
        Linear::new(&builtin("airsim-generic-quad").unwrap().airframe, 0.0025)
    }

    #[test]
    fn full_thrust_and_torque_are_airsims() {
        let rotors = rotors();
        assert!((rotors.max_thrust_n - 4.179_446).abs() < 1e-6, "{}", rotors.max_thrust_n);
        assert!((rotors.max_torque_nm - 0.055_562).abs() < 1e-6, "{}", rotors.max_torque_nm);
    }

    #[test]
    fn answers_a_step_after_one_step_of_delay_with_the_time_constant() {
        let mut rotors = rotors();
        let mut outputs = Vec::new();
        for _ in 0..4 {
            rotors.advance(&[1.0; 4]);
            outputs.push(rotors.total_output() / 4.0);
        }
        // 5 ms constant, 2.5 ms steps: 0, then 1 - exp(-k / 2).
        let expected =
            [0.0, 1.0 - (-0.5_f64).exp(), 1.0 - (-1.0_f64).exp(), 1.0 - (-1.5_f64).exp()];
        for (got, want) in outputs.iter().zip(expected) {
            assert!((got - want).abs() < 1e-12, "{outputs:?}");
        }
    }

    #[test]
    fn each_rotor_turns_the_body_its_own_way() {
        // Body axes forward, left, up: front right lifts the right side (negative about forward)
        // and the nose (negative about left), and turns the body clockwise (negative about up).
        let mut rotors = rotors();
        rotors.settle(&[1.0, 0.0, 0.0, 0.0]);
        let mut loads = Loads::default();
        rotors.add_loads(1.0, &Change::default(), &mut loads);
        assert!(loads.torque_nm.x < 0.0 && loads.torque_nm.y < 0.0 && loads.torque_nm.z < 0.0);
        rotors.settle(&[1.0; 4]);
        let mut loads = Loads::default();
        rotors.add_loads(1.0, &Change::default(), &mut loads);
        assert!(loads.torque_nm.norm() < 1e-12);
    }

    #[test]
    fn without_changes_loads_are_airsims_to_the_last_bit() {
        let mut rotors = rotors();
        for (k, ratio) in [(1_u32, 1.0), (7, 0.981_234_5), (13, 0.953_3)] {
            let output = [3, 5, 7, 11].map(|n| f64::from(n * k % 17) / 17.3);
            rotors.settle(&output);
            let mut loads = Loads::default();
            rotors.add_loads(ratio, &Change::default(), &mut loads);
            let [a, b, c, d] = output;
            let thrust_n = rotors.max_thrust_n * ratio;
            let yaw = 0.0 - a - b + c + d;
            assert_eq!(loads.force_n.z.to_bits(), ((a + b + c + d) * thrust_n).to_bits());
            let yaw_nm = yaw * rotors.max_torque_nm * ratio;
            assert_eq!(loads.torque_nm.z.to_bits(), yaw_nm.to_bits());
        }
    }
}
