//! Virtual vehicles on the wire, against what the show firmware was measured to do.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod guided;
mod server;
mod signing;
mod support;
mod vehicle;
