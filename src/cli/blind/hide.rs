//! `updraft blind hide`: a flight with something hidden, or nothing, and its sealed truth.

use std::path::PathBuf;

use clap::builder::PossibleValuesParser;
use clap::{Args, ValueEnum};
use rand::TryRng as _;
use rand::rngs::SysRng;

use crate::base::plain::Shown as _;
use crate::blind::game::{Choice, Game};
use crate::blind::hide::{KINDS, ON_REQUEST, kind_of};
use crate::blind::scenario::FULL_SIDE;
use crate::blind::{AirClass, Base, Protocol};
use crate::cli::context::Context;
use crate::cli::exit::{CommandError, Exit};
use crate::cli::mission_args::parse_grid;
use crate::cli::simulate::{speed, updraft};
use crate::cli::words;
use crate::vehicle::library;
use crate::workflow::game::hide::{self, Wish};

/// Rows and columns that a game can have.
const SIDES: std::ops::RangeInclusive<u16> = 2..=15;

/// Protocol that is flown.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Which {
    /// The paper's ladder (template `calibration`)
    Paper,
    /// The counter-phase ladder (template `calibration-counterphase`), with staggered charge and
    /// motor warmth
    Enhanced,
}

/// Motion of the air.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum AirWord {
    /// Steady: nothing but --wind and --updraft
    Still,
    /// A calm dawn: 0.12 m/s
    Calm,
    /// 0.36 m/s
    Moderate,
    /// As in the paper's field flights: 0.5 m/s
    Field,
}

/// Arguments of `updraft blind hide`.
#[derive(Debug, Args)]
#[command(after_long_help = format!("Examples:
  updraft blind hide -o game                      # something, or nothing: nobody knows
  updraft gap game                                # what does the model lack?
  updraft blind reveal game                       # only now: what was hidden?
  updraft blind verify game                       # nobody has altered anything
  updraft blind hide -o game --vehicle phantom4 --air still --wind 4 --grid 4x4
  updraft blind hide -o game --effect rotor-inflow=20 --effect battery
  updraft blind hide -o game --nothing --force

Without --effect and --nothing, one effect of the library is drawn with its size, or, in a quarter of
all games, nothing. What is printed does not tell. The truth is sealed in game/sealed/ with a random
nonce, and its SHA-256 is printed: write it down, or send it to whoever must believe you. The flight
is in game/flight/, where `updraft gap game` finds it; nothing in it, and nothing that `gap` reads,
says what is hidden. To let somebody else play, give them the folder without sealed/.

With --seed the same flight is flown again (the nonce is another one); whoever knows the seed can
find out what it hides. Sizes can be a tenth of the smallest to three times the largest usual one.

What can be hidden, with usual sizes for --effect NAME=SIZE:
{}
Only where --effect names it:
{}", super::kinds_text(KINDS), super::kinds_text(ON_REQUEST)))]
pub(super) struct HideArgs {
    /// Folder of the game
    #[arg(short, long, value_name = "FOLDER", default_value = "game")]
    output: PathBuf,
    /// Known vehicle
    #[arg(long, value_name = "NAME", default_value = "airsim-generic-quad", value_parser = PossibleValuesParser::new(library::names()))]
    vehicle: String,
    /// Grid of the fleet, rows x columns, 2 to 15 each
    #[arg(long, value_name = "RxC", value_parser = grid)]
    grid: Option<(u16, u16)>,
    /// Protocol of the flight
    #[arg(long, value_enum, default_value_t = Which::Enhanced)]
    protocol: Which,
    /// How much the air moves
    #[arg(long, value_enum, default_value_t = AirWord::Moderate)]
    air: AirWord,
    /// Horizontal wind speed, m/s [default: drawn, 1 to 6; none with --air still]
    #[arg(long, value_name = "MPS", value_parser = speed, allow_negative_numbers = true)]
    wind: Option<f64>,
    /// Steady vertical air speed, m/s, up positive
    #[arg(long, value_name = "MPS", default_value_t = 0.0, value_parser = updraft, allow_hyphen_values = true)]
    updraft: f64,
    /// Effect to hide, with its size or a drawn one; can be repeated [default: drawn]
    #[arg(long = "effect", value_name = "NAME[=SIZE]", value_parser = effect)]
    effects: Vec<(String, Option<f64>)>,
    /// Hide nothing
    #[arg(long, conflicts_with = "effects")]
    nothing: bool,
    /// Seed for the flight and for what is drawn [default: a random one from the operating system]
    #[arg(long, value_name = "SEED")]
    seed: Option<u64>,
    /// Replace the game in the folder
    #[arg(long)]
    force: bool,
}

fn grid(text: &str) -> Result<(u16, u16), String> {
    let (rows, columns) = parse_grid(text)?;
    let side = |count: i64| u16::try_from(count).ok().filter(|count| SIDES.contains(count));
    match (side(rows), side(columns)) {
        (Some(rows), Some(columns)) => Ok((rows, columns)),
        _ => Err(format!(
            "a game has {} to {} rows and columns; {rows}x{columns} is not possible",
            SIDES.start(),
            SIDES.end()
        )),
    }
}

/// Parser of `--effect`.
fn effect(text: &str) -> Result<(String, Option<f64>), String> {
    let (name, size) = match text.split_once('=') {
        Some((name, size)) => (name.trim(), Some(size.trim())),
        None => (text.trim(), None),
    };
    kind_of(name).map_err(|error| error.to_string())?;
    let number = |size: &str| {
        let wrong = || format!("\"{size}\" is not a number; write it as NAME=SIZE: battery=0.7");
        size.parse::<f64>().ok().filter(|size| size.is_finite()).ok_or_else(wrong)
    };
    Ok((name.to_owned(), size.map(number).transpose()?))
}

/// Random bytes of the operating system: nobody can guess them, and no seed repeats them.
fn unguessable<const N: usize>() -> Result<[u8; N], CommandError> {
    let mut bytes = [0; N];
    SysRng.try_fill_bytes(&mut bytes).map_err(|error| {
        CommandError::Failed(format!("the operating system has no random numbers: {error}"))
    })?;
    Ok(bytes)
}

impl HideArgs {
    fn game(&self) -> Result<Game, CommandError> {
        let base = Base::of_vehicle(&self.vehicle).ok_or_else(|| {
            CommandError::Usage(format!("physics cannot be hidden in {}", self.vehicle))
        })?;
        let (rows, columns) = self.grid.unwrap_or((FULL_SIDE, FULL_SIDE));
        Ok(Game {
            seed: match self.seed {
                Some(seed) => seed,
                None => u64::from_be_bytes(unguessable()?),
            },
            protocol: match self.protocol {
                Which::Paper => Protocol::Paper,
                Which::Enhanced => Protocol::Enhanced,
            },
            air: match self.air {
                AirWord::Still => AirClass::Still,
                AirWord::Calm => AirClass::Calm,
                AirWord::Moderate => AirClass::Moderate,
                AirWord::Field => AirClass::Field,
            },
            base,
            rows,
            columns,
            wind_mps: self.wind,
            updraft_mps: self.updraft,
            hidden: match (self.nothing, self.effects.is_empty()) {
                (true, _) => Choice::Nothing,
                (false, true) => Choice::Drawn,
                (false, false) => Choice::These(self.effects.clone()),
            },
        })
    }
}

pub(super) fn run(context: &Context, args: &HideArgs) -> Result<Exit, CommandError> {
    let wish = Wish {
        folder: args.output.clone(),
        force: args.force,
        game: args.game()?,
        nonce: unguessable()?,
    };
    let ready = hide::run(context, &wish)?;
    let folder = words::shell(&args.output.shown().to_string());
    if context.json {
        context.print_json(&ready.game)?;
    } else {
        context.print(&format!(
            "SHA-256 of the sealed truth: {}\nNow: updraft gap {folder}\nThen: updraft blind reveal {folder}\n",
            ready.game.truth_sha256
        ))?;
    }
    context.result(&args.output)?;
    if ready.lost > 0 {
        context.warn(&format!(
            "{} could not be flown and gave no log",
            words::count(ready.lost, "drone")
        ));
    }
    Ok(ready.ending().into())
}
