//! Where simulation and measurement disagree, which physics is missing, and what cannot be known.

mod bins;
mod candidates;
mod compare;
pub mod data;
mod decide;
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
mod lean;
mod lean_channel;
mod lean_fit;
mod make;
mod map_gain;
mod measure;
mod minimise;
pub mod next;
mod noise;
#[cfg(test)]
mod null_flights;
mod posterior;
mod refine;
mod refly;
mod regimes;
mod scene;
mod search;
mod sensor;
mod table;
pub mod verdict;
pub mod words;

pub use compare::Simulated;
pub use data::{Data, Flown};
pub use difficulty::{SteadyPulse, There, fisher_z};
pub use error::GapError;
pub use explain::{Found, Options, search};
pub use make::{Explained, Input, explain};
pub use map_gain::{Measured, map_gain};
pub use table::{aloft, as_pulses, lossless};
pub use verdict::Verdict;
