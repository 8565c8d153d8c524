//! The page, its figures and tables, the terminal.

mod browser;
mod chromium;
mod fields;
mod gap;
mod page;
pub(crate) mod synthetic;
mod terminal;
mod verdicts;
