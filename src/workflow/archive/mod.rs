//! Gathering of campaigns into one archive ([`crate::archive`]), which goes on where it stopped and does nothing twice.

#[cfg(feature = "parquet")]
mod gathering;
pub mod output;

use std::path::{Path, PathBuf};

use self::output::ArchiveOutput;
use super::ending::Ending;
use super::error::WorkflowError;
use super::host::Host;

/// Request to gather campaigns.
#[derive(Clone, Debug)]
pub struct Request {
    /// Folders that are campaigns or hold some.
    pub folders: Vec<PathBuf>,
    /// Folder of the archive.
    pub archive: PathBuf,
    /// Whether campaigns that are no more in their folders are removed.
    pub prune: bool,
}

/// Gathers campaigns into an archive. Broken campaigns are reported and left out.
///
/// # Errors
/// If a given folder or the archive cannot be read or written, another process writes into the archive, no campaign can be
/// used, or the work is stopped; what was gathered until then stays.
#[cfg(feature = "parquet")]
pub fn run(host: &dyn Host, request: &Request) -> Result<(ArchiveOutput, Ending), WorkflowError> {
    gathering::run(host, request)
}

/// Says that this build has no Parquet.
///
/// # Errors
/// Always.
#[cfg(not(feature = "parquet"))]
pub fn run(_host: &dyn Host, _request: &Request) -> Result<(ArchiveOutput, Ending), WorkflowError> {
    Err(WorkflowError::Failed(
        "this build of updraft has no Parquet, which archives are made of: build it with the feature \
         `parquet`"
            .to_owned(),
    ))
}

/// Whether a folder can become an archive: it is one, or holds nothing that is somebody else's.
///
/// # Errors
/// A sentence that names the folder.
#[cfg_attr(not(feature = "parquet"), expect(dead_code, reason = "nothing is written there"))]
fn check_place(archive: &Path) -> Result<(), WorkflowError> {
    use crate::archive::{TABLES, find::holds_campaign, index::index_path};
    use crate::base::plain::Shown as _;

    if index_path(archive).is_file() {
        return Ok(());
    }
    let is_foreign = |name: &str| !name.starts_with('.') && !TABLES.contains(&name);
    let mut entries = std::fs::read_dir(archive).into_iter().flatten().flatten();
    let is_occupied = entries.any(|entry| is_foreign(&entry.file_name().to_string_lossy()));
    if holds_campaign(archive) || is_occupied {
        return Err(WorkflowError::Usage(format!(
            "{} holds other files and no archive; name another folder with -o",
            archive.shown()
        )));
    }
    Ok(())
}
