//! Windows, calibration laws and updraft estimates.
//!
//! [`analyze_flight`] does one flight of a fleet: logs to windows, windows to laws (a calibration) or
//! to the map of the air (a measurement, with the laws of a calibration). [`analyze`] does a campaign.

mod account;
mod air_prior;
mod analyze;
mod aware;
pub mod battery;
pub mod budget;
pub mod calibrate;
mod caution;
mod caution_battery;
mod corrections;
#[cfg(test)]
mod coverage_tests;
pub mod density;
mod drone;
pub mod fit;
mod hover;
mod input;
mod ladder;
pub mod law;
pub mod lean_table;
mod local;
mod matching;
pub mod offset;
mod options;
pub mod prefer;
mod refer;
pub mod result;
mod shape;
pub mod slots;
mod split;
mod starts;
pub mod statistics;
mod stats;
pub mod steps;
pub mod together;
mod track;
mod truth;
pub mod updraft;
pub mod wind;
pub mod windows;
mod zero;

pub use analyze::{AnalysisError, Progress, analyze, analyze_flight};
pub use input::{FlightInput, LogInput, TruthSeries};
pub use options::{AnalysisOptions, MapLaw, OffsetRule};
