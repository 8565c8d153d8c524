//! Figures of campaigns side by side.

pub(in crate::report) mod drones;
pub(in crate::report) mod laws;
pub(in crate::report) mod maps;
pub(in crate::report) mod structure;

use kuva::plot::scatter::MarkerShape;

use crate::report::colour::{BLUE, VERMILLION};

/// Reference and other differ in colour, dash and mark.
const REFERENCE: (&str, &str, MarkerShape) = (BLUE, "", MarkerShape::Circle);
const OTHER: (&str, &str, MarkerShape) = (VERMILLION, "7 4", MarkerShape::Triangle);
/// Standard errors that hold 95 of 100.
const OF_95: f64 = 1.96;
