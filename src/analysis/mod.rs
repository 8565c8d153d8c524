//! Windows, calibration laws and updraft estimates.

pub mod result;
