//! A client of a running Skybrush Server: crews who already fly with it keep it.
//!
//! The server speaks JSON objects, one per line, over TCP (its port + 1, by default 5001). Long
//! work is answered with a receipt, and ends in a notification that may overtake the answer:
//! notifications are kept by receipt.

mod client;
mod error;
pub mod lines;
mod logs;
pub mod message;
mod show;
mod upload;
pub mod watch;

pub use client::{Client, Outcome, Running};
pub use error::ServerError;
pub use logs::{LogEntry, log_bytes, log_entries};
pub use show::StartConfig;
pub use upload::{Fence, ShowUpload};
