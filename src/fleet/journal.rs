//! Journal of a fleet, one event per line, in the campaign folder: `fleet-journal.ndjson`.
//!
//! Every line is one JSON object and is on the disk before the next thing is done, so that what
//! led to an accident is not lost with the station.

use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::base::file::{FileError, create_folder};
use crate::base::private::open_own;
use crate::link::id::DroneId;

/// Name of the journal in a campaign folder.
pub const JOURNAL_FILE: &str = "fleet-journal.ndjson";

/// A line of the journal.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Entry<'a, T> {
    /// Unix time of the station, us.
    pub unix_us: u64,
    /// Vehicle that the event is about; `None` for the station, or all vehicles.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub drone: Option<DroneId>,
    /// Event that is recorded.
    #[serde(flatten)]
    pub event: &'a T,
}

/// The journal, open for appending.
#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    file: File,
}

impl Journal {
    /// Opens the journal of a folder for appending, readable by its user alone.
    ///
    /// # Errors
    ///
    /// If the file cannot be opened or created.
    pub fn open(folder: &Path) -> Result<Self, FileError> {
        create_folder(folder)?;
        let path = folder.join(JOURNAL_FILE);
        let file = open_own(&path, OpenOptions::new().create(true).append(true))
            .map_err(|source| FileError::new("open the journal", &path, source))?;
        Ok(Self { path, file })
    }

    /// Appends a line and flushes it to the file.
    ///
    /// # Errors
    ///
    /// If the entry has no form as JSON, or the file cannot be written.
    pub fn write<T: Serialize>(&mut self, entry: &Entry<'_, T>) -> Result<(), FileError> {
        let fail = |source| FileError::new("write the journal", &self.path, source);
        let mut line = serde_json::to_vec(entry).map_err(|error| fail(error.into()))?;
        line.push(b'\n');
        self.file.write_all(&line).and_then(|()| self.file.flush()).map_err(fail)
    }
}

#[cfg(unix)]
#[cfg(test)]
mod tests {
    use std::fs;
    use std::os::unix::fs::{PermissionsExt as _, symlink};

    use super::*;

    #[test]
    fn a_journal_is_its_users_alone_and_no_link() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(JOURNAL_FILE);
        fs::write(&path, "{}\n").unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(0o644)).unwrap();
        let entry = Entry { unix_us: 1, drone: None, event: &serde_json::json!({ "a": "\n" }) };
        Journal::open(folder.path()).unwrap().write(&entry).unwrap();
        assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o600);
        assert_eq!(fs::read_to_string(&path).unwrap().lines().count(), 2);
        let other = folder.path().join("other");
        fs::rename(&path, &other).unwrap();
        symlink(&other, &path).unwrap();
        let error = Journal::open(folder.path()).unwrap_err();
        assert!(error.source.to_string().contains("symbolic link"), "{error:?}");
    }
}
