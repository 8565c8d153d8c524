//! Turbulence over a hover: what the drones' logs tell of the air faster than the map's 10 s means, and its statistics.
//!
//! `records` makes records of w, u and v in short blocks of each log, `make` has the crate `turbulence_statistics` say
//! what they tell, [`result`] is what is written and shown.

mod horizontal;
mod make;
mod pairs;
mod records;
pub mod result;
mod scales;

pub(crate) use make::SHAPE_SE;
pub(super) use make::{Asked, Drone, of_fleet};
pub(super) use records::Records;
