//! Physics that no library lists: what a search must call unknown, with what it depends on.
//!
//! Each acts on the way from command to motor: the command is lowered by what the pulse must then
//! rise.

mod climb_time;
mod heading;
mod height_wave;
mod step;

use crate::effects::{Definition, Effect, Reference, Signals, Values};
use crate::gap::Dependence;

/// Effect that no library lists.
#[derive(Clone, Copy)]
pub struct Foreign {
    /// Physics, as of an effect of the library.
    pub effect: &'static dyn Effect,
    /// Dependences that a verdict may name for the effect; the first is the plainest.
    pub depends_on: &'static [Dependence],
    /// Whether the effect goes with the cosine of the direction of the oncoming air against the nose; the closed
    /// form has the air straight from ahead.
    pub turns: bool,
}

/// Foreign effects: those that no library lists.
pub const FOREIGN: &[Foreign] =
    &[step::FOREIGN, height_wave::FOREIGN, climb_time::FOREIGN, heading::FOREIGN];

/// Foreign effect by its name; `None` if there is none.
pub fn find(name: &str) -> Option<&'static Foreign> {
    FOREIGN.iter().find(|foreign| foreign.effect.definition().name == name)
}

impl Foreign {
    /// Change in the pulse width of steady flight, us; `heading_rad` is the direction of the oncoming air
    /// against the nose.
    pub fn steady_us(
        &self,
        values: &Values,
        at: &Reference,
        signals: &Signals,
        heading_rad: f64,
    ) -> f64 {
        let ahead_us = self.effect.pulse_us(at, values, signals);
        if self.turns { ahead_us * heading_rad.cos() } else { ahead_us }
    }
}

/// A command (0..1) after the pulse has to rise by so much.
fn lowered(command: f64, pulse_us: f64) -> f64 {
    (command - pulse_us * 1e-3).clamp(0.0, 1.0)
}

/// Values by name, in the order of a definition; those not given are 0.
pub(super) fn values(definition: &Definition, of: impl Fn(&str) -> Option<f64>) -> Values {
    let mut values = Values::default();
    for (value, parameter) in values.iter_mut().zip(definition.parameters) {
        *value = of(parameter.name).unwrap_or_default();
    }
    values
}
