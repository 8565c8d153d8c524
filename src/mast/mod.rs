//! A campaign beside a mast: what its drones measured against an instrument that stands still.
//!
//! Both are running means over ten seconds at the same times ([`mod@matched`]), compared as they are and in longer averages
//! ([`make`]); a mast whose values are slower means is compared in those. Nothing is taken from the mast: neither a zero nor
//! a scale.

mod doubts;
mod heads;
pub mod make;
pub mod mapping;
pub mod matched;
#[cfg(feature = "netcdf-input")]
mod netcdf;
mod raw;
pub mod record;
pub mod result;
mod slow;

use std::path::PathBuf;

use thiserror::Error;

use crate::base::file::FileError;
use crate::base::plain::Shown as _;
use crate::flight::table::TableError;

pub use make::compare;
pub use record::MastRecord;
pub use result::MastComparison;

/// Error of reading a mast's record, or of comparing with it.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum MastError {
    /// A file could not be read.
    #[error(transparent)]
    File(#[from] FileError),
    /// A table could not be read.
    #[error(transparent)]
    Table(#[from] TableError),
    /// A file that says how a mast's table is read is not valid.
    #[error("{}: {reason}", path.shown())]
    Mapping {
        /// Path of the file.
        path: PathBuf,
        /// Statement of the problem.
        reason: String,
    },
    /// The record cannot be used.
    #[error("{}: {reason}", path.shown())]
    Record {
        /// Path of the record.
        path: PathBuf,
        /// Statement of the problem, and what to do.
        reason: String,
    },
    /// A variable of a NetCDF record cannot be used.
    #[error("{}, variable {variable}: {reason}", path.shown())]
    Variable {
        /// Path of the record.
        path: PathBuf,
        /// Name of the variable.
        variable: String,
        /// Statement of the problem, and what to do.
        reason: String,
    },
    /// No flight of the campaign can be compared.
    #[error("{} cannot be compared with {mast}: {}", campaign.shown(), reasons.join("; "))]
    Nothing {
        /// Path of the campaign.
        campaign: PathBuf,
        /// Name of the mast.
        mast: String,
        /// Reasons, one for each flight.
        reasons: Vec<String>,
    },
}
