//! `updraft cluster`: work shared out to a cluster that is scheduled by Slurm.

mod given;
mod job;
mod status;

use std::path::PathBuf;

use clap::{Args, Subcommand};
use serde::Serialize;

use self::job::{JobArgs, chosen};
use crate::cli::context::Context;
use crate::cli::exit::{CommandError, Exit};
use crate::workflow::cluster::{self, ClusterRecord, submit_script};

/// Arguments of `updraft cluster`.
#[derive(Debug, Args)]
#[command(after_long_help = "Examples:
  updraft cluster script blind --seed 20270101 --flights 3000 -o blind --time 1:00:00 > blind.sh
  updraft cluster submit blind --seed 20270101 --flights 3000 -o blind
  updraft cluster status blind
  updraft cluster cancel blind

An array job makes the items, each task those of its shard; a second job puts the results together when
the array has ended, or says what is missing. Results are files: whatever becomes of a task or a node,
submit the same command again, and only what is missing is made. docs/cluster.md is the way there.")]
pub(in crate::cli) struct ClusterArgs {
    #[command(subcommand)]
    command: ClusterCommand,
}

#[derive(Debug, Subcommand)]
enum ClusterCommand {
    /// Print a script that submits the array job and the merge
    Script(JobArgs),
    /// Submit the array job and the merge
    Submit(JobArgs),
    /// Count the results, and tell what runs, what waits and what is stuck
    Status(FolderArgs),
    /// Take a job and its merge out of the queue; what is finished stays
    Cancel(FolderArgs),
}

#[derive(Debug, Args)]
struct FolderArgs {
    /// Folder of the results, or of the job (--job-folder)
    folder: PathBuf,
}

/// What `submit` and `cancel` print with `--json`.
#[derive(Serialize)]
struct JobOutput<'a> {
    schema: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    script: Option<PathBuf>,
    job: &'a ClusterRecord,
}

pub(super) fn run(context: &Context, args: &ClusterArgs) -> Result<Exit, CommandError> {
    match &args.command {
        ClusterCommand::Script(args) => script(context, args),
        ClusterCommand::Submit(args) => submit(context, args),
        ClusterCommand::Status(args) => status::run(context, &args.folder),
        ClusterCommand::Cancel(args) => {
            let job = cluster::cancel(&args.folder)?;
            if context.json {
                let schema = "updraft.cluster-cancel/1";
                context.print_json(&JobOutput { schema, script: None, job: &job })?;
            }
            context.say(&format!(
                "Cancelled array {} and merge {}; what is finished stays",
                job.array_job, job.merge_job
            ));
            Ok(Exit::Done)
        }
    }
}

fn script(context: &Context, args: &JobArgs) -> Result<Exit, CommandError> {
    let Some(chosen) = chosen(context, args, "script")? else { return Ok(Exit::Done) };
    let made_by = concat!("updraft ", env!("CARGO_PKG_VERSION"));
    let text = submit_script(&chosen.job, chosen.shards, chosen.measured.as_ref(), made_by)?;
    context.emit(&text)?;
    Ok(Exit::Done)
}

fn submit(context: &Context, args: &JobArgs) -> Result<Exit, CommandError> {
    let Some(chosen) = chosen(context, args, "submit")? else { return Ok(Exit::Done) };
    let done = cluster::submit(context, &chosen.job, chosen.shards, chosen.measured.as_ref())?;
    let job = &done.record;
    if context.json {
        let (schema, script) = ("updraft.cluster-submit/1", Some(done.script.clone()));
        context.print_json(&JobOutput { schema, script, job })?;
    }
    context.result(&done.script)?;
    context.say(&format!(
        "Submitted array {} ({} tasks) and merge {}: {}",
        job.array_job,
        job.shards,
        job.merge_job,
        crate::base::plain::Shown::shown(&*done.script)
    ));
    Ok(Exit::Done)
}
