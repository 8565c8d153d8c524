//! Which work is shared out, and with which resources.

use std::path::PathBuf;

use clap::{Args, Subcommand};

use super::given::arguments;
use crate::cli::analyze::AnalyzeArgs;
use crate::cli::blind::SeriesArgs;
use crate::cli::context::Context;
use crate::cli::exit::CommandError;
use crate::cli::simulate::SimulateArgs;
use crate::cli::sweep::SweepArgs;
use crate::cli::words;
use crate::workflow::cluster::{
    Items, Job, Measured, Resources, Results, choose, cluster_folder, measure, most_tasks,
};

#[derive(Debug, Args)]
pub(super) struct JobArgs {
    #[command(subcommand)]
    work: Work,
}

#[derive(Debug, Subcommand)]
enum Work {
    /// A table of blind flights
    Blind(Of<SeriesArgs>),
    /// A study
    Sweep(Of<SweepArgs>),
    /// The simulation of a campaign, drone by drone
    Simulate(Of<SimulateArgs>),
    /// The analysis of many campaigns, each by itself
    Analyze(Of<AnalyzeArgs>),
}

/// A command's own arguments, and those of the cluster.
#[derive(Debug, Args)]
struct Of<T: Args> {
    #[command(flatten)]
    command: T,
    #[command(flatten)]
    cluster: OnCluster,
}

/// How the work is shared out.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Cluster")]
struct OnCluster {
    /// Number of tasks [default: one item is made and measured, and a task gets about ten minutes]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    shards: Option<u32>,
    /// Processors of each task
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=1024))]
    cpus: u16,
    /// Time limit of each task, as Slurm reads it: 90, 1:30:00, 2-0 [default: three times what was
    /// measured, or the partition's]
    #[arg(long, value_name = "TIME")]
    time: Option<String>,
    /// Memory of each task, as Slurm reads it: 2G
    #[arg(long, value_name = "SIZE")]
    mem: Option<String>,
    /// Partition
    #[arg(long, value_name = "NAME")]
    partition: Option<String>,
    /// Account that is charged
    #[arg(long, value_name = "NAME")]
    account: Option<String>,
    /// Another option of sbatch, as a line of a script has it: --sbatch=--qos=long, --sbatch='--comment="two words"';
    /// can be repeated
    #[arg(long, value_name = "OPTION", allow_hyphen_values = true)]
    sbatch: Vec<String>,
    /// Folder for the job's script, record and output [default: cluster/ in the folder of the results; for
    /// analyze, ./cluster]
    #[arg(long, value_name = "FOLDER")]
    job_folder: Option<PathBuf>,
}

/// A job with the number of its tasks.
pub(super) struct Chosen {
    pub(super) job: Job,
    pub(super) shards: u32,
    pub(super) measured: Option<Measured>,
}

/// The job that was asked for; `None`: all its results are there. `word`: `script` or `submit`.
pub(super) fn chosen(
    context: &Context,
    args: &JobArgs,
    word: &str,
) -> Result<Option<Chosen>, CommandError> {
    let (mut job, asked) = job(args, word)?;
    let most = most_tasks();
    if let Some(shards) = asked.shards.filter(|shards| *shards > most) {
        return Err(CommandError::Usage(format!(
            "{shards} tasks are more than an array here may have (MaxArraySize: up to {most}); a task may have \
             many items"
        )));
    }
    let missing = job.items.results.finished().iter().filter(|done| done.is_none()).count();
    if missing == 0 && job.items.results.count() > 0 {
        context.say(&format!("All results are there: run `{}` to put them together", job.line()));
        return Ok(None);
    }
    if let Some(asked) = asked.shards {
        let count = u32::try_from(job.items.results.count()).unwrap_or(u32::MAX).max(1);
        let shards = asked.min(count);
        if shards < asked {
            context.say(&format!("There are {count} items: {count} tasks, not {asked}"));
        }
        return Ok(Some(Chosen { job, shards, measured: None }));
    }
    context.say(&format!("Making one {} to see how long it takes ...", job.items.name));
    let Some(measured) = measure(context, &job)? else { return Ok(None) };
    let (shards, limit_s) = choose(&measured, asked.cpus, most);
    context.say(&format!(
        "It took {:.1} s; {} missing, shared out to {} of about {:.0} min",
        measured.item_s,
        measured.missing,
        words::count(shards as usize, "task"),
        (measured.missing as f64 * measured.item_s
            / f64::from(shards)
            / f64::from(asked.cpus)
            / 60.0)
            .max(1.0),
    ));
    job.resources.time.get_or_insert_with(|| minutes(limit_s));
    Ok(Some(Chosen { job, shards, measured: Some(measured) }))
}

/// Command line as people write it.
fn line(command: &str, given: &[String]) -> String {
    let words = given.iter().map(|word| words::shell(word));
    ["updraft".to_owned(), command.to_owned()]
        .into_iter()
        .chain(words)
        .collect::<Vec<_>>()
        .join(" ")
}

/// A time limit in whole minutes.
fn minutes(limit_s: u64) -> String {
    let minutes = limit_s.div_ceil(60);
    format!("{}:{:02}:00", minutes / 60, minutes % 60)
}

fn job<'a>(args_of: &'a JobArgs, word: &str) -> Result<(Job, &'a OnCluster), CommandError> {
    let (command, cluster) = match &args_of.work {
        Work::Blind(of) => ("blind", &of.cluster),
        Work::Sweep(of) => ("sweep", &of.cluster),
        Work::Simulate(of) => ("simulate", &of.cluster),
        Work::Analyze(of) => ("analyze", &of.cluster),
    };
    let mut given = arguments::<OnCluster>(word, command)?;
    if let Some(shard) =
        given.iter().find(|word| word.starts_with("--shard=") || *word == "--no-fly")
    {
        return Err(CommandError::Usage(format!(
            "{shard} is given by the script itself: leave it away"
        )));
    }
    let cwd = std::env::current_dir().map_err(|error| {
        CommandError::Failed(format!("failed to find the current folder: {error}"))
    })?;
    let program = std::env::current_exe()
        .map_err(|error| CommandError::Failed(format!("failed to find this program: {error}")))?;
    let mut args = vec![command.to_owned()];
    let named = |name: &'static str, folder: PathBuf, files: Vec<PathBuf>| Items {
        name,
        folder,
        results: Results::Named { files: files.iter().map(|file| cwd.join(file)).collect() },
        product: None,
        record: None,
        has_scratch: false,
    };
    let items = match &args_of.work {
        Work::Blind(of) => of.command.items(&cwd, line(command, &given))?,
        Work::Sweep(of) => of.command.items(&cwd)?,
        Work::Simulate(of) => {
            let (folder, files) = of.command.results()?;
            named("log", folder, files)
        }
        Work::Analyze(of) => {
            if !given.iter().any(|word| word == "--each") {
                given.push("--each".to_owned());
            }
            named("analysis", PathBuf::new(), of.command.results()?)
        }
    };
    let default = || cluster_folder(&items.folder);
    let job_folder = cwd.join(cluster.job_folder.clone().unwrap_or_else(default));
    args.append(&mut given);
    let job = Job {
        command,
        items,
        program,
        args,
        cwd,
        folder: job_folder,
        resources: Resources {
            cpus: cluster.cpus,
            time: cluster.time.clone(),
            mem: cluster.mem.clone(),
            partition: cluster.partition.clone(),
            account: cluster.account.clone(),
            more: cluster.sbatch.clone(),
        },
    };
    job.check()?;
    job.fits()?;
    Ok((job, cluster))
}
