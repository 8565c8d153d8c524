//! `updraft run --hide`: a flight with an effect hidden from the analysis, which names it before the
//! seal is opened.

use std::path::Path;

use clap::{Args, ValueEnum};

use super::context::Context;
use super::exit::{CommandError, Exit};
use super::mission_args::MissionArgs;
use super::words;
use crate::blind::scenario::FULL_SIDE;
use crate::blind::{AirClass, Base, Cell, Protocol};
use crate::workflow::hidden::hide;

/// Sides of the grid that are flown.
const SIDES: std::ops::RangeInclusive<i64> = 3..=15;

/// Which protocol is flown.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Which {
    /// The paper's ladder (template `calibration`)
    Paper,
    /// The counter-phase ladder (template `calibration-counterphase`), with staggered charge and
    /// motor warmth
    Enhanced,
}

/// How much the air moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Day {
    /// A calm dawn: 0.12 m/s
    Calm,
    /// 0.36 m/s
    Moderate,
    /// As in the paper's field flights: 0.5 m/s
    Field,
}

/// Options of `updraft run --hide`.
#[derive(Clone, Copy, Debug, Args)]
#[command(next_help_heading = "Hidden physics")]
pub(super) struct HideArgs {
    /// Fly a calibration whose drones have an effect, chosen by this seed, that the analysis does not
    /// know about. The truth is sealed, the search for missing physics gives its verdict, then the
    /// seal is opened. Accepts --grid NxN and --vehicle airsim-generic-quad or pixel
    #[arg(
        long,
        value_name = "SEED",
        conflicts_with_all = [
            "template", "updraft", "lose", "no_study", "direct", "calibration_updraft",
            "calibration_wind", "calibration_air", "wind", "wind_from", "specs", "truth", "seed",
            "full_logs", "effects", "drones", "spacing", "origin", "ground", "orientation", "speeds",
            "leg", "hover", "baseline", "height", "duration", "ramp", "set"
        ]
    )]
    hide: Option<u64>,
    /// Protocol of the flight with hidden physics [default: enhanced]
    #[arg(long, value_enum, requires = "hide")]
    protocol: Option<Which>,
    /// How much the air moves [default: moderate]
    #[arg(long, value_enum, requires = "hide")]
    day: Option<Day>,
}

impl HideArgs {
    /// The seed, when something is to be hidden.
    pub(super) fn seed(self) -> Option<u64> {
        self.hide
    }

    fn cell(self, seed: u64, mission: &MissionArgs) -> Result<Cell, CommandError> {
        let protocol = match self.protocol {
            Some(Which::Paper) => Protocol::Paper,
            Some(Which::Enhanced) | None => Protocol::Enhanced,
        };
        let air = match self.day {
            Some(Day::Calm) => AirClass::Calm,
            Some(Day::Moderate) | None => AirClass::Moderate,
            Some(Day::Field) => AirClass::Field,
        };
        let bases = [Base::Airsim, Base::Pixel];
        let base = match &mission.vehicle {
            None => Base::Airsim,
            Some(name) => {
                let of_name = |base: &Base| base.vehicle_name() == name;
                bases.into_iter().find(of_name).ok_or_else(|| {
                    let names = bases.map(Base::vehicle_name);
                    CommandError::Usage(format!(
                        "physics can be hidden in {}, not in {name}",
                        words::list(&names)
                    ))
                })?
            }
        };
        let side = match mission.grid {
            None => FULL_SIDE,
            Some((rows, columns)) if rows == columns && SIDES.contains(&rows) => {
                u16::try_from(rows).unwrap_or(FULL_SIDE)
            }
            Some((rows, columns)) => {
                return Err(CommandError::Usage(format!(
                    "with --hide the grid must be square, {}x{} to {}x{}; {rows}x{columns} is not",
                    SIDES.start(),
                    SIDES.start(),
                    SIDES.end(),
                    SIDES.end()
                )));
            }
        };
        let mut cell = Cell::hiding_one(seed, protocol, air, base);
        cell.side = side;
        Ok(cell)
    }
}

/// Runs it, and prints what came of it.
pub(super) fn run(
    context: &Context,
    folder: &Path,
    force: bool,
    args: HideArgs,
    mission: &MissionArgs,
    seed: u64,
) -> Result<Exit, CommandError> {
    let cell = args.cell(seed, mission)?;
    let hidden = hide(context, folder, force, &cell, seed)?;
    if context.json {
        context.print_json(&hidden.result)?;
    } else {
        context.print(&format!("{}\n", hidden.result.words.join("\n")))?;
    }
    context.result(&hidden.path)?;
    if hidden.lost > 0 {
        context.warn(&format!(
            "{} could not be flown and gave no log",
            words::count(hidden.lost, "drone")
        ));
    }
    Ok(hidden.ending().into())
}
