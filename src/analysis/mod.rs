//! Windows, calibration laws and updraft estimates.
//!
//! [`analyze_flight`] does one flight of a fleet: logs to windows, windows to laws (a calibration) or
//! to the map of the air (a measurement, with the laws of a calibration). [`analyze`] does a campaign.

mod account;
mod air_prior;
mod analyze;
#[cfg(test)]
mod analyze_tests;
mod aware;
pub mod battery;
mod beside;
pub mod budget;
pub mod calibrate;
mod cause;
mod caution;
mod caution_battery;
pub mod combine;
mod corrections;
#[cfg(test)]
mod coverage_tests;
pub mod density;
mod drone;
pub mod expected;
pub mod fit;
mod fit_warning;
mod fitted;
mod headline;
mod held_hover;
mod hold;
mod hover;
mod input;
mod kind;
mod kriging;
mod ladder;
pub mod law;
mod laws_of_others;
pub mod lean_table;
pub mod level;
mod levelled;
mod local;
mod map_statistics;
mod matching;
mod measured;
pub mod offset;
mod options;
mod posterior;
pub mod prefer;
mod refer;
mod reference;
pub mod response;
pub mod result;
mod running;
mod shape;
mod site;
pub mod slots;
mod split;
mod starts;
pub mod statistics;
mod stats;
pub mod steps;
pub mod table;
pub mod thermal;
pub mod together;
mod track;
mod track_lean;
mod truth;
pub mod turbulence;
pub mod updraft;
mod warning;
mod widened;
pub mod wind;
pub mod wind_forms;
pub mod wind_legs;
mod window;
pub mod windows;
mod zero;

pub use analyze::{AnalysisError, Progress, analyze, analyze_flight};
pub use cause::Cause;
pub use input::{AtHand, FlightInput, LogInput, TruthSeries};
pub use law::LawKind;
pub use levelled::Level;
pub use options::{AnalysisOptions, OffsetRule};
pub(crate) use running::RUNNING_S;
pub use warning::{Warning, WindHandled};
