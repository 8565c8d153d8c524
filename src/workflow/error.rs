//! Errors of workflows. The program that runs them decides what they mean: exit codes belong to the
//! command line.

use std::io;

use thiserror::Error;

use super::shows::load::LoadError;
use crate::base::causes::with_causes;
use crate::base::file::FileError;
use crate::blind::BlindError;
use crate::campaign::CampaignError;
use crate::campaign::write::WriteError;
use crate::compare::CompareError;
use crate::gap::GapError;
use crate::link::error::NetError;
use crate::log::LogError;
use crate::mission::resolve::MissionError;
use crate::report::ReportError;
use crate::sim::SimError;
use crate::skybrush_server::ServerError;
use crate::study::StudyError;
use crate::vehicle::VehicleError;

/// What stands between an error and its reason.
pub(crate) const BECAUSE: &str = "\n  because: ";

/// An error and its reasons, one below the other.
pub(crate) fn with_reasons(error: &dyn std::error::Error) -> String {
    with_causes(error, BECAUSE)
}

/// Error that ended a workflow early.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum WorkflowError {
    /// A template, override or vehicle is not valid.
    #[error(transparent)]
    Mission(Box<MissionError>),
    /// A vehicle is unknown or not valid.
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
    /// A blind flight could not be drawn, flown or scored.
    #[error(transparent)]
    Blind(Box<BlindError>),
    /// Air cannot be read from a model's output, or does not cover the flight.
    #[error(transparent)]
    Les(#[from] crate::les::LesError),
    /// Measurement and simulation cannot be compared.
    #[error(transparent)]
    Gap(#[from] GapError),
    /// Campaigns cannot be compared.
    #[error(transparent)]
    Compare(#[from] CompareError),
    /// The request contradicts itself, or a file is of the wrong kind; a sentence for people.
    #[error("{0}")]
    Usage(String),
    /// A check failed, or a person said no, so that nothing was started; a sentence for people.
    #[error("{0}")]
    Unsafe(String),
    /// The work failed unexpectedly, for this reason.
    #[error("{0}")]
    Failed(String),
    /// There is nothing to work on; a sentence for people.
    #[error("{0}")]
    Nothing(String),
    /// Items that others should have made are not there, and nothing was to be made.
    #[error(
        "{count} of {of} {what} missing: {missing}\nrun the same command without --no-fly to make them; several \
         processes can share the work (--shard K/N)"
    )]
    Missing {
        /// Kind of the items, a plural: "blind flights".
        what: &'static str,
        /// Number of missing items.
        count: usize,
        /// Number of items that were looked for.
        of: usize,
        /// Names of all missing items.
        missing: String,
    },
    /// The work was stopped from outside.
    #[error("interrupted; run the same command again to resume")]
    Interrupted,
    /// The work was stopped from outside, with the fate of what was going on.
    #[error("{0}")]
    Stopped(&'static str),
    /// The host could not show a table.
    #[error("failed to print: {0}")]
    Output(io::Error),
}

impl From<MissionError> for WorkflowError {
    fn from(error: MissionError) -> Self {
        Self::Mission(Box::new(error))
    }
}

impl From<WriteError> for WorkflowError {
    fn from(error: WriteError) -> Self {
        Self::Write(Box::new(error))
    }
}

impl From<LoadError> for WorkflowError {
    fn from(error: LoadError) -> Self {
        Self::Load(Box::new(error))
    }
}

impl From<StudyError> for WorkflowError {
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

impl From<SimError> for WorkflowError {
    fn from(error: SimError) -> Self {
        Self::Sim(Box::new(error))
    }
}

impl From<BlindError> for WorkflowError {
    fn from(error: BlindError) -> Self {
        match error {
            BlindError::File(error) => Self::File(error),
            BlindError::Campaign(error) => Self::Campaign(error),
            BlindError::Mission(error) => error.into(),
            BlindError::Vehicle(error) => Self::Vehicle(error),
            BlindError::Effect(error) => Self::Effect(error),
            BlindError::Sim(error) => error.into(),
            BlindError::Stopped => Self::Interrupted,
            other => Self::Blind(Box::new(other)),
        }
    }
}

impl From<NetError> for WorkflowError {
    fn from(error: NetError) -> Self {
        Self::Failed(with_reasons(&error))
    }
}

impl From<ServerError> for WorkflowError {
    fn from(error: ServerError) -> Self {
        Self::Failed(with_reasons(&error))
    }
}
