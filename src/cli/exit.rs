//! Exit codes: a documented part of the command line.

use std::process::ExitCode;

use thiserror::Error;

use super::load::LoadError;
use crate::base::causes::with_causes;
use crate::base::file::FileError;
use crate::blind::BlindError;
use crate::campaign::CampaignError;
use crate::campaign::write::WriteError;
use crate::gap::GapError;
use crate::log::LogError;
use crate::mission::resolve::MissionError;
use crate::report::ReportError;
use crate::sim::SimError;
use crate::study::StudyError;
use crate::vehicle::VehicleError;

/// What stands between an error and its reason.
pub(super) const BECAUSE: &str = "\n  because: ";

/// How a command ended. One rule for every command: what is not there or cannot be read or written
/// is 1, what is there but wrong is 2, what is right but empty is 5. The numbers are documented in the README and do not change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Exit {
    /// Done.
    Done = 0,
    /// A file or folder is not there, or cannot be read or written; anything unexpected.
    Failed = 1,
    /// The arguments or a template are wrong, or a file is of the wrong kind or broken.
    Usage = 2,
    /// Done, but something was lost and is named.
    Losses = 3,
    /// A check failed: the show is not safe as it is.
    Unsafe = 4,
    /// There was nothing to work on (no plan, no logs, no windows), or an analysis gave no law and no
    /// map at all.
    Nothing = 5,
    /// Another process is writing into the same folder.
    Busy = 6,
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
    /// A blind flight could not be drawn, flown or scored.
    #[error(transparent)]
    Blind(Box<BlindError>),
    /// Measurement and simulation cannot be compared.
    #[error(transparent)]
    Gap(#[from] GapError),
    /// The arguments do not fit together.
    #[error("{0}")]
    Usage(String),
    /// A check failed, or a person has said no: nothing was started.
    #[error("{0}")]
    Unsafe(String),
    /// Something unexpected, with its reason.
    #[error("{0}")]
    Failed(String),
    /// Nothing to work on.
    #[error("{0}")]
    Nothing(String),
    /// Ctrl-C.
    #[error("interrupted; the same command goes on where it stopped")]
    Interrupted,
    /// Ctrl-C, with what becomes of what was going on.
    #[error("{0}")]
    Stopped(&'static str),
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

impl From<BlindError> for CommandError {
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

impl CommandError {
    /// The exit code for this error.
    pub fn exit(&self) -> Exit {
        match self {
            Self::Mission(error) => of_mission(error),
            Self::Vehicle(error) => of_vehicle(error),
            Self::Campaign(error) => of_campaign(error),
            Self::Load(error) => match &**error {
                LoadError::File(_) => Exit::Failed,
                LoadError::Campaign(error) => of_campaign(error),
                LoadError::Vehicle(error) => of_vehicle(error),
                _ => Exit::Usage,
            },
            Self::Study(error) => match &**error {
                StudyError::Record { .. } => Exit::Failed,
                StudyError::NoStudy { name } => of_name(name),
                StudyError::NoReference { .. } => Exit::Nothing,
                _ => Exit::Usage,
            },
            Self::Blind(error) => match &**error {
                BlindError::Skyb { .. }
                | BlindError::NoVerdict { .. }
                | BlindError::Explain { .. }
                | BlindError::Text { .. } => Exit::Failed,
                _ => Exit::Usage,
            },
            Self::Gap(error) => match error {
                GapError::NoSimulatedSide | GapError::Effect(_) => Exit::Usage,
                GapError::Simulation(_) => Exit::Failed,
                _ => Exit::Nothing,
            },
            Self::Log(LogError::Open { .. })
            | Self::File(_)
            | Self::Write(_)
            | Self::Sim(_)
            | Self::Report(_)
            | Self::Failed(_) => Exit::Failed,
            Self::Effect(_) | Self::Log(_) | Self::Usage(_) => Exit::Usage,
            Self::Nothing(_) => Exit::Nothing,
            Self::Unsafe(_) => Exit::Unsafe,
            Self::Interrupted | Self::Stopped(_) => Exit::Interrupted,
            Self::BrokenPipe => Exit::Done,
        }
    }
}

/// A file that is not there or cannot be read: 1. One that is wrong: 2.
fn of_mission(error: &MissionError) -> Exit {
    match error {
        MissionError::File(_) => Exit::Failed,
        MissionError::Vehicle(error) => of_vehicle(error),
        MissionError::NoTemplate { name } => of_name(name),
        _ => Exit::Usage,
    }
}

fn of_vehicle(error: &VehicleError) -> Exit {
    match error {
        VehicleError::File(_) => Exit::Failed,
        VehicleError::Unknown { name, .. } => of_name(name),
        _ => Exit::Usage,
    }
}

fn of_campaign(error: &CampaignError) -> Exit {
    match error {
        CampaignError::File(_) => Exit::Failed,
        CampaignError::NoPlan { .. } => Exit::Nothing,
        CampaignError::Busy { .. } => Exit::Busy,
        _ => Exit::Usage,
    }
}

/// What is neither a file nor built in: a path is a file that is not there, a word is a wrong name.
fn of_name(name: &str) -> Exit {
    let is_path = name.contains(['/', '\\', '.']);
    if is_path { Exit::Failed } else { Exit::Usage }
}

/// An error as one line of JSON, for `--json`.
pub(super) fn as_json(text: &str, exit: Exit) -> String {
    let mut parts = text.split(BECAUSE);
    let error = parts.next().unwrap_or_default();
    let error = error.strip_prefix("error: ").unwrap_or(error);
    let because: Vec<_> = parts.collect();
    serde_json::json!({
        "schema": "updraft.error/1",
        "exit": exit as u8,
        "error": error,
        "because": because,
    })
    .to_string()
}

/// An error and its reasons, one below the other.
pub(super) fn with_reasons(error: &dyn std::error::Error) -> String {
    with_causes(error, BECAUSE)
}
