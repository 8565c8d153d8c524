//! Motions of the air.

mod fields;
mod kinds;
