//! Download that survives interruption: the bytes so far, and a journal of their ranges.
//!
//! `NN.BIN.part` holds bytes at their places; `NN.BIN.journal` is only appended to. A range is
//! written into the journal after its bytes are on the disk, and each line has a checksum, so
//! that after a kill or a power loss every line that can be read tells the truth.

use std::fs::{self, File, OpenOptions};
use std::io::{Read as _, Seek as _, SeekFrom, Write as _};
use std::path::{Path, PathBuf};

use sha2::{Digest as _, Sha256};

use crate::base::crc::{ApCrc32, ap_crc32};
use crate::base::file::FileError;
use crate::base::plain::Shown as _;
use crate::base::private::open_own;
use crate::fleet::intervals::Intervals;
use crate::fleet::sink::Sink;
use crate::link::clock::{Micros, S};

const HEAD: &str = "updraft.part/1";
/// What may be lost of a download by a power loss: bytes, or time.
const SYNC_BYTES: u64 = 16 << 20;
const SYNC_EVERY: Micros = 5 * S;
/// A journal is never longer, bytes.
const MOST_JOURNAL: u64 = 256 << 20;
/// Bytes that are written at once: packets are small.
const AT_ONCE: usize = 64 << 10;
/// Ranges in one line.
const RANGES_PER_LINE: usize = 256;

/// Download in progress, in a file.
#[derive(Debug)]
pub struct PartFile {
    path: PathBuf,
    file: File,
    journal: File,
    identity: String,
    have: Intervals,
    /// Written, but not yet in the journal.
    fresh: Intervals,
    position: u64,
    /// Bytes that follow each other and are not in the file yet, and where they begin.
    pending: Vec<u8>,
    pending_at: u64,
    synced: Option<Micros>,
    /// Whether it survives a power loss.
    is_durable: bool,
}

/// Checksums of a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Sums {
    /// Size of the file, bytes.
    pub size: u64,
    /// CRC-32 of the file as the vehicle computes it.
    pub crc32: u32,
    /// SHA-256 of the file, lower case, hexadecimal.
    pub sha256: String,
}

/// Path of the part file that belongs to a final file.
pub fn part_path(path: &Path) -> PathBuf {
    with_suffix(path, ".part")
}

/// Path of the journal that belongs to a final file.
pub fn journal_path(path: &Path) -> PathBuf {
    with_suffix(path, ".journal")
}

fn with_suffix(path: &Path, suffix: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(suffix);
    PathBuf::from(name)
}

impl PartFile {
    /// Continues the download of the final file `path`, or begins it. `identity` names the file and
    /// the drone: a part of another file is begun anew.
    ///
    /// # Errors
    /// When the files cannot be opened or written.
    pub fn open(path: &Path, identity: &str) -> Result<Self, FileError> {
        let mut options = OpenOptions::new();
        options.read(true).write(true).create(true).truncate(false);
        let fail = |path: &Path, source| FileError::new("open", path, source);
        let identity = identity.replace(['\n', '\r'], " ");
        let (part, journal) = (part_path(path), journal_path(path));
        let file = options.open(&part).map_err(|source| fail(&part, source))?;
        let mut journal =
            open_own(&journal, &mut options).map_err(|source| fail(&journal, source))?;
        let read = |source| FileError::new("read", &journal_path(path), source);
        let mut bytes = Vec::new();
        (&mut journal).take(MOST_JOURNAL).read_to_end(&mut bytes).map_err(read)?;
        let (valid, have) = read_journal(&bytes, &identity);
        let length = file.metadata().map_err(read)?.len();
        let mut part = Self {
            path: path.to_owned(),
            file,
            journal,
            identity,
            have: Intervals::default(),
            fresh: Intervals::default(),
            position: u64::MAX,
            pending: Vec::new(),
            pending_at: 0,
            synced: None,
            is_durable: true,
        };
        match have {
            Some(have) if have.end() <= length => {
                // What is torn must not run into what follows.
                part.journal.set_len(valid).map_err(read)?;
                part.journal.seek(SeekFrom::End(0)).map_err(read)?;
                part.have = have;
            }
            _ => part.clear()?,
        }
        Ok(part)
    }

    /// Switches off waiting for the disk, for logs that can be downloaded again at any time. A kill
    /// is still survived, a power loss is not.
    #[must_use]
    pub fn without_waiting(mut self) -> Self {
        self.is_durable = false;
        self
    }

    /// Discards what has come and starts over.
    ///
    /// # Errors
    ///
    /// If the files cannot be written.
    pub fn clear(&mut self) -> Result<(), FileError> {
        self.have = Intervals::default();
        self.fresh = Intervals::default();
        self.position = u64::MAX;
        self.pending.clear();
        let line = line(&format!("{HEAD} {}", self.identity));
        // What an older journal says must not come back with what is written now.
        let was_empty = self.journal.metadata().is_ok_and(|data| data.len() == 0);
        let waits = self.is_durable && !was_empty;
        let result = self
            .journal
            .set_len(0)
            .and_then(|()| self.journal.seek(SeekFrom::Start(0)))
            .and_then(|_| self.file.set_len(0))
            .and_then(|()| self.journal.write_all(line.as_bytes()))
            .and_then(|()| if waits { self.journal.sync_data() } else { Ok(()) });
        result.map_err(|source| FileError::new("write", &journal_path(&self.path), source))
    }

    /// Begins with the bytes of `from`, an earlier log that this one is thought to begin with.
    /// Ranges that have already come are kept.
    ///
    /// # Errors
    ///
    /// If a file cannot be read or written.
    pub fn seed(&mut self, from: &Path) -> Result<(), FileError> {
        let read = |source| FileError::new("read", from, source);
        let part = part_path(&self.path);
        let write = |source| FileError::new("write", &part, source);
        if self.have.total() > 0 {
            return Ok(());
        }
        let mut earlier = File::open(from).map_err(read)?;
        self.file.seek(SeekFrom::Start(0)).map_err(write)?;
        let length = std::io::copy(&mut earlier, &mut self.file).map_err(write)?;
        self.position = length;
        self.have.insert(0, length);
        self.fresh.insert(0, length);
        self.sync()
    }

    /// Removes the part file and its journal.
    pub fn discard(self) {
        // What cannot be removed is begun anew by the next download.
        let _ = fs::remove_file(journal_path(&self.path));
        let _ = fs::remove_file(part_path(&self.path));
    }

    /// Path of the final file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes everything so far into the journal, and waits for the disk.
    ///
    /// # Errors
    ///
    /// If a file cannot be written.
    pub fn sync(&mut self) -> Result<(), FileError> {
        if self.fresh.count() == 0 {
            return Ok(());
        }
        self.note()?;
        let fail = |source| FileError::new("write", &journal_path(&self.path), source);
        if self.is_durable { self.journal.sync_data().map_err(fail) } else { Ok(()) }
    }

    /// Writes everything so far into the journal: what it names is on the disk, it itself will be.
    fn note(&mut self) -> Result<(), FileError> {
        if self.fresh.count() == 0 {
            return Ok(());
        }
        self.flush()?;
        let fail = |source| FileError::new("write", &part_path(&self.path), source);
        if self.is_durable {
            self.file.sync_data().map_err(fail)?;
        }
        let ranges: Vec<String> =
            self.fresh.iter().map(|(start, end)| format!("{start}-{end}")).collect();
        let text: String =
            ranges.chunks(RANGES_PER_LINE).map(|some| line(&some.join(" "))).collect();
        self.journal
            .write_all(text.as_bytes())
            .map_err(|source| FileError::new("write", &journal_path(&self.path), source))?;
        self.fresh = Intervals::default();
        Ok(())
    }

    /// Writes the bytes in memory to the file.
    ///
    /// # Errors
    ///
    /// If the file cannot be written.
    pub fn flush(&mut self) -> Result<(), FileError> {
        if self.pending.is_empty() {
            return Ok(());
        }
        let fail = |source| FileError::new("write", &part_path(&self.path), source);
        if self.position != self.pending_at {
            self.file.seek(SeekFrom::Start(self.pending_at)).map_err(fail)?;
        }
        self.file.write_all(&self.pending).map_err(fail)?;
        self.position = self.pending_at + self.pending.len() as u64;
        self.pending.clear();
        Ok(())
    }

    /// Cuts or keeps the file at `size` bytes and computes its checksums.
    ///
    /// # Errors
    ///
    /// If a file cannot be read or written.
    pub fn sums(&mut self, size: u64) -> Result<Sums, FileError> {
        self.note()?;
        let path = part_path(&self.path);
        self.file.set_len(size).map_err(|source| FileError::new("cut", &path, source))?;
        sums(&path)
    }

    /// Gives the finished file its name; its journal goes. The content is on the disk then, the
    /// name once its folder is: see [`super::manifest::Shelf::settle`].
    ///
    /// # Errors
    ///
    /// If a file cannot be written or renamed.
    pub fn finish(self) -> Result<(), FileError> {
        let path = self.path.clone();
        self.finish_as(&path)
    }

    /// Gives the finished file another name than it was begun for.
    ///
    /// # Errors
    ///
    /// If a file cannot be written or renamed.
    pub fn finish_as(self, path: &Path) -> Result<(), FileError> {
        let part = part_path(&self.path);
        let fail = |source| FileError::new("rename", &part, source);
        if self.is_durable {
            self.file.sync_data().map_err(fail)?;
        }
        fs::rename(&part, path).map_err(fail)?;
        // A journal without its part is begun anew by the next download; no harm.
        let _ = fs::remove_file(journal_path(&self.path));
        Ok(())
    }
}

/// What came until an interruption is kept as well.
impl Drop for PartFile {
    fn drop(&mut self) {
        // What cannot be written comes again.
        let _ = self.note();
    }
}

impl PartFile {
    /// In words, without what to do: whoever asked for the log knows that.
    fn cannot_write(&self, error: &FileError) -> String {
        format!("cannot write {}: {}", part_path(&self.path).shown(), error.source)
    }
}

impl Sink for PartFile {
    fn have(&self) -> &Intervals {
        &self.have
    }

    fn put(&mut self, now: Micros, offset: u64, data: &[u8]) -> Result<u64, String> {
        let end = offset + data.len() as u64;
        if self.have.contains(offset, end) {
            return Ok(0);
        }
        let follows = self.pending_at + self.pending.len() as u64 == offset;
        if !follows || self.pending.len() >= AT_ONCE {
            self.flush().map_err(|error| self.cannot_write(&error))?;
            self.pending_at = offset;
        }
        self.pending.extend_from_slice(data);
        let new = self.have.insert(offset, end);
        self.fresh.insert(offset, end);
        let synced = *self.synced.get_or_insert(now);
        if self.fresh.total() >= SYNC_BYTES || now >= synced + SYNC_EVERY {
            self.synced = Some(now);
            self.sync().map_err(|error| self.cannot_write(&error))?;
        }
        Ok(new)
    }
}

fn line(text: &str) -> String {
    format!("{text} *{:08x}\n", ap_crc32(text.as_bytes()))
}

/// The lines that are whole: their length, and the ranges if the identity is right.
fn read_journal(bytes: &[u8], identity: &str) -> (u64, Option<Intervals>) {
    let mut have = None;
    let mut valid = 0;
    for whole in bytes.split_inclusive(|byte| *byte == b'\n') {
        let text = whole.strip_suffix(b"\n").and_then(|text| std::str::from_utf8(text).ok());
        let Some((text, sum)) = text.and_then(|text| text.rsplit_once(" *")) else { break };
        if u32::from_str_radix(sum, 16) != Ok(ap_crc32(text.as_bytes())) {
            break;
        }
        match &mut have {
            None if text == format!("{HEAD} {identity}") => have = Some(Intervals::default()),
            None => return (0, None),
            Some(have) => {
                for range in text.split(' ') {
                    let range = range.split_once('-');
                    let range = range.and_then(|(a, b)| a.parse().ok().zip(b.parse().ok()));
                    if let Some((start, end)) = range {
                        have.insert(start, end);
                    }
                }
            }
        }
        valid += whole.len() as u64;
    }
    (valid, have)
}

/// Size and checksums of bytes in memory.
pub fn sums_of(bytes: &[u8]) -> Sums {
    let sha256 = format!("{:x}", Sha256::digest(bytes));
    Sums { size: bytes.len() as u64, crc32: ap_crc32(bytes), sha256 }
}

/// Size and checksums of a file, which is read through.
///
/// # Errors
///
/// If the file cannot be read.
pub fn sums(path: &Path) -> Result<Sums, FileError> {
    let fail = |source| FileError::new("read", path, source);
    let mut file = File::open(path).map_err(fail)?;
    let (mut crc32, mut sha256, mut size) = (ApCrc32::default(), Sha256::new(), 0);
    let mut bytes = vec![0; 1 << 18];
    loop {
        let read = file.read(&mut bytes).map_err(fail)?;
        if read == 0 {
            break;
        }
        crc32.update(&bytes[..read]);
        sha256.update(&bytes[..read]);
        size += read as u64;
    }
    let sha256 = format!("{:x}", sha256.finalize());
    Ok(Sums { size, crc32: crc32.value(), sha256 })
}

/// Comparison of pieces of the vehicle's file with those of a part; nothing is kept.
#[derive(Debug)]
pub struct Sample {
    file: File,
    have: Intervals,
    /// Whether a difference has been found.
    pub differs: bool,
    size: u64,
}

impl Sample {
    /// Prepares to compare these ranges (start and end in bytes) of the part of `path`, whose file
    /// has `size` bytes.
    ///
    /// # Errors
    ///
    /// If the part cannot be opened.
    pub fn new(path: &Path, size: u64, ranges: &[(u64, u64)]) -> Result<Self, FileError> {
        let part = part_path(path);
        let file = File::open(&part).map_err(|source| FileError::new("open", &part, source))?;
        let mut wanted = Intervals::default();
        for &(start, end) in ranges {
            wanted.insert(start, end.min(size));
        }
        let mut have = Intervals::default();
        let mut at = 0;
        while let Some((start, end)) = wanted.gap(at, size) {
            have.insert(start, end);
            at = end;
        }
        Ok(Self { file, have, differs: false, size })
    }
}

impl Sink for Sample {
    fn have(&self) -> &Intervals {
        &self.have
    }

    fn put(&mut self, _now: Micros, offset: u64, data: &[u8]) -> Result<u64, String> {
        let end = (offset + data.len() as u64).min(self.size);
        let mut at = offset;
        let mut new = 0;
        while let Some((start, stop)) = self.have.gap(at, end) {
            let mut ours = vec![0; (stop - start) as usize];
            let read = self.file.seek(SeekFrom::Start(start));
            let read = read.and_then(|_| self.file.read_exact(&mut ours));
            let theirs = &data[(start - offset) as usize..(stop - offset) as usize];
            self.differs |= read.is_err() || ours != theirs;
            new += self.have.insert(start, stop);
            at = stop;
        }
        Ok(new)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_journal_says_is_there_and_the_rest_is_asked_again() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("01.BIN");
        let mut part = PartFile::open(&path, "drone=1 source=a").unwrap();
        part.put(0, 10, b"abcdef").unwrap();
        part.put(S, 100, b"xyz").unwrap();
        part.sync().unwrap();
        part.put(S, 200, b"not in the journal").unwrap();
        // As a kill does.
        std::mem::forget(part);
        let mut journal = OpenOptions::new().append(true).open(journal_path(&path)).unwrap();
        journal.write_all(b"200-218 *0000").unwrap();
        for _ in 0..2 {
            let part = PartFile::open(&path, "drone=1 source=a").unwrap();
            let have: Vec<_> = part.have().iter().collect();
            assert_eq!(have, [(10, 16), (100, 103)]);
        }
        let mut part = PartFile::open(&path, "drone=1 source=a").unwrap();
        part.put(0, 300, b"more").unwrap();
        part.sync().unwrap();
        let part = PartFile::open(&path, "drone=1 source=a").unwrap();
        assert_eq!(part.have().total(), 13);
        let other = PartFile::open(&path, "drone=2 source=a").unwrap();
        assert_eq!(other.have().total(), 0);
    }

    #[cfg(unix)]
    #[test]
    fn its_journal_is_its_users_alone() {
        use std::os::unix::fs::{PermissionsExt as _, symlink};
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("01.BIN");
        PartFile::open(&path, "drone 1 log 1").unwrap();
        let mode = fs::metadata(journal_path(&path)).unwrap().permissions().mode() & 0o777;
        assert_eq!(mode, 0o600);
        let (victim, path) = (folder.path().join("victim"), folder.path().join("02.BIN"));
        fs::write(&victim, "precious").unwrap();
        symlink(&victim, journal_path(&path)).unwrap();
        let error = PartFile::open(&path, "drone 2 log 1").unwrap_err();
        assert!(error.to_string().contains("open"), "{error}");
        assert_eq!(fs::read(&victim).unwrap(), b"precious");
    }

    #[test]
    fn a_part_that_lost_bytes_is_begun_anew() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("01.BIN");
        let mut part = PartFile::open(&path, "a").unwrap();
        part.put(0, 0, &[7; 100]).unwrap();
        part.sync().unwrap();
        part.file.set_len(50).unwrap();
        drop(part);
        assert_eq!(PartFile::open(&path, "a").unwrap().have().total(), 0);
    }

    #[test]
    fn what_cannot_be_written_is_said_once_and_without_advice() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("01.BIN");
        let mut part = PartFile::open(&path, "a").unwrap();
        part.file = File::open(part_path(&path)).unwrap();
        part.put(0, 0, &[7; 100]).unwrap();
        let said = part.put(0, 500, &[7; 100]).unwrap_err();
        assert!(said.starts_with("cannot write ") && !said.contains(';'), "{said}");
    }

    #[test]
    fn a_sample_finds_a_difference() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("01.BIN");
        fs::write(part_path(&path), b"0123456789").unwrap();
        let mut sample = Sample::new(&path, 10, &[(2, 4), (8, 12)]).unwrap();
        assert_eq!(sample.have.gap(0, 10), Some((2, 4)));
        sample.put(0, 0, b"xx23").unwrap();
        assert!(!sample.differs);
        sample.put(0, 7, b"x8X").unwrap();
        assert!(sample.differs && sample.have.gap(0, 10).is_none());
    }

    #[test]
    fn the_sums_of_a_file_are_those_of_its_bytes() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("01.BIN");
        let bytes: Vec<u8> = (0..600_000_u32).map(|place| (place % 251) as u8).collect();
        for length in [0, 1, bytes.len()] {
            fs::write(&path, &bytes[..length]).unwrap();
            assert_eq!(sums(&path).unwrap(), sums_of(&bytes[..length]));
        }
    }
}
