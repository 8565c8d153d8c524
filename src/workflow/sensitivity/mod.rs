//! Flight, evaluation and report of a sensitivity study: whole campaigns that differ in some factors.

mod campaign;
mod naming;
mod silent;

use std::path::{Path, PathBuf};

use self::campaign::Campaigns;
use super::error::WorkflowError;
use super::host::Host;
use super::made_by;
use super::pages;
use super::share::{self, ShardDone, numbers, on_threads};
use crate::base::file::{write_whole, write_with};
use crate::base::shard::{Shard, Share};
use crate::campaign::items::ItemsRecord;
use crate::campaign::to_json;
use crate::report::{self, Provenance};
use crate::study::sensitivity::{
    Gathered, SensitivityPlan, SensitivityResult, SensitivityWork, evaluate, sensitivity_sha256,
    table,
};

/// Name of the built-in sensitivity study.
pub const BUILT_IN: &str = "sensitivity";

/// File of the numbers, in a study's folder.
pub const RESULT_FILE: &str = "sensitivity.json";
/// File of the table, without its ending.
const TABLE_FILE: &str = "results";

/// Settings of flying a study that do not belong to its file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Settings {
    /// Seed of the study; every campaign has its own from it.
    pub seed: u64,
    /// Whether the folder of each campaign is kept, in `work/`.
    pub keep: bool,
    /// Number of campaigns that are flown at the same time; `None`: one for each processor.
    pub jobs: Option<u16>,
    /// Folder in which campaigns are flown, best on a disk of this machine alone; `None`: `work/`.
    pub scratch: Option<PathBuf>,
}

/// Takes a study's folder for the campaigns of `work`, or joins the processes that have taken it. Without a
/// shard the folder is locked, and a changed study takes it over: its campaigns each know their settings.
///
/// # Errors
/// If the folder has campaigns of other settings or another version, or, where missing ones are only to be
/// named, one is missing.
pub fn join(
    host: &dyn Host,
    folder: &Path,
    (study, seed): (&SensitivityPlan, u64),
    work: &SensitivityWork<'_>,
    share: Share,
) -> Result<(), WorkflowError> {
    share::join(folder, &record(study, seed, host.command())?, share, true)?;
    let missing =
        if share.gather_only { work.missing(&|item| share.takes(item)) } else { Vec::new() };
    if missing.is_empty() {
        return Ok(());
    }
    let (count, of) = (missing.len(), share.count(work.total()));
    let missing = numbers(&missing);
    Err(WorkflowError::Missing { what: "campaigns of the study", count, of, missing })
}

/// Record of a study's campaigns; `command`: for people.
///
/// # Errors
/// If the settings have no form as JSON.
pub fn record(
    study: &SensitivityPlan,
    seed: u64,
    command: String,
) -> Result<ItemsRecord, WorkflowError> {
    let settings = sensitivity_sha256(study, seed)?;
    Ok(ItemsRecord::new(made_by(), "campaigns of a study", settings, command))
}

/// Outcome of a shard of a study.
pub fn shard_done(host: &dyn Host, shard: Shard, total: usize, gathered: &Gathered) -> ShardDone {
    let share = Share { shard: Some(shard), gather_only: false };
    let mut lost = Vec::new();
    for (item, row) in gathered.rows.iter().enumerate().filter(|(item, _)| share.takes(*item)) {
        if let Some(Err(reason)) = row.as_ref().map(|row| row.result.as_ref()) {
            lost.push(format!("campaign {item}: {reason}"));
        }
    }
    for reason in &lost {
        host.warn(reason);
    }
    let items = share.count(total);
    let there = items.saturating_sub(gathered.flown).min(items - lost.len());
    ShardDone { shard, items, there, lost }
}

/// Flies the open campaigns that `takes` takes. Each is flown in a folder of its own below `work/`, which is
/// removed when its outcome is kept.
///
/// # Errors
/// When a file cannot be read or written, or the work is stopped.
pub fn fly(
    host: &dyn Host,
    study: &SensitivityPlan,
    work: SensitivityWork<'_>,
    folder: &Path,
    settings: &Settings,
    takes: &(dyn Fn(usize) -> bool + Sync),
) -> Result<Gathered, WorkflowError> {
    let scratch = settings.scratch.as_deref();
    let campaigns = Campaigns::new(host, study, folder, settings.keep, scratch);
    let progress = host.progress("flying campaigns", work.open_items(takes) as u64);
    let fly =
        || work.fly(takes, &|item| campaigns.fly(item), host.stop_flag(), &|| progress.advance());
    let gathered = on_threads(settings.jobs, fly)?;
    progress.finish();
    let gathered = gathered?;
    host.check_stop()?;
    Ok(gathered)
}

/// Evaluates a study as far as it is flown, and reports the campaigns that were lost to the host.
pub fn evaluated(
    host: &dyn Host,
    study: &SensitivityPlan,
    seed: u64,
    gathered: &Gathered,
) -> SensitivityResult {
    let result = evaluate(study, seed, gathered);
    for lost in &result.lost_reasons {
        host.warn(&format!(
            "{} lost: {}",
            super::words::count(lost.campaigns, "campaign"),
            lost.reason
        ));
    }
    result
}

/// Writes tables, numbers and report; the page comes last, so that a folder with a page is complete. Returns its
/// path.
///
/// # Errors
/// If the results cannot be made or written.
pub fn write(
    folder: &Path,
    command: String,
    study: &SensitivityPlan,
    gathered: &Gathered,
    result: &SensitivityResult,
) -> Result<PathBuf, WorkflowError> {
    let drawn = study.drawn(result.seed);
    let path = |ending: &str| folder.join(format!("{TABLE_FILE}.{ending}"));
    write_with(&path("csv"), |out| table::write_csv(out, study, &drawn, &gathered.rows))?;
    #[cfg(feature = "parquet")]
    write_with(&path("parquet"), |out| {
        report::sensitivity_parquet::write(out, study, &drawn, &gathered.rows)
            .map_err(std::io::Error::other)
    })?;
    let json = to_json(result)
        .map_err(|error| WorkflowError::Failed(format!("failed to make JSON: {error}")))?;
    write_whole(&folder.join(RESULT_FILE), &json)?;
    let links = pages::of_study(
        folder,
        &[
            ("All numbers of this page", RESULT_FILE),
            ("Every campaign, as a table", "results.csv"),
            ("The same in Parquet", "results.parquet"),
        ],
    );
    let provenance = Provenance {
        program: made_by(),
        command,
        seed: Some(result.seed),
        links,
        ..Provenance::default()
    };
    let points = report::Points::of(study, &drawn, &gathered.rows);
    let made = report::render_sensitivity(result, &points, &provenance)?;
    let pages = folder.join("report");
    report::write(&made, &pages)?;
    Ok(pages.join(report::PAGE_FILE))
}
