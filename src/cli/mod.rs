//! The command line: arguments, one file per subcommand, exit codes.

mod analyze;
mod analyze_each;
mod archive;
mod basemap_args;
mod blind;
mod check;
mod cluster;
mod compare;
mod context;
mod effects;
mod effects_plot;
pub mod exit;
mod expected_words;
mod files_args;
mod fleet;
mod fly;
mod gap;
mod help_text;
mod hidden;
mod inspect;
mod live;
mod live_args;
mod logs;
mod manual;
mod mission_args;
mod origin;
mod paper_args;
mod physics;
mod plan;
mod progress;
mod run;
mod sensitivity;
mod shard_args;
mod show_text;
mod signals;
mod simulate;
mod sweep;
mod timetable;
pub mod tools;
mod words;
mod zero;

use std::process::ExitCode;

use clap::builder::FalseyValueParser;
use clap::{Args, CommandFactory as _, Parser, Subcommand, ValueEnum};
use serde::Serialize;

use context::{Context, complain};
use exit::{CommandError, Exit, exit_of};

use crate::base::plain::{for_terminal, plain};
#[cfg(debug_assertions)]
use crate::workflow::clock::SharedClock;

/// Measure the vertical motion of the air with a swarm of show drones.
///
/// updraft plans calibration and measurement flights as Skybrush shows, checks them, flies them in
/// its embedded simulator, and turns the drones' own logs into a map of the vertical air speed.
#[derive(Debug, Parser)]
#[command(
    name = "updraft",
    version,
    max_term_width = 100,
    after_long_help = "Examples:
  updraft run                                     the paper's campaign, simulated, with its report
  updraft plan templates/calibration.toml --grid 7x7 --spacing 7 -o my-campaign
  updraft check my-campaign                       or any .skyc or .skyb
  updraft simulate my-campaign
  updraft physics                                 the real firmware's simulator in our air
  updraft sweep                                   the paper's simulation study, with its figure 2
  updraft analyze my-campaign                     or a folder of logs, or one log
  updraft gap my-campaign                         what physics the model lacks
  updraft compare monday tuesday                  what changed: drones, fleet, air
  updraft archive seasons/                        all campaigns below as one Parquet dataset
  updraft inspect my-campaign/show.skyc

Exit codes: 0 done; 1 a file or folder does not exist, or cannot be read or written; 2 wrong
arguments or template, or a file that is broken or of the wrong kind; 3 done with losses; 4 a check
failed; 5 nothing to work on (a folder without a plan or logs), or no result at all; 6 another
updraft is writing into the same folder; 130 interrupted."
)]
pub struct Cli {
    #[command(flatten)]
    global: Global,
    #[command(subcommand)]
    command: Command,
}

/// Options that every command takes.
#[derive(Clone, Debug, Args)]
pub struct Global {
    /// Print one JSON object on standard output instead of tables
    ///
    /// If the command fails, standard output stays empty and the last line of standard error is one
    /// JSON object with the schema updraft.error/1; warnings are plain lines there.
    #[arg(long, global = true)]
    json: bool,
    /// Print only warnings and errors, and the path of the result
    ///
    /// Standard error then has only warnings and errors. Standard output has one line, the folder
    /// (plan) or the page (analyze, run, sweep), or nothing (check, simulate, physics). Output that
    /// is the purpose of a command is printed as usual: --json, inspect, effects, completions, man,
    /// schema.
    #[arg(short, long, global = true)]
    quiet: bool,
    /// When to use colours (NO_COLOR is respected)
    #[arg(long, global = true, value_enum, default_value_t = ColorChoice::Auto)]
    color: ColorChoice,
    /// Show no progress bars
    #[arg(
        long,
        global = true,
        env = "UPDRAFT_NO_PROGRESS",
        action = clap::ArgAction::SetTrue,
        value_parser = FalseyValueParser::new(),
        hide_env_values = true
    )]
    no_progress: bool,
    /// For tests: the clock that all programs of a test share
    #[cfg(debug_assertions)]
    #[arg(long, global = true, hide = true, value_name = "UNIX_S:FILE")]
    shared_clock: Option<SharedClock>,
}

/// When to use colours.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ColorChoice {
    /// On a terminal
    Auto,
    /// Always
    Always,
    /// Never
    Never,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Do everything: plan, check, fly, collect, analyse, report
    Run(run::RunArgs),
    /// Make a campaign folder from a mission template
    Plan(plan::PlanArgs),
    /// Check whether a show is safe, whoever made it
    Check(check::CheckArgs),
    /// Fly a campaign in the embedded simulator
    Simulate(simulate::SimulateArgs),
    /// Fly a campaign: upload, preflight, start, watch, logs
    Fly(fly::FlyArgs),
    /// Run the steps of a flight one by one
    Fleet(fleet::FleetArgs),
    /// Show a flown or simulated flight in a browser, from its logs
    Live(live::LiveCommandArgs),
    /// List, download, verify and import logs
    Logs(logs::LogsArgs),
    /// Provide the physics and the air for the real firmware's simulator
    Physics(physics::PhysicsArgs),
    /// Turn logs into calibration laws, a map of the air and a report
    Analyze(analyze::AnalyzeArgs),
    /// Put campaigns side by side: laws, drones that changed, maps, scales of the air
    Compare(compare::CompareArgs),
    /// Gather campaigns into one Parquet dataset, for queries over a season
    Archive(archive::ArchiveArgs),
    /// Fly the ladder in every wind and updraft of a study, and correlate the results with the truth
    Sweep(sweep::SweepArgs),
    /// Find where simulation and measurement disagree, name the missing physics, and add it
    Gap(gap::GapArgs),
    /// Test the search for missing physics on flights with hidden effects
    Blind(blind::BlindArgs),
    /// Share work out to a cluster (Slurm): script, submit, status, cancel
    Cluster(cluster::ClusterArgs),
    /// List the physical effects that can be flown, or explain one
    Effects(effects::EffectsArgs),
    /// Show what is in a file
    Inspect(inspect::InspectArgs),
    /// Print a shell's completion script
    Completions(tools::CompletionsArgs),
    /// Print the manual page of a command, or write those of all
    Man(manual::ManArgs),
    /// Print the JSON schema of a file format
    Schema(tools::SchemaArgs),
}

/// Runs the program; the only place where an exit code is made.
pub fn main() -> ExitCode {
    let (cli, name) = match help_text::parse(std::env::args_os()) {
        Ok(parsed) => parsed,
        Err(error) => return answer(&error),
    };
    use_threads_of_job();
    let context = Context::new(&cli.global);
    match dispatch(&context, cli.command) {
        Ok(exit) => {
            if exit == Exit::Losses {
                context.account_for_losses();
            }
            if context.json { ending_as_json(&context, &name, exit) } else { exit.into() }
        }
        Err(error) => {
            if exit_of(&error) != Exit::Done {
                let text = exit::with_reasons(&error);
                let prefix = if text.starts_with("error") { "" } else { "error: " };
                if context.json {
                    complain(&exit::as_json(&text, exit_of(&error)));
                } else {
                    complain(&format!("{prefix}{text}"));
                }
            }
            exit_of(&error).into()
        }
    }
}

/// Prints the help that was asked for, or what is wrong with the command line.
fn answer(error: &clap::Error) -> ExitCode {
    if !error.use_stderr() {
        return match context::emit_help(&error.render()) {
            Ok(()) => Exit::Done.into(),
            Err(error) if exit::is_end_of_pipe(&error) => Exit::Done.into(),
            Err(_) => Exit::Failed.into(),
        };
    }
    let error = quoting_plainly(error);
    if std::env::args_os().any(|word| word == "--json") {
        let text = help_text::printed(&error.to_string());
        complain(&exit::as_json(text.trim_end(), Exit::Usage));
    } else {
        let _ = error.print();
    }
    Exit::Usage.into()
}

/// What `--json` prints where a command has no numbers or names to tell.
#[derive(Serialize, schemars::JsonSchema)]
struct DoneOutput<'a> {
    /// Format name and version: `updraft.done/1`.
    schema: &'static str,
    /// Words of the command: `fleet restore`.
    command: &'a str,
    /// Exit code: 0, or 3 where something was lost; warnings on standard error say what.
    exit: u8,
}

/// Keeps the promise of `--json`: one object on standard output if the command has done its work; else an error as the last
/// line of standard error.
fn ending_as_json(context: &Context, command: &str, exit: Exit) -> ExitCode {
    let error = match exit {
        Exit::Done | Exit::Losses => {
            if !context.has_printed_json() {
                let output = DoneOutput { schema: "updraft.done/1", command, exit: exit as u8 };
                if let Err(error) = context.print_json(&output) {
                    return exit_of(&error).into();
                }
            }
            return exit.into();
        }
        Exit::Unsafe if context.has_printed_json() => {
            "a check failed, or somebody answered no: the object on standard output says which"
        }
        Exit::Unsafe => "a check failed, or somebody answered no: nothing was started",
        Exit::Nothing => "there is no result; the lines above say why",
        _ => "the command failed; the lines above say why",
    };
    complain(&exit::as_json(error, exit));
    exit.into()
}

/// Inside of a Slurm job that asked for a number of processors, so many threads are used: where jobs are not
/// bound to theirs, the machine has more.
fn use_threads_of_job() {
    let variable = |name: &str| std::env::var(name).ok();
    let is_job = variable("SLURM_JOB_ID").is_some() && variable("RAYON_NUM_THREADS").is_none();
    let count = variable("SLURM_CPUS_PER_TASK").and_then(|text| text.parse().ok());
    if let Some(count) = count.filter(|count| is_job && (1..=4096).contains(count)) {
        // Only fails if threads were started already.
        let _ = rayon::ThreadPoolBuilder::new().num_threads(count).build_global();
    }
}

/// An error of clap in which the words of the command line are plain text.
fn quoting_plainly(error: &clap::Error) -> clap::Error {
    let given = std::env::args_os().map(|word| plain(&word.to_string_lossy()).into_owned());
    // Whether it is an error may hang on such a character.
    let anyhow = || clap::Error::raw(error.kind(), for_terminal(&error.to_string(), false));
    help_text::parse(given).err().unwrap_or_else(anyhow)
}

fn dispatch(context: &Context, command: Command) -> Result<Exit, CommandError> {
    match command {
        Command::Run(args) => run::run(context, &args),
        Command::Plan(args) => plan::run(context, &args),
        Command::Check(args) => check::run(context, &args),
        Command::Simulate(args) => simulate::run(context, &args),
        Command::Fly(args) => fly::run(context, &args),
        Command::Fleet(args) => fleet::run(context, &args),
        Command::Live(args) => live::run(context, &args),
        Command::Logs(args) => logs::run(context, &args),
        Command::Physics(args) => physics::run(context, &args),
        Command::Analyze(args) => analyze::run(context, &args),
        Command::Compare(args) => compare::run(context, &args),
        Command::Archive(args) => archive::run(context, &args),
        Command::Sweep(args) => sweep::run(context, &args),
        Command::Gap(args) => gap::run(context, &args),
        Command::Blind(args) => blind::run(context, &args),
        Command::Cluster(args) => cluster::run(context, &args),
        Command::Effects(args) => effects::run(context, &args),
        Command::Inspect(args) => inspect::run(context, &args),
        Command::Completions(args) => tools::completions(context, &args, Cli::command()),
        Command::Man(args) => manual::run(context, &args, Cli::command()),
        Command::Schema(args) => tools::schema(context, &args),
    }
}
