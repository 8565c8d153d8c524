//! The embedded simulator: flies a show and writes one DataFlash log per drone.
//!
//! [`air`] says how the air moves, [`plant`] how the body answers to it and to the rotors,
//! [`sensors`] what the autopilot believes, [`autopilot`] what it does, [`recorder`] what its log
//! says. Inside, world axes are the show frame's (x forward, y left, z up, metres from the show's
//! origin) and body axes forward, left, up; drones stand heading along show x.

pub mod air;
pub mod autopilot;
mod error;
mod flight;
mod flying;
pub mod json;
pub mod plant;
mod recorded;
pub mod recorder;
pub mod sensors;
pub mod strain;

pub use crate::effects::Reading as BatteryReading;
pub use air::{Atmosphere, Uniform};
pub use error::SimError;
pub use flight::{
    Beyond, FlightSetup, FlightSummary, Hooks, fly, fly_beyond, fly_beyond_to_file, fly_to_file,
    fly_with, fly_without_log,
};
pub use flying::OngoingFlight;
pub use recorded::RecordedFlight;
