//! Comparison of a campaign with a mast.

use std::path::{Path, PathBuf};

use super::analysis_file::AnalysisFile;
use super::compare::refuse_output;
use super::error::WorkflowError;
use super::hashes::Hashes;
use super::host::Host;
use super::made_by;
use crate::base::file::write_whole;
use crate::base::plain::Shown as _;
use crate::campaign::to_json;
use crate::mast::make::drones_height_m;
use crate::mast::{MastComparison, MastError, MastRecord, compare};
use crate::report::{self, InputFile, Provenance};

/// Name of the file with the numbers.
pub const RESULT_FILE: &str = "mast.json";

/// A finished comparison.
#[derive(Debug)]
pub struct BesideMast {
    /// Results of the comparison.
    pub comparison: MastComparison,
    /// Path of the page, if one was written.
    pub page: Option<PathBuf>,
}

/// Compares an analysed campaign with a mast's record, and writes numbers and page where that is asked for.
///
/// # Errors
///
/// If one of both cannot be read or used, or nothing can be written.
pub fn run(
    host: &dyn Host,
    campaign: &Path,
    mast: &Path,
    output: Option<&Path>,
) -> Result<BesideMast, WorkflowError> {
    if let Some(output) = output {
        refuse_output(output)?;
    }
    let read = AnalysisFile::read(campaign)?;
    let near_m = drones_height_m(&read.analysis);
    let record = MastRecord::read(mast, near_m).map_err(failed)?;
    let comparison = compare(&read.analysis, campaign, &record, &made_by()).map_err(failed)?;
    for note in &comparison.notes {
        host.warn(note);
    }
    let page = output.map(|output| {
        let _lock = host.lock(output)?;
        let hashes = Hashes::default();
        let mut inputs =
            vec![InputFile { path: read.path.shown().to_string(), sha256: read.sha256.clone() }];
        for file in [mast, &record.file] {
            let path = file.shown().to_string();
            if inputs.iter().all(|input| input.path != path) {
                inputs.push(InputFile { path, sha256: hashes.sha256(file)? });
            }
        }
        let provenance = Provenance {
            program: made_by(),
            command: host.command(),
            inputs,
            ..Provenance::default()
        };
        let json = to_json(&comparison)
            .map_err(|error| WorkflowError::Failed(format!("failed to make JSON: {error}")))?;
        let made = report::render_mast(&comparison, &provenance)?;
        write_whole(&output.join(RESULT_FILE), &json)?;
        let folder = output.join("report");
        report::write(&made, &folder)?;
        Ok::<_, WorkflowError>(folder.join(report::PAGE_FILE))
    });
    Ok(BesideMast { page: page.transpose()?, comparison })
}

fn failed(error: MastError) -> WorkflowError {
    match error {
        MastError::File(error) => error.into(),
        MastError::Nothing { .. } => WorkflowError::Nothing(error.to_string()),
        _ => WorkflowError::Usage(error.to_string()),
    }
}
