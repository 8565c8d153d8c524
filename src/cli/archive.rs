//! `updraft archive`: campaigns as one Parquet dataset.

use std::fmt::Write as _;
use std::path::PathBuf;

use clap::Args;

use super::context::Context;
use super::exit::{CommandError, Exit};
use super::words;
use crate::base::plain::Shown as _;
use crate::workflow::archive::output::{ArchiveOutput, Gathered, Outcome};
use crate::workflow::archive::{Request, run as gather};
use crate::workflow::clock::Stopwatch;

/// Arguments of `updraft archive`.
#[derive(Debug, Args)]
#[command(after_long_help = "Examples:
  updraft archive my-campaign
  updraft archive seasons/ -o archive             # every campaign below seasons/
  updraft archive seasons/ -o archive --prune     # and remove those that are gone
  duckdb -c \"SELECT campaign, flight, w_mps FROM read_parquet('archive/flights/**/*.parquet',
    hive_partitioning = true)\"

An archive is one partitioned Parquet dataset: the tables flights, drones, thermals, verdicts and
seconds, each in files TABLE/date=DATE/campaign=ID/part.parquet. DuckDB, pandas and others query it
in place; docs/archive.md has the columns and queries.

Campaigns whose files have not changed are passed over; of one that has, every file is replaced as a
whole. A campaign that was removed from its folder stays in the archive without --prune. Campaigns
are found below the folders that are given (six deep; links are not followed).

Exit code 3: done, but a campaign is broken or was not analysed, and is named. Exit code 5: no
campaign can be used.")]
pub(super) struct ArchiveArgs {
    /// Campaign folders, or folders that hold campaigns
    #[arg(value_name = "CAMPAIGN", required_unless_present = "prune")]
    campaigns: Vec<PathBuf>,
    /// Folder of the archive
    #[arg(short, long, value_name = "FOLDER", default_value = "archive")]
    output: PathBuf,
    /// Remove campaigns that are no longer in the folders they were gathered from
    #[arg(long)]
    prune: bool,
}

pub(super) fn run(context: &Context, args: &ArchiveArgs) -> Result<Exit, CommandError> {
    let watch = Stopwatch::start(context);
    let request = Request {
        folders: args.campaigns.clone(),
        archive: args.output.clone(),
        prune: args.prune,
    };
    let (output, ending) = gather(context, &request)?;
    if context.json {
        context.print_json(&output)?;
    } else {
        context.print(&table(&output))?;
    }
    context.result(&output.archive)?;
    context.say(&format!(
        "{} in {} ({}), gathered in {watch}",
        words::count(output.held, "campaign"),
        output.archive.shown(),
        words::count(usize::try_from(output.rows.seconds).unwrap_or(usize::MAX), "drone second")
    ));
    Ok(ending.into())
}

/// Campaigns that something became of, a line each; those that did not change are counted.
fn table(output: &ArchiveOutput) -> String {
    let told = |one: &&Gathered| one.outcome != Outcome::Unchanged;
    let named =
        |one: &Gathered| one.campaign.clone().unwrap_or_else(|| one.folder.shown().to_string());
    let width = output.campaigns.iter().filter(told).map(|one| named(one).len()).max();
    let width = width.unwrap_or_default();
    let mut text = String::new();
    for one in output.campaigns.iter().filter(told) {
        let rows = one.rows;
        let _ = write!(text, "{:9}  {:width$}", one.outcome.name(), named(one));
        if matches!(one.outcome, Outcome::Added | Outcome::Replaced) {
            let _ = write!(
                text,
                "  {:>3} flights  {:>5} drones  {:>3} thermals  {:>3} findings  {:>8} seconds",
                rows.flights, rows.drones, rows.thermals, rows.verdicts, rows.seconds
            );
        }
        text.truncate(text.trim_end().len());
        text.push('\n');
    }
    let unchanged = output.campaigns.iter().filter(|one| one.outcome == Outcome::Unchanged).count();
    if unchanged > 0 {
        let _ = writeln!(text, "{} unchanged", words::count(unchanged, "campaign"));
    }
    text
}
