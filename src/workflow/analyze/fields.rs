//! Files beside the report of an analysis: the measured fields for other programs, and the finished
//! study that goes into the report.

use std::path::{Path, PathBuf};

use crate::analysis::result::Analysis;
use crate::base::file::write_with;
use crate::base::plain::Shown as _;
use crate::campaign;
use crate::report::{fields, fields_grid};
use crate::study::result::{STUDY_RESULT_SCHEMA, StudyResult};
use crate::workflow::error::WorkflowError;
use crate::workflow::host::Host;

/// Writes the fields, if there are any. Those of an earlier analysis that has become empty go.
pub(super) fn write_fields(analysis: &Analysis, folder: &Path) -> Result<(), WorkflowError> {
    let (csv, parquet) = (campaign::fields_csv(folder), campaign::fields_parquet(folder));
    if fields::any(analysis) {
        write_with(&csv, |out| fields::write_csv(analysis, out))?;
        #[cfg(feature = "parquet")]
        write_parquet(&parquet, crate::report::fields_parquet::parquet(analysis))?;
        #[cfg(not(feature = "parquet"))]
        remove(&[parquet]);
    } else {
        remove(&[csv, parquet]);
    }
    let (csv, parquet) = (campaign::fields_grid_csv(folder), campaign::fields_grid_parquet(folder));
    if fields_grid::any(analysis) {
        write_with(&csv, |out| fields_grid::write_csv(analysis, out))?;
        #[cfg(feature = "parquet")]
        write_parquet(&parquet, crate::report::fields_parquet::grid_parquet(analysis))?;
        #[cfg(not(feature = "parquet"))]
        remove(&[parquet]);
    } else {
        remove(&[csv, parquet]);
    }
    Ok(())
}

fn remove(old: &[PathBuf]) {
    for old in old {
        // Nothing to remove is the usual case.
        let _ = std::fs::remove_file(old);
    }
}

#[cfg(feature = "parquet")]
fn write_parquet(
    path: &Path,
    bytes: parquet::errors::Result<Vec<u8>>,
) -> Result<(), WorkflowError> {
    let bytes =
        bytes.map_err(|error| WorkflowError::Failed(format!("failed to make Parquet: {error}")))?;
    Ok(crate::base::file::write_whole(path, &bytes)?)
}

/// The study that a campaign holds; says so, and goes on without, where it cannot be read.
pub(super) fn read_study(host: &dyn Host, root: &Path) -> Option<StudyResult> {
    let path = campaign::study_result(root);
    if !path.is_file() {
        return None;
    }
    match campaign::read_json::<StudyResult>(&path) {
        Ok(study) if study.schema == STUDY_RESULT_SCHEMA => Some(study),
        Ok(study) => {
            host.warn(&format!(
                "{} has the format \"{}\", this program reads \"{STUDY_RESULT_SCHEMA}\": the \
                 report does without Fig. 2 and Table I; fly the study again",
                path.shown(),
                study.schema
            ));
            None
        }
        Err(error) => {
            host.warn(&format!("the report does without Fig. 2 and Table I: {error}"));
            None
        }
    }
}
