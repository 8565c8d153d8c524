//! The station's side of a flight with real (or virtual) vehicles: what is known of them, what is
//! put on them, what they are told, what is watched, and their logs.
//!
//! Everything that talks is a [`crate::link::conversation::Conversation`], a conversation with one drone, many
//! at once: it has no socket, clock or thread, and its refusals are values that say what is wrong
//! and what to do. Safety comes before convenience: nothing is armed without a deliberate second
//! step, a show is loaded whole or cleared, and the fence is never switched off.

pub mod changes;
pub mod dry_run;
pub mod fence;
pub mod gate;
pub mod guided;
#[cfg(test)]
mod guided_tests;
pub mod journal;
pub mod logs;
mod off_course;
pub mod order_handler;
pub mod orders;
pub mod preflight;
#[cfg(test)]
mod preflight_tests;
pub mod recorded;
pub mod required;
pub mod slots;
pub mod start;
#[cfg(test)]
mod start_tests;
pub mod upload;
pub mod watch;
#[cfg(test)]
mod watch_tests;

pub use mavlink_station::{
    abort, budget, clear, command, ftp, greet, intervals, load, log_protocol, messages, params,
    put_file, rtt, sink, telemetry, vehicle_clock,
};
