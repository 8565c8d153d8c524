//! The flight that would tell: what to fly next, by what the verdict left open.
//!
//! [`ask`] takes the questions from a verdict, `elements` is what a flight can be made of, `predict`
//! says without flying how well a flight separates, and `search` finds the shortest that separates
//! well enough.

pub mod elements;
pub mod known;
pub mod predict;
pub mod questions;
pub mod result;
mod scenery;
pub mod search;

pub use elements::{Elements, Legs, Order};
pub use known::{Flight, Known};
pub use predict::{Predicted, Separation, predict};
pub use questions::{Question, Sought, ask};
pub use result::{NEXT_SCHEMA, Next};
pub use search::{Aim, search};
