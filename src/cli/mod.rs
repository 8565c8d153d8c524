//! The command line: arguments, one file per subcommand, exit codes.

mod analyze;
mod check;
mod clock;
mod context;
mod effects;
mod effects_plot;
pub mod exit;
mod inspect;
mod leaning;
mod load;
mod mission_args;
mod physics;
mod plan;
mod progress;
mod run;
mod show_text;
mod simulate;
mod sweep;
mod timetable;
pub mod tools;
mod words;

use std::io::Write as _;
use std::process::ExitCode;

use clap::{Args, CommandFactory as _, Parser, Subcommand, ValueEnum};

use context::Context;
use exit::{CommandError, Exit};

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
  updraft check my-campaign                       also any .skyc or .skyb
  updraft simulate my-campaign
  updraft physics                                 the real firmware's simulator in our air
  updraft sweep                                   the paper's simulation study, with its figure 2
  updraft analyze my-campaign                     also a folder of logs, or one log
  updraft inspect my-campaign/show.skyc

Exit codes: 0 done, 1 failed, 2 wrong arguments or template, 3 done with losses,
4 a check failed, 5 nothing to work on or no result at all, 130 interrupted."
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
    /// One JSON object on standard output instead of tables
    #[arg(long, global = true)]
    json: bool,
    /// Say only what went wrong
    #[arg(short, long, global = true)]
    quiet: bool,
    /// When to use colours (NO_COLOR is honoured)
    #[arg(long, global = true, value_enum, default_value_t = ColorChoice::Auto)]
    color: ColorChoice,
    /// No progress bars
    #[arg(long, global = true, env = "UPDRAFT_NO_PROGRESS")]
    no_progress: bool,
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
    /// Do it all: plan, check, fly, collect, analyse, report
    Run(run::RunArgs),
    /// Make a campaign folder from a mission template
    Plan(plan::PlanArgs),
    /// Check whether a show is safe, whoever made it
    Check(check::CheckArgs),
    /// Fly a campaign in the embedded simulator
    Simulate(simulate::SimulateArgs),
    /// Fly the real firmware's simulator in our physics and our air
    Physics(physics::PhysicsArgs),
    /// Turn logs into calibration laws, a map of the air and a report
    Analyze(analyze::AnalyzeArgs),
    /// Fly the ladder in every wind and updraft of a study, and correlate what is found with the truth
    Sweep(sweep::SweepArgs),
    /// List the physics that can be flown, or explain one piece
    Effects(effects::EffectsArgs),
    /// Say what is in a file
    Inspect(inspect::InspectArgs),
    /// Print a shell's completion script
    #[command(hide = true)]
    Completions(tools::CompletionsArgs),
    /// Print the manual page
    #[command(hide = true)]
    Man,
    /// Print the JSON schema of a file format
    #[command(hide = true)]
    Schema(tools::SchemaArgs),
}

/// Runs the program; the only place where an exit code is made.
pub fn main() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => {
            let _ = error.print();
            return if error.use_stderr() { Exit::Usage.into() } else { Exit::Done.into() };
        }
    };
    let context = Context::new(&cli.global);
    match dispatch(&context, cli.command) {
        Ok(exit) => exit.into(),
        Err(error) => {
            if !matches!(error, CommandError::BrokenPipe) {
                let text = exit::with_reasons(&error);
                let prefix = if text.starts_with("error") { "" } else { "error: " };
                let _ = writeln!(std::io::stderr().lock(), "{prefix}{text}");
            }
            error.exit().into()
        }
    }
}

fn dispatch(context: &Context, command: Command) -> Result<Exit, CommandError> {
    match command {
        Command::Run(args) => run::run(context, &args),
        Command::Plan(args) => plan::run(context, &args),
        Command::Check(args) => check::run(context, &args),
        Command::Simulate(args) => simulate::run(context, &args),
        Command::Physics(args) => physics::run(context, &args),
        Command::Analyze(args) => analyze::run(context, &args),
        Command::Sweep(args) => sweep::run(context, &args),
        Command::Effects(args) => effects::run(context, &args),
        Command::Inspect(args) => inspect::run(context, &args),
        Command::Completions(args) => tools::completions(context, &args, Cli::command()),
        Command::Man => tools::man(context, Cli::command()),
        Command::Schema(args) => tools::schema(context, &args),
    }
}
