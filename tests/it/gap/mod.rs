//! The flight that would tell.

mod next;
pub(crate) mod verdicts;
