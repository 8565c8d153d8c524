//! Reading: one pass, only the wanted columns are decoded.

use std::fmt;
use std::fs::{File, Metadata};
use std::path::{Path, PathBuf};

use memmap2::Mmap;
use thiserror::Error;

use super::columns::Notes;
use super::format::{FMT_ID, Format};
use super::inventory::{self, Count, Inventory};
use super::scan::{Scan, ScanStats, Visitor, scan, scan_file};
use super::writer::MAGIC;

/// A log must start within this many bytes.
const SEARCHED_BYTES: usize = 4096;

/// A DataFlash log, mapped from a file or held in memory.
///
/// A mapped file must not be cut short by another process while it is being read.
pub struct Log {
    bytes: Bytes,
}

enum Bytes {
    /// The map serves those who want the bytes themselves; messages are read from the file again,
    /// which is faster. The file is not held open: thousands of logs may be.
    Mapped {
        map: Mmap,
        path: PathBuf,
        metadata: Metadata,
    },
    Held(Vec<u8>),
}

/// One message type and the fields wanted of it.
#[derive(Clone, Copy, Debug)]
pub struct Select<'a> {
    /// Message name: `ATT`.
    pub message: &'a str,
    /// Field labels; those that the log does not have are absent from the table.
    pub fields: &'a [&'a str],
}

/// The wanted columns of one message type, one row per message, in file order.
///
/// Where types of one name differ in their fields (a log may define a type anew), rows without a
/// field have NaN or an empty text in its column.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// Message name.
    pub message: String,
    /// Rows in every column.
    pub rows: usize,
    /// Number columns by label, in engineering units.
    pub numbers: Vec<(String, Vec<f64>)>,
    /// Text columns by label.
    pub texts: Vec<(String, Vec<String>)>,
    /// What the log says about the columns that were found, in the order of the selection.
    pub columns: Vec<Column>,
}

/// Unit and multiplier of a column, from the log's UNIT, MULT and FMTU rows.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Column {
    /// Label.
    pub field: String,
    /// `m`, `deg`, ...; absent in old logs and for plain numbers.
    pub unit: Option<String>,
    /// Scale of the stored number. Already applied for the letters `c C e E L`, never applied for
    /// others, and wrong for some fields (`SHOW.HDist`).
    pub multiplier: Option<f64>,
}

impl Table {
    /// A number column.
    pub fn number(&self, field: &str) -> Option<&[f64]> {
        self.numbers.iter().find(|(name, _)| name == field).map(|(_, column)| column.as_slice())
    }

    /// A text column.
    pub fn text(&self, field: &str) -> Option<&[String]> {
        self.texts.iter().find(|(name, _)| name == field).map(|(_, column)| column.as_slice())
    }

    /// Unit label of a column, if the log gives one.
    pub fn unit(&self, field: &str) -> Option<&str> {
        self.column(field)?.unit.as_deref()
    }

    /// Multiplier of a column, if the log gives one; see [`Column::multiplier`].
    pub fn multiplier(&self, field: &str) -> Option<f64> {
        self.column(field)?.multiplier
    }

    fn column(&self, field: &str) -> Option<&Column> {
        self.columns.iter().find(|column| column.field == field)
    }
}

/// A log could not be read.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum LogError {
    /// The file could not be opened or mapped.
    #[error("failed to open the log {}", path.display())]
    Open {
        /// The file.
        path: PathBuf,
        /// The operating system's reason.
        #[source]
        source: std::io::Error,
    },
    /// Not a DataFlash log at all.
    #[error("{} is not a DataFlash log: {reason}", path.display())]
    NotALog {
        /// The file.
        path: PathBuf,
        /// What was found instead.
        reason: String,
    },
}

impl Log {
    /// Maps a log file.
    ///
    /// # Errors
    /// [`LogError::Open`] if the file cannot be read, [`LogError::NotALog`] if no message
    /// definition is near its start.
    pub fn open(path: &Path) -> Result<Self, LogError> {
        let fail = |source| LogError::Open { path: path.to_owned(), source };
        let file = File::open(path).map_err(fail)?;
        let metadata = file.metadata().map_err(fail)?;
        if metadata.is_dir() {
            return Err(fail(std::io::ErrorKind::IsADirectory.into()));
        }
        let bytes = if metadata.len() == 0 {
            Bytes::Held(Vec::new())
        } else {
            let map = map(&file).map_err(fail)?;
            Bytes::Mapped { map, path: path.to_owned(), metadata }
        };
        let log = Self { bytes };
        match log.why_not_a_log() {
            None => Ok(log),
            Some(reason) => Err(LogError::NotALog { path: path.to_owned(), reason }),
        }
    }

    /// A log in memory; anything goes, also bytes that are no log.
    pub fn from_bytes(bytes: Vec<u8>) -> Self {
        Self { bytes: Bytes::Held(bytes) }
    }

    /// Reads the wanted columns in one pass; one table per entry of `wanted`, in its order.
    ///
    /// Damage is never an error: what is readable is read, the rest is in the [`ScanStats`].
    pub fn select(&self, wanted: &[Select<'_>]) -> (Vec<Table>, ScanStats) {
        let (notes, scan) = self.walk(|| Notes::new(wanted));
        (notes.tables(&scan.units), scan.stats)
    }

    /// What is in the log: messages, times, firmware, damage.
    pub fn inventory(&self) -> Inventory {
        let (count, scan) = self.walk(Count::default);
        inventory::take(self.size_bytes(), &count, scan)
    }

    /// Shows all messages to a visitor.
    fn walk<V: Visitor>(&self, new: impl Fn() -> V) -> (V, Scan) {
        if let Bytes::Mapped { path, metadata, .. } = &self.bytes
            && let Some(file) = reopen(path, metadata)
        {
            let mut visitor = new();
            // A file that fails half-way is left to the map.
            if let Ok(scan) = scan_file(&file, self.bytes().len(), &mut visitor) {
                return (visitor, scan);
            }
        }
        let mut visitor = new();
        let scan = scan(self.bytes(), &mut visitor);
        (visitor, scan)
    }

    /// Size of the log.
    pub fn size_bytes(&self) -> u64 {
        self.bytes().len() as u64
    }

    /// The log as it was written.
    pub fn bytes(&self) -> &[u8] {
        match &self.bytes {
            Bytes::Mapped { map, .. } => map,
            Bytes::Held(bytes) => bytes,
        }
    }

    /// What is there instead of a log; `None`: it begins as one.
    pub fn why_not_a_log(&self) -> Option<String> {
        let bytes = self.bytes();
        let start = &bytes[..bytes.len().min(SEARCHED_BYTES)];
        let header = [MAGIC[0], MAGIC[1], FMT_ID];
        let is_format = |at: usize| {
            start[at..].starts_with(&header)
                && bytes.get(at..at + 89).and_then(Format::from_row).is_some()
        };
        if (0..start.len()).any(is_format) {
            return None;
        }
        Some(if bytes.is_empty() {
            "it is empty".into()
        } else if start.starts_with(b"FMT, ") {
            "it is the text form of a log (.log); use the .BIN from the vehicle".into()
        } else if start.starts_with(b"PK") {
            "it is a ZIP archive; unpack it, or is it a .skyc show?".into()
        } else if start.starts_with(b"skyb") {
            "it is a .skyb show".into()
        } else {
            format!("its first {} bytes define no message (no valid FMT row)", start.len())
        })
    }
}

impl fmt::Debug for Log {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Log").field("size_bytes", &self.size_bytes()).finish()
    }
}

/// Opens a file again, if it is still the one that it was.
#[cfg(unix)]
fn reopen(path: &Path, before: &Metadata) -> Option<File> {
    use std::os::unix::fs::MetadataExt;
    let file = File::open(path).ok()?;
    let now = file.metadata().ok()?;
    (now.dev() == before.dev() && now.ino() == before.ino()).then_some(file)
}

/// Where files have no identity there is only the map.
#[cfg(not(unix))]
fn reopen(_path: &Path, _before: &Metadata) -> Option<File> {
    None
}

#[expect(unsafe_code, reason = "memory-mapping a file has no safe form")]
fn map(file: &File) -> std::io::Result<Mmap> {
    // SAFETY: the map is read-only and private to this type; that no other process cuts the file
    // short meanwhile is the documented condition of `Log`.
    unsafe { Mmap::map(file) }
}
