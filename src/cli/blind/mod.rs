//! `updraft blind`: flights that hide physics, what the search makes of them, and then the truth; in a
//! series for a table, or one as a game for strangers.

mod hide;
mod reveal;
mod verify;

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand, ValueEnum};

use crate::base::plain::Shown as _;
use crate::blind::hide::HiddenKind;
use crate::blind::render::{Style, render};
use crate::blind::series::{Place, Settings};
use crate::blind::tables::{FOREIGN_KINDS, KINDS, ON_REQUEST};
use crate::blind::{AirClass, Base, Protocol, Worlds};
use crate::cli::context::Context;
use crate::cli::exit::{CommandError, Exit};
use crate::cli::shard_args::{self, ShardArgs};
use crate::cli::words;
use crate::workflow::blind::{self, RESULT_FILE, Ran, record};
use crate::workflow::cluster::{Items, Results};

/// The word for nothing.
const NONE: &str = "none";

/// Which protocols are flown.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Which {
    /// The paper's ladder (template `calibration`)
    Paper,
    /// The counter-phase ladder (template `calibration-counterphase`), with staggered charge and
    /// motor warmth
    Enhanced,
    /// Each equally often
    Both,
}

/// Arguments of `updraft blind`.
#[derive(Debug, Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
#[command(after_long_help = format!("Examples:
  updraft blind --seed 7 --tuning --flights 20 --grid 3
  updraft blind --seed 20270101 --flights 3000 -o blind
  updraft blind --seed 20270102 --protocol paper --effects none --air field --flights 200
  updraft blind --seed 20270103 --effects battery,rotor-inflow+battery --base airsim --keep
  updraft blind --seed 20270101 --flights 3000 -o blind --shard 3/10
  updraft blind hide -o game                      # a game: then updraft gap game, blind reveal game

Each flight is drawn from the seed, its truth is sealed (the SHA-256 is published before the flight),
and it is flown with physics that the vehicle's file does not have. The search sees template,
vehicle, plan and logs, as for any campaign. Only when its verdict is on disk is the seal opened and
the two are compared. Finished flights are kept in flights/: running the same command again resumes
an interrupted run. The table is in table.json and table.md. Method and metrics: docs/blind.md.

What can be hidden:
{}
Only where --effects names it:
{}

In foreign worlds (--worlds foreign), where the base airsim is a thrust law and pixel one of blades:
{}", kinds_text(KINDS), kinds_text(ON_REQUEST), foreign_kinds_text()))]
pub(super) struct BlindArgs {
    #[command(subcommand)]
    command: Option<BlindCommand>,
    #[command(flatten)]
    series: SeriesArgs,
}

/// Arguments of a series of blind flights.
#[derive(Debug, Args)]
pub(super) struct SeriesArgs {
    /// Whose physics to fly with, separated by commas
    #[arg(long, value_enum, value_delimiter = ',', default_value = "home")]
    worlds: Vec<WorldsWord>,
    /// Which protocol to fly
    #[arg(long, value_enum, default_value_t = Which::Both)]
    protocol: Which,
    /// Number of flights; the cells (protocol, air, vehicle, hidden effects) take turns
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    flights: u32,
    /// Seed for all flights: 1000000 or more for scoring; below that, with --tuning, for trying
    /// things out
    #[arg(long, value_name = "SEED", required = true)]
    seed: Option<u64>,
    /// What to hide, separated by commas; NAME+NAME hides both together, `none` hides nothing
    /// [default: each by itself, and nothing six times as often]
    #[arg(long, value_name = "NAMES", value_parser = hidden_sets)]
    effects: Option<Sets>,
    /// Also hide pairs and triples
    #[arg(long)]
    pairs: bool,
    /// How much the air moves, separated by commas
    #[arg(long, value_enum, value_delimiter = ',', default_value = "calm,moderate,field")]
    air: Vec<AirWord>,
    /// Known vehicles, separated by commas
    #[arg(long, value_enum, value_delimiter = ',', default_value = "airsim,inflow,pixel")]
    base: Vec<BaseWord>,
    /// Drones along each side of the grid, 3 to 15: fewer take less time and show less
    #[arg(long, value_name = "N", default_value_t = 7, value_parser = clap::value_parser!(u16).range(3..=15))]
    grid: u16,
    /// Accept a seed reserved for tuning; the table says so
    #[arg(long)]
    tuning: bool,
    /// Folder for the finished flights and the table
    #[arg(short, long, value_name = "FOLDER", default_value = "blind")]
    output: PathBuf,
    /// Keep each flight with its logs, seal and verdict in work/
    #[arg(long)]
    keep: bool,
    /// Text for the table's head, such as date and commit
    #[arg(long, value_name = "TEXT")]
    note: Option<String>,
    /// Flights at the same time [default: one per core]
    #[arg(short, long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
    /// Folder to fly in, best on a disk of this machine alone [default: work/ in the table's folder]
    #[arg(long, value_name = "FOLDER")]
    scratch: Option<PathBuf>,
    #[command(flatten)]
    sharing: ShardArgs,
}

#[derive(Debug, Subcommand)]
enum BlindCommand {
    /// Fly a game: something is hidden, or nothing, and its truth is sealed
    Hide(hide::HideArgs),
    /// Open a game's seal, now that there is a verdict
    Reveal(reveal::RevealArgs),
    /// Check that nobody has altered a game
    Verify(verify::VerifyArgs),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum WorldsWord {
    /// The simulator's own, with the hidden effects added
    Home,
    /// A second plant, written from other equations, with other air, noise and faults
    Foreign,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum AirWord {
    /// A calm dawn: 0.12 m/s
    Calm,
    /// 0.36 m/s
    Moderate,
    /// As in the paper's field flights: 0.5 m/s
    Field,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum BaseWord {
    /// AirSim's law
    Airsim,
    /// AirSim's law with rotor inflow
    Inflow,
    /// A show drone like pixel
    Pixel,
}

/// What is hidden, set by set.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Sets(Vec<Vec<String>>);

/// Parser of `--effects`.
fn hidden_sets(text: &str) -> Result<Sets, String> {
    let mut sets = Vec::new();
    for part in text.split(',').map(str::trim) {
        let names: Vec<String> = match part {
            NONE => Vec::new(),
            part => part.split('+').map(|name| name.trim().to_owned()).collect(),
        };
        for name in &names {
            if crate::blind::worlds::kind_of(name).is_none() {
                crate::blind::hide::kind_of(name).map_err(|error| error.to_string())?;
            }
        }
        sets.push(names);
    }
    Ok(Sets(sets))
}

fn kinds_text(kinds: &[HiddenKind]) -> String {
    use std::fmt::Write as _;
    kinds.iter().fold(String::new(), |mut text, kind| {
        let library = if kind.foreign { "  (in no library)" } else { "" };
        let (low, high) = kind.range;
        let _ = writeln!(text, "  {:<24} {low} to {high} {}{library}", kind.name, kind.unit);
        text
    })
}

fn foreign_kinds_text() -> String {
    use std::fmt::Write as _;
    FOREIGN_KINDS.iter().fold(String::new(), |mut text, kind| {
        let library = if kind.like.is_none() { "  (in no library)" } else { "" };
        let what = foreign_worlds::hidden::find(kind.name).map_or("", |found| found.what);
        let _ = writeln!(text, "  {:<20} {what}{library}", kind.name);
        text
    })
}

impl SeriesArgs {
    /// Flights of the table, as a cluster makes them, after a look at the arguments.
    pub(super) fn items(&self, cwd: &Path, command: String) -> Result<Items, CommandError> {
        let settings = self.settings();
        settings.check_seed()?;
        settings.cells()?;
        Ok(Items {
            name: "blind flight",
            results: Results::Numbered {
                folder: cwd.join(&self.output).join("flights"),
                digits: 5,
                suffix: ".json".to_owned(),
                count: settings.flights,
                per_folder: None,
            },
            product: Some(self.output.join(RESULT_FILE)),
            record: Some(record(&settings, command)?),
            has_scratch: self.scratch.is_none(),
            folder: self.output.clone(),
        })
    }

    fn settings(&self) -> Settings {
        let protocols = match self.protocol {
            Which::Paper => vec![Protocol::Paper],
            Which::Enhanced => vec![Protocol::Enhanced],
            Which::Both => vec![Protocol::Paper, Protocol::Enhanced],
        };
        let airs = self.air.iter().map(|air| match air {
            AirWord::Calm => AirClass::Calm,
            AirWord::Moderate => AirClass::Moderate,
            AirWord::Field => AirClass::Field,
        });
        let bases = self.base.iter().map(|base| match base {
            BaseWord::Airsim => Base::Airsim,
            BaseWord::Inflow => Base::Inflow,
            BaseWord::Pixel => Base::Pixel,
        });
        let mut worlds: Vec<Worlds> = self
            .worlds
            .iter()
            .map(|worlds| match worlds {
                WorldsWord::Home => Worlds::Home,
                WorldsWord::Foreign => Worlds::Foreign,
            })
            .collect();
        worlds.sort_unstable();
        worlds.dedup();
        let each = || blind::one_each(&worlds);
        let mut hidden = self.effects.as_ref().map_or_else(each, |sets| sets.0.clone());
        if self.pairs {
            hidden.extend(blind::several());
        }
        Settings {
            worlds,
            protocols,
            airs: airs.collect(),
            bases: bases.collect(),
            hidden,
            flights: self.flights as usize,
            seed: self.seed.unwrap_or_default(),
            side: self.grid,
            tuning: self.tuning,
        }
    }
}

pub(super) fn run(context: &Context, args: &BlindArgs) -> Result<Exit, CommandError> {
    match &args.command {
        Some(BlindCommand::Hide(args)) => return hide::run(context, args),
        Some(BlindCommand::Reveal(args)) => return reveal::run(context, args),
        Some(BlindCommand::Verify(args)) => return verify::run(context, args),
        None => {}
    }
    let args = &args.series;
    let (folder, keep, scratch) = (args.output.clone(), args.keep, args.scratch.clone());
    let place = Place { folder, keep, scratch };
    let (note, share) = (args.note.as_deref(), args.sharing.share());
    let scored = match blind::run(context, &args.settings(), &place, share, args.jobs, note)? {
        Ran::Table(scored) => scored,
        Ran::Shard(done) => return shard_args::report(context, &done, "blind flight"),
    };
    if context.json {
        context.print_json(&scored.table)?;
    } else {
        context.print(&render(&scored.table, Style::Text, note))?;
    }
    context.result(&scored.markdown)?;
    context.say(&format!(
        "{} scored -> {}",
        words::count(scored.flights, "blind flight"),
        scored.markdown.shown()
    ));
    Ok(scored.ending().into())
}
