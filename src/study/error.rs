//! Errors of reading, flying and evaluating a study.

use thiserror::Error;

use crate::base::file::FileError;
use crate::base::plain::plain;
use crate::mission::error::TemplateError;
use crate::mission::resolve::MissionError;
use crate::vehicle::VehicleError;

/// Error of a study.
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
    /// The name is neither a file nor a built-in study.
    #[error("there is no study {}; built in are study.toml and sensitivity.toml", plain(name))]
    NoStudy {
        /// Name of the study, as asked for.
        name: String,
    },
    /// A finished flight has no form as JSON; a bug of this program.
    #[error("failed to make the record of {cell}: {source}")]
    Record {
        /// Name of the flight.
        cell: String,
        /// Reason given by the serialiser.
        #[source]
        source: serde_json::Error,
    },
    /// Threads could not be started.
    #[error("failed to start threads: {reason}")]
    Threads {
        /// Reason given by the operating system.
        reason: String,
    },
    /// The user asked to stop.
    #[error("the study was stopped; finished flights are kept")]
    Stopped,
    /// The reference flight gave neither A nor u0.
    #[error("A and u0 come from the flight {cell}, which gave none: {reason}")]
    NoReference {
        /// Name of the flight without wind and updraft.
        cell: String,
        /// Reason why that flight gave no fit.
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
