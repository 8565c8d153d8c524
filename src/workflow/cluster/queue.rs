//! Questions to the scheduler: how large an array may be, and which tasks are in its queue.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde::{Deserialize, Serialize};

use super::record::ClusterRecord;
use crate::base::file::write_whole;
use crate::campaign::{read_json, to_json};
use crate::workflow::error::WorkflowError;

/// Largest array where the scheduler does not say: its default.
pub const MOST_TASKS: u32 = 1000;
/// The scheduler is asked no more often, s: it answers everybody on a cluster.
pub const MIN_PERIOD_S: u64 = 30;

/// Largest number of tasks in an array, counted from 1.
pub fn most_tasks() -> u32 {
    let config = run("scontrol", &["show", "config"]).ok().filter(|output| output.status.success());
    let said = config.map(|output| String::from_utf8_lossy(&output.stdout).into_owned());
    let size = said.as_deref().and_then(|text| {
        let line = text.lines().find(|line| line.trim_start().starts_with("MaxArraySize"))?;
        line.split('=').nth(1)?.trim().parse::<u32>().ok()
    });
    // Task numbers stay below it.
    size.map_or(MOST_TASKS, |size| size.saturating_sub(1).max(1))
}

/// State of a job or a task in the queue.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Queued {
    /// Number of the job or, with the task's, `7_3`.
    pub(super) id: String,
    /// Slurm's letters: `R`, `PD`, `CG`.
    pub(super) state: String,
    /// Time that it has run, s.
    pub(super) running_s: u64,
    /// Nodes, or why it waits.
    pub(super) place: String,
}

/// `cluster/queue.json`: the last answer of the scheduler.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Answer {
    asked_unix_s: u64,
    /// The jobs that were asked for.
    jobs: Vec<String>,
    /// `None`: the scheduler could not be asked, for this reason.
    queued: Option<Vec<Queued>>,
    reason: String,
}

/// What the scheduler says of a job, at most once in [`MIN_PERIOD_S`], whoever asks.
pub(super) struct Queue {
    /// Jobs and tasks in the queue, or why that is not known.
    pub(super) queued: Result<Vec<Queued>, String>,
    /// Age of the answer, s.
    pub(super) age_s: u64,
}

/// Forgets the scheduler's last answer: the next one asks anew.
pub(super) fn forget(folder: &Path) {
    let _ = std::fs::remove_file(queue_path(folder));
}

fn queue_path(folder: &Path) -> PathBuf {
    folder.join("queue.json")
}

pub(super) fn ask(record: &ClusterRecord, folder: &Path, now_unix_s: u64) -> Queue {
    let path = queue_path(folder);
    let jobs = vec![record.array_job.clone(), record.merge_job.clone()];
    let last: Option<Answer> = read_json(&path).ok();
    let fresh = last.filter(|last| {
        let age_s = now_unix_s.checked_sub(last.asked_unix_s);
        last.jobs == jobs && age_s.is_some_and(|age_s| age_s < MIN_PERIOD_S)
    });
    let answer = fresh.unwrap_or_else(|| {
        let asked = squeue(&jobs);
        let reason = asked.as_ref().err().cloned().unwrap_or_default();
        let answer = Answer { asked_unix_s: now_unix_s, jobs, queued: asked.ok(), reason };
        // Where it cannot be kept, the next one asks again.
        let _ = to_json(&answer).map(|bytes| write_whole(&path, &bytes));
        answer
    });
    let age_s = now_unix_s.saturating_sub(answer.asked_unix_s);
    Queue { queued: answer.queued.ok_or(answer.reason), age_s }
}

fn squeue(jobs: &[String]) -> Result<Vec<Queued>, String> {
    let output = run("squeue", &["-h", "-r", "-o", "%i|%t|%M|%R", "-j", &jobs.join(",")])
        .map_err(|error| format!("squeue cannot be run: {error}"))?;
    if !output.status.success() {
        let said = String::from_utf8_lossy(&output.stderr).trim().to_owned();
        // The scheduler forgets jobs some minutes after their end.
        let first = said.lines().next().unwrap_or("squeue failed").to_owned();
        return if said.contains("Invalid job id") { Ok(Vec::new()) } else { Err(first) };
    }
    Ok(String::from_utf8_lossy(&output.stdout).lines().filter_map(queued).collect())
}

fn queued(line: &str) -> Option<Queued> {
    let mut parts = line.trim().splitn(4, '|');
    let mut part = || parts.next().map(str::to_owned);
    let (id, state, running, place) = (part()?, part()?, part()?, part()?);
    Some(Queued { id, state, running_s: duration_s(&running)?, place })
}

/// Slurm's `days-hours:minutes:seconds`, from the right.
fn duration_s(text: &str) -> Option<u64> {
    let (days, clock) = match text.split_once('-') {
        Some((days, clock)) => (days.parse::<u64>().ok()?, clock),
        None => (0, text),
    };
    let mut seconds = 0_u64;
    for part in clock.split(':') {
        seconds = seconds.checked_mul(60)?.checked_add(part.parse().ok()?)?;
    }
    days.checked_mul(86_400)?.checked_add(seconds)
}

/// Runs a program of the scheduler.
pub(super) fn run(program: &str, args: &[&str]) -> std::io::Result<Output> {
    Command::new(program).args(args).output()
}

/// Runs a program of the scheduler, which must succeed.
pub(super) fn must(program: &str, args: &[&str]) -> Result<String, WorkflowError> {
    let output = run(program, args).map_err(|error| {
        WorkflowError::Failed(format!(
            "{program} cannot be run: {error}; are you on a machine of the cluster?"
        ))
    })?;
    let said = |bytes: &[u8]| String::from_utf8_lossy(bytes).trim().to_owned();
    if output.status.success() {
        Ok(said(&output.stdout))
    } else {
        Err(WorkflowError::Failed(format!("{program} failed: {}", said(&output.stderr))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_squeue_prints_is_read() {
        let read = queued("42_7|R|1-02:03:04|n[1-2]").unwrap();
        assert_eq!((read.id.as_str(), read.state.as_str(), read.running_s), ("42_7", "R", 93_784));
        assert_eq!(duration_s("0:59"), Some(59));
        assert!(queued("slurm_load_jobs error").is_none() && queued("1|R|x|n1").is_none());
    }
}
