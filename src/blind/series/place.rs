//! Folders of a table of blind flights: where results lie, and where each process flies.

use std::path::PathBuf;

use crate::base::file::FileError;
use crate::base::own_folder::OwnFolder;

/// Folder of a table of blind flights.
#[derive(Clone, Debug)]
pub struct Place {
    /// Folder that holds the table's files.
    pub folder: PathBuf,
    /// Whether flights are kept after they are scored.
    pub keep: bool,
    /// Folder in which flights are flown before they are scored, best on a disk of this machine alone;
    /// `None`: `work/` in the table's folder.
    pub scratch: Option<PathBuf>,
}

impl Place {
    /// Path of the result of a flight.
    pub(super) fn result(&self, index: usize) -> PathBuf {
        self.folder.join("flights").join(format!("{index:05}.json"))
    }

    /// Folder of a flight that was kept: `flight/`, `sealed/` and `verdict.json`.
    pub fn work(&self, index: usize) -> PathBuf {
        self.folder.join("work").join(format!("{index:05}"))
    }

    /// Folder in which flights are flown.
    fn flying_in(&self) -> PathBuf {
        self.scratch.clone().unwrap_or_else(|| self.folder.join("work"))
    }

    /// Folder in which this process flies a flight; no other process uses it.
    pub(super) fn flying(&self, index: usize) -> Result<OwnFolder, FileError> {
        OwnFolder::make(&self.flying_in(), &format!("{index:05}"))
    }

    /// Removes what killed processes of this machine were flying in.
    pub(super) fn sweep(&self) {
        OwnFolder::sweep(&self.flying_in());
        OwnFolder::sweep(&self.folder.join("work"));
    }
}
