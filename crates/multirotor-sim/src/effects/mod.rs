//! Physics beyond the base model, each piece stated once and used twice: the simulator flies it,
//! the analysis explains with it.
//!
//! An [`Effect`] is one file here. Its [`Definition`] says for people what it is; its hooks act on
//! the simulated drone at 400 Hz; its [`Effect::pulse_us`] is the same physics in closed form for
//! steady flight. [`LIBRARY`] lists all effects; a new one is a file and its line there.
//! A vehicle's file switches effects on and sets their parameters (`[effects.NAME]`).

pub mod active;
mod added_mass;
mod air_density;
pub mod battery;
mod blade_flapping;
pub mod definition;
pub mod doc;
mod error;
mod ground_effect;
mod mass_spread;
pub mod model;
pub mod momentum;
mod motor_thermal;
mod neighbour_downwash;
mod parasitic_drag;
pub mod reference;
mod rotor_inflow;
pub mod select;
pub mod signals;
mod thrust_curve;
mod thrust_spread;
mod tilt_formula;
mod translational_lift;
mod turbulence;
mod velocity_error;
mod vortex_ring;

pub use active::{Active, Air, Change, Extra, Now, Own, Reading, Start};
pub use definition::{Class, Definition, Hook, Parameter, Signal, Sought, Values};
pub use error::EffectError;
pub use model::Model;
pub use reference::Reference;
pub use signals::Signals;

use crate::vehicle::{Airframe, Vehicle};

/// All effects, in the order in which they act: what makes drones differ comes first, as the others
/// are set up for the drone that results.
pub const LIBRARY: &[&dyn Effect] = &[
    &mass_spread::MassSpread,
    &thrust_spread::ThrustSpread,
    &air_density::AirDensity,
    &turbulence::Turbulence,
    &neighbour_downwash::NeighbourDownwash,
    &thrust_curve::ThrustCurve,
    &motor_thermal::MotorThermal,
    &battery::Battery,
    &rotor_inflow::RotorInflow,
    &vortex_ring::VortexRing,
    &translational_lift::TranslationalLift,
    &ground_effect::GroundEffect,
    &blade_flapping::BladeFlapping,
    &parasitic_drag::ParasiticDrag,
    &added_mass::AddedMass,
    &velocity_error::VelocityError,
    &tilt_formula::TiltFormula,
];

/// The effect of a name.
pub fn find(name: &str) -> Option<&'static dyn Effect> {
    LIBRARY.iter().copied().find(|effect| effect.definition().name == name)
}

/// One piece of physics.
///
/// Only the hooks that [`Definition::hooks`] names are ever called; the others keep their empty
/// default. Hooks run at every step of 2.5 ms and must not allocate; what they remember is in
/// [`Own`].
pub trait Effect: Sync {
    /// What it is.
    fn definition(&self) -> &'static Definition;

    /// Change of the rotor control pulse that steady flight needs because of this effect, us.
    ///
    /// `at` is the vehicle without the effect, `values` are the effect's parameters in the order
    /// of its definition.
    fn pulse_us(&self, at: &Reference, values: &Values, signals: &Signals) -> f64;

    /// A parameter with which no flight makes sense though it is within its bounds: its place in the
    /// definition, and what it must be or what would come of it.
    fn refusal(&self, _values: &Values, _vehicle: &Vehicle) -> Option<(usize, String)> {
        None
    }

    /// Once, before the flight: prepares what it remembers, changes the drone ([`Hook::Drone`]).
    /// Called for every effect that is on.
    fn start(&self, _own: &mut Own, _start: &Start<'_>, _airframe: &mut Airframe) {}

    /// Changes the air around the drone ([`Hook::Air`]).
    fn air(&self, _own: &mut Own, _now: &Now, _air: &mut Air) {}

    /// Follows the flight once per step, before the commands ([`Hook::Command`]).
    fn follow(&self, _own: &mut Own, _now: &Now) {}

    /// What becomes of one rotor's command, 0..1 ([`Hook::Command`]).
    fn command(&self, _own: &Own, command: f64) -> f64 {
        command
    }

    /// Changes thrust and torque, adds forces ([`Hook::Loads`]).
    fn loads(&self, _own: &mut Own, _now: &Now, _change: &mut Change) {}

    /// Changes what the autopilot takes for its vertical speed, m/s up ([`Hook::Sense`]).
    fn sense(&self, _own: &mut Own, _dt_s: f64, _climb_mps: &mut f64) {}

    /// The state of the battery, if this effect is one.
    fn battery(&self, _own: &Own) -> Option<Reading> {
        None
    }
}
