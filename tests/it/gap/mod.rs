//! The search for missing physics, and the flight that would tell.

mod next;
mod plants;
pub(crate) mod verdicts;
