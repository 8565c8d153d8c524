//! `updraft gap next`: the flight that would tell what the verdict left open.

use std::path::PathBuf;

use clap::Args;

use crate::base::plain::Shown as _;
use crate::cli::context::Context;
use crate::cli::exit::{CommandError, Exit};
use crate::cli::words;
use crate::gap::next::result::Asked;
use crate::report::next_terminal;
use crate::workflow::gap::next::{self, Proposed, Wish};

/// Arguments of `updraft gap next`.
#[derive(Debug, Args)]
#[command(after_long_help = "Examples:
  updraft gap next my-campaign
  updraft gap next my-campaign --longest 500 --no-verify
  updraft plan my-campaign/gap/next.toml -o second-flight

Reads the open questions from the campaign's gap/verdict.json: classes that the flight cannot
separate, unknowns, and effects that matter at their usual size but were too small to see. From the
elements of a flight (counter-phase, shuffled and repeated rungs, horizontal legs, hovers at two
heights, a low hover, staggered charge, payload) it composes the shortest flight that answers them
in the noise that was found, and simulates it with each answer in turn. Exit code 5: there is no
verdict, nothing to ask, or no flight of these elements that would tell.")]
pub(super) struct NextArgs {
    /// Campaign folder that `updraft gap` has analysed
    campaign: PathBuf,
    /// Folder of the comparison [default: CAMPAIGN/gap]
    #[arg(long, value_name = "FOLDER")]
    gap: Option<PathBuf>,
    /// Fisher z that every question should reach: 5 is found nearly always
    #[arg(long, value_name = "Z", default_value_t = 5.0, value_parser = z)]
    z: f64,
    /// Longest flight, s [default: the vehicle's endurance minus its reserve]
    #[arg(long, value_name = "S", value_parser = seconds)]
    longest: Option<f64>,
    /// Flight of the campaign [default: its calibration]
    #[arg(long, value_name = "NAME")]
    flight: Option<String>,
    /// Expected horizontal wind, m/s
    #[arg(long, value_name = "MPS", default_value_t = 3.0, value_parser = wind)]
    wind: f64,
    /// Do not simulate the proposed flight
    #[arg(long)]
    no_verify: bool,
    /// Seed for the simulated flights
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Folder for next.toml and next.json [default: that of the comparison]
    #[arg(short, long, value_name = "FOLDER")]
    output: Option<PathBuf>,
}

fn number(text: &str, low: f64, high: f64) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if (low..=high).contains(&value) => Ok(value),
        _ => Err(format!("a number from {low} to {high}")),
    }
}

fn z(text: &str) -> Result<f64, String> {
    number(text, 0.5, 100.0)
}

fn seconds(text: &str) -> Result<f64, String> {
    number(text, 60.0, 36_000.0)
}

fn wind(text: &str) -> Result<f64, String> {
    number(text, 0.0, 20.0)
}

pub(super) fn run(context: &Context, args: &NextArgs) -> Result<Exit, CommandError> {
    let proposed = next::run(
        context,
        &Wish {
            campaign: args.campaign.clone(),
            gap: args.gap.clone(),
            z: args.z,
            longest_s: args.longest,
            flight: args.flight.clone(),
            wind_mps: args.wind,
            verify: !args.no_verify,
            seed: args.seed,
            output: args.output.clone(),
        },
    )?;
    let Proposed { next, path } = &proposed;
    if context.json {
        context.print_json(next)?;
    } else {
        context.print(&next_terminal::text(next))?;
    }
    context.result(path)?;
    context.say(&format!("{} -> {}", words::count(next.questions.len(), "question"), path.shown()));
    let is_told_ever = |asked: &Asked| asked.reached || asked.flights_needed.is_some();
    Ok(if next.questions.iter().any(is_told_ever) { Exit::Done } else { Exit::Nothing })
}
