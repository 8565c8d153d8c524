//! Folders of a table of blind flights: where results lie, and where each process flies.

use std::path::{Path, PathBuf};

use crate::base::file::{FileError, create_folder};
use crate::base::owner;
use crate::blind::error::BlindError;

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

    /// Folder in which this process flies a flight; no other process uses it.
    pub(super) fn flying(&self, index: usize) -> Flying {
        let work = self.scratch.clone().unwrap_or_else(|| self.folder.join("work"));
        Flying(work.join(format!("{FLYING_PREFIX}{}-{index:05}", owner::mark())))
    }

    /// Removes what killed processes of this machine were flying in.
    pub(super) fn sweep(&self) {
        let folders = [Some(self.folder.join("work")), self.scratch.clone()];
        for entry in folders.iter().flatten().filter_map(|folder| std::fs::read_dir(folder).ok()) {
            for entry in entry.flatten() {
                let name = entry.file_name();
                if owner::may_run(&name.to_string_lossy(), FLYING_PREFIX) == Some(false) {
                    // A peer may be sweeping it, too.
                    let _ = std::fs::remove_dir_all(entry.path());
                }
            }
        }
    }
}

/// Beginning of the names of folders in which a process flies.
const FLYING_PREFIX: &str = ".flying-";

/// Folder in which a flight is flown; it goes with its value.
pub(super) struct Flying(pub(super) PathBuf);

impl Flying {
    /// Moves the flight to where it is kept. If another process has kept it already, that is the same.
    pub(super) fn keep(&self, kept: &Path) -> Result<(), BlindError> {
        let fail = |error| FileError::new("keep the flight in", kept, error);
        create_folder(kept.parent().unwrap_or(kept))?;
        if !is_whole(kept) && kept.exists() {
            // From a version that flew in this place.
            std::fs::remove_dir_all(kept).map_err(fail)?;
        }
        match std::fs::rename(&self.0, kept) {
            Err(_) if is_whole(kept) => Ok(()),
            // Scratch may be another disk.
            Err(error) if error.kind() == std::io::ErrorKind::CrossesDevices => {
                let name = kept.file_name().unwrap_or_default().to_string_lossy();
                let name = format!("{FLYING_PREFIX}{}-{name}", owner::mark());
                let beside = Self(kept.with_file_name(name));
                copy_folder(&self.0, &beside.0)?;
                match std::fs::rename(&beside.0, kept) {
                    Err(error) if !is_whole(kept) => Err(fail(error).into()),
                    _ => Ok(()),
                }
            }
            done => Ok(done.map_err(fail)?),
        }
    }
}

impl Drop for Flying {
    fn drop(&mut self) {
        // What cannot be removed is swept by a later run.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Whether a kept flight is whole: it is moved there when it has its verdict.
fn is_whole(kept: &Path) -> bool {
    kept.join("verdict.json").is_file()
}

/// Copies a flight's folder to another disk.
fn copy_folder(from: &Path, to: &Path) -> Result<(), BlindError> {
    let mut open = vec![(from.to_owned(), to.to_owned())];
    while let Some((from, to)) = open.pop() {
        create_folder(&to)?;
        let fail = |error| FileError::new("read", &from, error);
        for entry in std::fs::read_dir(&from).map_err(fail)? {
            let entry = entry.map_err(fail)?;
            let (path, copy) = (entry.path(), to.join(entry.file_name()));
            if entry.file_type().map_err(fail)?.is_dir() {
                open.push((path, copy));
            } else {
                std::fs::copy(&path, &copy)
                    .map_err(|error| FileError::new("write", &copy, error))?;
            }
        }
    }
    Ok(())
}
