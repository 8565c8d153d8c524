//! Flights of known truth: effects, air, logs, and packets of the real firmware.

mod air;
mod effects;
mod flight;
mod json;
mod trim;
