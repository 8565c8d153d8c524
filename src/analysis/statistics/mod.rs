//! Statistics of the map of the air: correlations in space and time, the field behind them, wind and
//! averaging times.
//!
//! [`field_statistics`] takes the map as plain numbers ([`FieldInput`]) and gives every estimate
//! twice: as the paper has it (curves through correlations), and with an interval that means
//! something, from simulated flights of the same drones in a field of maximum likelihood
//! (`likelihood.rs`).

pub mod averaging;
pub(in crate::analysis) mod baseline;
mod curve;
mod estimators;
mod field;
pub mod integral;
mod likelihood;
mod make;
mod paper;
pub mod result;
mod search;
mod simulate;
mod space;
pub mod tilt_wind;
mod time;
mod words;

pub use field::FieldInput;
pub use make::{PaperScales, StatisticsOptions, field_statistics, paper_scales};
pub use simulate::{FieldScales, Simulator};
