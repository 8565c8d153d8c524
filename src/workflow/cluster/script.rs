//! Script that submits an array of shards and its merge. It is what a person would write by hand, to be read,
//! changed and kept.

use std::fmt::Write as _;

use super::job::Job;
use super::measure::Measured;
use super::record::ClusterRecord;
use crate::workflow::error::WorkflowError;
use crate::workflow::words::{self, shell};

/// Renders the script that submits a job of so many shards.
///
/// # Errors
///
/// If something cannot stand in a script.
pub fn submit_script(
    job: &Job,
    shards: u32,
    measured: Option<&Measured>,
    made_by: &str,
) -> Result<String, WorkflowError> {
    job.check()?;
    let folder = shell(&job.folder.to_string_lossy());
    let mut text = String::new();
    let mut line = |line: &str| {
        text.push_str(line);
        text.push('\n');
    };
    line("#!/bin/bash");
    line(
        "# Submits an array job and the job that puts its results together. Run it where sbatch is: bash FILE",
    );
    line(&format!("# {}", job.line()));
    let each = job.items.results.count().div_ceil(shards.max(1) as usize);
    line(&format!(
        "# {}, {} of up to {each}{}",
        words::count(job.items.results.count(), "item"),
        words::count(shards as usize, "task"),
        told(measured)
    ));
    line(&format!("# Made by {made_by}"));
    line("set -eu");
    line(&format!("folder={folder}"));
    line("mkdir -p \"$folder\"");
    line("");
    line("# Tasks other than all of them may be named: bash FILE 7-9,12");
    line(&format!("array=$(sbatch --parsable --array=\"${{1:-1-{shards}}}\" <<'ARRAY'"));
    line("#!/bin/bash");
    line(&options(job, job.command, true));
    line(
        "# exec: the scheduler's signals reach the program, which then ends with what is finished.",
    );
    let scratch = if job.items.has_scratch { " --scratch \"${TMPDIR:-/tmp}\"" } else { "" };
    line(&format!(
        "exec {}{scratch} --no-progress --shard \"$SLURM_ARRAY_TASK_ID/{shards}\"",
        job.exec()
    ));
    line("ARRAY");
    line(")");
    line("array=${array%%;*}");
    line("");
    line("# After any end of the array: it says what is missing, if anything is.");
    line("merge=$(sbatch --parsable --dependency=afterany:\"$array\" <<'MERGE'");
    line("#!/bin/bash");
    line(&options(job, &format!("{}-merge", job.command), false));
    line(&format!("exec {} --no-progress --no-fly", job.exec()));
    line("MERGE");
    line(")");
    line("merge=${merge%%;*}");
    line("");
    line("# For `updraft cluster status` and `cancel`.");
    line("cat > \"$folder/job.json.new\" <<RECORD");
    line(ClusterRecord::template(job, shards, made_by)?.trim_end());
    line("RECORD");
    line("mv \"$folder/job.json.new\" \"$folder/job.json\"");
    line("echo \"array $array, merge $merge; updraft cluster status $folder\"");
    Ok(text)
}

fn told(measured: Option<&Measured>) -> String {
    measured.map_or_else(String::new, |measured| {
        format!("; one item took {:.1} s on one processor", measured.item_s)
    })
}

/// Options of sbatch at the head of a script.
fn options(job: &Job, name: &str, is_array: bool) -> String {
    let resources = &job.resources;
    let mut text = format!("#SBATCH --job-name=updraft-{name}");
    let mut option = |name: &str, value: &str| {
        let _ = write!(text, "\n#SBATCH --{name}={value}");
    };
    option("nodes", "1");
    option("ntasks", "1");
    option("cpus-per-task", &resources.cpus.to_string());
    let given = [
        ("time", &resources.time),
        ("mem", &resources.mem),
        ("partition", &resources.partition),
        ("account", &resources.account),
    ];
    for (name, value) in given {
        if let Some(value) = value {
            option(name, value);
        }
    }
    option("chdir", &format!("\"{}\"", job.cwd.to_string_lossy()));
    // A percent sign begins a pattern there.
    let folder = job.folder.to_string_lossy().replace('%', "%%");
    let file = if is_array { "array-%A-%a.out" } else { "merge-%j.out" };
    option("output", &format!("\"{folder}/{file}\""));
    // A task that starts again writes on.
    option("open-mode", "append");
    text.push_str("\n#SBATCH --requeue");
    for more in &resources.more {
        let _ = write!(text, "\n#SBATCH {more}");
    }
    text
}
