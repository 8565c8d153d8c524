//! The safety checks on planned shows.

mod plan;
#[path = "../../../crates/skybrush-show/tests/it/check/support.rs"]
mod support;
