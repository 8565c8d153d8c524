//! Show files: what is written comes back, what is broken is refused, what is hostile is survived.
#![expect(clippy::unwrap_used, reason = "helpers of tests may panic like the tests themselves")]

mod common;
mod csv;
mod skyb;
mod skyc;
