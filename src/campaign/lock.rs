//! Keeps two processes from writing into one campaign folder at the same time.
//!
//! The lock is the operating system's advisory lock on the folder itself, held as long as the process
//! lives: nothing is left behind, however it ends. Where folders cannot be locked (Windows), a file in
//! it stands in, which is removed at the end.

use std::fs::{self, File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

use super::{CampaignError, index_path};
use crate::base::file::{FileError, create_folder};

/// Lock on a folder, which this process alone writes into until the lock is dropped.
#[derive(Debug)]
pub struct FolderLock {
    path: PathBuf,
    locked: PathBuf,
    /// Open as long as the folder is locked; `None` where the file system knows no locks.
    file: Option<File>,
    /// The folder was made for the lock.
    made: bool,
}

impl FolderLock {
    /// Locks the campaign that a folder belongs to: the folder itself, or the one above when the
    /// folder is a flight of it. The folder is created if it does not exist, and removed again if
    /// nothing was written into it.
    ///
    /// # Errors
    ///
    /// [`CampaignError::Busy`] if another process holds it; [`CampaignError::File`] if the folder
    /// cannot be made or opened.
    pub fn take(folder: &Path) -> Result<Self, CampaignError> {
        let made = !folder.exists();
        create_folder(folder)?;
        let full = fs::canonicalize(folder).map_err(|e| FileError::new("open", folder, e))?;
        let campaign = full.parent().filter(|above| index_path(above).is_file());
        let path = campaign.unwrap_or(&full).to_owned();
        let file = open(&path).map_err(|error| FileError::new("lock", folder, error))?;
        let file = match file.try_lock() {
            Ok(()) => Some(file),
            Err(TryLockError::WouldBlock) => {
                return Err(CampaignError::Busy { path: folder.to_owned() });
            }
            // Some network file systems have no locks; the work is worth more than the lock.
            Err(TryLockError::Error(_)) => None,
        };
        Ok(Self { path: full, locked: path, file, made })
    }

    /// Folder that is locked: that of the whole campaign.
    pub fn folder(&self) -> &Path {
        &self.locked
    }

    /// Whether the file system supports the lock; if not, the folder is not protected.
    pub fn is_held(&self) -> bool {
        self.file.is_some()
    }
}

impl Drop for FolderLock {
    fn drop(&mut self) {
        if !cfg!(unix) {
            let _ = fs::remove_file(self.path.join(LOCK_FILE));
        }
        if self.made {
            // Only an empty folder can be removed.
            let _ = fs::remove_dir(&self.path);
        }
    }
}

/// Stands in for the folder where folders cannot be opened.
const LOCK_FILE: &str = ".lock";

fn open(folder: &Path) -> io::Result<File> {
    if cfg!(unix) {
        File::open(folder)
    } else {
        File::options().create(true).truncate(false).write(true).open(folder.join(LOCK_FILE))
    }
}

#[cfg(test)]
mod tests {
    use super::super::{CAMPAIGN_SCHEMA, CampaignIndex, to_json};
    use super::*;

    #[test]
    fn a_folder_is_locked_once_and_free_again() {
        let folder = tempfile::tempdir().unwrap();
        let campaign = folder.path().join("campaign");
        let held = FolderLock::take(&campaign).unwrap();
        assert!(held.is_held());
        let error = FolderLock::take(&campaign).unwrap_err();
        assert!(error.to_string().contains("another updraft"), "{error}");
        fs::write(campaign.join("plan.json"), "{}").unwrap();
        drop(held);
        drop(FolderLock::take(&campaign).unwrap());
        assert_eq!(fs::read_dir(&campaign).unwrap().count(), 1, "nothing but the plan is left");
    }

    #[test]
    fn an_empty_folder_made_for_the_lock_goes_with_it() {
        let folder = tempfile::tempdir().unwrap();
        drop(FolderLock::take(&folder.path().join("new")).unwrap());
        assert!(!folder.path().join("new").exists());
    }

    #[test]
    fn a_flight_is_locked_with_its_campaign() {
        let folder = tempfile::tempdir().unwrap();
        let index = CampaignIndex {
            schema: CAMPAIGN_SCHEMA.to_owned(),
            name: "x".to_owned(),
            title: "x".to_owned(),
            flights: vec!["hover".to_owned()],
        };
        fs::write(index_path(folder.path()), to_json(&index).unwrap()).unwrap();
        let _held = FolderLock::take(&folder.path().join("hover")).unwrap();
        assert!(FolderLock::take(folder.path()).is_err());
    }
}
