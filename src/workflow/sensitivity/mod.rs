//! Flight, evaluation and report of a sensitivity study: whole campaigns that differ in some factors.

mod campaign;
mod naming;
mod silent;

use std::path::{Path, PathBuf};

use self::campaign::Campaigns;
use super::error::WorkflowError;
use super::host::Host;
use super::made_by;
use crate::base::file::{write_whole, write_with};
use crate::campaign::to_json;
use crate::report::{self, Provenance};
use crate::study::sensitivity::{
    Gathered, SensitivityPlan, SensitivityResult, SensitivityWork, evaluate, table,
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
    let campaigns = Campaigns::new(host, study, folder, settings.keep)?;
    let progress = host.progress("flying campaigns", work.open_items(takes) as u64);
    let fly =
        || work.fly(takes, &|item| campaigns.fly(item), host.stop_flag(), &|| progress.advance());
    let gathered = match settings.jobs {
        Some(jobs) => rayon::ThreadPoolBuilder::new()
            .num_threads(usize::from(jobs))
            .build()
            .map_err(|error| WorkflowError::Failed(format!("failed to start threads: {error}")))?
            .install(fly),
        None => fly(),
    };
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
    let provenance = Provenance {
        program: made_by(),
        command,
        seed: Some(result.seed),
        ..Provenance::default()
    };
    let points = report::Points::of(study, &drawn, &gathered.rows);
    let made = report::render_sensitivity(result, &points, &provenance)?;
    let pages = folder.join("report");
    report::write(&made, &pages)?;
    Ok(pages.join(report::PAGE_FILE))
}
