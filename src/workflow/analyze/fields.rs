//! Files beside the report of an analysis: the measured fields for other programs, and the finished
//! study that goes into the report.

use std::path::Path;

use crate::analysis::result::Analysis;
use crate::base::file::write_with;
use crate::base::plain::Shown as _;
use crate::campaign;
use crate::report::fields;
use crate::study::result::{STUDY_RESULT_SCHEMA, StudyResult};
use crate::workflow::error::WorkflowError;
use crate::workflow::host::Host;

/// Writes the fields, if there are any. Those of an earlier analysis that has become empty go.
pub(super) fn write_fields(analysis: &Analysis, folder: &Path) -> Result<(), WorkflowError> {
    let (csv, parquet) = (campaign::fields_csv(folder), campaign::fields_parquet(folder));
    if !fields::any(analysis) {
        for old in [csv, parquet] {
            // Nothing to remove is the usual case.
            let _ = std::fs::remove_file(old);
        }
        return Ok(());
    }
    write_with(&csv, |out| fields::write_csv(analysis, out))?;
    #[cfg(feature = "parquet")]
    {
        let bytes = crate::report::fields_parquet::parquet(analysis)
            .map_err(|error| WorkflowError::Failed(format!("failed to make Parquet: {error}")))?;
        crate::base::file::write_whole(&parquet, &bytes)?;
    }
    #[cfg(not(feature = "parquet"))]
    let _ = std::fs::remove_file(parquet);
    Ok(())
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
