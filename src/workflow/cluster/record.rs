//! `cluster/job.json`: which jobs of the scheduler make which results.

use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::job::Job;
use super::results::Results;
use crate::base::file::FileError;
use crate::base::plain::Shown as _;
use crate::campaign::read_json;
use crate::workflow::error::WorkflowError;

/// Name and version of the format.
pub const CLUSTER_SCHEMA: &str = "updraft.cluster/1";
/// Stand-ins for what only the script knows.
const ARRAY: &str = "@ARRAY@";
const MERGE: &str = "@MERGE@";
const NOW: u64 = 8_888_888_888_888_888;

/// Jobs that were submitted, and the results that they make.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ClusterRecord {
    /// Format name and version: `updraft.cluster/1`.
    pub schema: String,
    /// Program and version.
    pub made_by: String,
    /// Command line whose work is shared out.
    pub command: String,
    /// A result, in a word or two.
    pub item: String,
    /// Files of the results.
    pub results: Results,
    /// File that the merge writes; absent: none of its own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub product: Option<PathBuf>,
    /// Number of shards.
    pub shards: u32,
    /// Number of the array job.
    pub array_job: String,
    /// Number of the job that puts the results together.
    pub merge_job: String,
    /// Unix time of submission, s.
    pub submitted_unix_s: u64,
}

impl ClusterRecord {
    /// Text of the record for a here-document of the shell, in which the variables `array` and `merge` and
    /// the time are filled in.
    pub(super) fn template(job: &Job, shards: u32, made_by: &str) -> Result<String, WorkflowError> {
        let record = Self {
            schema: CLUSTER_SCHEMA.to_owned(),
            made_by: made_by.to_owned(),
            command: job.line(),
            item: job.items.name.to_owned(),
            results: job.items.results.clone(),
            product: job.items.product.as_ref().map(|product| job.cwd.join(product)),
            shards,
            array_job: ARRAY.to_owned(),
            merge_job: MERGE.to_owned(),
            submitted_unix_s: NOW,
        };
        let text = serde_json::to_string(&record)
            .map_err(|error| WorkflowError::Failed(format!("failed to make JSON: {error}")))?;
        let quoted = text.replace('\\', "\\\\").replace('$', "\\$").replace('`', "\\`");
        let quoted = quoted.replace(ARRAY, "$array").replace(MERGE, "$merge");
        Ok(quoted.replace(&NOW.to_string(), "$(date +%s)"))
    }

    /// Reads the record of a job's folder, or of the folder of its results.
    ///
    /// # Errors
    ///
    /// If there is none, or it cannot be read.
    pub fn read(folder: &Path) -> Result<(Self, PathBuf), WorkflowError> {
        let places = [folder.to_owned(), cluster_folder(folder)];
        let found = places.iter().find(|place| record_path(place).is_file());
        let Some(place) = found else {
            if !folder.is_dir() {
                let missing = std::io::Error::from(std::io::ErrorKind::NotFound);
                return Err(FileError::new("look into", folder, missing).into());
            }
            return Err(WorkflowError::Nothing(format!(
                "{} has no job of `updraft cluster submit`: give the folder of its results",
                folder.shown()
            )));
        };
        let path = record_path(place);
        let record: Self = read_json(&path)?;
        if record.schema != CLUSTER_SCHEMA {
            return Err(WorkflowError::Usage(format!(
                "{} has the format \"{}\", this program reads \"{CLUSTER_SCHEMA}\"",
                path.shown(),
                record.schema
            )));
        }
        for job in [&record.array_job, &record.merge_job] {
            let is_number = !job.is_empty() && job.bytes().all(|byte| byte.is_ascii_digit());
            if !is_number || record.shards == 0 {
                return Err(WorkflowError::Usage(format!(
                    "{} is not a job's record",
                    path.shown()
                )));
            }
        }
        Ok((record, place.clone()))
    }
}

/// Folder for scripts, output and record of a job, in the folder of its results.
pub fn cluster_folder(results: &Path) -> PathBuf {
    results.join("cluster")
}

fn record_path(folder: &Path) -> PathBuf {
    folder.join("job.json")
}
