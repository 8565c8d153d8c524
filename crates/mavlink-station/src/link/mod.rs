//! The radio link: MAVLink 2 frames, their signatures, and the sockets they travel through.
//!
//! Nothing here knows what a show is. [`frame`] is the only file that names the MAVLink crate;
//! [`net::Net`] is what everything above talks through, so that protocols run the same over a
//! socket, a serial radio, or a simulated link with a clock of its own.

pub mod address;
pub mod clock;
pub mod conversation;
pub mod error;
pub mod frame;
pub mod id;
pub mod net;
pub mod signing;
mod stamps;
pub mod station;
pub mod traffic;
pub mod wire;
