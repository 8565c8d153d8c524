//! The page, its figures and tables, the terminal.

mod browser;
pub(crate) mod chromium;
mod explorer;
mod fields;
mod gap;
mod page;
pub(crate) mod synthetic;
mod terminal;
mod verdicts;
