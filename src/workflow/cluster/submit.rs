//! Submission and cancellation of a job.

use std::path::{Path, PathBuf};
use std::process::Command;

use super::job::Job;
use super::measure::Measured;
use super::queue::{ask, forget, must};
use super::record::ClusterRecord;
use super::script::submit_script;
use crate::base::file::write_whole;
use crate::base::plain::Shown as _;
use crate::workflow::error::WorkflowError;
use crate::workflow::host::Host;
use crate::workflow::made_by;

/// A job that was submitted.
#[derive(Clone, Debug)]
pub struct Submitted {
    /// Record of the job.
    pub record: ClusterRecord,
    /// Path of the script that submitted it.
    pub script: PathBuf,
}

/// Writes the script of a job and runs it.
///
/// # Errors
///
/// If a job for these results is still in the queue, or the scheduler does not take it.
pub fn submit(
    host: &dyn Host,
    job: &Job,
    shards: u32,
    measured: Option<&Measured>,
) -> Result<Submitted, WorkflowError> {
    let text = submit_script(job, shards, measured, &made_by())?;
    if let Ok((last, place)) = ClusterRecord::read(&job.folder) {
        let queued = ask(&last, &place, host.clock().unix_us() / 1_000_000).queued;
        if queued.is_ok_and(|queued| !queued.is_empty()) {
            return Err(WorkflowError::Usage(format!(
                "job {} for these results is still in the queue; wait for it, or `updraft cluster cancel {}`",
                last.array_job,
                job.folder.shown()
            )));
        }
    }
    let script = job.folder.join("submit.sh");
    write_whole(&script, text.as_bytes())?;
    let output = Command::new("bash").arg(&script).output();
    let output =
        output.map_err(|error| WorkflowError::Failed(format!("bash cannot be run: {error}")))?;
    if !output.status.success() {
        let said = String::from_utf8_lossy(&output.stderr).trim().to_owned();
        return Err(WorkflowError::Failed(format!(
            "the job was not submitted by {}: {said}",
            script.shown()
        )));
    }
    let (record, _) = ClusterRecord::read(&job.folder)?;
    Ok(Submitted { record, script })
}

/// A job that was to be taken out of the queue.
#[derive(Clone, Debug)]
pub struct Cancelled {
    /// Record of the job.
    pub record: ClusterRecord,
    /// Whether anything of it was in the queue.
    pub was_queued: bool,
}

/// Takes a job and its merge out of the queue; tasks that run end with what is finished.
///
/// # Errors
///
/// If the folder has no job, or the scheduler refuses.
pub fn cancel(host: &dyn Host, folder: &Path) -> Result<Cancelled, WorkflowError> {
    let (record, place) = ClusterRecord::read(folder)?;
    // What was in the queue before says nothing of now.
    forget(&place);
    let queued = ask(&record, &place, host.clock().unix_us() / 1_000_000).queued;
    forget(&place);
    let was_queued = queued.map_or(true, |queued| !queued.is_empty());
    if was_queued {
        must("scancel", &[&record.array_job, &record.merge_job])?;
    }
    Ok(Cancelled { record, was_queued })
}
