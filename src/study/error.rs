//! Why a study could not be read, flown or evaluated.

use thiserror::Error;

use crate::base::file::FileError;
use crate::base::plain::plain;
use crate::mission::error::TemplateError;
use crate::mission::resolve::MissionError;
use crate::vehicle::VehicleError;

/// A study cannot go on.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum StudyError {
    /// The study's file is wrong.
    #[error(transparent)]
    Template(#[from] Box<TemplateError>),
    /// The mission template that the study flies is wrong.
    #[error(transparent)]
    Mission(Box<MissionError>),
    /// The vehicle that the study flies is wrong.
    #[error(transparent)]
    Vehicle(Box<VehicleError>),
    /// A file could not be read or written.
    #[error(transparent)]
    File(#[from] FileError),
    /// There is no such file, and no built-in study of that name.
    #[error("there is no study {}; built in is study.toml", plain(name))]
    NoStudy {
        /// As asked for.
        name: String,
    },
    /// A finished flight could not be put into words; a bug of this program.
    #[error("failed to make the record of {cell}: {source}")]
    Record {
        /// Which flight.
        cell: String,
        /// Why.
        #[source]
        source: serde_json::Error,
    },
    /// The user asked to stop.
    #[error("the study was stopped; finished flights are kept")]
    Stopped,
    /// A and u0 cannot be had.
    #[error("A and u0 come from the flight {cell}, which gave none: {reason}")]
    NoReference {
        /// The flight without wind and updraft.
        cell: String,
        /// Why it gave none.
        reason: String,
    },
}

impl From<TemplateError> for StudyError {
    fn from(error: TemplateError) -> Self {
        Self::Template(Box::new(error))
    }
}

impl From<MissionError> for StudyError {
    fn from(error: MissionError) -> Self {
        Self::Mission(Box::new(error))
    }
}
