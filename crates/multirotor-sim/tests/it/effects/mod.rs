//! Effects as their users read of them.

mod figures;
mod flight;
mod speed_limit;
pub(crate) mod support;
