//! How long one item takes, and how many tasks follow from it.

use std::process::Command;

use super::job::Job;
use crate::workflow::clock::Stopwatch;
use crate::workflow::error::WorkflowError;
use crate::workflow::host::Host;

/// Length that a task should have, s: a start of a task costs a scheduler some tenths of a second, and a task
/// that is lost costs what it did not finish.
pub const TASK_S: f64 = 600.0;
/// A task may take so many times longer than expected: items differ, and so do machines.
const SLACK: f64 = 3.0;
/// Time that every task is given beside its items, s.
const SPARE_S: f64 = 300.0;

/// Measured length of one item.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// Wall-clock time of a process that makes one item on one processor, s.
    pub item_s: f64,
    /// Number of items that are missing now.
    pub missing: usize,
}

/// Makes the first missing item in a process of its own, on one thread, and measures how long it takes. The
/// result counts. `None`: nothing is missing.
///
/// # Errors
///
/// If the process cannot be started or fails.
pub fn measure(host: &dyn Host, job: &Job) -> Result<Option<Measured>, WorkflowError> {
    let finished = job.items.results.finished();
    let missing = finished.iter().filter(|finished| finished.is_none()).count();
    let Some(item) = finished.iter().position(Option::is_none) else { return Ok(None) };
    let shard = format!("{}/{}", item + 1, finished.len());
    let watch = Stopwatch::start(host);
    let output = Command::new(&job.program)
        .args(&job.args)
        .args(["--shard", &shard, "--quiet", "--no-progress"])
        .current_dir(&job.cwd)
        .env("RAYON_NUM_THREADS", "1")
        .output();
    let output = output
        .map_err(|error| WorkflowError::Failed(format!("failed to measure an item: {error}")))?;
    host.check_stop()?;
    // An item that is lost takes its time, too.
    if !output.status.success() && output.status.code() != Some(3) {
        let said = String::from_utf8_lossy(&output.stderr);
        let said = said.trim().trim_start_matches("error: ");
        return Err(WorkflowError::Failed(format!(
            "an item could not be made to measure its time: {said}"
        )));
    }
    let missing = if output.status.success() { missing - 1 } else { missing };
    Ok(Some(Measured { item_s: watch.elapsed().as_secs_f64(), missing }))
}

/// Number of tasks, each of about [`TASK_S`], and the time limit of a task, s.
pub fn choose(measured: &Measured, cpus: u16, most: u32) -> (u32, u64) {
    let all_s = measured.item_s * measured.missing as f64 / f64::from(cpus.max(1));
    let most = most.min(u32::try_from(measured.missing).unwrap_or(u32::MAX)).max(1);
    let shards = ((all_s / TASK_S).ceil() as u32).clamp(1, most);
    let each = measured.missing.div_ceil(shards as usize) as f64;
    // No more processors work than there are items.
    let task_s = (measured.item_s * each / f64::from(cpus.max(1))).max(measured.item_s);
    (shards, (SLACK * task_s + SPARE_S).ceil() as u64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_task_lasts_minutes() {
        let measured = Measured { item_s: 14.0, missing: 3000 };
        let (shards, limit_s) = choose(&measured, 2, 1000);
        assert_eq!(shards, 35);
        assert!((1800..2400).contains(&limit_s), "{limit_s}");
        // Few short items are one task, and the scheduler's bound holds.
        assert_eq!(choose(&Measured { item_s: 0.1, missing: 143 }, 1, 1000).0, 1);
        assert_eq!(choose(&Measured { item_s: 60.0, missing: 1_000_000 }, 1, 1000).0, 1000);
        assert_eq!(choose(&Measured { item_s: 3600.0, missing: 3 }, 1, 1000).0, 3);
    }
}
