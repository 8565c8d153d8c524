//! The program as its users meet it: arguments, exit codes, files, interruption.

#![expect(clippy::unwrap_used, reason = "a test that cannot run the program fails")]

pub(crate) mod support;

#[cfg(unix)]
mod air;
mod analyze;
mod analyze_inputs;
mod analyze_messages;
mod analyze_unplanned;
mod basemap;
mod blind_game;
mod check;
mod compare;
#[cfg(unix)]
mod drones;
mod effects;
pub(crate) mod fleet;
#[cfg(unix)]
mod fleet_refusals;
#[cfg(unix)]
mod fleet_upload;
#[cfg(unix)]
mod flights;
mod foreign_text;
mod gap;
mod gap_firmware;
mod gap_in_updraft;
mod gap_next;
mod gap_nothing;
pub(crate) mod guided;
mod help;
mod indicators;
mod inspect;
mod json;
mod lock;
mod logs;
mod logs_import;
#[cfg(unix)]
mod logs_pull;
mod manners;
mod manual;
mod masts;
mod orders;
mod paper;
mod physics;
mod plan;
mod plan_messages;
mod scan;
mod simulate;
mod tables;
#[cfg(unix)]
mod terminal;
mod tracks;
mod words;
