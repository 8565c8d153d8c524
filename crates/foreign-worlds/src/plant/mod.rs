//! Plants: what rotors and body do at an air speed. Body axes are forward, left, up.

mod blade_element;
mod inflow;
mod motor;
mod thrust_law;

pub use blade_element::{BladeElement, Rotor};
pub use inflow::induced_mps;
pub use motor::Motor;
pub use thrust_law::ThrustLaw;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::vector::Vector;

/// Acceleration of gravity, m/s² (CODATA's standard value).
pub const GRAVITY: f64 = 9.80665;
/// Density of air at sea level, kg/m³ (standard atmosphere).
pub const SEA_LEVEL_KGPM3: f64 = 1.225;

/// Air density at a height above sea level over that at sea level: the standard atmosphere's troposphere
/// (ISO 2533), without weather.
pub fn density_ratio(amsl_m: f64) -> f64 {
    (1.0 - 2.25577e-5 * amsl_m).max(0.1).powf(4.25588)
}

/// Air around the body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flow {
    /// Velocity of the body relative to the air, body axes, m/s.
    pub relative_mps: Vector,
    /// Air density over sea level's.
    pub density_ratio: f64,
}

/// Forces on the body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Loads {
    /// Force of all rotors, body axes, N.
    pub rotors_n: Vector,
    /// Force of the body's drag, body axes, N.
    pub body_n: Vector,
}

/// A vehicle's plant. Its rotors have one state: for a thrust law the share of full command that acts,
/// for blades the rotor speed in rad/s.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", tag = "family")]
pub enum Plant {
    /// Thrust proportional to the command.
    ThrustLaw(ThrustLaw),
    /// Blades and motors.
    BladeElement(BladeElement),
}

impl Plant {
    /// Mass of the vehicle, kg.
    pub fn mass_kg(&self) -> f64 {
        match self {
            Self::ThrustLaw(law) => law.mass_kg,
            Self::BladeElement(blades) => blades.mass_kg,
        }
    }

    /// Forces at a state of the rotors.
    pub fn loads(&self, state: f64, flow: &Flow) -> Loads {
        match self {
            Self::ThrustLaw(law) => law.loads(state, flow),
            Self::BladeElement(blades) => blades.loads(state, flow),
        }
    }

    /// Rate of the rotors' state under a command from 0 to 1, per second.
    pub fn rate(&self, state: f64, command: f64, flow: &Flow) -> f64 {
        match self {
            Self::ThrustLaw(law) => law.rate(state, command),
            Self::BladeElement(blades) => blades.rate(state, command, flow),
        }
    }

    /// Command under which a state of the rotors is steady; it may be above 1.
    pub fn command_for(&self, state: f64, flow: &Flow) -> f64 {
        match self {
            Self::ThrustLaw(_) => state,
            Self::BladeElement(blades) => blades.command_for(state, flow),
        }
    }

    /// Largest state of the rotors, for whoever looks for a steady one.
    pub fn largest_state(&self) -> f64 {
        match self {
            Self::ThrustLaw(_) => 2.0,
            Self::BladeElement(blades) => blades.largest_radps(),
        }
    }

    /// Speed of the rotors at a state, rad/s; a thrust law has none.
    pub fn rotor_radps(&self, state: f64) -> Option<f64> {
        match self {
            Self::ThrustLaw(_) => None,
            Self::BladeElement(_) => Some(state),
        }
    }

    /// Electrical power at a state of the rotors, W.
    pub fn power_w(&self, state: f64, flow: &Flow) -> f64 {
        match self {
            Self::ThrustLaw(law) => law.power_w(state),
            Self::BladeElement(blades) => blades.power_w(state, flow),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn density_is_the_standard_atmospheres() {
        // ISO 2533: 1.225, 1.112 and 1.007 kg/m³.
        for (amsl_m, kgpm3) in [(0.0, 1.225), (1000.0, 1.1117), (2000.0, 1.0066)] {
            let density = SEA_LEVEL_KGPM3 * density_ratio(amsl_m);
            assert!((density - kgpm3).abs() < 2e-4, "{density}");
        }
    }
}
