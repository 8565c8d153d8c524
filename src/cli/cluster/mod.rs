//! `updraft cluster`: work shared out to a cluster that is scheduled by Slurm.

mod given;
mod job;
pub(in crate::cli) mod output;
mod status;

use std::path::PathBuf;

use clap::{Args, Subcommand};

use self::job::{Chosen, JobArgs, chosen};
use self::output::{CancelOutput, SCRIPT_SCHEMA, SUBMIT_SCHEMA, ScriptOutput, SubmitOutput};
use crate::cli::context::Context;
use crate::cli::exit::{CommandError, Exit};
use crate::cli::words;
use crate::workflow::cluster::{self, submit_script};

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

pub(super) fn run(context: &Context, args: &ClusterArgs) -> Result<Exit, CommandError> {
    match &args.command {
        ClusterCommand::Script(args) => script(context, args),
        ClusterCommand::Submit(args) => submit(context, args),
        ClusterCommand::Status(args) => status::run(context, &args.folder),
        ClusterCommand::Cancel(args) => {
            let done = cluster::cancel(context, &args.folder)?;
            if context.json {
                context.print_json(&CancelOutput::of(&done))?;
            }
            let (array, merge) = (&done.record.array_job, &done.record.merge_job);
            context.say(&if done.was_queued {
                format!("Cancelled array {array} and merge {merge}; what is finished stays")
            } else {
                format!("Nothing of array {array} and merge {merge} was in the queue any more")
            });
            Ok(Exit::Done)
        }
    }
}

fn script(context: &Context, args: &JobArgs) -> Result<Exit, CommandError> {
    let chosen = chosen(context, args, "script")?;
    let made_by = concat!("updraft ", env!("CARGO_PKG_VERSION"));
    let script = |chosen: &Chosen| {
        submit_script(&chosen.job, chosen.shards, chosen.measured.as_ref(), made_by)
    };
    let text = chosen.as_ref().map(script).transpose()?;
    if context.json {
        let tasks = chosen.as_ref().map_or(0, |chosen| chosen.shards);
        context.print_json(&ScriptOutput { schema: SCRIPT_SCHEMA, script: text, tasks })?;
    } else if let Some(text) = text {
        context.emit(&text)?;
    }
    Ok(Exit::Done)
}

fn submit(context: &Context, args: &JobArgs) -> Result<Exit, CommandError> {
    let Some(chosen) = chosen(context, args, "submit")? else {
        if context.json {
            let (script, job) = (None, None);
            context.print_json(&SubmitOutput { schema: SUBMIT_SCHEMA, script, job })?;
        }
        return Ok(Exit::Done);
    };
    let done = cluster::submit(context, &chosen.job, chosen.shards, chosen.measured.as_ref())?;
    let job = &done.record;
    if context.json {
        let (script, job) = (Some(done.script.clone()), Some(job.clone()));
        context.print_json(&SubmitOutput { schema: SUBMIT_SCHEMA, script, job })?;
    }
    context.result(&done.script)?;
    context.say(&format!(
        "Submitted array {} ({}) and merge {}: {}",
        job.array_job,
        words::count(job.shards as usize, "task"),
        job.merge_job,
        crate::base::plain::Shown::shown(&*done.script)
    ));
    Ok(Exit::Done)
}
