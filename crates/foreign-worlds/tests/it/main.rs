//! Flights of foreign worlds: trimmed, flown, logged and read again.

#![expect(clippy::unwrap_used, reason = "a test that cannot fly fails")]

mod flight;
mod hidden;
mod support;
