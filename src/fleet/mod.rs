//! A fleet of real drones: what is sent to them, what is watched, and their logs.
//!
//! Everything is a conversation ([`crate::link::drive::Machine`]) with one drone, many at once.

pub mod budget;
pub mod ftp;
pub mod intervals;
pub mod log_protocol;
pub mod logs;
pub mod rtt;
pub mod sink;
