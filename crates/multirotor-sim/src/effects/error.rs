//! Errors of a choice of effects.

use thiserror::Error;

use untrusted_io::plain::plain;

/// An effect or its parameter cannot be used.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum EffectError {
    /// No effect of this name.
    #[error("there is no effect \"{}\"; `updraft effects` lists them{hint}", plain(name))]
    Unknown {
        /// Name that was given.
        name: String,
        /// A name that is near, as text.
        hint: String,
    },
    /// The effect has no such parameter.
    #[error("the effect {effect} has no parameter \"{}\"; it has: {known}", plain(name))]
    Parameter {
        /// Effect of the parameter.
        effect: &'static str,
        /// Name that was given.
        name: String,
        /// Names of the parameters that exist, as text.
        known: String,
    },
    /// A parameter outside of what makes sense.
    #[error(
        "effects.{effect}.{name} = {value} is not allowed; it must be {low} to {high}{}",
        spaced(unit)
    )]
    Bounds {
        /// Effect of the parameter.
        effect: &'static str,
        /// Parameter with the value.
        name: &'static str,
        /// Value that was given.
        value: f64,
        /// Smallest allowed value.
        low: f64,
        /// Largest allowed value.
        high: f64,
        /// Unit of the parameter.
        unit: &'static str,
    },
    /// A parameter that is within its bounds, but with which nothing can be flown.
    #[error("effects.{effect}.{name} = {value} is not allowed; {why}")]
    Nonsense {
        /// Effect of the parameter.
        effect: &'static str,
        /// Parameter with the value.
        name: &'static str,
        /// Value that was given.
        value: f64,
        /// Condition on the value, or consequence of it, as text.
        why: String,
    },
    /// A steady flight that the vehicle with its effects cannot fly.
    #[error(
        "the vehicle cannot fly steadily at {climb_mps:+.1} m/s of climb and {horizontal_mps:.1} m/s of wind"
    )]
    NotFlown {
        /// Climb relative to the air, m/s.
        climb_mps: f64,
        /// Horizontal speed relative to the air, m/s.
        horizontal_mps: f64,
    },
    /// Not `NAME`, `NAME=on`, `NAME=off` or `NAME.PARAMETER=NUMBER`.
    #[error("\"{0}\" is not NAME, NAME=on, NAME=off or NAME.PARAMETER=NUMBER")]
    Syntax(String),
}

/// A unit behind its number; nothing for a pure number.
fn spaced(unit: &str) -> String {
    if unit.is_empty() { String::new() } else { format!(" {unit}") }
}
