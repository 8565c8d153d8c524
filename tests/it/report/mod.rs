//! The page, its figures and tables, the terminal.

mod browser;
mod browser_access;
pub(crate) mod chromium;
mod explorer;
mod gap;
mod page;
mod paper;
pub(crate) mod synthetic;
mod terminal;
mod verdicts;
