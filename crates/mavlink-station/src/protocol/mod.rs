//! Layouts of the show protocol's bytes, for both ends: stations and virtual vehicles.
//!
//! Layouts only; who says what when is told by the rooms that speak.

pub mod ftp;
pub mod show;
