//! The air the drones fly in: its motion and its density.
//!
//! A new kind of air is one more file here that implements [`Atmosphere`], and one line in
//! [`spec`]'s table so that it can be asked for by name. Formulas and sources: `docs/air.md`.

mod allen;
mod drone_constant;
mod field;
pub mod gridded;
mod gusts;
mod knots;
mod lenschow;
mod profile;
pub mod spec;
mod sum;
pub mod truth;
mod uniform;
mod waves;

use nalgebra::Vector3;

pub use crate::air::{DensityNearby, SEA_LEVEL_DENSITY, density_ratio};
pub use allen::{AllenThermals, Thermal};
pub use drone_constant::DroneConstant;
pub use field::{FieldScales, RandomField};
pub use gridded::GriddedAir;
pub use gusts::{GustSpectrum, Gusts};
pub use knots::{KNOT_S, Knots};
pub use lenschow::{Lenschow, convective_length_m, convective_sd_mps};
pub use profile::{WindLaw, WindProfile};
pub use sum::Sum;
pub use uniform::Uniform;

/// Motion of the air.
pub trait Atmosphere: Sync {
    /// Velocity of the air at a place (show frame, m) and show time (s): show frame, m/s, z up, so
    /// that a positive z is an updraft and x is where the air goes, not where it comes from.
    ///
    /// Without what only one drone meets ([`DroneConstant`]).
    fn air_velocity(&self, position_m: &Vector3<f64>, time_s: f64) -> Vector3<f64>;

    /// The air that one drone (its slot, from 1) meets on its flight. Made once per flight; costly
    /// kinds of air answer faster this way than through [`Atmosphere::air_velocity`].
    fn sampler(&self, drone: u16) -> Box<dyn AirSampler + Send + '_> {
        let _ = drone;
        Box::new(Direct(self))
    }
}

/// The air along one drone's flight; may keep state between queries.
///
/// The answers depend on the atmosphere, the drone and the places and times asked for so far, and on
/// nothing else. Queries are meant to go forward in time in steps well below [`KNOT_S`].
pub trait AirSampler {
    /// Velocity of the air at a position (show frame, m) and show time, m/s; see
    /// [`Atmosphere::air_velocity`].
    fn air_velocity(&mut self, position_m: &Vector3<f64>, time_s: f64) -> Vector3<f64>;
}

/// Asks the atmosphere itself each time.
struct Direct<'a, A: ?Sized>(&'a A);

impl<A: Atmosphere + ?Sized> AirSampler for Direct<'_, A> {
    fn air_velocity(&mut self, position_m: &Vector3<f64>, time_s: f64) -> Vector3<f64> {
        self.0.air_velocity(position_m, time_s)
    }
}

/// State of the air around a drone at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surroundings {
    /// Velocity of the air, show frame, m/s.
    pub air_velocity_mps: Vector3<f64>,
    /// Density as a share of that at sea level.
    pub density_ratio: f64,
}
