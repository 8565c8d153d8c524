//! Flights from other people's tables (CSV). A mapping file says which column holds which quantity
//! in which unit; this is the border where their signs and units become ours.

mod cells;
mod mapping;
mod read;
mod time;

use std::path::PathBuf;

use thiserror::Error;

use crate::base::file::FileError;
use crate::base::plain::Shown as _;

pub use mapping::{Channel, Mapping, Steps, TableFlight, TimeColumn, TimeFormat};
#[cfg(feature = "netcdf-input")]
pub(crate) use time::{date_time, zoned};

pub(crate) use read::time_of;
pub use read::{Columns, Wish, read, read_columns, read_from};

/// Error of reading a flight from tables.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum TableError {
    /// A file could not be read.
    #[error(transparent)]
    File(#[from] FileError),
    /// The mapping file is not valid.
    #[error("{}: {reason}", path.shown())]
    Mapping {
        /// Path of the mapping file.
        path: PathBuf,
        /// Statement of the problem, with its place in the file.
        reason: String,
    },
    /// A column that the mapping names is not in the table.
    #[error(
        "{}: there is no column \"{column}\", which the mapping names for {channel}; the columns \
         are: {there}",
        path.shown()
    )]
    Column {
        /// Path of the table.
        path: PathBuf,
        /// Name of the missing column.
        column: String,
        /// Quantity that the column would give.
        channel: &'static str,
        /// Names of the columns that the table has.
        there: String,
    },
    /// A cell does not hold what its column should.
    #[error("{}, line {line}, column \"{column}\": {reason}", path.shown())]
    Cell {
        /// Path of the table.
        path: PathBuf,
        /// Number of the line, from 1.
        line: u64,
        /// Name of the column.
        column: String,
        /// Statement of the problem with the cell.
        reason: String,
    },
    /// A rotor stands, or is not measured, while the others turn.
    #[error(
        "{}: \"{column}\" is 0 or less in {standing} of {turning} rows in which the other columns of {channel} are not: \
         a mean with it is no rotor effort; leave the column out of [{channel}] for all flights of the mapping",
        path.shown()
    )]
    Dead {
        /// Path of the table.
        path: PathBuf,
        /// Name of the column.
        column: String,
        /// Quantity that the column is a part of.
        channel: &'static str,
        /// Number of rows in which the column alone is 0 or less.
        standing: usize,
        /// Number of rows in which another column of the channel is above 0.
        turning: usize,
    },
    /// A line cannot be read.
    #[error("{}: {reason}", path.shown())]
    Row {
        /// Path of the table.
        path: PathBuf,
        /// Statement of the problem, with the line.
        reason: String,
    },
    /// The table is empty: it has no header line either.
    #[error("{}: the table is empty: there is no line with the columns' names", path.shown())]
    Empty {
        /// Path of the table.
        path: PathBuf,
    },
    /// The file is larger than any flight's table.
    #[error(
        "{}: the table has {bytes} bytes, and more than {most} are not read; cut it to the flight",
        path.shown()
    )]
    Huge {
        /// Path of the table.
        path: PathBuf,
        /// Size of the table, bytes.
        bytes: u64,
        /// Largest size that is read, bytes.
        most: u64,
    },
    /// The table has too few usable rows.
    #[error(
        "{}: {rows} usable rows are too few{}",
        path.shown(),
        left_out(*backward)
    )]
    Short {
        /// Path of the table.
        path: PathBuf,
        /// Number of rows with a time.
        rows: usize,
        /// Number of rows left out because their time does not increase.
        backward: usize,
    },
}

fn left_out(backward: usize) -> String {
    if backward == 0 {
        return String::new();
    }
    format!(
        " ({backward} more were skipped, because their time does not advance: are the time \
         column and its format right?)"
    )
}
