#![doc = include_str!("../README.md")]

pub mod air;
pub mod effects;
pub mod rng;
pub mod sim;
pub mod vehicle;
