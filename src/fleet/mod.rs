//! The station's side of a flight with real (or virtual) vehicles: what is known of them, what is
//! put on them, what they are told, what is watched, and their logs.
//!
//! Everything that talks is a [`crate::link::drive::Machine`], a conversation with one drone, many
//! at once: it has no socket, clock or thread, and its refusals are values that say what is wrong
//! and what to do. Safety comes before convenience: nothing is armed without a deliberate second
//! step, a show is loaded whole or cleared, and the fence is never switched off.

pub mod abort;
pub mod budget;
pub mod changes;
pub mod clear;
pub mod command;
pub mod desk;
pub mod dry_run;
pub mod fence;
pub mod ftp;
pub mod gate;
pub mod greet;
pub mod guided;
pub mod intervals;
pub mod journal;
pub mod load;
pub mod log_protocol;
pub mod logs;
pub mod messages;
mod off_course;
pub mod orders;
pub mod params;
pub mod preflight;
pub mod put_file;
pub mod required;
pub mod rtt;
pub mod sink;
pub mod slots;
pub mod start;
pub mod telemetry;
pub mod upload;
pub mod vehicle_clock;
pub mod watch;
