//! Reader: one pass through the log, in which only the wanted columns are decoded.

use std::fmt;
use std::fs::{File, Metadata};
use std::io::Read;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use thiserror::Error;

use super::columns::Notes;
use super::format::{FMT_ID, Format};
use super::inventory::{self, Count, Inventory};
use super::scan::{Scan, ScanStats, Visitor, scan, scan_file};
use super::writer::MAGIC;
use untrusted_io::file::open_regular;
use untrusted_io::plain::Shown as _;

/// A log must start within this many bytes.
const SEARCHED_BYTES: usize = 4096;

/// Bytes that are looked at for the start of a log: a definition may begin at the last of those
/// searched.
const START_BYTES: usize = SEARCHED_BYTES + 89;

/// A DataFlash log, in a file or held in memory.
///
/// A file is read anew, piece by piece, each time: never more of it than a window is in memory, and
/// none is held open (thousands of logs may be). What another process cuts off meanwhile is missing
/// at the end, like the end of a log whose drone lost power.
pub struct Log {
    bytes: Bytes,
}

enum Bytes {
    File { path: PathBuf, identity: Identity, size: usize, start: Vec<u8> },
    Held(Vec<u8>),
}

/// One message type and the fields wanted of it.
#[derive(Clone, Copy, Debug)]
pub struct Select<'a> {
    /// Name of the message to read: `ATT`.
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
    /// Name of the message, as in the log: `ATT`.
    pub message: String,
    /// Number of rows, the same in every column.
    pub rows: usize,
    /// Number columns by label, in engineering units.
    pub numbers: Vec<(String, Vec<f64>)>,
    /// Text columns by label.
    pub texts: Vec<(String, Vec<String>)>,
    /// Unit and multiplier that the log gives each column found, in the order of the selection.
    pub columns: Vec<Column>,
}

/// Unit and multiplier of a column, from the log's UNIT, MULT and FMTU rows.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Column {
    /// Label of the field: `DesRoll`.
    pub field: String,
    /// Unit label, such as `m` or `deg`; absent in old logs and for plain numbers.
    pub unit: Option<String>,
    /// Scale of the stored number. Already applied for the letters `c C e E L`, never applied for
    /// others, and wrong for some fields (`SHOW.HDist`).
    pub multiplier: Option<f64>,
}

impl Table {
    /// Values of a column of numbers, by its label; `None` if the table has no such column.
    pub fn number(&self, field: &str) -> Option<&[f64]> {
        self.numbers.iter().find(|(name, _)| name == field).map(|(_, column)| column.as_slice())
    }

    /// Values of a column of text, by its label; `None` if the table has no such column.
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

/// Error of opening a log.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum LogError {
    /// The file could not be opened.
    #[error("failed to open the log {}", path.shown())]
    Open {
        /// Path that was to be opened.
        path: PathBuf,
        /// Reason given by the operating system.
        #[source]
        source: std::io::Error,
    },
    /// The file is not a DataFlash log.
    #[error("{} is not a DataFlash log: {reason}", path.shown())]
    NotALog {
        /// Path of the file that is no log.
        path: PathBuf,
        /// Description of what the file holds instead.
        reason: String,
    },
}

impl Log {
    /// Opens a log file.
    ///
    /// # Errors
    /// [`LogError::Open`] if the file cannot be read, [`LogError::NotALog`] if no message
    /// definition is near its start.
    pub fn open(path: &Path) -> Result<Self, LogError> {
        let fail = |source| LogError::Open { path: path.to_owned(), source };
        let (file, metadata) = open_regular(path).map_err(fail)?;
        let mut start = Vec::new();
        (&file).take(START_BYTES as u64).read_to_end(&mut start).map_err(fail)?;
        let size = usize::try_from(metadata.len())
            .map_err(|_| fail(std::io::ErrorKind::FileTooLarge.into()))?;
        let identity = Identity::of(&metadata);
        let log = Self { bytes: Bytes::File { path: path.to_owned(), identity, size, start } };
        match log.why_not_a_log() {
            None => Ok(log),
            Some(reason) => Err(LogError::NotALog { path: path.to_owned(), reason }),
        }
    }

    /// A log in memory. Any bytes are accepted, also those of no log.
    pub fn from_bytes(bytes: Vec<u8>) -> Self {
        Self { bytes: Bytes::Held(bytes) }
    }

    /// Reads the wanted columns in one pass; one table per entry of `wanted`, in its order.
    ///
    /// Damage is never an error: what is readable is read, the rest is in the [`ScanStats`].
    ///
    /// ```
    /// use dataflash::{Log, LogWriter, Select, Value, catalog};
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let mut writer = LogWriter::new(Vec::new(), &[&catalog::MSG])?;
    /// for (time_us, text) in [(1_000, "armed"), (2_000, "landed")] {
    ///     writer.row(&catalog::MSG, &[Value::Int(time_us), Value::Text(text)])?;
    /// }
    /// let mut bytes = writer.finish()?;
    /// // The drone lost power while it wrote the last row.
    /// bytes.truncate(bytes.len() - 3);
    ///
    /// let (tables, damage) = Log::from_bytes(bytes).select(&[Select { message: "MSG", fields: &["Message"] }]);
    /// assert_eq!(tables[0].text("Message").unwrap(), ["armed"]);
    /// assert!(damage.truncated_bytes > 0 && damage.bad_bytes == 0);
    /// # Ok(())
    /// # }
    /// ```
    pub fn select(&self, wanted: &[Select<'_>]) -> (Vec<Table>, ScanStats) {
        let (notes, scan) = self.walk(|| Notes::new(wanted));
        (notes.tables(&scan.units), scan.stats)
    }

    /// Inventory of the log: message types with their counts and times, firmware, damage.
    pub fn inventory(&self) -> Inventory {
        let (count, scan) = self.walk(Count::default);
        inventory::take(self.size_bytes(), &count, scan)
    }

    /// Shows all messages to a visitor.
    fn walk<V: Visitor>(&self, new: impl Fn() -> V) -> (V, Scan) {
        let mut visitor = new();
        let scan = match &self.bytes {
            Bytes::Held(bytes) => scan(bytes, &mut visitor),
            Bytes::File { path, identity, size, .. } => {
                scan_file(reopen(path, identity), *size, &mut visitor)
            }
        };
        (visitor, scan)
    }

    /// Size of the log, bytes.
    pub fn size_bytes(&self) -> u64 {
        match &self.bytes {
            Bytes::File { size, .. } => *size as u64,
            Bytes::Held(bytes) => bytes.len() as u64,
        }
    }

    /// Bytes of a log that is held in memory; `None` if it is read from a file.
    pub fn held(&self) -> Option<&[u8]> {
        match &self.bytes {
            Bytes::File { .. } => None,
            Bytes::Held(bytes) => Some(bytes),
        }
    }

    /// Reader of the log's bytes from its start; it ends early where the file cannot be read any
    /// more.
    pub fn reader(&self) -> Box<dyn Read + '_> {
        match &self.bytes {
            Bytes::Held(bytes) => Box::new(bytes.as_slice()),
            Bytes::File { path, identity, size, .. } => match reopen(path, identity) {
                Some(file) => Box::new(file.take(*size as u64)),
                None => Box::new(std::io::empty()),
            },
        }
    }

    /// Description of what the file holds if it is not a DataFlash log; `None` if it begins as one.
    pub fn why_not_a_log(&self) -> Option<String> {
        let bytes = match &self.bytes {
            Bytes::File { start, .. } => start,
            Bytes::Held(bytes) => bytes,
        };
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

/// Which file it is, whatever its name.
#[derive(Clone, Copy, PartialEq, Eq)]
struct Identity {
    /// Numbers are used again once a file is gone; when it was made tells them apart where that is
    /// known.
    #[cfg(unix)]
    file: (u64, u64, Option<SystemTime>),
    /// Where files have no number, one that was written since is another.
    #[cfg(not(unix))]
    file: (u64, Option<SystemTime>),
}

impl Identity {
    #[cfg(unix)]
    fn of(metadata: &Metadata) -> Self {
        use std::os::unix::fs::MetadataExt as _;
        Self { file: (metadata.dev(), metadata.ino(), metadata.created().ok()) }
    }

    #[cfg(not(unix))]
    fn of(metadata: &Metadata) -> Self {
        Self { file: (metadata.len(), metadata.modified().ok()) }
    }
}

/// Opens a file again, if it is still the one that it was.
fn reopen(path: &Path, before: &Identity) -> Option<File> {
    let (file, now) = open_regular(path).ok()?;
    (Identity::of(&now) == *before).then_some(file)
}
