//! Result of gathering campaigns, as `updraft archive --json` prints it.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::Serialize;

use crate::archive::index::ArchivedCampaign;

/// Name and version of the format.
pub const ARCHIVE_SCHEMA: &str = "updraft.archive/1";

/// What `updraft archive --json` prints.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct ArchiveOutput {
    /// Format name and version: `updraft.archive/1`.
    pub schema: &'static str,
    /// Folder of the archive.
    pub archive: PathBuf,
    /// What became of each campaign.
    pub campaigns: Vec<Gathered>,
    /// Campaigns that the archive holds now.
    pub held: usize,
    /// Rows that it holds now.
    pub rows: Rows,
}

/// Rows by table.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Rows {
    /// Flights.
    pub flights: u64,
    /// Drones of flights.
    pub drones: u64,
    /// Thermals.
    pub thermals: u64,
    /// Findings.
    pub verdicts: u64,
    /// Drones and seconds.
    pub seconds: u64,
}

impl Rows {
    /// Rows of campaigns together.
    pub fn of<'a>(campaigns: impl IntoIterator<Item = &'a ArchivedCampaign>) -> Self {
        campaigns.into_iter().fold(Self::default(), |sum, campaign| Self {
            flights: sum.flights + campaign.rows("flights"),
            drones: sum.drones + campaign.rows("drones"),
            thermals: sum.thermals + campaign.rows("thermals"),
            verdicts: sum.verdicts + campaign.rows("verdicts"),
            seconds: sum.seconds + campaign.rows("seconds"),
        })
    }
}

/// A campaign and what became of it.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Gathered {
    /// Folder of the campaign.
    pub folder: PathBuf,
    /// Id in the archive; absent: it is not known.
    pub campaign: Option<String>,
    /// What became of it.
    pub outcome: Outcome,
    /// Why it was skipped.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// Rows that the archive holds of it.
    pub rows: Rows,
}

/// What became of a campaign.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// It is new in the archive.
    Added,
    /// Its files had changed: its rows are new.
    Replaced,
    /// Its files are those of last time.
    Unchanged,
    /// It is a copy of a campaign that the archive has from another folder.
    Copy,
    /// It could not be gathered; what the archive had of it stays.
    Skipped,
    /// It is in its folder no more, and was removed from the archive.
    Pruned,
}

impl Outcome {
    /// Name of the outcome in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Added => "added",
            Self::Replaced => "replaced",
            Self::Unchanged => "unchanged",
            Self::Copy => "copy",
            Self::Skipped => "skipped",
            Self::Pruned => "pruned",
        }
    }
}
