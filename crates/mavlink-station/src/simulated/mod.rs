//! Vehicles and radio links that exist only in memory, in simulated time.
//!
//! A vehicle is an [`endpoint::Endpoint`]; [`files::FileVehicle`] serves files by MAVFTP and logs by
//! the log messages as ArduPilot does, including its limits. [`lossy::LossyNet`] is a
//! [`Net`](crate::link::net::Net) that loses, delays, repeats and reorders the frames between them and
//! the station. Everything follows from a seed, so a test of hours of bad radio takes milliseconds
//! and fails the same way each time.

pub mod endpoint;
pub mod files;
pub mod ftp_server;
pub mod log_server;
pub mod lossy;
pub mod storage;
pub mod transfers;
