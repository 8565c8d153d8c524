#![doc = include_str!("../README.md")]

pub mod abort;
pub mod budget;
pub mod clear;
pub mod command;
pub mod fence;
pub mod ftp;
pub mod greet;
pub mod intervals;
pub mod link;
pub mod load;
pub mod log_protocol;
pub mod messages;
pub mod pace;
pub mod params;
pub mod protocol;
pub mod put_file;
pub mod rtt;
#[cfg(feature = "simulated")]
pub mod simulated;
pub mod sink;
pub mod telemetry;
pub mod vehicle_clock;

pub use link::clock::{MS, Micros, S, SystemClock};
pub use link::conversation::{Conversation, NoObserver, Observer, Progress, Step, run_all};
pub use link::id::DroneId;
pub use link::net::{Net, Received};
pub use link::station::{Setup, Station};
