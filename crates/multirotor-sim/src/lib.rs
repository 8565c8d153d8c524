#![doc = include_str!("../README.md")]

pub mod air;
pub mod effects;
pub mod rng;
pub mod sim;
pub mod vehicle;

/// Their types are part of the interface.
pub use {dataflash, nalgebra, skybrush_show};
