//! An analysis that somebody names: its file, or the folder that holds it.

use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::error::WorkflowError;
use crate::analysis::result::{ANALYSIS_SCHEMA, Analysis};
use crate::base::digest::sha256;
use crate::base::file::{FileError, read_whole};
use crate::base::parse;
use crate::base::plain::Shown as _;
use crate::campaign::CampaignError;

/// Largest analysis that is read, bytes; see the archive's.
const MOST_BYTES: u64 = 4 << 30;

/// An analysis, where it is, and the hash of its file.
pub(super) struct AnalysisFile {
    pub(super) path: PathBuf,
    pub(super) sha256: String,
    pub(super) analysis: Analysis,
}

impl AnalysisFile {
    /// Reads the analysis behind a path.
    ///
    /// # Errors
    /// If there is none, it cannot be read, or it is of another format.
    pub(super) fn read(path: &Path) -> Result<Self, WorkflowError> {
        std::fs::metadata(path).map_err(|error| FileError::new("read", path, error))?;
        let file = analysis_of(path);
        if path.is_dir() && !file.exists() {
            return Err(WorkflowError::Nothing(format!(
                "{} has no analysis.json: run `updraft analyze` on it",
                path.shown()
            )));
        }
        let bytes = read_whole(&file, MOST_BYTES)?;
        let broken = |reason: String| CampaignError::Json { path: file.clone(), reason };
        let head: Head = parse::json(&bytes).map_err(|error| broken(error.to_string()))?;
        refuse_schema(&file, head.schema.as_deref())?;
        let analysis = parse::json(&bytes).map_err(|error| broken(error.to_string()))?;
        Ok(Self { path: file, sha256: sha256(&bytes), analysis })
    }
}

/// Path of the analysis behind a path.
pub(super) fn analysis_of(path: &Path) -> PathBuf {
    if path.is_dir() { path.join("analysis.json") } else { path.to_owned() }
}

/// The format's name alone.
#[derive(Deserialize)]
struct Head {
    #[serde(default)]
    schema: Option<String>,
}

/// Refuses files of other kinds, and of a newer format, by its name.
fn refuse_schema(file: &Path, schema: Option<&str>) -> Result<(), WorkflowError> {
    let file = file.shown();
    let Some(schema) = schema.filter(|schema| *schema != ANALYSIS_SCHEMA) else {
        return match schema {
            Some(_) => Ok(()),
            None => Err(WorkflowError::Usage(format!("{file} is no analysis: it has no schema"))),
        };
    };
    let version = |schema: &str| {
        let (name, version) = schema.rsplit_once('/')?;
        Some((name.to_owned(), version.parse::<u32>().ok()?))
    };
    let plain = crate::base::plain::plain(schema);
    Err(WorkflowError::Usage(match (version(schema), version(ANALYSIS_SCHEMA)) {
        (Some((name, theirs)), Some((own, ours))) if name == own && theirs > ours => format!(
            "{file} was made by a newer updraft (\"{plain}\"; this one reads \"{ANALYSIS_SCHEMA}\"): use that one, or \
             analyse the campaign again"
        ),
        _ => format!("{file} is no analysis: its schema is \"{plain}\", not \"{ANALYSIS_SCHEMA}\""),
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn other_formats_are_refused_by_their_name() {
        let told = |schema: Option<&str>| {
            refuse_schema(Path::new("a.json"), schema).map_err(|error| error.to_string())
        };
        assert_eq!(told(Some(ANALYSIS_SCHEMA)), Ok(()));
        assert!(told(Some("updraft.analysis/2")).unwrap_err().contains("newer updraft"));
        assert!(told(Some("updraft.plan/1")).unwrap_err().contains("is no analysis"));
        assert!(told(None).unwrap_err().contains("no schema"));
    }
}
