//! Folders that one process works in, among others that work beside it and may be killed.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use super::file::{FileError, create_folder};
use super::owner;

/// Beginning of the names of such folders; the mark of the process follows.
const PREFIX: &str = ".flying-";

/// Folder of this process alone; it is removed with its value.
#[derive(Debug)]
pub struct OwnFolder(PathBuf);

impl OwnFolder {
    /// Makes the folder, in `above` and with `name` in its name.
    ///
    /// # Errors
    ///
    /// If it cannot be made.
    pub fn make(above: &Path, name: &str) -> Result<Self, FileError> {
        let folder = Self::named(above, name);
        create_folder(&folder.0)?;
        Ok(folder)
    }

    fn named(above: &Path, name: &str) -> Self {
        Self(above.join(format!("{PREFIX}{}-{name}", owner::mark())))
    }

    /// Path of the folder.
    pub fn path(&self) -> &Path {
        &self.0
    }

    /// Moves the folder to where it is kept. `whole` is a file that a whole one has; if there is one already,
    /// another process was first, with the same.
    ///
    /// # Errors
    ///
    /// If it cannot be moved or copied.
    pub fn keep(&self, kept: &Path, whole: &str) -> Result<(), FileError> {
        let fail = |error| FileError::new("keep", kept, error);
        let is_whole = || kept.join(whole).is_file();
        create_folder(kept.parent().unwrap_or(kept))?;
        if !is_whole() && kept.exists() {
            // From a run that worked in this place.
            std::fs::remove_dir_all(kept).map_err(fail)?;
        }
        match std::fs::rename(&self.0, kept) {
            Err(_) if is_whole() => Ok(()),
            // It may lie on another disk.
            Err(error) if error.kind() == ErrorKind::CrossesDevices => {
                let name = kept.file_name().unwrap_or_default().to_string_lossy();
                let beside = Self::named(kept.parent().unwrap_or(kept), &name);
                copy(&self.0, &beside.0)?;
                match std::fs::rename(&beside.0, kept) {
                    Err(error) if !is_whole() => Err(fail(error)),
                    _ => Ok(()),
                }
            }
            done => done.map_err(fail),
        }
    }

    /// Removes what processes of this machine that have ended left in a folder.
    pub fn sweep(above: &Path) {
        for entry in std::fs::read_dir(above).into_iter().flatten().flatten() {
            let name = entry.file_name();
            if owner::may_run(&name.to_string_lossy(), PREFIX) == Some(false) {
                // A peer may be sweeping it, too.
                let _ = std::fs::remove_dir_all(entry.path());
            }
        }
    }
}

impl Drop for OwnFolder {
    fn drop(&mut self) {
        // What cannot be removed is swept by a later run.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Copies a folder to another disk.
fn copy(from: &Path, to: &Path) -> Result<(), FileError> {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_goes_with_its_value_unless_it_is_kept() {
        let above = tempfile::tempdir().unwrap();
        let kept = above.path().join("kept").join("00007");
        for _ in 0..2 {
            let own = OwnFolder::make(above.path(), "00007").unwrap();
            std::fs::create_dir(own.path().join("below")).unwrap();
            std::fs::write(own.path().join("below/verdict.json"), "{}").unwrap();
            own.keep(&kept, "below/verdict.json").unwrap();
        }
        drop(OwnFolder::make(above.path(), "00008").unwrap());
        assert!(kept.join("below/verdict.json").exists());
        assert_eq!(std::fs::read_dir(above.path()).unwrap().count(), 1);
    }

    #[test]
    fn another_disk_is_copied_to() {
        let (above, other) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        std::fs::create_dir(above.path().join("a")).unwrap();
        std::fs::write(above.path().join("a/b"), "b").unwrap();
        copy(above.path(), &other.path().join("copy")).unwrap();
        assert_eq!(std::fs::read(other.path().join("copy/a/b")).unwrap(), b"b");
    }

    #[test]
    fn folders_of_killed_processes_are_swept_and_no_others() {
        let above = tempfile::tempdir().unwrap();
        let own = OwnFolder::make(above.path(), "1").unwrap();
        let process = format!("-{}-", std::process::id());
        let name =
            own.path().file_name().unwrap().to_string_lossy().replace(&process, "-2147483646-");
        for name in [name.as_str(), ".flying-node9-01234567-1-2", "00003"] {
            std::fs::create_dir(above.path().join(name)).unwrap();
        }
        OwnFolder::sweep(above.path());
        assert!(own.path().exists() && !above.path().join(&name).exists());
        assert_eq!(std::fs::read_dir(above.path()).unwrap().count(), 3);
    }
}
