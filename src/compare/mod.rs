//! Campaigns side by side: laws, maps and scales of the air, with tests of what differs.
//!
//! [`Side`]s go in, each an analysis with what is known of its drones; [`compare()`] puts each against the first, and a
//! [`result::Comparison`] comes out. `docs/compare.md` has the statistics.

pub mod chance;
mod fleet_laws;
mod laws;
mod make;
mod maps;
pub mod result;
mod side;
mod structure;
#[cfg(test)]
mod tests;

pub use fleet_laws::LawChoice;
pub use make::{CompareError, compare};
pub use side::{FlightFacts, Side};
