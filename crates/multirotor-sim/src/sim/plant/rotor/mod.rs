//! Rotors: from commands to thrust and torque. One file for each law; the vehicle's file chooses.

mod linear;
mod motor;

use super::Loads;
use crate::effects::Change;
use crate::vehicle::{Airframe, RotorLaw};
use linear::Linear;
use motor::Motor;

/// Number of rotors of a quadcopter.
pub const ROTORS: usize = 4;

/// Place of each rotor (forward, left: signs) and the sign of its torque about the up axis, in
/// ArduPilot's order for a quad X: front right, rear left, front left, rear right. The first two
/// turn counter-clockwise seen from above, which turns the body clockwise.
pub const LAYOUT: [(f64, f64, f64); ROTORS] =
    [(1.0, -1.0, -1.0), (-1.0, 1.0, -1.0), (1.0, 1.0, 1.0), (-1.0, -1.0, 1.0)];

/// The four rotors and their state.
#[derive(Clone, Copy, Debug)]
pub enum Rotors {
    /// AirSim's rotors, whose thrust is linear in the pulse.
    Linear(Linear),
    /// Brushless motors at a supply voltage.
    Motor(Motor),
}

impl Rotors {
    /// Rotors at rest, for steps of `dt_s`.
    pub fn new(airframe: &Airframe, dt_s: f64) -> Self {
        match &airframe.rotor {
            RotorLaw::Linear => Self::Linear(Linear::new(airframe, dt_s)),
            RotorLaw::Motor(law) => Self::Motor(Motor::new(airframe, law, dt_s)),
        }
    }

    /// Changes the length of the steps; `airframe` must be that of the rotors.
    pub fn set_step(&mut self, airframe: &Airframe, dt_s: f64) {
        match self {
            Self::Linear(rotors) => rotors.set_step(airframe, dt_s),
            Self::Motor(rotors) => rotors.set_step(airframe, dt_s),
        }
    }

    /// Thrust of one rotor at its largest speed and sea level, N.
    pub fn max_thrust_n(&self) -> f64 {
        match self {
            Self::Linear(rotors) => rotors.max_thrust_n(),
            Self::Motor(rotors) => rotors.max_thrust_n(),
        }
    }

    /// Present speed of each rotor, rad/s.
    pub fn speeds_radps(&self) -> [f64; ROTORS] {
        match self {
            Self::Linear(rotors) => rotors.speeds_radps(),
            Self::Motor(rotors) => rotors.speeds_radps(),
        }
    }

    /// Sum of the rotors' present outputs, 0..4, as shares of full thrust.
    pub fn total_output(&self) -> f64 {
        match self {
            Self::Linear(rotors) => rotors.total_output(),
            Self::Motor(rotors) => rotors.total_output(),
        }
    }

    /// Thrust of all rotors in still air at their present speed, N.
    pub fn thrust_n(&self, density_ratio: f64) -> f64 {
        match self {
            Self::Linear(rotors) => rotors.thrust_n(density_ratio),
            Self::Motor(rotors) => rotors.thrust_n(density_ratio),
        }
    }

    /// Electrical power, W, when the torque is `torque` times that in still air.
    pub fn power_w(&self, density_ratio: f64, torque: f64) -> f64 {
        match self {
            Self::Linear(rotors) => rotors.power_w(density_ratio, torque),
            Self::Motor(rotors) => rotors.power_w(density_ratio, torque),
        }
    }

    /// Adds thrust and torque at the present output.
    #[inline]
    pub fn add_loads(&self, density_ratio: f64, change: &Change, loads: &mut Loads) {
        match self {
            Self::Linear(rotors) => rotors.add_loads(density_ratio, change, loads),
            Self::Motor(rotors) => rotors.add_loads(density_ratio, change, loads),
        }
    }

    /// Advances the rotors by one step towards `command` (0 to 1); `torque` is their torque over
    /// that in still air at sea level.
    #[inline]
    pub fn advance(&mut self, command: &[f64; ROTORS], torque: f64) {
        match self {
            Self::Linear(rotors) => rotors.advance(command),
            Self::Motor(rotors) => rotors.advance(command, torque),
        }
    }

    /// Turns all rotors steadily with this share of full thrust.
    pub fn settle(&mut self, output: f64) {
        match self {
            Self::Linear(rotors) => rotors.settle(&[output; ROTORS]),
            Self::Motor(rotors) => rotors.settle(output),
        }
    }

    /// Command (0 to 1) that keeps this share of full thrust in still air when the torque is `torque`
    /// times that in still air at sea level.
    pub fn command_for(&self, output: f64, torque: f64) -> f64 {
        match self {
            Self::Linear(_) => output,
            Self::Motor(rotors) => rotors.command_for(output, torque),
        }
    }

    /// Rotor speed at this share of full thrust, rad/s.
    pub fn speed_radps(&self, output: f64) -> f64 {
        match self {
            Self::Linear(rotors) => rotors.speed_radps(output),
            Self::Motor(rotors) => rotors.speed_radps(output),
        }
    }
}

/// Share of the way to the command that the motors go in one step.
fn lag_gain(airframe: &Airframe, dt_s: f64) -> f64 {
    if airframe.motor_time_constant_s > 0.0 {
        // Exact for a command held over the step.
        -(-dt_s / airframe.motor_time_constant_s).exp_m1()
    } else {
        1.0
    }
}
