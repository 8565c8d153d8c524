//! An archive: what any number of campaigns measured, as one partitioned Parquet dataset.
//!
//! ```text
//! archive/
//!   archive.json                                              what is in it, and what it was made from
//!   flights/date=2026-06-01/campaign=NAME-HASH/part.parquet   a row for each flight
//!   drones/...                                                a row for each drone of each flight
//!   thermals/...                                              a row for each thermal
//!   verdicts/...                                              a row for each finding of `updraft gap`
//!   seconds/...                                               a row for each drone and second
//! ```
//!
//! `gather` takes one campaign: its short tables are made from `slim`, the long one is streamed by `series`.
//! Files are made in a hidden folder and renamed into their places, one after the other, when all are whole.
//! The columns are described in `docs/archive.md`.

#[cfg(feature = "parquet")]
pub mod drones;
pub mod find;
#[cfg(feature = "parquet")]
pub mod flights;
#[cfg(feature = "parquet")]
pub mod gather;
pub mod index;
#[cfg(feature = "parquet")]
pub mod origin;
#[cfg(feature = "parquet")]
pub mod seconds;
#[cfg(feature = "parquet")]
pub mod series;
#[cfg(feature = "parquet")]
pub mod slim;
#[cfg(feature = "parquet")]
pub mod sources;
#[cfg(feature = "parquet")]
pub mod staging;
#[cfg(feature = "parquet")]
pub mod table;
#[cfg(feature = "parquet")]
pub mod thermals;
#[cfg(feature = "parquet")]
pub mod verdicts;

use thiserror::Error;

use crate::base::file::FileError;
use crate::campaign::CampaignError;

/// Names of the tables, which are folders of an archive.
pub const TABLES: [&str; 5] = ["flights", "drones", "thermals", "verdicts", "seconds"];

/// Name of a partition's file.
pub const PART_FILE: &str = "part.parquet";

/// Reason why a campaign is not in an archive.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ArchiveError {
    /// It has no analysis.
    #[error("it has no analysis.json: run `updraft analyze` on it")]
    NotAnalysed,
    /// A file cannot be read or written.
    #[error(transparent)]
    File(#[from] FileError),
    /// A file of the campaign is broken.
    #[error(transparent)]
    Campaign(#[from] CampaignError),
    /// It has more days, or more flights, than a campaign has.
    #[error("it has {number} {what}, more than the {most} that a campaign may have")]
    TooMany {
        /// Number of them.
        number: usize,
        /// Name of what there is too much of.
        what: &'static str,
        /// Most that are taken.
        most: usize,
    },
    /// A table cannot be written.
    #[error("failed to write the table {table}: {reason}")]
    Table {
        /// Name of the table.
        table: &'static str,
        /// Reason of the Parquet writer.
        reason: String,
    },
}
