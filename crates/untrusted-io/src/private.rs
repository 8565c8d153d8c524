//! Folders and files that belong to one user alone: others can neither read them nor put anything
//! into them.

use std::fs::{self, File, OpenOptions};
use std::io;
use std::path::Path;

/// Why a folder or file of another is not used.
#[cfg(unix)]
fn foreign(what: &str) -> io::Error {
    io::Error::new(
        io::ErrorKind::PermissionDenied,
        format!("{what}: remove it, or work as the user who owns it"),
    )
}

/// Whether `path` itself is what it must be (no link to it) and of this user.
#[cfg(unix)]
fn check(path: &Path, is_right: impl Fn(&fs::Metadata) -> bool) -> io::Result<fs::Metadata> {
    use std::os::unix::fs::MetadataExt as _;
    let metadata = fs::symlink_metadata(path)?;
    if metadata.is_symlink() {
        Err(foreign("it is a symbolic link, which somebody may have put there"))
    } else if !is_right(&metadata) {
        Err(foreign("it is something else"))
    } else if metadata.uid() != rustix::process::geteuid().as_raw() {
        Err(foreign("it belongs to another user"))
    } else {
        Ok(metadata)
    }
}

#[cfg(unix)]
fn close_to_others(path: &Path, before: &fs::Metadata, mode: u32) -> io::Result<()> {
    use std::os::unix::fs::PermissionsExt as _;
    if before.permissions().mode() & 0o077 != 0 {
        fs::set_permissions(path, fs::Permissions::from_mode(mode))?;
    }
    Ok(())
}

/// Creates a folder that only this user can look into, or accepts one that is there if it is
/// theirs, and closes it to others.
///
/// # Errors
///
/// If the path is a symbolic link, no folder, or belongs to another user, or if the operating
/// system refuses.
pub fn own_folder(path: &Path) -> io::Result<()> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::DirBuilderExt as _;
        match fs::DirBuilder::new().mode(0o700).create(path) {
            Ok(()) => {}
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
            Err(error) => return Err(error),
        }
        let metadata = check(path, fs::Metadata::is_dir)?;
        close_to_others(path, &metadata, 0o700)
    }
    #[cfg(not(unix))]
    fs::create_dir_all(path)
}

/// Checks that a folder exists and belongs to this user.
///
/// # Errors
///
/// If it does not exist, is a symbolic link, or belongs to another user.
pub fn is_own_folder(path: &Path) -> io::Result<()> {
    #[cfg(unix)]
    return check(path, fs::Metadata::is_dir).map(drop);
    #[cfg(not(unix))]
    fs::metadata(path).map(drop)
}

/// Opens a file that only this user can read, with these options; creates it if they say so.
///
/// # Errors
///
/// If the path is a symbolic link, no regular file, or belongs to another user, or if the operating
/// system refuses.
pub fn open_own(path: &Path, options: &mut OpenOptions) -> io::Result<File> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::{MetadataExt as _, OpenOptionsExt as _};
        // Before it is opened: a pipe would make this wait.
        match check(path, fs::Metadata::is_file) {
            Ok(metadata) => close_to_others(path, &metadata, 0o600)?,
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            Err(error) => return Err(error),
        }
        let file = options.mode(0o600).open(path)?;
        // And after: somebody may have put another there meanwhile.
        let (there, opened) = (check(path, fs::Metadata::is_file)?, file.metadata()?);
        if (there.dev(), there.ino()) == (opened.dev(), opened.ino()) {
            Ok(file)
        } else {
            Err(foreign("it has just been replaced"))
        }
    }
    #[cfg(not(unix))]
    options.open(path)
}

#[cfg(unix)]
#[cfg(test)]
mod tests {
    use std::io::Write as _;
    use std::os::unix::fs::{MetadataExt as _, PermissionsExt as _, symlink};

    use super::*;

    fn mode(path: &Path) -> u32 {
        fs::metadata(path).unwrap().permissions().mode() & 0o777
    }

    #[test]
    fn folders_and_files_are_closed_to_others() {
        let root = tempfile::tempdir().unwrap();
        let folder = root.path().join("orders");
        own_folder(&folder).unwrap();
        assert_eq!(mode(&folder), 0o700);
        fs::set_permissions(&folder, fs::Permissions::from_mode(0o777)).unwrap();
        own_folder(&folder).unwrap();
        assert_eq!(mode(&folder), 0o700);
        let file = folder.join("journal");
        fs::write(&file, "a").unwrap();
        fs::set_permissions(&file, fs::Permissions::from_mode(0o666)).unwrap();
        let mut open = open_own(&file, OpenOptions::new().append(true).create(true)).unwrap();
        open.write_all(b"b").unwrap();
        assert_eq!((mode(&file), fs::read(&file).unwrap().as_slice()), (0o600, &b"ab"[..]));
        open_own(&folder.join("new"), OpenOptions::new().append(true).create(true)).unwrap();
        assert_eq!(mode(&folder.join("new")), 0o600);
    }

    #[test]
    fn links_and_what_is_of_others_are_refused() {
        let root = tempfile::tempdir().unwrap();
        let (target, link) = (root.path().join("target"), root.path().join("link"));
        fs::create_dir(&target).unwrap();
        symlink(&target, &link).unwrap();
        let refused = |error: io::Error| {
            assert_eq!(error.kind(), io::ErrorKind::PermissionDenied, "{error}");
            error.to_string()
        };
        assert!(refused(own_folder(&link).unwrap_err()).contains("symbolic link"));
        assert!(refused(is_own_folder(&link).unwrap_err()).contains("symbolic link"));
        let file = root.path().join("file");
        symlink(root.path().join("not-there-yet"), &file).unwrap();
        let mut options = OpenOptions::new();
        options.append(true).create(true);
        assert!(refused(open_own(&file, &mut options).unwrap_err()).contains("symbolic link"));
        assert!(!root.path().join("not-there-yet").exists());
        assert!(refused(open_own(&target, &mut options).unwrap_err()).contains("something else"));
        // The system's own folder belongs to another, unless the test runs as that.
        let of_root = Path::new("/etc");
        let own = fs::metadata(&target).unwrap().uid();
        if fs::metadata(of_root).unwrap().uid() != own {
            assert!(refused(own_folder(of_root).unwrap_err()).contains("another user"));
        } else if std::os::unix::fs::chown(&target, Some(own + 1), None).is_ok() {
            assert!(refused(own_folder(&target).unwrap_err()).contains("another user"));
            assert!(refused(is_own_folder(&target).unwrap_err()).contains("another user"));
        }
    }
}
