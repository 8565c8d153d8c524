//! Series of blind flights: flown, explained, scored, and their table.

use std::path::PathBuf;

use super::ending::Ending;
use super::error::{WorkflowError, with_reasons};
use super::gap::search::Searched;
use super::host::Host;
use super::made_by;
use super::share::{self, ShardDone, numbers, on_threads};
use crate::base::file::write_whole;
use crate::base::shard::Share;
use crate::blind::render::{Style, render};
use crate::blind::score::Outcome;
use crate::blind::series::{self, Place, Settings, Taken};
use crate::blind::table::{Table, table};
use crate::blind::tables::{FIRST_OF_PAIRS, FOREIGN_KINDS, KINDS, TOGETHER};
use crate::blind::{Base, BlindError, Worlds};
use crate::campaign::items::ItemsRecord;
use crate::campaign::to_json;

/// Nothing hidden is this many times as frequent as each thing that is hidden, unless `--effects` says
/// which: false alarms are what is demanded most of.
const NONE_WEIGHT: usize = 6;

/// Default sets of hidden effects: each effect of these worlds by itself.
pub fn one_each(worlds: &[Worlds]) -> Vec<Vec<String>> {
    let nothing = std::iter::repeat_n(Vec::new(), NONE_WEIGHT);
    let home = KINDS.iter().map(|kind| (Worlds::Home, kind.name));
    let foreign = FOREIGN_KINDS.iter().map(|kind| (Worlds::Foreign, kind.name));
    let some = home.chain(foreign).filter(|(one, _)| worlds.contains(one));
    nothing.chain(some.map(|(_, name)| vec![name.to_owned()])).collect()
}

/// Sets of two and three effects that are hidden together.
pub fn several() -> Vec<Vec<String>> {
    let others = KINDS.iter().filter(|kind| !kind.foreign && kind.name != FIRST_OF_PAIRS);
    // With the inflow hidden too, the base is AirSim's, and that feels no neighbours.
    let others = others.filter(|kind| kind.bases.contains(&Base::Airsim));
    let pairs = others.map(|kind| [FIRST_OF_PAIRS, kind.name].map(str::to_owned).to_vec());
    let owned = |set: &&[&str]| set.iter().map(|name| (*name).to_owned()).collect();
    pairs.chain(TOGETHER.iter().map(owned)).collect()
}

/// A series of blind flights after its scoring.
pub struct Scored {
    /// Table of the series.
    pub table: Table,
    /// Path of the table as Markdown.
    pub markdown: PathBuf,
    /// Number of flights that have a verdict.
    pub flights: usize,
    /// Reasons why flights have no verdict, one sentence each.
    pub lost: Vec<String>,
}

impl Scored {
    /// Ending of the series: with losses if a flight has no verdict.
    pub fn ending(&self) -> Ending {
        Ending::of_losses(!self.lost.is_empty())
    }
}

/// Outcome of a run of a series.
pub enum Ran {
    /// All flights were looked at, and their table was written.
    Table(Box<Scored>),
    /// A shard's flights were flown; the table comes from a run without a shard.
    Shard(ShardDone),
}

/// Record of a series' flights; `command`: for people.
///
/// # Errors
/// If the settings have no form as JSON.
pub fn record(settings: &Settings, command: String) -> Result<ItemsRecord, WorkflowError> {
    Ok(ItemsRecord::new(made_by(), "blind flights", settings.flight_sha256()?, command))
}

/// File of the table's numbers, in a series' folder.
pub const RESULT_FILE: &str = "table.json";

/// Flies a series, `jobs` flights at the same time (`None`: one per core), and writes its table; of a
/// shard, only its flights. `note` goes into the table's head. Finished flights are kept.
///
/// # Errors
/// When the seed is not for this, the folder cannot be written or has flights of other settings, no flight
/// has a verdict, or, where missing flights are only to be named, one is missing.
pub fn run(
    host: &dyn Host,
    settings: &Settings,
    place: &Place,
    share: Share,
    jobs: Option<u16>,
    note: Option<&str>,
) -> Result<Ran, WorkflowError> {
    settings.check_seed()?;
    settings.cells()?;
    share::needs_folder(&place.folder, share)?;
    // Shards share the folder, on file systems that may have no locks.
    let _lock = share.shard.is_none().then(|| host.lock(&place.folder)).transpose()?;
    share::join(&place.folder, &record(settings, host.command())?, share, false)?;
    let count = share.count(settings.flights);
    let progress = host.progress("blind flights", count as u64);
    let work = || {
        series::run(settings, place, share, &made_by(), &Searched, host.stop_flag(), &|| {
            progress.advance();
        })
    };
    let taken = on_threads(jobs, work)?;
    progress.finish();
    let sorted = sort(taken?)?;
    if !sorted.missing.is_empty() {
        let missing = numbers(&sorted.missing);
        return Err(WorkflowError::Missing {
            what: "blind flights",
            count: sorted.missing.len(),
            of: count,
            missing,
        });
    }
    for reason in &sorted.lost {
        host.warn(reason);
    }
    if let Some(shard) = share.shard {
        let Sorted { there, lost, .. } = sorted;
        return Ok(Ran::Shard(ShardDone { shard, items: count, there, lost }));
    }
    if sorted.outcomes.is_empty() {
        return Err(WorkflowError::Nothing("no flight has a verdict".to_owned()));
    }
    let table = table(settings, &sorted.outcomes, sorted.lost.len(), &made_by());
    let json = to_json(&table)
        .map_err(|error| WorkflowError::Failed(format!("failed to make JSON: {error}")))?;
    let markdown = place.folder.join("table.md");
    write_whole(&place.folder.join(RESULT_FILE), &json)?;
    write_whole(&markdown, render(&table, Style::Markdown, note).as_bytes())?;
    let flights = sorted.outcomes.len();
    Ok(Ran::Table(Box::new(Scored { table, markdown, flights, lost: sorted.lost })))
}

/// Flights by what became of them.
#[derive(Default)]
struct Sorted {
    outcomes: Vec<Outcome>,
    /// Number of those that were finished before.
    there: usize,
    /// Reasons why flights have no verdict, one sentence each.
    lost: Vec<String>,
    /// Places in the table of those that were not to be flown.
    missing: Vec<usize>,
}

fn sort(taken: Vec<Taken>) -> Result<Sorted, WorkflowError> {
    let mut sorted = Sorted::default();
    for Taken { index, result, was_there } in taken {
        match result {
            Ok(result) => {
                sorted.outcomes.push(result.outcome);
                sorted.there += usize::from(was_there);
            }
            Err(BlindError::Stopped) => return Err(WorkflowError::Interrupted),
            Err(BlindError::NotFlown { .. }) => sorted.missing.push(index),
            Err(error) => {
                let reason = with_reasons(&WorkflowError::from(error));
                sorted.lost.push(format!("flight {index}: {reason}"));
            }
        }
    }
    Ok(sorted)
}
