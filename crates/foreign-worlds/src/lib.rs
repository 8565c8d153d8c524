#![doc = include_str!("../README.md")]

pub mod air;
pub mod autopilot;
pub mod battery;
pub mod flight;
pub mod hidden;
pub mod noise;
pub mod plant;
pub mod random;
mod record;
pub mod telemetry;
pub mod trim;
pub mod vector;
pub mod world;

pub use flight::{Drone, Target, fly};
pub use trim::{Condition, Steady, Trim};
pub use world::World;
