//! The program as its users meet it: arguments, exit codes, files, interruption.

#![expect(clippy::unwrap_used, reason = "a test that cannot run the program fails")]

#[path = "cli/support.rs"]
mod support;

#[cfg(unix)]
mod fleet_loaded_support;

#[cfg(unix)]
#[path = "cli/air.rs"]
mod air;
#[path = "cli/analyze.rs"]
mod analyze;
#[path = "cli/analyze_inputs.rs"]
mod analyze_inputs;
#[path = "cli/analyze_messages.rs"]
mod analyze_messages;
#[path = "cli/analyze_unplanned.rs"]
mod analyze_unplanned;
#[path = "cli/check.rs"]
mod check;
#[cfg(unix)]
#[path = "cli/drones.rs"]
mod drones;
#[path = "cli/fleet.rs"]
mod fleet;
#[cfg(unix)]
#[path = "cli/fleet_refusals.rs"]
mod fleet_refusals;
#[cfg(unix)]
#[path = "cli/fleet_upload.rs"]
mod fleet_upload;
#[cfg(unix)]
#[path = "cli/flights.rs"]
mod flights;
#[path = "cli/foreign_text.rs"]
mod foreign_text;
#[path = "cli/gap.rs"]
mod gap;
#[path = "cli/guided.rs"]
mod guided;
#[path = "cli/help.rs"]
mod help;
#[path = "cli/inspect.rs"]
mod inspect;
#[path = "cli/lock.rs"]
mod lock;
#[path = "cli/logs.rs"]
mod logs;
#[path = "cli/logs_import.rs"]
mod logs_import;
#[cfg(unix)]
#[path = "cli/logs_pull.rs"]
mod logs_pull;
#[path = "cli/manners.rs"]
mod manners;
#[path = "cli/orders.rs"]
mod orders;
#[path = "cli/plan.rs"]
mod plan;
#[path = "cli/scan.rs"]
mod scan;
#[path = "cli/simulate.rs"]
mod simulate;
#[path = "cli/tables.rs"]
mod tables;
#[cfg(unix)]
#[path = "cli/terminal.rs"]
mod terminal;
#[path = "cli/words.rs"]
mod words;
