//! The live page: its server from outside, and the page in a real browser.

#[cfg(unix)]
mod air;
#[cfg(unix)]
mod page;
mod server;
