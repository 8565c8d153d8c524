//! The air the drones fly in: its motion and its density.
//!
//! A new kind of air is one more file here that implements [`Atmosphere`].

mod uniform;

use nalgebra::Vector3;

pub use crate::base::air::{SEA_LEVEL_DENSITY, density_ratio};
pub use uniform::Uniform;

/// Motion of the air.
pub trait Atmosphere: Sync {
    /// Velocity of the air at a place (show frame, m) and show time (s): show frame, m/s, z up, so
    /// that a positive z is an updraft and x is where the air goes, not where it comes from.
    fn air_velocity(&self, position_m: &Vector3<f64>, time_s: f64) -> Vector3<f64>;
}

/// What the air does to a drone at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surroundings {
    /// Velocity of the air, show frame, m/s.
    pub air_velocity_mps: Vector3<f64>,
    /// Density as a share of that at sea level.
    pub density_ratio: f64,
}
