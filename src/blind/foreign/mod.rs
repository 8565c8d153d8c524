//! Physics that no library lists: what a search must call unknown, with what it depends on.
//!
//! Each acts on the way from command to motor: the command is lowered by what the pulse must then
//! rise.

mod climb_time;
mod heading;
mod height_wave;
mod step;

use crate::effects::{Definition, Effect, Reference, Signals, Values};

/// Foreign effects: those that no library lists.
pub const FOREIGN: &[&dyn Effect] =
    &[&step::Step, &height_wave::HeightWave, &climb_time::ClimbTime, &heading::Heading];

/// Foreign effect by its name; `None` if there is none.
pub fn find(name: &str) -> Option<&'static dyn Effect> {
    FOREIGN.iter().copied().find(|effect| effect.definition().name == name)
}

/// Words by which a verdict may name the dependence of a foreign effect; the first is the plainest.
/// Empty for an unknown name.
pub fn depends_on(name: &str) -> &'static [&'static str] {
    match name {
        "step" => &["step", "time"],
        "height-wave" => &["height"],
        "climb-time" => &["climb-time"],
        "heading" => &["heading"],
        _ => &[],
    }
}

/// Change in the pulse width of steady flight that an effect causes, us; `heading_rad` is the
/// direction of the oncoming air against the nose.
pub fn steady_us(
    effect: &dyn Effect,
    values: &Values,
    at: &Reference,
    signals: &Signals,
    heading_rad: f64,
) -> f64 {
    let ahead_us = effect.pulse_us(at, values, signals);
    // The closed form has the air straight from ahead.
    if effect.definition().name == "heading" { ahead_us * heading_rad.cos() } else { ahead_us }
}

/// Places in [`crate::effects::Own::state`] that all of them share: change of the pulse now (us) and
/// time since the motors started (s).
const PULSE_US: usize = 0;
const TIME_S: usize = 1;

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
