//! Storage of a virtual vehicle's files: in memory, or in a folder.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File, OpenOptions};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Component, Path, PathBuf};

/// Error of a file operation, as a vehicle would report it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StorageError {
    /// The file or folder does not exist.
    NotFound,
    /// The name leaves the storage, or is not a name.
    BadName,
    /// The operation failed with this number of the operating system.
    Failed(u8),
}

/// An entry of a folder: a file or a folder in it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Entry {
    /// Name of the file or folder, without the path to it.
    pub name: String,
    /// Size of the file, bytes; `None` for a folder.
    pub size: Option<u64>,
}

/// Files of a vehicle. Names are as the vehicle is asked for them: `/APM/LOGS/00000001.BIN`,
/// `logs/00000001.BIN`; a leading slash means nothing, and no name leads out of the storage.
pub trait Storage {
    /// Entries of a folder, sorted by name.
    fn list(&self, folder: &str) -> Result<Vec<Entry>, StorageError>;
    /// Size of a file, bytes.
    fn size(&self, name: &str) -> Result<u64, StorageError>;
    /// Reads from an offset and returns the number of bytes; fewer than asked for only at the end
    /// of the file.
    fn read_at(&self, name: &str, offset: u64, into: &mut [u8]) -> Result<usize, StorageError>;
    /// Writes at an offset; a gap before it is filled with zeros.
    fn write_at(&mut self, name: &str, offset: u64, data: &[u8]) -> Result<(), StorageError>;
    /// Creates a file or empties it; its folder must exist.
    fn create(&mut self, name: &str) -> Result<(), StorageError>;
    /// Removes a file, which must exist.
    fn remove(&mut self, name: &str) -> Result<(), StorageError>;
    /// Creates a folder; the one above it must exist.
    fn create_folder(&mut self, name: &str) -> Result<(), StorageError>;
}

/// Normal form of a name: parts joined by `/`, none of them special; empty for the root.
///
/// # Errors
///
/// [`StorageError::BadName`] if it leaves the storage.
pub fn plain_name(name: &str) -> Result<String, StorageError> {
    let name = name.trim_end_matches('\0');
    let parts: Vec<&str> = name.split('/').filter(|part| !matches!(*part, "" | ".")).collect();
    let bad = |part: &&str| *part == ".." || part.contains(['\\', ':', '\0']);
    if parts.iter().any(bad) {
        return Err(StorageError::BadName);
    }
    Ok(parts.join("/"))
}

/// Storage in memory, which is gone with the vehicle.
#[derive(Clone, Debug, Default)]
pub struct MemoryStorage {
    files: BTreeMap<String, Vec<u8>>,
    folders: BTreeSet<String>,
}

/// Largest file that is kept in memory, bytes: no request grows one further.
const MOST_IN_MEMORY: u64 = 1 << 30;

impl MemoryStorage {
    /// Stores a file, and creates the folders above it.
    ///
    /// # Errors
    ///
    /// [`StorageError::BadName`] if the name leaves the storage.
    pub fn put(&mut self, name: &str, content: Vec<u8>) -> Result<(), StorageError> {
        let name = plain_name(name)?;
        let mut folder = parent(&name);
        while !folder.is_empty() {
            self.folders.insert(folder.to_owned());
            folder = parent(folder);
        }
        self.files.insert(name, content);
        Ok(())
    }

    /// Content of a file; `None` if there is no such file.
    pub fn get(&self, name: &str) -> Option<&[u8]> {
        self.files.get(&plain_name(name).ok()?).map(Vec::as_slice)
    }

    /// Appends to a file, as to a log that still grows.
    ///
    /// # Errors
    ///
    /// [`StorageError::NotFound`] if there is no such file, [`StorageError::BadName`] if the name
    /// leaves the storage.
    pub fn append(&mut self, name: &str, more: &[u8]) -> Result<(), StorageError> {
        let file = self.files.get_mut(&plain_name(name)?).ok_or(StorageError::NotFound)?;
        file.extend_from_slice(more);
        Ok(())
    }
}

fn parent(name: &str) -> &str {
    name.rsplit_once('/').map_or("", |(folder, _)| folder)
}

impl Storage for MemoryStorage {
    fn list(&self, folder: &str) -> Result<Vec<Entry>, StorageError> {
        let folder = plain_name(folder)?;
        if !folder.is_empty() && !self.folders.contains(&folder) {
            return Err(StorageError::NotFound);
        }
        let here = |name: &&String| parent(name) == folder && !name.is_empty();
        let own = |name: &String| name.rsplit('/').next().unwrap_or_default().to_owned();
        let folders = self.folders.iter().filter(here);
        let files = self.files.iter().filter(|(name, _)| here(name));
        let mut entries: Vec<Entry> =
            folders
                .map(|name| Entry { name: own(name), size: None })
                .chain(files.map(|(name, content)| Entry {
                    name: own(name),
                    size: Some(content.len() as u64),
                }))
                .collect();
        entries.sort_by(|a, b| a.name.cmp(&b.name));
        Ok(entries)
    }

    fn size(&self, name: &str) -> Result<u64, StorageError> {
        let content = self.files.get(&plain_name(name)?).ok_or(StorageError::NotFound)?;
        Ok(content.len() as u64)
    }

    fn read_at(&self, name: &str, offset: u64, into: &mut [u8]) -> Result<usize, StorageError> {
        let content = self.files.get(&plain_name(name)?).ok_or(StorageError::NotFound)?;
        let rest = usize::try_from(offset).ok().and_then(|offset| content.get(offset..));
        let rest = rest.unwrap_or_default();
        let length = rest.len().min(into.len());
        into[..length].copy_from_slice(&rest[..length]);
        Ok(length)
    }

    fn write_at(&mut self, name: &str, offset: u64, data: &[u8]) -> Result<(), StorageError> {
        let file = self.files.get_mut(&plain_name(name)?).ok_or(StorageError::NotFound)?;
        let end = offset + data.len() as u64;
        if end > MOST_IN_MEMORY {
            return Err(StorageError::Failed(28));
        }
        if file.len() < end as usize {
            file.resize(end as usize, 0);
        }
        file[offset as usize..end as usize].copy_from_slice(data);
        Ok(())
    }

    fn create(&mut self, name: &str) -> Result<(), StorageError> {
        let name = plain_name(name)?;
        if name.is_empty() {
            return Err(StorageError::BadName);
        }
        let folder = parent(&name);
        if !folder.is_empty() && !self.folders.contains(folder) {
            return Err(StorageError::NotFound);
        }
        self.files.insert(name, Vec::new());
        Ok(())
    }

    fn remove(&mut self, name: &str) -> Result<(), StorageError> {
        let name = plain_name(name)?;
        self.files.remove(&name).map(drop).ok_or(StorageError::NotFound)
    }

    fn create_folder(&mut self, name: &str) -> Result<(), StorageError> {
        let name = plain_name(name)?;
        let folder = parent(&name);
        if !folder.is_empty() && !self.folders.contains(folder) {
            return Err(StorageError::NotFound);
        }
        self.folders.insert(name);
        Ok(())
    }
}

/// Storage in a folder of this computer.
#[derive(Clone, Debug)]
pub struct FolderStorage {
    root: PathBuf,
}

impl FolderStorage {
    /// Storage of everything below `root`, and nothing outside of it.
    pub fn new(root: &Path) -> Self {
        Self { root: root.to_owned() }
    }

    /// Links could lead out: a part that is one is refused.
    fn path(&self, name: &str) -> Result<PathBuf, StorageError> {
        let name = plain_name(name)?;
        let mut path = self.root.clone();
        for part in Path::new(&name).components() {
            let Component::Normal(part) = part else { return Err(StorageError::BadName) };
            path.push(part);
            if path.is_symlink() {
                return Err(StorageError::BadName);
            }
        }
        Ok(path)
    }
}

#[expect(clippy::needless_pass_by_value, reason = "for map_err")]
fn failed(error: std::io::Error) -> StorageError {
    match error.kind() {
        std::io::ErrorKind::NotFound => StorageError::NotFound,
        // EIO where the system has no number that fits.
        _ => StorageError::Failed(
            error.raw_os_error().and_then(|code| code.try_into().ok()).unwrap_or(5),
        ),
    }
}

impl Storage for FolderStorage {
    fn list(&self, folder: &str) -> Result<Vec<Entry>, StorageError> {
        let mut entries = Vec::new();
        for entry in fs::read_dir(self.path(folder)?).map_err(failed)? {
            let entry = entry.map_err(failed)?;
            let about = entry.metadata().map_err(failed)?;
            if about.is_symlink() {
                continue;
            }
            let size = about.is_file().then_some(about.len());
            entries.push(Entry { name: entry.file_name().to_string_lossy().into_owned(), size });
        }
        entries.sort_by(|a, b| a.name.cmp(&b.name));
        Ok(entries)
    }

    fn size(&self, name: &str) -> Result<u64, StorageError> {
        let about = fs::metadata(self.path(name)?).map_err(failed)?;
        if about.is_file() { Ok(about.len()) } else { Err(StorageError::NotFound) }
    }

    fn read_at(&self, name: &str, offset: u64, into: &mut [u8]) -> Result<usize, StorageError> {
        let mut file = File::open(self.path(name)?).map_err(failed)?;
        file.seek(SeekFrom::Start(offset)).map_err(failed)?;
        let mut done = 0;
        while done < into.len() {
            match file.read(&mut into[done..]).map_err(failed)? {
                0 => break,
                more => done += more,
            }
        }
        Ok(done)
    }

    fn write_at(&mut self, name: &str, offset: u64, data: &[u8]) -> Result<(), StorageError> {
        let mut file = OpenOptions::new().write(true).open(self.path(name)?).map_err(failed)?;
        file.seek(SeekFrom::Start(offset)).map_err(failed)?;
        file.write_all(data).map_err(failed)
    }

    fn create(&mut self, name: &str) -> Result<(), StorageError> {
        File::create(self.path(name)?).map(drop).map_err(failed)
    }

    fn remove(&mut self, name: &str) -> Result<(), StorageError> {
        fs::remove_file(self.path(name)?).map_err(failed)
    }

    fn create_folder(&mut self, name: &str) -> Result<(), StorageError> {
        fs::create_dir(self.path(name)?).map_err(failed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn acts_as_storage(storage: &mut dyn Storage) {
        assert_eq!(storage.create("/collmot/show.skyb"), Err(StorageError::NotFound));
        storage.create_folder("collmot").unwrap();
        storage.create("/collmot/show.skyb").unwrap();
        storage.write_at("collmot/show.skyb", 2, b"cd").unwrap();
        storage.write_at("/collmot/show.skyb", 0, b"ab").unwrap();
        let mut bytes = [0; 9];
        assert_eq!(storage.read_at("collmot/show.skyb", 1, &mut bytes), Ok(3));
        assert_eq!(&bytes[..3], b"bcd");
        assert_eq!(storage.read_at("collmot/show.skyb", 9, &mut bytes), Ok(0));
        let entry = Entry { name: "show.skyb".to_owned(), size: Some(4) };
        assert_eq!(storage.list("/collmot"), Ok(vec![entry]));
        for out in ["../x", "/collmot/../../etc/passwd", "a\\b", "c:x", ".."] {
            assert_eq!(storage.size(out), Err(StorageError::BadName), "{out}");
            assert_eq!(storage.create(out), Err(StorageError::BadName), "{out}");
        }
        storage.remove("collmot/show.skyb").unwrap();
        assert_eq!(storage.size("collmot/show.skyb"), Err(StorageError::NotFound));
    }

    #[test]
    fn both_kinds_act_the_same_and_let_nobody_out() {
        acts_as_storage(&mut MemoryStorage::default());
        let folder = tempfile::tempdir().unwrap();
        acts_as_storage(&mut FolderStorage::new(folder.path()));
    }

    #[cfg(unix)]
    #[test]
    fn a_link_does_not_lead_out() {
        let folder = tempfile::tempdir().unwrap();
        std::os::unix::fs::symlink("/etc", folder.path().join("etc")).unwrap();
        let storage = FolderStorage::new(folder.path());
        assert_eq!(storage.size("etc/passwd"), Err(StorageError::BadName));
        assert_eq!(storage.list("/"), Ok(Vec::new()));
    }
}
