//! Progress of a job, counted in files.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::time::UNIX_EPOCH;

use schemars::JsonSchema;
use serde::Serialize;

use super::queue::{Queued, ask};
use super::record::ClusterRecord;
use crate::base::shard::Shard;
use crate::workflow::error::WorkflowError;
use crate::workflow::host::Host;

/// Name and version of what `--json` prints.
const STATUS_SCHEMA: &str = "updraft.cluster-status/1";
/// Results of the last so many seconds tell the rate.
const RATE_OVER_S: u64 = 900;
/// A task is stuck when its last result is so many times longer ago than results of one shard are apart...
const STUCK_TIMES: f64 = 5.0;
/// ... and at least so long, s.
const STUCK_LEAST_S: f64 = 300.0;

/// State of a shard that is not complete.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct ShardState {
    /// Number of the shard, from 1.
    pub shard: u32,
    /// Number of its results that are missing.
    pub missing: usize,
    /// State of its task in the scheduler's words, such as `R`; absent: it is not in the queue.
    pub state: Option<String>,
    /// Nodes of the task, or why it waits.
    pub place: Option<String>,
    /// Time since its last result, or since its start, s; absent: it does not run.
    pub silent_s: Option<f64>,
}

/// Progress of a job.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Status {
    /// Format name and version: `updraft.cluster-status/1`.
    pub schema: &'static str,
    /// Command line whose work is shared out.
    pub command: String,
    /// A result, in a word or two.
    pub item: String,
    /// Number of items.
    pub items: usize,
    /// Number of results that are there.
    pub done: usize,
    /// Results per minute, lately; absent: there are too few.
    pub per_minute: Option<f64>,
    /// Time until the last result at this rate, s.
    pub left_s: Option<f64>,
    /// Number of tasks that run.
    pub running: usize,
    /// Number of tasks that wait in the queue.
    pub waiting: usize,
    /// Reason why the scheduler could not be asked; absent: it was.
    pub queue_unknown: Option<String>,
    /// Age of the scheduler's answer, s.
    pub queue_age_s: u64,
    /// Tasks that run without results for unusually long.
    pub stuck: Vec<ShardState>,
    /// Shards with missing results whose tasks have ended.
    pub ended: Vec<ShardState>,
    /// Whether the job that puts the results together is in the queue.
    pub merge_waits: bool,
    /// Whether all results are there and were put together since.
    pub complete: bool,
    /// Why tasks wait in the queue, in the scheduler's words, each reason once.
    pub waiting_for: Vec<String>,
    /// Folder of scripts and output.
    pub folder: PathBuf,
}

/// Counts the results of the job in a folder, and asks the scheduler, at most once in 30 s.
///
/// # Errors
///
/// If the folder has no job.
pub fn status(host: &dyn Host, folder: &std::path::Path) -> Result<Status, WorkflowError> {
    let (record, place) = ClusterRecord::read(folder)?;
    let now_s = host.clock().unix_us() / 1_000_000;
    let queue = ask(&record, &place, now_s);
    let finished = record.results.finished();
    let shards = shard_counts(&finished, record.shards);
    let done = finished.iter().flatten().count();
    let (per_minute, left_s) = rate(&finished, &record, now_s);
    let (tasks, queue_unknown) = match queue.queued {
        Ok(tasks) => (tasks, None),
        Err(reason) => (Vec::new(), Some(reason)),
    };
    let of_array = |task: &&Queued| task.id.starts_with(&format!("{}_", record.array_job));
    let count =
        |runs: bool| tasks.iter().filter(of_array).filter(|task| is_running(task) == runs).count();
    let by_shard: BTreeMap<u32, &Queued> = (tasks.iter().filter(of_array))
        .filter_map(|task| Some((task.id.rsplit_once('_')?.1.parse().ok()?, task)))
        .collect();
    let usual_s = usual_gap_s(&shards);
    let (mut stuck, mut ended) = (Vec::new(), Vec::new());
    for (shard, counted) in (1..).zip(&shards).filter(|(_, counted)| counted.missing > 0) {
        let task = by_shard.get(&shard).copied();
        let silent_s = task.filter(|task| is_running(task)).map(|task| {
            let since_ms = (now_s * 1000).saturating_sub(counted.last_ms.unwrap_or(0));
            (since_ms as f64 / 1000.0).min(task.running_s as f64)
        });
        let state = ShardState {
            shard,
            missing: counted.missing,
            state: task.map(|task| task.state.clone()),
            place: task.map(|task| task.place.clone()),
            silent_s,
        };
        let bound_s = usual_s.map(|usual_s| (STUCK_TIMES * usual_s).max(STUCK_LEAST_S));
        match silent_s {
            Some(silent_s) if bound_s.is_some_and(|bound_s| silent_s > bound_s) => {
                stuck.push(state);
            }
            None if task.is_none() && queue_unknown.is_none() => ended.push(state),
            _ => {}
        }
    }
    Ok(Status {
        schema: STATUS_SCHEMA,
        command: record.command.clone(),
        item: record.item.clone(),
        items: finished.len(),
        done,
        per_minute,
        left_s,
        running: count(true),
        waiting: count(false),
        queue_unknown,
        queue_age_s: queue.age_s,
        stuck,
        ended,
        merge_waits: tasks.iter().any(|task| task.id == record.merge_job),
        complete: done == finished.len() && is_merged(&record, &finished),
        waiting_for: tasks
            .iter()
            .filter(of_array)
            .filter(|task| !is_running(task) && !task.place.is_empty())
            .map(|task| task.place.trim_matches(['(', ')']).to_owned())
            .collect::<BTreeSet<_>>()
            .into_iter()
            .collect(),
        folder: place,
    })
}

/// Whether the merge has written its file since the last result.
fn is_merged(record: &ClusterRecord, finished: &[Option<u64>]) -> bool {
    let Some(product) = &record.product else { return true };
    let written = std::fs::metadata(product).and_then(|found| found.modified()).ok();
    let since = written.and_then(|at| at.duration_since(UNIX_EPOCH).ok());
    let last_ms = finished.iter().flatten().max().copied().unwrap_or(0);
    since.is_some_and(|since| since.as_millis() >= u128::from(last_ms))
}

fn is_running(task: &Queued) -> bool {
    matches!(task.state.as_str(), "R" | "CG" | "CF" | "S")
}

/// Results of a shard.
#[derive(Clone, Debug, Default)]
struct Counted {
    missing: usize,
    /// Times between one result and the next, s.
    gaps_s: Vec<f64>,
    last_ms: Option<u64>,
}

fn shard_counts(finished: &[Option<u64>], shards: u32) -> Vec<Counted> {
    let shards = (1..=shards).filter_map(|number| Shard::new(number.into(), shards.into()).ok());
    let count = |shard: Shard| {
        let first = shard.number() as usize - 1;
        let its = || finished.iter().skip(first).step_by(shard.of() as usize);
        let mut times_ms: Vec<u64> = its().flatten().copied().collect();
        times_ms.sort_unstable();
        let gap = |pair: &[u64]| match pair {
            [before, after] => (after - before) as f64 / 1000.0,
            _ => 0.0,
        };
        Counted {
            missing: its().filter(|finished| finished.is_none()).count(),
            gaps_s: times_ms.windows(2).map(gap).collect(),
            last_ms: times_ms.last().copied(),
        }
    };
    shards.map(count).collect()
}

/// Median time between results of one shard, s.
fn usual_gap_s(shards: &[Counted]) -> Option<f64> {
    let gaps: Vec<f64> = shards.iter().flat_map(|shard| shard.gaps_s.iter().copied()).collect();
    crate::numeric::median(gaps)
}

/// Results per minute of the last quarter of an hour (or since the submission, if that is shorter), and the
/// time that the rest takes, s.
fn rate(
    finished: &[Option<u64>],
    record: &ClusterRecord,
    now_s: u64,
) -> (Option<f64>, Option<f64>) {
    let from_s = record.submitted_unix_s.max(now_s.saturating_sub(RATE_OVER_S));
    let lately = finished.iter().flatten().filter(|ms| **ms / 1000 >= from_s).count();
    let over_s = now_s.saturating_sub(from_s) as f64;
    let missing = finished.iter().filter(|finished| finished.is_none()).count();
    // When all is done, the rate would only sink.
    if lately < 2 || over_s < 1.0 || missing == 0 {
        return (None, None);
    }
    let per_s = lately as f64 / over_s;
    (Some(per_s * 60.0), Some(missing as f64 / per_s))
}
