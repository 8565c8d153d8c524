//! Exit codes: a documented part of the command line.

use std::process::ExitCode;

use thiserror::Error;

use super::load::LoadError;
use crate::base::causes::with_causes;
use crate::base::file::FileError;
use crate::campaign::CampaignError;
use crate::campaign::write::WriteError;
use crate::log::LogError;
use crate::mission::resolve::MissionError;
use crate::report::ReportError;
use crate::sim::SimError;
use crate::study::StudyError;
use crate::vehicle::VehicleError;

/// How a command ended. The numbers are documented in the README and do not change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Exit {
    /// Done.
    Done = 0,
    /// Something unexpected: a disk is full, a file cannot be read.
    Failed = 1,
    /// The arguments or a template are wrong.
    Usage = 2,
    /// Done, but something was lost and is named.
    Losses = 3,
    /// A check failed: the show is not safe as it is.
    Unsafe = 4,
    /// There was nothing to work on (no logs, no windows), or an analysis gave no law and no map at all.
    Nothing = 5,
    /// Interrupted by the user; the same command goes on where it stopped.
    Interrupted = 130,
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(exit as u8)
    }
}

/// Why a command ended early.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum CommandError {
    /// A template, override or vehicle is wrong.
    #[error(transparent)]
    Mission(Box<MissionError>),
    /// A vehicle is unknown or wrong.
    #[error(transparent)]
    Vehicle(#[from] VehicleError),
    /// An effect cannot be used.
    #[error(transparent)]
    Effect(#[from] crate::effects::EffectError),
    /// A campaign folder cannot be used.
    #[error(transparent)]
    Campaign(#[from] CampaignError),
    /// A file could not be read or written.
    #[error(transparent)]
    File(#[from] FileError),
    /// A show could not be written.
    #[error(transparent)]
    Write(Box<WriteError>),
    /// A show could not be read.
    #[error(transparent)]
    Load(Box<LoadError>),
    /// A log could not be read.
    #[error(transparent)]
    Log(#[from] LogError),
    /// A report could not be made.
    #[error(transparent)]
    Report(#[from] ReportError),
    /// A flight could not be simulated.
    #[error(transparent)]
    Sim(Box<SimError>),
    /// A study could not be read, flown or evaluated.
    #[error(transparent)]
    Study(Box<StudyError>),
    /// The arguments do not fit together.
    #[error("{0}")]
    Usage(String),
    /// Something unexpected, with its reason.
    #[error("{0}")]
    Failed(String),
    /// Nothing to work on.
    #[error("{0}")]
    Nothing(String),
    /// Ctrl-C.
    #[error("interrupted; the same command goes on where it stopped")]
    Interrupted,
    /// Standard output was closed by its reader, which is how pipes end.
    #[error("standard output was closed")]
    BrokenPipe,
}

impl From<MissionError> for CommandError {
    fn from(error: MissionError) -> Self {
        Self::Mission(Box::new(error))
    }
}

impl From<WriteError> for CommandError {
    fn from(error: WriteError) -> Self {
        Self::Write(Box::new(error))
    }
}

impl From<LoadError> for CommandError {
    fn from(error: LoadError) -> Self {
        Self::Load(Box::new(error))
    }
}

impl From<StudyError> for CommandError {
    fn from(error: StudyError) -> Self {
        match error {
            StudyError::File(error) => Self::File(error),
            StudyError::Mission(error) => Self::Mission(error),
            StudyError::Vehicle(error) => Self::Vehicle(*error),
            StudyError::Stopped => Self::Interrupted,
            other => Self::Study(Box::new(other)),
        }
    }
}

impl From<SimError> for CommandError {
    fn from(error: SimError) -> Self {
        Self::Sim(Box::new(error))
    }
}

impl CommandError {
    /// The exit code for this error.
    pub fn exit(&self) -> Exit {
        match self {
            Self::Mission(error) if matches!(**error, MissionError::File(_)) => Exit::Failed,
            Self::Load(error) if matches!(**error, LoadError::File(_)) => Exit::Failed,
            Self::Study(error) if matches!(**error, StudyError::Record { .. }) => Exit::Failed,
            Self::Study(error) if matches!(**error, StudyError::NoReference { .. }) => {
                Exit::Nothing
            }
            Self::Vehicle(VehicleError::File(_))
            | Self::File(_)
            | Self::Write(_)
            | Self::Sim(_)
            | Self::Report(_)
            | Self::Failed(_) => Exit::Failed,
            Self::Mission(_)
            | Self::Study(_)
            | Self::Vehicle(_)
            | Self::Effect(_)
            | Self::Campaign(_)
            | Self::Load(_)
            | Self::Log(_)
            | Self::Usage(_) => Exit::Usage,
            Self::Nothing(_) => Exit::Nothing,
            Self::Interrupted => Exit::Interrupted,
            Self::BrokenPipe => Exit::Done,
        }
    }
}

/// An error and its reasons, one below the other.
pub(super) fn with_reasons(error: &dyn std::error::Error) -> String {
    with_causes(error, "\n  because: ")
}
