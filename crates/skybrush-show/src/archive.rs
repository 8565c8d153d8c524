//! A ZIP archive that may be hostile, read within limits.

use std::collections::BTreeMap;
use std::io::{Cursor, Read};
use std::sync::atomic::{AtomicU64, Ordering};

use zip::ZipArchive;

use super::skyc::{Limits, SkycError};
use untrusted_io::plain::acts;

/// Entries smaller than this may be compressed as well as they like, bytes.
const SMALL: u64 = 1 << 20;

/// An archive whose names have been checked.
pub(crate) struct Archive<'a> {
    zip: ZipArchive<Cursor<&'a [u8]>>,
    entries: BTreeMap<String, usize>,
    limits: Limits,
    unpacked: AtomicU64,
}

impl<'a> Archive<'a> {
    pub(crate) fn open(bytes: &'a [u8], limits: Limits) -> Result<Self, SkycError> {
        let broken = |problem: String| SkycError::Archive { problem };
        let zip = ZipArchive::new(Cursor::new(bytes)).map_err(|error| broken(error.to_string()))?;
        if zip.len() > limits.entries {
            let (count, limit) = (zip.len(), limits.entries);
            return Err(broken(format!("it has {count} entries, more than the {limit} allowed")));
        }
        if zip.has_duplicate_names() {
            return Err(broken("two entries have the same name".to_owned()));
        }
        let mut entries = BTreeMap::new();
        for (index, raw) in zip.file_names_raw().enumerate() {
            let name = std::str::from_utf8(raw).map_err(|_| {
                broken(format!("the name of entry \"{}\" is not UTF-8", raw.escape_ascii()))
            })?;
            if let Some(trick) = path_trick(name) {
                return Err(broken(format!("entry {name:?} {trick}; it may be meant to do harm")));
            }
            if !name.ends_with('/') {
                entries.insert(name.to_owned(), index);
            }
        }
        Ok(Self { zip, entries, limits, unpacked: AtomicU64::new(0) })
    }

    pub(crate) fn limits(&self) -> &Limits {
        &self.limits
    }

    /// Names of the files, sorted.
    pub(crate) fn names(&self) -> impl Iterator<Item = &str> {
        self.entries.keys().map(String::as_str)
    }

    pub(crate) fn contains(&self, name: &str) -> bool {
        self.entries.contains_key(name)
    }

    /// Unpacks one entry. What counts is how many bytes come out, not what the header says.
    pub(crate) fn unpack(&self, name: &str) -> Result<Vec<u8>, SkycError> {
        let fail = |problem: String| SkycError::Entry { entry: name.to_owned(), problem };
        let index = *self
            .entries
            .get(name)
            .ok_or_else(|| fail("there is no such entry in the archive".to_owned()))?;
        // Clones share the directory; only the read position is their own.
        let mut zip = self.zip.clone();
        let entry = zip.by_index(index).map_err(|error| fail(error.to_string()))?;
        if entry.is_symlink() {
            return Err(fail("it is a symbolic link".to_owned()));
        }
        let (size, packed) = (entry.size(), entry.compressed_size());
        let limit = self.limits.entry_bytes;
        if size > limit {
            return Err(fail(format!("it unpacks to {size} bytes, more than {limit}")));
        }
        if size > SMALL && size / packed.max(1) > self.limits.ratio {
            let ratio = size / packed.max(1);
            return Err(fail(format!("it is compressed {ratio}:1; it may be a ZIP bomb")));
        }
        self.charge(size)?;
        let mut content = Vec::with_capacity(size.min(SMALL) as usize);
        entry
            .take(size + 1)
            .read_to_end(&mut content)
            .map_err(|error| fail(format!("it cannot be unpacked: {error}")))?;
        if content.len() as u64 != size {
            return Err(fail(format!("it does not unpack to the {size} bytes its header says")));
        }
        Ok(content)
    }

    /// Counts bytes against the limit for the whole file.
    pub(crate) fn charge(&self, bytes: u64) -> Result<(), SkycError> {
        let before = self.unpacked.fetch_add(bytes, Ordering::Relaxed);
        let limit = self.limits.total_bytes;
        if before.saturating_add(bytes) > limit {
            return Err(SkycError::Bomb { limit, unit: "bytes" });
        }
        Ok(())
    }
}

/// Unpacks every entry of an archive, so that the checksum of each is compared.
///
/// # Errors
///
/// When it is no ZIP archive, looks hostile, or an entry is damaged; the error names the entry.
pub fn verify(bytes: &[u8]) -> Result<(), SkycError> {
    let archive = Archive::open(bytes, Limits::default())?;
    archive.names().try_for_each(|name| archive.unpack(name).map(drop))
}

/// What is suspicious about the name of an entry, if anything.
fn path_trick(name: &str) -> Option<&'static str> {
    if name.is_empty() {
        Some("has no name")
    } else if name.starts_with('/') {
        Some("has an absolute path")
    } else if name.contains('\\') {
        Some("has a backslash in its name")
    } else if name.contains(':') {
        Some("has a colon in its name")
    } else if name.contains(acts) {
        Some("has a control character in its name")
    } else if name.split('/').any(|part| part == "..") {
        Some("has \"..\" in its path")
    } else {
        None
    }
}
