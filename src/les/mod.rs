//! Air from the output of large-eddy simulations: `--air les:FILE.nc` (docs/air.md).
//!
//! NetCDF files of PALM, MicroHH and CM1 are known by the names of their dimensions; a TOML file names the variables
//! of other models. The simulator flies in what [`open`] makes, and asks it for blocks of the grid as it needs them.

mod about;
#[cfg(feature = "les")]
mod file;
#[cfg(feature = "les")]
mod known;
#[cfg(feature = "les")]
mod layout;
mod map;
#[cfg(feature = "les")]
mod open;
#[cfg(feature = "les")]
mod source;

use std::path::{Path, PathBuf};

use thiserror::Error;

use crate::base::file::FileError;
use crate::base::plain::Shown as _;

pub use about::{About, Les};
pub use map::{ComponentMap, LesMap, MAP_SCHEMA};
#[cfg(feature = "les")]
pub use open::open;

/// Error of air that is to be read from a model's output.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum LesError {
    /// A file is not there, or cannot be read.
    #[error(transparent)]
    Open(#[from] FileError),
    /// A file cannot be used.
    #[error("{file}: {reason}")]
    File {
        /// Path of the file.
        file: String,
        /// Problem, and what to do.
        reason: String,
    },
    /// A variable of a file cannot be used.
    #[error("{file}, variable {variable}: {reason}")]
    Variable {
        /// Path of the file.
        file: String,
        /// Name of the variable.
        variable: String,
        /// Problem, and what to do.
        reason: String,
    },
    /// The flight is not inside of what the model covers.
    #[error("{file}: {reason}")]
    Outside {
        /// Path of the file.
        file: String,
        /// Where and when, and what to do.
        reason: String,
    },
}

impl LesError {
    /// A file cannot be used.
    pub(crate) fn of_file(path: &Path, reason: impl Into<String>) -> Self {
        Self::File { file: path.shown().to_string(), reason: reason.into() }
    }

    #[cfg(feature = "les")]
    fn of_variable(path: &Path, variable: &str, reason: impl Into<String>) -> Self {
        let variable = crate::base::plain::plain(variable).into_owned();
        Self::Variable { file: path.shown().to_string(), variable, reason: reason.into() }
    }
}

/// Place of a flight in a model, beyond what its specification says.
#[derive(Clone, Copy, Debug)]
pub struct Where {
    /// Direction of the show's x axis, degrees clockwise from north.
    pub orientation_deg: f64,
    /// Height above ground at which the model's mean wind carries frozen air, m.
    pub height_m: f64,
}

/// Reads nothing: this program cannot.
///
/// # Errors
/// Always.
#[cfg(not(feature = "les"))]
pub fn open(spec: &crate::sim::air::spec::AirSpec, _place: Where) -> Result<Les, LesError> {
    let file = PathBuf::from(spec.word("file").unwrap_or_default());
    Err(LesError::of_file(
        &file,
        "this program was built without a reader of NetCDF: build it with the feature \"les\", which is on by default",
    ))
}

/// Path of a file that lies beside another.
#[cfg(feature = "les")]
fn beside(file: &Path, name: &str) -> PathBuf {
    file.parent().map_or_else(|| PathBuf::from(name), |folder| folder.join(name))
}
