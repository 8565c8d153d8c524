//! A thrust law: thrust proportional to command and density, and quadratic drag on the faces of the body.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Flow, Loads, SEA_LEVEL_KGPM3};
use crate::vector::Vector;

/// Electrical power of hover per mass, W/kg: 9-inch propellers at a figure of merit of a half. It says
/// how fast the battery drains and nothing else.
const HOVER_WPKG: f64 = 120.0;

/// A vehicle with such a law.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ThrustLaw {
    /// Mass, kg.
    pub mass_kg: f64,
    /// Thrust of all rotors at full command and sea level, N.
    pub full_thrust_n: f64,
    /// Force along forward, left and up over density and squared speed, m².
    pub drag_m2: Vector,
    /// Time constant of the rotors, s.
    pub lag_s: f64,
}

impl ThrustLaw {
    /// Forces at a share of full command.
    pub fn loads(&self, state: f64, flow: &Flow) -> Loads {
        let density = SEA_LEVEL_KGPM3 * flow.density_ratio;
        let drag = |axis: usize| {
            let speed = flow.relative_mps[axis];
            -density * self.drag_m2[axis] * speed * speed.abs()
        };
        Loads {
            rotors_n: [0.0, 0.0, self.full_thrust_n * flow.density_ratio * state],
            body_n: [drag(0), drag(1), drag(2)],
        }
    }

    /// Rate of the acting share under a command, per second.
    pub fn rate(&self, state: f64, command: f64) -> f64 {
        (command - state) / self.lag_s
    }

    /// Electrical power, W: with the thrust to 3/2, as momentum theory has it.
    pub fn power_w(&self, state: f64) -> f64 {
        let load = self.full_thrust_n * state.max(0.0) / (self.mass_kg * super::GRAVITY);
        HOVER_WPKG * self.mass_kg * load * load.sqrt()
    }
}
