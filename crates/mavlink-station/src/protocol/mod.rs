//! What the bytes of the show protocol mean, for both ends: the station and
//! the virtual vehicles.
//!
//! Layouts only; who says what when is told by the rooms that speak.

pub mod ftp;
pub mod show;
