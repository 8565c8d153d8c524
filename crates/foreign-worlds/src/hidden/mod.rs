//! Hidden effects: physics that the known vehicle of a flight lacks. One file each.

mod base_drag;
mod battery_scale;
mod body_drag;
mod ceiling;
mod climb_time;
mod extra_inflow;
mod heading_wake;
mod height_response;
mod hub_force;
mod hysteresis;
mod icing;
mod log_velocity;
mod loop_lag;
mod momentum_drag;
mod oscillation;
mod side_wake;
mod thrust_curve;
mod translational_lift;
mod vortex_dip;
mod warming;

use std::fmt::Debug;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::vector::Vector;

/// Parameters of a hidden effect at most.
pub const MOST_PARAMETERS: usize = 4;

/// One moment of a drone's flight, as effects see it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment {
    /// Time since the motors started, s.
    pub time_s: f64,
    /// Height above home, m.
    pub height_m: f64,
    /// Velocity relative to the air, show frame, m/s; z is the climb through the air.
    pub relative_mps: Vector,
    /// Velocity relative to the air in body axes, m/s.
    pub body_mps: Vector,
    /// Vertical acceleration, m/s², up positive.
    pub acceleration_mps2: f64,
    /// Air density over sea level's.
    pub density_ratio: f64,
    /// Mass of the vehicle, kg.
    pub mass_kg: f64,
    /// Thrust of the rotors, N.
    pub thrust_n: f64,
    /// Drag of the body as the known vehicle has it, body axes, N.
    pub body_n: Vector,
    /// Battery voltage over that at which a command has its nominal meaning.
    pub supply_ratio: f64,
    /// Command of hover in still air at home, 0 to 1.
    pub hover_command: f64,
    /// Whether another drone flies next to it on the left.
    pub has_left: bool,
}

/// Errors of the vertical velocity.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct VelocityError {
    /// How late the control loop gets it, and with it the log, s.
    pub loop_lag_s: f64,
    /// How late it is in the log alone, s.
    pub log_lag_s: f64,
    /// By how much it is wrong in the log alone, m/s.
    pub log_bias_mps: f64,
}

/// An effect acting on one drone. What it does not override it leaves alone.
pub trait Acting: Debug + Send {
    /// Follows the flight; called at each step, with its length in s.
    fn follow(&mut self, _now: &Moment, _step_s: f64) {}

    /// By how much the pulse must rise, us.
    fn pulse_us(&self, _now: &Moment) -> f64 {
        0.0
    }

    /// Factor on the thrust.
    fn thrust(&self, _now: &Moment) -> f64 {
        1.0
    }

    /// Further force, body axes, N.
    fn force_n(&self, _now: &Moment) -> Vector {
        [0.0; 3]
    }

    /// Command that acts where the autopilot gives this one, 0 to 1. It must rise with it.
    fn command(&self, given: f64, _now: &Moment) -> f64 {
        given
    }

    /// Highest command that the controllers take.
    fn ceiling(&self, _hover_command: f64) -> f64 {
        1.0
    }

    /// Errors of the vertical velocity.
    fn velocity(&self) -> VelocityError {
        VelocityError::default()
    }
}

/// One parameter of a hidden effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameter {
    /// Name, with its unit.
    pub name: &'static str,
    /// Smallest value that is drawn.
    pub low: f64,
    /// Largest value that is drawn.
    pub high: f64,
    /// How a value is drawn.
    pub drawn: Drawn,
}

/// How a value is drawn between two bounds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Drawn {
    /// Uniformly between the bounds.
    Uniform,
    /// Uniformly in its logarithm.
    Log,
    /// Uniformly in its logarithm, and of either sign.
    EitherSign,
    /// As a share of the flight's length, uniformly; the value is in s.
    FlightShare,
}

/// A kind of hidden effect.
#[derive(Clone, Copy, Debug)]
pub struct Kind {
    /// Name, for options and tables.
    pub name: &'static str,
    /// Description in a few words.
    pub what: &'static str,
    /// Words for the quantities along which it can be recognised, the plainest first.
    pub depends_on: &'static [&'static str],
    /// Parameters; the first says how large it is.
    pub parameters: &'static [Parameter],
    /// Whether drones do not differ in it and time does not matter but by [`Moment::time_s`]: then a steady
    /// state shows all of it.
    pub is_steady: bool,
    /// Starts it on one drone.
    pub start: fn(&Values) -> Box<dyn Acting>,
}

/// Values of the parameters of an effect, in the order of its kind.
pub type Values = [f64; MOST_PARAMETERS];

/// All kinds; new ones go to the end.
pub const KINDS: &[Kind] = &[
    extra_inflow::KIND,
    base_drag::KIND,
    body_drag::KIND,
    hub_force::KIND,
    battery_scale::KIND,
    warming::KIND,
    vortex_dip::KIND,
    translational_lift::KIND,
    thrust_curve::KIND,
    log_velocity::LAG,
    log_velocity::BIAS,
    loop_lag::KIND,
    momentum_drag::KIND,
    climb_time::KIND,
    icing::KIND,
    hysteresis::KIND,
    ceiling::KIND,
    height_response::KIND,
    heading_wake::KIND,
    oscillation::KIND,
    side_wake::KIND,
];

/// Kind of a name.
pub fn find(name: &str) -> Option<&'static Kind> {
    KINDS.iter().find(|kind| kind.name == name)
}

/// A hidden effect of a world.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HiddenEffect {
    /// Name of its kind.
    pub kind: String,
    /// Values of its parameters, in the order of the kind.
    pub values: Vec<f64>,
}

impl HiddenEffect {
    /// Starts it on one drone; `None`: there is no such kind.
    pub fn start(&self) -> Option<Box<dyn Acting>> {
        let mut values = Values::default();
        for (value, given) in values.iter_mut().zip(&self.values) {
            *value = *given;
        }
        find(&self.kind).map(|kind| (kind.start)(&values))
    }

    /// Value of a parameter by its name.
    pub fn value(&self, name: &str) -> Option<f64> {
        let place = find(&self.kind)?.parameters.iter().position(|one| one.name == name)?;
        self.values.get(place).copied()
    }
}

/// A parameter that is drawn uniformly in its logarithm.
const fn log(name: &'static str, low: f64, high: f64) -> Parameter {
    Parameter { name, low, high, drawn: Drawn::Log }
}

/// A parameter that is drawn uniformly.
const fn uniform(name: &'static str, low: f64, high: f64) -> Parameter {
    Parameter { name, low, high, drawn: Drawn::Uniform }
}

/// A parameter of either sign.
const fn either(name: &'static str, low: f64, high: f64) -> Parameter {
    Parameter { name, low, high, drawn: Drawn::EitherSign }
}

/// A moment of the flight.
const fn moment(name: &'static str, low: f64, high: f64) -> Parameter {
    Parameter { name, low, high, drawn: Drawn::FlightShare }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kinds_have_names_of_their_own_and_bounds_in_order() {
        for (place, kind) in KINDS.iter().enumerate() {
            assert!(!KINDS[..place].iter().any(|other| other.name == kind.name), "{}", kind.name);
            assert!(!kind.parameters.is_empty() && kind.parameters.len() <= MOST_PARAMETERS);
            assert!(kind.parameters.iter().all(|one| one.low < one.high), "{}", kind.name);
        }
        let effect = HiddenEffect { kind: "warming".to_owned(), values: vec![7.0, 90.0] };
        assert_eq!(effect.value("time_s"), Some(90.0));
        assert!(effect.start().is_some());
        assert!(HiddenEffect { kind: "nothing".to_owned(), values: Vec::new() }.start().is_none());
    }
}
