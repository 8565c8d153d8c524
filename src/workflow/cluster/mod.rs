//! Work on a cluster that is scheduled by Slurm: an array of shards, and a merge after it.
//!
//! The files of results are the truth, the scheduler is not: progress is counted in files, and whatever
//! becomes of a job, the same command goes on with what is missing.

mod job;
mod measure;
mod queue;
mod record;
mod results;
mod script;
mod status;
mod submit;

pub use job::{Items, Job, Resources};
pub use measure::{Measured, TASK_S, choose, measure};
pub use queue::{MIN_PERIOD_S, MOST_TASKS, most_tasks};
pub use record::{CLUSTER_SCHEMA, ClusterRecord, cluster_folder};
pub use results::Results;
pub use script::submit_script;
pub use status::{ShardState, Status, status};
pub use submit::{Cancelled, Submitted, cancel, submit};
