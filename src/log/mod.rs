//! ArduPilot's DataFlash logs (`.BIN`): reader and writer.
//!
//! Engineering values on both sides: format letters that imply a scale (`c C e E` hundredths, `L`
//! 1e-7 degrees) are applied by the reader and undone by the writer; FMTU multipliers are never
//! applied on top of them.

pub mod catalog;
pub mod definition;
mod letter;
pub mod reader;
pub mod units;
pub mod writer;

pub use definition::MessageDef;
pub use reader::{Log, LogError, ScanStats, Select, Table};
pub use writer::{LogWriter, Value};
