//! `updraft compare`: campaigns side by side, or beside a mast.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};

use super::context::Context;
use super::exit::{CommandError, Exit};
use super::paper_args::PaperArgs;
use crate::base::plain::Shown as _;
use crate::compare::LawChoice;
use crate::report;
use crate::workflow::clock::Stopwatch;
use crate::workflow::compare::{Request, run as compare};
use crate::workflow::mast;
use crate::workflow::paper::Shown;

/// Width of the terminal summary, columns: at most, and at least.
const WIDTH: usize = 100;
const MIN_WIDTH: usize = 60;

/// Arguments of `updraft compare`.
#[derive(Debug, Args)]
#[command(after_long_help = "Examples:
  updraft compare monday tuesday                       # campaigns that were analysed
  updraft compare monday tuesday wednesday -o week     # each against the first, with a report
  updraft compare old/analysis.json new/analysis.json --law linear
  updraft compare monday tuesday --json | jq '.laws[].drones[] | select(.is_changed)'
  updraft compare monday --mast tower.csv -o beside    # its map beside an instrument (docs/mast.md)
  updraft compare monday --mast tower.nc               # of several heights, the nearest to the drones

Says whether the fleet as a whole changed (air density, battery, temperature, air during a calibration),
and which drones changed by more than the fleet: a weak motor, a propeller, weight. Drones are known by
their system ids where the campaigns have them, else by their slots. The tests of all drones of a pair
are corrected together (Holm): the probability that any is named wrongly is at most 5 %. Maps are
compared by their means, and by place where the grids agree, scales of the air by their intervals
(docs/compare.md).

Exit code 3: done, but something that both have could not be compared, and is named. Exit code 5: the
campaigns have no flight in common, or nothing can be compared.")]
pub(super) struct CompareArgs {
    /// Analysed campaigns, folders with an analysis.json, or such files; the first is the reference
    #[arg(value_name = "CAMPAIGN", required = true, num_args = 1..)]
    campaigns: Vec<PathBuf>,
    /// Record of a mast to compare one campaign with: a table with the columns utc and w, NetCDF, or a description of
    /// one of both (TOML; docs/mast.md). Means over minutes are compared as such
    #[arg(long, value_name = "FILE", conflicts_with = "law")]
    mast: Option<PathBuf>,
    /// Folder for compare.json (mast.json) and report/index.html [default: nothing is written]
    #[arg(short, long, value_name = "FOLDER")]
    output: Option<PathBuf>,
    /// Which law is compared
    #[arg(long, value_enum, default_value_t = Law::Preferred)]
    law: Law,
    #[command(flatten)]
    paper: PaperArgs,
}

/// Which law is compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Law {
    /// The one that each flight's windows prefer
    Preferred,
    /// The paper's line
    Linear,
    /// The paper's signed quadratic
    SignedQuadratic,
}

pub(super) fn run(context: &Context, args: &CompareArgs) -> Result<Exit, CommandError> {
    let watch = Stopwatch::start(context);
    match (&args.mast, args.campaigns.as_slice()) {
        (Some(mast), [campaign]) => return beside(context, args, campaign, mast),
        (Some(_), _) => {
            return Err(CommandError::Usage("--mast takes one campaign".to_owned()));
        }
        (None, [_]) => {
            return Err(CommandError::Usage(
                "give two campaigns or more, or one with --mast FILE".to_owned(),
            ));
        }
        (None, _) => {}
    }
    let request = Request {
        paths: args.campaigns.clone(),
        law: match args.law {
            Law::Preferred => LawChoice::Preferred,
            Law::Linear => LawChoice::Linear,
            Law::SignedQuadratic => LawChoice::SignedQuadratic,
        },
        output: args.output.clone(),
    };
    let paper = args.paper.wish()?;
    let compared = compare(context, &request)?;
    if context.json {
        context.print_json(&compared.comparison)?;
    } else {
        let width = context.width.map_or(WIDTH, |columns| columns.clamp(MIN_WIDTH, WIDTH));
        let text = report::comparison_summary(&compared.comparison, width, context.color);
        context.print(&text)?;
    }
    if let Some(paper) = &paper {
        paper.write(context, Shown::Comparison(&compared.comparison))?;
    }
    if let Some(page) = &compared.page {
        context.result(page)?;
        context.say(&format!("Compared in {watch} -> {}", page.shown()));
    }
    Ok(compared.ending.into())
}

/// Compares a campaign with a mast.
fn beside(
    context: &Context,
    args: &CompareArgs,
    campaign: &Path,
    mast: &Path,
) -> Result<Exit, CommandError> {
    let watch = Stopwatch::start(context);
    let paper = args.paper.wish()?;
    let found = mast::run(context, campaign, mast, args.output.as_deref())?;
    if context.json {
        context.print_json(&found.comparison)?;
    } else {
        let width = context.width.map_or(WIDTH, |columns| columns.clamp(MIN_WIDTH, WIDTH));
        context.print(&report::mast_summary(&found.comparison, width))?;
    }
    if let Some(paper) = &paper {
        paper.write(context, Shown::Mast(&found.comparison))?;
    }
    if let Some(page) = &found.page {
        context.result(page)?;
        context.say(&format!("Compared in {watch} -> {}", page.shown()));
    }
    Ok(Exit::Done)
}
