//! Flight, evaluation and report of a study: the ladder in every wind and updraft.

use std::path::{Path, PathBuf};

use super::clock::Stopwatch;
use super::error::WorkflowError;
use super::host::Host;
use super::made_by;
use super::pages;
use super::share::{self, ShardDone, on_threads};
use crate::base::file::write_whole;
use crate::base::plain::Shown as _;
use crate::base::shard::{Shard, Share};
use crate::campaign::items::ItemsRecord;
use crate::campaign::{self, to_json};
use crate::report::{self, Provenance};
use crate::study::result::StudyResult;
use crate::study::{Flown, Settings, StudyPlan, Work, evaluate, study_sha256};

/// Name of the built-in study.
pub const BUILT_IN: &str = "study";

/// File of the numbers, in a study's folder.
pub const RESULT_FILE: &str = "study.json";

/// Flies the open cells of a study, `jobs` flights at the same time.
///
/// # Errors
///
/// If a flight cannot be written, or the work is stopped.
pub fn fly(
    host: &dyn Host,
    work: Work<'_>,
    doing: &'static str,
    jobs: Option<u16>,
) -> Result<Flown, WorkflowError> {
    let progress = host.progress(doing, work.open_flights() as u64);
    let flown = on_threads(jobs, || work.fly(host.stop_flag(), &|| progress.advance()))?;
    progress.finish();
    let flown = flown?;
    host.check_stop()?;
    Ok(flown)
}

/// Takes a study's folder for the flights of `work`, or joins the processes that have taken it. Without a
/// shard the folder is locked, and a changed study takes it over: its flights each know their settings.
///
/// # Errors
///
/// If the folder has flights of other settings or another version, or, where missing flights are only to be
/// named, one is missing.
pub fn join(
    host: &dyn Host,
    folder: &Path,
    work: &Work<'_>,
    share: Share,
) -> Result<(), WorkflowError> {
    share::join(folder, &record(work.study(), work.seed(), host.command())?, share, true)?;
    let missing = if share.gather_only { work.missing() } else { Vec::new() };
    if missing.is_empty() {
        return Ok(());
    }
    let (count, missing) = (missing.len(), missing.join(", "));
    Err(WorkflowError::Missing { what: "cells of the study", count, of: work.total(), missing })
}

/// Record of a study's flights; `command`: for people.
///
/// # Errors
/// If the settings have no form as JSON.
pub fn record(study: &StudyPlan, seed: u64, command: String) -> Result<ItemsRecord, WorkflowError> {
    Ok(ItemsRecord::new(made_by(), "cells of a study", study_sha256(study, seed)?, command))
}

/// Outcome of a shard of a study.
pub fn shard_done(host: &dyn Host, shard: Shard, items: usize, flown: &Flown) -> ShardDone {
    let lost: Vec<String> = flown.lost.iter().map(|lost| lost.reason.clone()).collect();
    for reason in &lost {
        host.warn(reason);
    }
    ShardDone { shard, items, there: items - flown.flown, lost }
}

/// Evaluates a study, and reports the flights that were lost to the host.
///
/// # Errors
///
/// If the reference flight is lost or gives no law.
pub fn evaluated(
    host: &dyn Host,
    study: &StudyPlan,
    seed: u64,
    flown: &Flown,
) -> Result<StudyResult, WorkflowError> {
    let result = evaluate(study, seed, flown)?;
    for lost in &result.lost {
        host.warn(&format!("{}: {}", lost.name, lost.reason));
    }
    Ok(result)
}

/// Flies the built-in study into a folder, for the report of a campaign. Finished flights are kept.
///
/// # Errors
///
/// If the study cannot be flown or written, or the work is stopped.
pub fn fly_built_in(host: &dyn Host, folder: &Path, seed: u64) -> Result<(), WorkflowError> {
    let watch = Stopwatch::start(host);
    let study = StudyPlan::load(BUILT_IN)?;
    let work = Work::open(&study, folder, Settings::new(seed))?;
    let flown = fly(host, work, "flying the study", None)?;
    let result = evaluated(host, &study, seed, &flown)?;
    write(folder, format!("updraft run --seed {seed}"), seed, &result)?;
    host.say(&format!("Flew the simulation study ({} flights) in {watch}", flown.flown));
    Ok(())
}

/// Refuses a campaign's folder for a study, which would overwrite its report.
///
/// # Errors
///
/// If the folder holds a campaign.
pub fn refuse_campaign(folder: &Path) -> Result<(), WorkflowError> {
    if campaign::is_campaign(folder) {
        return Err(WorkflowError::Usage(format!(
            "{} is a campaign; give the study another folder with --output",
            folder.shown()
        )));
    }
    Ok(())
}

/// Writes the results; the page comes last, so that a folder with a page is complete.
///
/// # Errors
///
/// If the results cannot be made or written.
pub fn write(
    folder: &Path,
    command: String,
    seed: u64,
    result: &StudyResult,
) -> Result<PathBuf, WorkflowError> {
    let json = to_json(result)
        .map_err(|error| WorkflowError::Failed(format!("failed to make JSON: {error}")))?;
    write_whole(&folder.join(RESULT_FILE), &json)?;
    let links = pages::of_study(folder, &[("All numbers of this page", RESULT_FILE)]);
    let program = made_by();
    let provenance =
        Provenance { program, command, seed: Some(seed), links, ..Provenance::default() };
    let made = report::render_study(result, &provenance)?;
    let report_folder = folder.join("report");
    report::write(&made, &report_folder)?;
    Ok(report_folder.join(report::PAGE_FILE))
}
