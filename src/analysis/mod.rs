//! Windows, calibration laws and updraft estimates.

pub mod fit;
pub mod law;
pub mod result;
