//! The vehicle's log files: when one begins, and how it grows.

use crate::link::clock::{Micros, S};
use crate::virtual_fleet::storage::Storage;

/// The firmware goes on writing for so long after disarming.
const WRITES_ON: Micros = 15 * S;
/// Files grow by whole pieces.
const PIECE: usize = 4096;

/// Log files in one folder.
#[derive(Clone, Debug)]
pub(super) struct Logbook {
    folder: String,
    /// The file that is written to, and its size.
    open: Option<(String, u64)>,
    /// What is not in the file yet, and, once disarmed, since when.
    waiting: Vec<u8>,
    disarmed: Option<(Micros, usize)>,
}

impl Logbook {
    pub(super) fn new(folder: &str) -> Self {
        Self { folder: folder.to_owned(), open: None, waiting: Vec::new(), disarmed: None }
    }

    /// Whether something is still to be written, without a flight.
    pub(super) fn is_growing(&self) -> bool {
        self.disarmed.is_some()
    }

    /// Arming: goes on in the file of this boot, or begins one.
    pub(super) fn open(&mut self, storage: &mut dyn Storage) {
        self.flush(storage);
        self.disarmed = None;
        if self.open.is_some() {
            return;
        }
        let entries = storage.list(&self.folder).unwrap_or_default();
        let numbers = entries.iter().filter_map(|entry| entry.name.strip_suffix(".BIN"));
        let last = numbers.filter_map(|number| number.parse::<u32>().ok()).max().unwrap_or(0);
        let name = format!("{}/{:08}.BIN", self.folder, last + 1);
        if storage.create(&name).is_ok() {
            self.open = Some((name, 0));
        }
    }

    /// More of the log.
    pub(super) fn write(&mut self, bytes: &[u8], storage: &mut dyn Storage) {
        self.waiting.extend_from_slice(bytes);
        if self.disarmed.is_none() {
            let whole = self.waiting.len() / PIECE * PIECE;
            self.put(whole, storage);
        }
    }

    /// Disarmed: what comes now is written little by little.
    pub(super) fn disarm(&mut self, now: Micros) {
        self.disarmed.get_or_insert((now, 0));
    }

    /// Writes on after a flight; `rotate`: at once, and the next flight gets its own file.
    pub(super) fn poll(&mut self, now: Micros, rotate: bool, storage: &mut dyn Storage) {
        let Some((since, written)) = self.disarmed else { return };
        if rotate || now >= since + WRITES_ON {
            self.flush(storage);
            self.disarmed = None;
            if rotate {
                self.open = None;
            }
            return;
        }
        // In proportion to time, in whole pieces.
        let total = written + self.waiting.len();
        let share = (now - since) as f64 / WRITES_ON as f64;
        let due = (total as f64 * share) as usize / PIECE * PIECE;
        let more = due.saturating_sub(written);
        self.put(more, storage);
        self.disarmed = Some((since, written + more));
    }

    /// A download has begun: the next flight gets a new file.
    pub(super) fn close(&mut self, storage: &mut dyn Storage) {
        self.flush(storage);
        self.open = None;
    }

    /// Everything that waits, at once.
    pub(super) fn flush(&mut self, storage: &mut dyn Storage) {
        self.put(self.waiting.len(), storage);
    }

    fn put(&mut self, count: usize, storage: &mut dyn Storage) {
        let bytes: Vec<u8> = self.waiting.drain(..count.min(self.waiting.len())).collect();
        if let Some((name, size)) = &mut self.open
            && !bytes.is_empty()
            && storage.write_at(name, *size, &bytes).is_ok()
        {
            *size += bytes.len() as u64;
        }
    }
}
