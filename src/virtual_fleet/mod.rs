//! Virtual vehicles that speak MAVLink as the show firmware does, flown by the embedded
//! simulator: what `run` flies, and what a crew practises with.
//!
//! A vehicle is an [`endpoint::Endpoint`]: no sockets and no clock of its own, so that a whole
//! fleet with a bad radio link also runs in one thread, in simulated time ([`lossy::LossyNet`]).

pub mod broadcast;
mod faulty;
mod post;
pub mod server;
pub mod vehicle;
pub mod world;

pub use mavlink_station::simulated::{
    endpoint, files, ftp_server, log_server, lossy, storage, transfers,
};
