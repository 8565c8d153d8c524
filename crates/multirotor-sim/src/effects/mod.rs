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
mod battery;
mod blade_flapping;
pub mod cell;
pub mod definition;
mod disc;
pub mod doc;
mod error;
mod face_drag;
mod ground_effect;
mod mass_spread;
pub mod model;
pub mod momentum;
mod momentum_drag;
mod motor_thermal;
mod neighbour_downwash;
mod parasitic_drag;
mod pulse_noise;
pub mod reference;
mod response_drift;
pub mod role;
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

pub use active::{Active, Air, Change, Extra, InFlight, Now, Reading, Settled, Start, Supply};
pub use definition::{Class, Definition, Hook, Parameter, Signal, Sought, Values};
pub use error::EffectError;
pub use model::Model;
pub use reference::Reference;
pub use role::Role;
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
    &pulse_noise::PulseNoise,
    &rotor_inflow::RotorInflow,
    &vortex_ring::VortexRing,
    &translational_lift::TranslationalLift,
    &ground_effect::GroundEffect,
    &blade_flapping::BladeFlapping,
    &momentum_drag::MomentumDrag,
    &face_drag::FaceDrag,
    &parasitic_drag::ParasiticDrag,
    &response_drift::ResponseDrift,
    &added_mass::AddedMass,
    &velocity_error::VelocityError,
    &tilt_formula::TiltFormula,
];

/// Effect of a name; `None` if the library has none.
///
/// ```
/// let inflow = multirotor_sim::effects::find("rotor-inflow").unwrap().definition();
/// assert!(inflow.formula.contains("w"), "{}", inflow.formula);
/// assert!(multirotor_sim::effects::find("phlogiston").is_none());
/// ```
pub fn find(name: &str) -> Option<&'static dyn Effect> {
    LIBRARY.iter().copied().find(|effect| effect.definition().name == name)
}

/// One piece of physics.
pub trait Effect: Sync {
    /// Description of the effect.
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

    /// Before the flight: changes the drone ([`Hook::Drone`]) and gives what acts during the flight,
    /// with its own memory; `None`: nothing does.
    ///
    /// Called for every effect that is on, in the order of the library: `airframe` is what the
    /// effects before left of it.
    fn start(&self, _start: &Start<'_>, _airframe: &mut Airframe) -> Option<Box<dyn InFlight>> {
        None
    }
}
