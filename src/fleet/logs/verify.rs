//! Check whether a folder of logs is still what its manifest says.

use std::fs;
use std::io::ErrorKind;
use std::path::Path;

use super::manifest::{ManifestEntry, Shelf};
use super::part::sums;
use crate::base::file::FileError;
use crate::campaign::CampaignError;
use crate::log::Log;

/// A log of the manifest, with its faults.
#[derive(Clone, Debug, PartialEq)]
pub struct Checked {
    /// Entry of the log in the manifest.
    pub entry: ManifestEntry,
    /// Faults of the log; empty if it is as it came.
    pub faults: Vec<Fault>,
}

/// Fault of a log.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Fault {
    /// The file cannot be read.
    #[error("cannot be read: {0}; pull or import it again")]
    Unreadable(String),
    /// The file has another size than when it came.
    #[error("has {found} bytes, but had {right} when it was downloaded; pull or import it again")]
    Size {
        /// Present size, bytes.
        found: u64,
        /// Size by the manifest, bytes.
        right: u64,
    },
    /// The file has another content than when it came.
    #[error("has changed since it was downloaded (different SHA-256); pull or import it again")]
    Changed,
    /// The log is incomplete, as the text says.
    #[error("is not known to be whole: {0}; pull it again, or import its card")]
    Incomplete(String),
    /// The file is whole, but not a log, as the text says.
    #[error("is what the drone had, but no log that can be read: {0}")]
    NotALog(String),
}

/// Checks every log of the manifest in `folder`: size, SHA-256, and whether it is a log.
///
/// # Errors
/// When the manifest cannot be read.
pub fn verify(folder: &Path) -> Result<Vec<Checked>, CampaignError> {
    let shelf = Shelf::open(folder, "")?;
    let check = |entry: &ManifestEntry| {
        let path = shelf.path(&entry.file);
        let mut faults = Vec::new();
        match sums(&path) {
            Err(error) => faults.push(Fault::Unreadable(error.source.to_string())),
            Ok(found) if found.size != entry.size_bytes => {
                faults.push(Fault::Size { found: found.size, right: entry.size_bytes });
            }
            Ok(found) if found.sha256 != entry.sha256 => faults.push(Fault::Changed),
            Ok(_) => {
                faults.extend(entry.incomplete.clone().map(Fault::Incomplete));
                if let Err(error) = Log::open(&path) {
                    faults.push(Fault::NotALog(error.to_string()));
                }
            }
        }
        Checked { entry: entry.clone(), faults }
    };
    Ok(shelf.manifest.logs.iter().map(check).collect())
}

/// Names of the logs in `folder` that its manifest does not have.
///
/// # Errors
/// When the folder or its manifest cannot be read; a folder that is not there has none.
pub fn unknown(folder: &Path) -> Result<Vec<String>, CampaignError> {
    let shelf = Shelf::open(folder, "")?;
    let fail = |error| FileError::new("read", folder, error);
    let entries = match fs::read_dir(folder) {
        Ok(entries) => entries,
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(Vec::new()),
        Err(error) => return Err(fail(error).into()),
    };
    let mut found = Vec::new();
    for entry in entries {
        let path = entry.map_err(fail)?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let is_log = path.extension().is_some_and(|end| end.eq_ignore_ascii_case("bin"));
        if is_log && path.is_file() && shelf.entry(&name).is_none() {
            found.push(name);
        }
    }
    found.sort();
    Ok(found)
}
