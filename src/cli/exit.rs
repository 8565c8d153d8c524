//! Exit codes: a documented part of the command line.

use std::process::ExitCode;

use schemars::JsonSchema;
use serde::Serialize;

use crate::blind::BlindError;
use crate::campaign::CampaignError;
use crate::compare::CompareError;
use crate::gap::GapError;
use crate::les::LesError;
use crate::log::LogError;
use crate::mission::resolve::MissionError;
use crate::study::StudyError;
use crate::vehicle::VehicleError;
use crate::workflow::ending::Ending;
pub use crate::workflow::error::WorkflowError as CommandError;
pub(super) use crate::workflow::error::{BECAUSE, with_reasons};
use crate::workflow::shows::load::LoadError;

/// Exit code of a command. One rule holds for every command: what is missing or cannot be read or
/// written is 1, what is there but not valid is 2, what is valid but empty is 5. The numbers are
/// documented in the README and do not change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Exit {
    /// All of the work was done.
    Done = 0,
    /// A file or folder is missing, or cannot be read or written; also anything unexpected.
    Failed = 1,
    /// The arguments or a template are not valid, or a file is of the wrong kind or broken.
    Usage = 2,
    /// The work was done, but something was lost, and is named.
    Losses = 3,
    /// A check failed: the show is not safe as it is.
    Unsafe = 4,
    /// There was nothing to work on (no plan, no logs, no windows), or an analysis gave no law and no
    /// map at all.
    Nothing = 5,
    /// Another process is writing into the folder.
    Busy = 6,
    /// The user interrupted the command; when run again it goes on where it stopped.
    Interrupted = 130,
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(exit as u8)
    }
}

/// The exit code for an error.
pub fn exit_of(error: &CommandError) -> Exit {
    use CommandError as E;
    match error {
        E::Mission(error) => of_mission(error),
        E::Vehicle(error) => of_vehicle(error),
        E::Campaign(error) => of_campaign(error),
        E::Load(error) => match &**error {
            LoadError::File(_) => Exit::Failed,
            LoadError::Campaign(error) => of_campaign(error),
            LoadError::Vehicle(error) => of_vehicle(error),
            _ => Exit::Usage,
        },
        E::Study(error) => match &**error {
            StudyError::Record { .. } | StudyError::Threads { .. } => Exit::Failed,
            StudyError::NoStudy { name } => of_name(name),
            StudyError::NoReference { .. } => Exit::Nothing,
            _ => Exit::Usage,
        },
        E::Blind(error) => match &**error {
            BlindError::Skyb { .. }
            | BlindError::NoVerdict { .. }
            | BlindError::Explain { .. }
            | BlindError::Text { .. } => Exit::Failed,
            _ => Exit::Usage,
        },
        E::Gap(error) => match error {
            GapError::NoSimulatedSide | GapError::OtherPlan { .. } | GapError::Effect(_) => {
                Exit::Usage
            }
            GapError::Simulation(_) | GapError::InReadWind { .. } => Exit::Failed,
            _ => Exit::Nothing,
        },
        E::Compare(CompareError::NothingInCommon { .. } | CompareError::Nothing { .. }) => {
            Exit::Nothing
        }
        E::Output(error) if is_end_of_pipe(error) => Exit::Done,
        E::Log(LogError::Open { .. })
        | E::File(_)
        | E::Write(_)
        | E::Sim(_)
        | E::Report(_)
        | E::Output(_)
        | E::Failed(_)
        | E::Les(LesError::Open(_)) => Exit::Failed,
        E::Compare(_) | E::Les(_) | E::Effect(_) | E::Log(_) | E::Usage(_) => Exit::Usage,
        E::Nothing(_) => Exit::Nothing,
        E::Missing { .. } => Exit::Losses,
        E::Unsafe(_) => Exit::Unsafe,
        E::Interrupted | E::Stopped(_) => Exit::Interrupted,
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

/// The last line on standard error of a command with `--json` that has failed.
#[derive(Serialize, JsonSchema)]
pub(super) struct ErrorOutput<'a> {
    /// Reasons, each behind what it is the reason of.
    because: Vec<&'a str>,
    /// What went wrong, in one sentence.
    error: &'a str,
    /// Exit code of the program.
    exit: u8,
    /// Format name and version: `updraft.error/1`.
    schema: &'static str,
}

/// An error as one line of JSON, for `--json`.
pub(super) fn as_json(text: &str, exit: Exit) -> String {
    let mut parts = text.split(BECAUSE);
    let error = parts.next().unwrap_or_default();
    let error = error.strip_prefix("error: ").unwrap_or(error);
    let output = ErrorOutput {
        because: parts.collect(),
        error,
        exit: exit as u8,
        schema: "updraft.error/1",
    };
    // Texts and a number cannot fail.
    serde_json::to_string(&output).unwrap_or_default()
}

/// Whether standard output was closed by its reader, which is how pipes end.
pub(super) fn is_end_of_pipe(error: &std::io::Error) -> bool {
    error.kind() == std::io::ErrorKind::BrokenPipe
}

impl From<Ending> for Exit {
    fn from(ending: Ending) -> Self {
        match ending {
            Ending::Done => Self::Done,
            Ending::Losses => Self::Losses,
            Ending::NoGo => Self::Unsafe,
        }
    }
}
