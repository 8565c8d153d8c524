//! Files and text of strangers.
//!
//! What comes from outside (a show somebody sent, a drone's words, a server's answer, the name of a
//! file) is read within bounds and shown as text and nothing else:
//!
//! ```
//! use untrusted_io::plain::plain;
//!
//! // A carriage return and an escape sequence would have overwritten the line before it.
//! assert_eq!(plain("GO\r\u{1b}[2J"), "GO␍␛[2J");
//! ```
//!
//! * [`number`]: numbers in sentences, however large.
//! * [`plain`]: text that drives no terminal, and output that does neither.
//! * [`file`](mod@file): reading within a limit (no pipes, no devices), writing whole or not at all.
//! * [`parse`]: JSON and TOML whose texts and keys arrive plain (feature `parse`, on by default).
//! * [`private`]: folders and files that only their user can look into.

pub mod file;
pub mod number;
#[cfg(feature = "parse")]
pub mod parse;
pub mod plain;
pub mod private;
