//! Brushless motors at a voltage: the command is the share of the supply that a motor gets.
//!
//! Voltage = K_e speed + R (torque / K_e + I_0): a motor's steady speed follows from the command and
//! the rotor's torque, and is reached with a first-order lag. Thrust and torque are quadratic in
//! the speed (vehicle::MotorLaw; the same law backwards is effects::Reference).

use std::f64::consts::{FRAC_1_SQRT_2, TAU};

use nalgebra::Vector3;

use super::{LAYOUT, ROTORS, lag_gain};
use crate::effects::Change;
use crate::effects::reference::{motor_volts, rotor_w};
use crate::sim::plant::Loads;
use crate::vehicle::{Airframe, MotorLaw, RotorLaw};

/// Least torque over that in still air: a rotor that the air drives is not modelled.
const LEAST_TORQUE: f64 = 0.05;

/// The four motors with their rotors.
#[derive(Clone, Copy, Debug)]
pub struct Motor {
    law: MotorLaw,
    constant: f64,
    thrust_factor: f64,
    torque_factor: f64,
    /// Squared largest speed, (rad/s)².
    max_square: f64,
    /// Distance of a rotor from the body's forward and left axes, m.
    offset_m: f64,
    gain: f64,
    speed_radps: [f64; ROTORS],
}

impl Motor {
    /// Motors at rest, for steps of `dt_s`.
    pub fn new(airframe: &Airframe, law: &MotorLaw, dt_s: f64) -> Self {
        Self {
            law: *law,
            constant: law.constant(),
            thrust_factor: airframe.thrust_factor(),
            torque_factor: airframe.torque_factor(),
            max_square: (airframe.max_rpm * TAU / 60.0).powi(2),
            offset_m: airframe.arm_m * FRAC_1_SQRT_2,
            gain: lag_gain(airframe, dt_s),
            speed_radps: [0.0; ROTORS],
        }
    }

    /// Changes the length of the steps.
    pub fn set_step(&mut self, airframe: &Airframe, dt_s: f64) {
        self.gain = lag_gain(airframe, dt_s);
    }

    /// Thrust of one rotor at its largest speed and sea level, N.
    pub fn max_thrust_n(&self) -> f64 {
        self.thrust_factor * self.max_square
    }

    /// Present speed of each rotor, rad/s.
    pub fn speeds_radps(&self) -> [f64; ROTORS] {
        self.speed_radps
    }

    /// Sum of the rotors' squared speeds as shares of the largest, 0 to 4.
    pub fn total_output(&self) -> f64 {
        self.squares().iter().sum::<f64>() / self.max_square
    }

    /// Thrust of all rotors in still air at their present speed, N.
    pub fn thrust_n(&self, density_ratio: f64) -> f64 {
        self.squares().iter().sum::<f64>() * self.thrust_factor * density_ratio
    }

    /// Electrical power, W, when the torque is `torque` times that in still air.
    pub fn power_w(&self, density_ratio: f64, torque: f64) -> f64 {
        let factor = self.torque_factor * density_ratio * torque.max(LEAST_TORQUE);
        let law = RotorLaw::Motor(self.law);
        let turning = self.speed_radps.iter().filter(|speed| **speed > 0.0);
        turning.map(|speed| rotor_w(&law, *speed, factor * speed * speed)).sum()
    }

    /// Adds thrust and torque at the present speeds.
    #[inline]
    pub fn add_loads(&self, density_ratio: f64, change: &Change, loads: &mut Loads) {
        let [mut thrust, mut roll, mut pitch, mut yaw] = [0.0; 4];
        for ((forward, left, turn), square) in LAYOUT.into_iter().zip(self.squares()) {
            thrust += square;
            roll += left * square;
            pitch -= forward * square;
            yaw += turn * square;
        }
        let factor = self.thrust_factor * density_ratio * change.thrust;
        loads.force_n.z += thrust * factor;
        let lever = self.offset_m * factor;
        let torque = self.torque_factor * density_ratio * change.torque.max(LEAST_TORQUE);
        loads.torque_nm += Vector3::new(roll * lever, pitch * lever, yaw * torque);
    }

    /// Advances the motors by one step; `torque` is the rotors' torque over that in still air at
    /// sea level.
    #[inline]
    pub fn advance(&mut self, command: &[f64; ROTORS], torque: f64) {
        let quadratic =
            self.law.resistance_ohm * self.torque_factor * torque.max(LEAST_TORQUE) / self.constant;
        for (speed, command) in self.speed_radps.iter_mut().zip(command) {
            let volts = command.clamp(0.0, 1.0) * self.law.supply_v
                - self.law.resistance_ohm * self.law.no_load_a;
            // The positive root of quadratic speed² + K_e speed = volts, without cancellation.
            let root = self.constant * self.constant + 4.0 * quadratic * volts.max(0.0);
            let steady = 2.0 * volts.max(0.0) / (self.constant + root.sqrt());
            *speed += self.gain * (steady - *speed);
        }
    }

    /// Rotor speed at this share of full thrust, rad/s.
    pub fn speed_radps(&self, output: f64) -> f64 {
        (output.max(0.0) * self.max_square).sqrt()
    }

    /// Turns all rotors steadily with this share of full thrust.
    pub fn settle(&mut self, output: f64) {
        self.speed_radps = [self.speed_radps(output); ROTORS];
    }

    /// Command (0 to 1) that keeps this share of full thrust against a torque, as [`Motor::advance`] has it.
    pub fn command_for(&self, output: f64, torque: f64) -> f64 {
        let speed = self.speed_radps(output);
        let torque_nm = self.torque_factor * torque.max(LEAST_TORQUE) * speed * speed;
        motor_volts(&self.law, speed, torque_nm) / self.law.supply_v
    }

    fn squares(&self) -> [f64; ROTORS] {
        self.speed_radps.map(|speed| speed * speed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::Reference;
    use crate::vehicle::library::builtin;

    #[test]
    fn reaches_the_thrust_that_the_reference_says() {
        let vehicle = builtin("pixel").unwrap();
        let RotorLaw::Motor(law) = vehicle.airframe.rotor else { panic!("the pixel has motors") };
        let reference = Reference::of(&vehicle);
        for (ratio, torque) in [(1.0_f64, 1.0), (1.3, 1.0), (0.8, 1.1)] {
            let mut motors = Motor::new(&vehicle.airframe, &law, 0.0025);
            let pulse_us = reference.pulse_us(ratio.sqrt(), torque);
            for _ in 0..2_000 {
                motors.advance(&[(pulse_us - 1000.0) / 1000.0; ROTORS], torque);
            }
            let thrust = motors.thrust_n(1.0) / reference.weight_n();
            assert!((thrust - ratio).abs() < 1e-9, "{thrust} instead of {ratio}");
            assert!((motors.power_w(1.0, torque) > 10.0) && motors.total_output() < 4.0);
        }
    }
}
