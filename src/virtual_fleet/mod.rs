//! Virtual vehicles that speak MAVLink as the show firmware does, flown by the embedded
//! simulator: what `run` flies, and what a crew practises with.
//!
//! A vehicle is an [`endpoint::Endpoint`]: no sockets and no clock of its own, so that a whole
//! fleet with a bad radio link also runs in one thread, in simulated time ([`lossy::LossyNet`]).

pub mod broadcast;
pub mod endpoint;
mod faulty;
pub mod files;
pub mod ftp_server;
pub mod log_server;
pub mod lossy;
mod post;
pub mod server;
pub mod storage;
pub mod transfers;
pub mod vehicle;
pub mod world;
