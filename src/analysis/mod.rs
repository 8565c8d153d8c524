//! Windows, calibration laws and updraft estimates.

pub mod calibrate;
pub mod fit;
pub mod law;
pub mod result;
mod stats;
pub mod windows;
