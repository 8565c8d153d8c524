//! Indicators of rotor effort: pulse width, rotor speed, electrical power.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Series;

/// The number that rises with the work of the rotors, from which the air's motion is told.
///
/// Wherever a name says "pulse", a flight that was read with another indicator has that one there,
/// in its own unit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Indicator {
    /// Rotor control pulse width, us: mean over the motors' outputs (the paper's).
    #[default]
    Pulse,
    /// Rotor speed, rpm: mean over the motors' speed controllers. Battery voltage and the motors'
    /// temperature are not in it, as they are in the pulse.
    RotorSpeed,
    /// Electrical power, W: battery voltage times current.
    Power,
}

/// Rotor effort over a flight.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Effort {
    /// Indicator that the values are of.
    pub indicator: Indicator,
    /// Values over time, in the indicator's unit.
    pub values: Series,
}

impl Indicator {
    /// Name of the indicator for people: "rotor speed".
    pub fn words(self) -> &'static str {
        match self {
            Self::Pulse => "rotor control pulse width",
            Self::RotorSpeed => "rotor speed",
            Self::Power => "electrical power",
        }
    }

    /// Symbol of the indicator's unit: us, rpm or W.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Pulse => "us",
            Self::RotorSpeed => "rpm",
            Self::Power => "W",
        }
    }

    /// Whether it is the pulse width.
    pub fn is_pulse(&self) -> bool {
        *self == Self::Pulse
    }

    /// Value of the indicator at which a rotor gives no thrust, in the indicator's unit.
    pub fn without_thrust(self) -> f64 {
        match self {
            Self::Pulse => 1000.0,
            Self::RotorSpeed | Self::Power => 0.0,
        }
    }

    /// Power of thrust that what is above [`Indicator::without_thrust`] goes with, near hover.
    ///
    /// Pulse: 300 us per unit of ln T at a hover of 546 us above 1000, which the firmware's thrust
    /// curve of the show drone and blade element theory with a motor and a battery agree on; where
    /// thrust is linear in the pulse (AirSim) it is 1. Rotor speed: thrust goes with its square.
    /// Power: thrust times induced velocity, `T^1.5`.
    pub fn thrust_exponent(self) -> f64 {
        match self {
            Self::Pulse => 0.55,
            Self::RotorSpeed => 0.5,
            Self::Power => 1.5,
        }
    }

    /// Standard deviation of the rounding of one sample, in the indicator's unit. No window is
    /// known better.
    pub fn quantum(self) -> f64 {
        match self {
            Self::Pulse => 1.0 / 12.0_f64.sqrt(),
            Self::RotorSpeed => 1.0,
            Self::Power => 0.1,
        }
    }
}
