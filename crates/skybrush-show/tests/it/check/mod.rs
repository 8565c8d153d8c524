//! The safety checks: every one has a show that must fail it, and one that just passes.

mod distance;
mod limits;
mod support;
mod zones;
