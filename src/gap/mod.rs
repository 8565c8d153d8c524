//! Search for missing physics: where simulation and measurement disagree, which effect is missing,
//! and what cannot be known.

mod as_flown;
mod backward;
mod bins;
mod candidates;
mod compare;
mod contest;
pub mod data;
mod decide;
pub mod dependence;
mod detectable;
mod difficulty;
mod drones;
mod error;
mod explain;
mod filter;
mod formula;
mod generic;
mod gls;
mod heldout;
mod in_field;
mod instead;
mod kept;
mod lean;
mod lean_channel;
mod lean_fit;
pub mod left_out;
mod make;
mod map_gain;
mod measure;
mod memory;
mod model_flights;
pub mod next;
mod noise;
#[cfg(test)]
mod null_flights;
mod refine;
mod refly;
mod regimes;
mod response;
mod scene;
mod search;
mod sensor;
mod single;
mod slopes;
mod stand_in;
mod steady;
mod table;
mod together;
#[cfg(test)]
mod trial;
pub mod verdict;
mod warning;
pub mod words;

pub use compare::Simulated;
pub use data::{Data, Flown};
pub use dependence::Dependence;
pub use difficulty::{SteadyPulse, There, fisher_z};
pub use error::GapError;
pub use explain::{Found, Only, Options};
pub use left_out::LeftOut;
pub use make::{Explained, Input, explain};
pub use map_gain::{Measured, map_gain};
pub use table::{aloft, as_pulses, lossless};
pub use verdict::Verdict;
pub use warning::Warning;
