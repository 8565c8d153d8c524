//! A client of a running Skybrush Server: crews who already fly with it keep it.
//!
//! The server speaks JSON objects, one per line, over TCP (its port + 1, by default 5001). Long
//! work is answered with a receipt, and ends in a notification that may overtake the answer:
//! notifications are kept by receipt. It goes on when whoever has asked is gone, until it is
//! cancelled. The server does any number of drones at once, and per drone one log at a time.

mod client;
mod error;
pub mod gate;
pub mod lines;
mod logs;
pub mod message;
pub mod refusal;
mod show;
pub mod state;
mod upload;
pub mod watch;
mod work;

pub use client::Client;
pub use error::ServerError;
pub use logs::{LogEntry, fetch_log, list_logs, log_bytes, log_entries};
pub use show::{Authorized, StartConfig, end_flight, mode, show_mode};
pub use upload::{Fence, ShowUpload, upload};
pub use work::{Foreman, Job, Outcome, Running};
