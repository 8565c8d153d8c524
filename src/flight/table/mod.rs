//! Flights from other people's tables (CSV): which column is what, in which unit, is told by a mapping
//! file. This is the border where their signs and units become ours.

mod mapping;
mod read;
mod time;

use std::path::PathBuf;

use thiserror::Error;

use crate::base::file::FileError;
use crate::base::plain::Shown as _;

pub use mapping::{Channel, Mapping, Steps, TableFlight, TimeColumn, TimeFormat};
pub use read::{read, read_from};

/// A table cannot be used.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum TableError {
    /// A file could not be read.
    #[error(transparent)]
    File(#[from] FileError),
    /// The mapping is not what it should be.
    #[error("{}: {reason}", path.shown())]
    Mapping {
        /// The mapping file.
        path: PathBuf,
        /// What is wrong, with the place.
        reason: String,
    },
    /// A column that the mapping names is not in the table.
    #[error(
        "{}: there is no column \"{column}\", which the mapping names for {channel}; there are: {there}",
        path.shown()
    )]
    Column {
        /// The table.
        path: PathBuf,
        /// The missing column.
        column: String,
        /// What it is wanted for.
        channel: &'static str,
        /// The table's columns.
        there: String,
    },
    /// A cell is not what its column holds.
    #[error("{}, line {line}, column \"{column}\": {reason}", path.shown())]
    Cell {
        /// The table.
        path: PathBuf,
        /// The line, from 1.
        line: u64,
        /// The column.
        column: String,
        /// What is wrong.
        reason: String,
    },
    /// A line cannot be read at all.
    #[error("{}: {reason}", path.shown())]
    Row {
        /// The table.
        path: PathBuf,
        /// What is wrong, with the line.
        reason: String,
    },
    /// There is not even a header line.
    #[error("{}: the table is empty: there is no line with the columns' names", path.shown())]
    Empty {
        /// The table.
        path: PathBuf,
    },
    /// The file is larger than any flight's table.
    #[error(
        "{}: the table has {bytes} bytes, and more than {most} are not read; cut it to the flight",
        path.shown()
    )]
    Huge {
        /// The table.
        path: PathBuf,
        /// Its size.
        bytes: u64,
        /// The limit.
        most: u64,
    },
    /// There are too few rows for a flight.
    #[error(
        "{}: {rows} usable rows are no flight{}",
        path.shown(),
        left_out(*backward)
    )]
    Short {
        /// The table.
        path: PathBuf,
        /// Rows with a time.
        rows: usize,
        /// Rows that were left out because their time does not go forward.
        backward: usize,
    },
}

fn left_out(backward: usize) -> String {
    if backward == 0 {
        return String::new();
    }
    format!(
        " ({backward} more were left out, as their time does not go forward: is the column of \
         times the right one, and its format?)"
    )
}
