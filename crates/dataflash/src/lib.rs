#![doc = include_str!("../README.md")]
//!
//! # Values
//!
//! Engineering values on both sides: format letters that imply a scale (`c C e E` hundredths, `L`
//! 1e-7 degrees) are applied by the reader and undone by the writer; FMTU multipliers are never
//! applied on top of them.

pub mod catalog;
mod columns;
pub mod definition;
mod format;
mod inventory;
mod letter;
pub mod reader;
mod scan;
pub mod time;
pub mod units;
mod window;
pub mod writer;

pub use definition::MessageDef;
pub use inventory::{FieldInventory, Inventory, MessageInventory};
pub use reader::{Column, Log, LogError, Select, Table};
pub use scan::{ScanStats, TimeJump};
pub use writer::{LogWriter, Value};
