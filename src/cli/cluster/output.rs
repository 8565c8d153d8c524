//! Output of `updraft cluster` with `--json`.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::Serialize;

use crate::workflow::cluster::{Cancelled, ClusterRecord};

/// Name and version of what `script` prints.
pub(super) const SCRIPT_SCHEMA: &str = "updraft.cluster-script/1";
/// Name and version of what `submit` prints.
pub(super) const SUBMIT_SCHEMA: &str = "updraft.cluster-submit/1";

/// Script that submits a job.
#[derive(Serialize, JsonSchema)]
pub(in crate::cli) struct ScriptOutput {
    /// Format name and version: `updraft.cluster-script/1`.
    pub(super) schema: &'static str,
    /// Text of the script; null: all results are there.
    pub(super) script: Option<String>,
    /// Number of tasks.
    pub(super) tasks: u32,
}

/// Job that was submitted.
#[derive(Serialize, JsonSchema)]
pub(in crate::cli) struct SubmitOutput {
    /// Format name and version: `updraft.cluster-submit/1`.
    pub(super) schema: &'static str,
    /// Path of the script that was run; null: all results are there.
    pub(super) script: Option<PathBuf>,
    /// Record of the job.
    pub(super) job: Option<ClusterRecord>,
}

/// Job that was taken out of the queue.
#[derive(Serialize, JsonSchema)]
pub(in crate::cli) struct CancelOutput {
    /// Format name and version: `updraft.cluster-cancel/1`.
    schema: &'static str,
    /// Record of the job.
    job: ClusterRecord,
    /// Whether anything of it was in the queue.
    was_queued: bool,
}

impl CancelOutput {
    pub(super) fn of(done: &Cancelled) -> Self {
        let (job, was_queued) = (done.record.clone(), done.was_queued);
        Self { schema: "updraft.cluster-cancel/1", job, was_queued }
    }
}
