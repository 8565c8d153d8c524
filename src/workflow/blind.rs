//! Series of blind flights: flown, explained, scored, and their table.

use std::path::PathBuf;

use super::ending::Ending;
use super::error::{WorkflowError, with_reasons};
use super::gap::search::Searched;
use super::host::Host;
use super::made_by;
use crate::base::file::write_whole;
use crate::blind::render::{Style, render};
use crate::blind::series::{self, Place, Settings};
use crate::blind::table::{Table, table};
use crate::blind::tables::{FIRST_OF_PAIRS, FOREIGN_KINDS, KINDS, TOGETHER};
use crate::blind::{Base, BlindError, Worlds};
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

/// Flies a series, `jobs` flights at the same time (`None`: one per core), and writes its table.
/// `note` goes into the table's head. Finished flights are kept.
///
/// # Errors
/// When the seed is not for this, the folder cannot be written, or no flight has a verdict.
pub fn run(
    host: &dyn Host,
    settings: &Settings,
    place: &Place,
    jobs: Option<u16>,
    note: Option<&str>,
) -> Result<Scored, WorkflowError> {
    settings.check_seed()?;
    let _lock = host.lock(&place.folder)?;
    let progress = host.progress("blind flights", settings.flights as u64);
    let work = || {
        series::run(settings, place, &made_by(), &Searched, host.stop_flag(), &|| {
            progress.advance();
        })
    };
    let results = match jobs {
        Some(jobs) => rayon::ThreadPoolBuilder::new()
            .num_threads(usize::from(jobs))
            .build()
            .map_err(|error| WorkflowError::Failed(format!("failed to start threads: {error}")))?
            .install(work),
        None => work(),
    };
    progress.finish();
    let mut outcomes = Vec::new();
    let mut lost = Vec::new();
    for (index, result) in results?.into_iter().enumerate() {
        match result {
            Ok(result) => outcomes.push(result.outcome),
            Err(BlindError::Stopped) => return Err(WorkflowError::Interrupted),
            Err(error) => {
                let reason = with_reasons(&WorkflowError::from(error));
                lost.push(format!("flight {index}: {reason}"));
            }
        }
    }
    for reason in &lost {
        host.warn(reason);
    }
    if outcomes.is_empty() {
        return Err(WorkflowError::Nothing("no flight has a verdict".to_owned()));
    }
    let table = table(settings, &outcomes, lost.len(), &made_by());
    let json = to_json(&table)
        .map_err(|error| WorkflowError::Failed(format!("failed to make JSON: {error}")))?;
    let markdown = place.folder.join("table.md");
    write_whole(&place.folder.join("table.json"), &json)?;
    write_whole(&markdown, render(&table, Style::Markdown, note).as_bytes())?;
    Ok(Scored { table, markdown, flights: outcomes.len(), lost })
}
