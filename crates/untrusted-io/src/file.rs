//! Whole files: nothing half-written is ever taken for a finished file.

use std::fs::{self, File, Metadata, TryLockError};
use std::io::{self, BufWriter, Read, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;
use thiserror::Error;

use crate::owner;
use crate::plain::Shown as _;

/// Prefix of the names of unfinished files, by which a later step recognises and sweeps them; the
/// [`mark`](crate::owner::mark) of the process that writes follows.
pub const PARTIAL_PREFIX: &str = ".partial-";

/// A file could not be read or written.
#[derive(Debug, Error)]
#[error("failed to {action} {}", path.shown())]
pub struct FileError {
    /// The attempted operation, as a verb phrase: "read", "write", "create the folder".
    pub action: &'static str,
    /// Path of the file or folder.
    pub path: PathBuf,
    /// Reason given by the operating system.
    #[source]
    pub source: io::Error,
}

impl FileError {
    /// Wraps an I/O error with the attempted operation and the path.
    pub fn new(action: &'static str, path: &Path, source: io::Error) -> Self {
        Self { action, path: path.to_owned(), source }
    }
}

/// Writes a whole file: temporary file beside it, flush to disk, rename.
///
/// A reader sees the old content or the new one, never a part. Missing parent folders are created.
///
/// # Errors
///
/// If the folder or the file cannot be written; the old content stays then.
pub fn write_whole(path: &Path, content: &[u8]) -> Result<(), FileError> {
    write_with(path, |out| out.write_all(content))
}

/// Like [`write_whole`], with the content streamed by `fill`.
///
/// When `fill` fails, the temporary file is removed and `path` is untouched.
///
/// # Errors
///
/// The error of `fill`, or that of writing; the old content stays then.
pub fn write_with(
    path: &Path,
    fill: impl FnOnce(&mut BufWriter<&mut File>) -> io::Result<()>,
) -> Result<(), FileError> {
    write_as(path, 0o644, fill)
}

/// Writes a whole file as [`write_whole`] does, readable by its owner alone (mode 0600 on Unix).
///
/// # Errors
///
/// As [`write_whole`].
pub fn write_private(path: &Path, content: &[u8]) -> Result<(), FileError> {
    write_as(path, 0o600, |out| out.write_all(content))
}

/// `mode`: who may do what with it, where files have modes.
fn write_as(
    path: &Path,
    mode: u32,
    fill: impl FnOnce(&mut BufWriter<&mut File>) -> io::Result<()>,
) -> Result<(), FileError> {
    let temporary = filled(path, mode, fill)?;
    let fail = |source| FileError::new("write", path, source);
    temporary.persist(path).map_err(|error| fail(error.error))?;
    sync_folder(path);
    Ok(())
}

/// Writes a whole file unless there is one; returns whether it was written. Of several processes that
/// try at the same time, one succeeds.
///
/// # Errors
///
/// If the folder or the file cannot be written.
pub fn write_new(path: &Path, content: &[u8]) -> Result<bool, FileError> {
    let temporary = filled(path, 0o644, |out| out.write_all(content))?;
    match temporary.persist_noclobber(path) {
        Ok(_) => {
            sync_folder(path);
            Ok(true)
        }
        Err(error) if error.error.kind() == io::ErrorKind::AlreadyExists => Ok(false),
        Err(error) => Err(FileError::new("write", path, error.error)),
    }
}

fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

/// A rename is durable only once the folder is on disk; not every file system allows it.
fn sync_folder(path: &Path) {
    if let Ok(folder) = File::open(folder_of(path)) {
        let _ = folder.sync_all();
    }
}

/// The temporary file that becomes `path`, written and flushed to disk.
#[cfg_attr(not(unix), expect(unused_variables, reason = "files have no modes there"))]
fn filled(
    path: &Path,
    mode: u32,
    fill: impl FnOnce(&mut BufWriter<&mut File>) -> io::Result<()>,
) -> Result<NamedTempFile, FileError> {
    let folder = folder_of(path);
    create_folder(folder)?;
    let fail = |source| FileError::new("write", path, source);
    let prefix = format!("{PARTIAL_PREFIX}{}-", owner::mark());
    let mut builder = tempfile::Builder::new();
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(mode));
    }
    let mut temporary: NamedTempFile = builder.prefix(&prefix).tempfile_in(folder).map_err(fail)?;
    // As long as it is locked, nobody sweeps it. Where it cannot be, the folder's lock must do.
    let _ = temporary.as_file().try_lock();
    {
        let mut out = BufWriter::with_capacity(1 << 16, temporary.as_file_mut());
        fill(&mut out).and_then(|()| out.flush()).map_err(fail)?;
    }
    temporary.as_file().sync_all().map_err(fail)?;
    Ok(temporary)
}

/// Creates a folder and its parents, if they do not exist.
///
/// # Errors
///
/// If a folder cannot be created, or a file is in its place.
pub fn create_folder(path: &Path) -> Result<(), FileError> {
    fs::create_dir_all(path).map_err(|source| FileError::new("create the folder", path, source))
}

/// Opens a regular file for reading. Anything else is refused before it is opened: a named pipe may
/// block its reader for ever, and a device may never end.
///
/// # Errors
///
/// `IsADirectory` for a folder, `InvalidInput` for a pipe, a socket or a device, otherwise the
/// operating system's error.
pub fn open_regular(path: &Path) -> io::Result<(File, Metadata)> {
    let regular = |metadata: &Metadata| match metadata {
        of if of.is_file() => Ok(()),
        of if of.is_dir() => Err(io::Error::from(io::ErrorKind::IsADirectory)),
        _ => Err(io::Error::new(
            io::ErrorKind::InvalidInput,
            "it is not a file but a pipe, a socket or a device",
        )),
    };
    regular(&fs::metadata(path)?)?;
    let file = File::open(path)?;
    // Another may stand there by now.
    let metadata = file.metadata()?;
    regular(&metadata)?;
    Ok((file, metadata))
}

/// Opens a file that a user names: a regular file, or anything below `/dev` that is no folder, such
/// as the pipe of a shell's `<(...)`.
///
/// # Errors
///
/// As [`open_regular`]; below `/dev` the operating system's error.
pub fn open_named(path: &Path) -> io::Result<File> {
    let is_dir = || fs::metadata(path).is_ok_and(|metadata| metadata.is_dir());
    if path.starts_with("/dev") && !is_dir() {
        return File::open(path);
    }
    open_regular(path).map(|(file, _)| file)
}

/// Reads a whole file.
///
/// # Errors
///
/// `FileTooLarge` if the file holds more than `limit_bytes`, or never ends; otherwise the operating
/// system's error.
pub fn read_whole(path: &Path, limit_bytes: u64) -> Result<Vec<u8>, FileError> {
    let fail = |source| FileError::new("read", path, source);
    let file = open_named(path).map_err(fail)?;
    let size = file.metadata().map_err(fail)?.len();
    let too_large = |size: String| {
        fail(io::Error::new(
            io::ErrorKind::FileTooLarge,
            format!("the file has {size} bytes, more than the {limit_bytes} allowed here"),
        ))
    };
    if size > limit_bytes {
        return Err(too_large(size.to_string()));
    }
    let mut content = Vec::with_capacity(size as usize);
    file.take(limit_bytes.saturating_add(1)).read_to_end(&mut content).map_err(fail)?;
    if content.len() as u64 > limit_bytes {
        return Err(too_large("more".to_owned()));
    }
    Ok(content)
}

/// Bytes that are read at a time; they stay in the processor's cache.
const PIECE_BYTES: usize = 1 << 17;

/// Reads a regular file from start to end, piece by piece; returns its size in bytes.
///
/// # Errors
///
/// If the file is not a regular file, or cannot be read.
pub fn read_pieces(path: &Path, mut piece: impl FnMut(&[u8])) -> Result<u64, FileError> {
    let fail = |source| FileError::new("read", path, source);
    let (mut file, _) = open_regular(path).map_err(fail)?;
    let mut buffer = vec![0; PIECE_BYTES];
    let mut size_bytes = 0;
    loop {
        match file.read(&mut buffer) {
            Ok(0) => return Ok(size_bytes),
            Ok(count) => {
                piece(buffer.get(..count).unwrap_or_default());
                size_bytes += count as u64;
            }
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(fail(error)),
        }
    }
}

/// Removes the temporary files that a killed run left in `folder` (not in its subfolders) and
/// returns their number. Files that are still being written stay: those that are locked, those of a
/// process that runs, and those of other machines, whose processes nobody here can see.
///
/// # Errors
///
/// If the folder cannot be read, or a file cannot be removed.
pub fn sweep_partial(folder: &Path) -> Result<usize, FileError> {
    let fail = |source| FileError::new("clean", folder, source);
    let mut swept = 0;
    for entry in fs::read_dir(folder).map_err(fail)? {
        let entry = entry.map_err(fail)?;
        let is_file = entry.file_type().is_ok_and(|kind| kind.is_file());
        let name = entry.file_name();
        let name = name.to_string_lossy();
        if is_file
            && name.starts_with(PARTIAL_PREFIX)
            && owner::may_run(&name, PARTIAL_PREFIX) != Some(true)
            && !is_being_written(&entry.path())
        {
            match fs::remove_file(entry.path()) {
                Ok(()) => swept += 1,
                // Renamed or removed by its writer meanwhile.
                Err(error) if error.kind() == io::ErrorKind::NotFound => {}
                Err(error) => return Err(fail(error)),
            }
        }
    }
    Ok(swept)
}

fn is_being_written(path: &Path) -> bool {
    let Ok(file) = File::open(path) else { return false };
    matches!(file.try_lock(), Err(TryLockError::WouldBlock))
}

/// Folders below a campaign's that files are written into: `flight/logs/flight-1`,
/// `gap/report/figures`.
const SWEPT_DEPTH: usize = 4;
/// Folders that are looked into.
const SWEPT_FOLDERS: usize = 10_000;

/// Applies [`sweep_partial`] to a folder and those below it, and returns the number of files
/// removed. Links are not followed, and what cannot be read or removed is left.
pub fn sweep_below(folder: &Path) -> usize {
    let mut swept = 0;
    let mut left = SWEPT_FOLDERS;
    let mut open = vec![(folder.to_owned(), 0)];
    while let Some((folder, depth)) = open.pop() {
        swept += sweep_partial(&folder).unwrap_or(0);
        if depth == SWEPT_DEPTH {
            continue;
        }
        let Ok(entries) = fs::read_dir(&folder) else { continue };
        for entry in entries.flatten() {
            let is_hidden = entry.file_name().to_string_lossy().starts_with('.');
            if left > 0 && !is_hidden && entry.file_type().is_ok_and(|kind| kind.is_dir()) {
                left -= 1;
                open.push((entry.path(), depth + 1));
            }
        }
    }
    swept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_write_leaves_the_old_file_and_no_rubbish() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        write_whole(&path, b"old").unwrap();
        let failed = write_with(&path, |out| {
            out.write_all(b"half of the new")?;
            Err(io::Error::other("disk full"))
        });
        assert!(failed.unwrap_err().to_string().contains("a.txt"));
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn of_several_writers_one_is_the_first() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("record.json");
        let first = std::thread::scope(|scope| {
            let write = |text: u8| {
                scope.spawn({
                    let path = &path;
                    move || write_new(path, &[text]).unwrap()
                })
            };
            let writers: Vec<_> = (0..8).map(write).collect();
            writers
                .into_iter()
                .filter_map(|writer| writer.join().ok())
                .filter(|first| *first)
                .count()
        });
        assert_eq!(first, 1);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn files_of_other_machines_and_of_running_processes_are_not_swept() {
        let folder = tempfile::tempdir().unwrap();
        let mine = format!("{PARTIAL_PREFIX}{}-abc", owner::mark());
        let theirs = format!("{PARTIAL_PREFIX}node7-01234567-1-abc");
        let ended = mine.replace(&format!("-{}-", std::process::id()), "-2147483646-");
        for name in [&mine, &theirs, &ended] {
            fs::write(folder.path().join(name), b"half").unwrap();
        }
        assert_eq!(sweep_partial(folder.path()).unwrap(), 1);
        assert!(folder.path().join(mine).exists() && folder.path().join(theirs).exists());
    }

    #[test]
    fn sweeps_only_what_a_killed_run_left() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join(".partial-abc"), b"half").unwrap();
        fs::write(folder.path().join("01.BIN"), b"whole").unwrap();
        assert_eq!(sweep_partial(folder.path()).unwrap(), 1);
        assert!(folder.path().join("01.BIN").exists());
    }

    #[test]
    fn sweeps_all_folders_but_no_file_that_is_being_written() {
        let root = tempfile::tempdir().unwrap();
        let folders = ["", "a", "a/logs", "a/logs/older", "report/figures", "gap/report/figures"];
        for folder in folders {
            fs::create_dir_all(root.path().join(folder)).unwrap();
            fs::write(root.path().join(folder).join(".partial-abc"), b"half").unwrap();
        }
        let path = root.path().join("a/logs/01.BIN");
        write_with(&path, |out| {
            out.write_all(b"half")?;
            assert_eq!(sweep_below(root.path()), folders.len());
            assert_eq!(sweep_below(root.path()), 0);
            out.write_all(b" and half")
        })
        .unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"half and half");
        assert_eq!(fs::read_dir(root.path().join("a/logs")).unwrap().count(), 2);
    }

    #[cfg(unix)]
    #[test]
    fn what_has_no_end_or_no_beginning_is_not_read() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe");
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        let refused = |path: &Path| {
            let whole = read_whole(path, 1 << 20).unwrap_err();
            let pieces = read_pieces(path, |_| ()).unwrap_err();
            (whole.source.kind(), pieces.source.kind())
        };
        let (wrong, large) = (io::ErrorKind::InvalidInput, io::ErrorKind::FileTooLarge);
        assert_eq!(refused(&pipe), (wrong, wrong));
        assert_eq!(refused(Path::new("/dev/zero")), (large, wrong));
        let directory = io::ErrorKind::IsADirectory;
        assert_eq!(refused(folder.path()), (directory, directory));
        assert_eq!(read_whole(Path::new("/dev/null"), 10).unwrap(), b"");
    }

    #[test]
    fn refuses_a_file_over_the_limit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("big");
        fs::write(&path, [0_u8; 20]).unwrap();
        assert!(read_whole(&path, 10).is_err());
        assert_eq!(read_whole(&path, 20).unwrap().len(), 20);
    }
}
