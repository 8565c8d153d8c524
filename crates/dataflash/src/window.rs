//! The part of a log that is looked at: all of a log in memory, or a piece of a file at a time.
//!
//! Reading a file piece by piece into one small buffer costs less than half of what mapping it does:
//! no page tables are made and torn down, and the walk finds each piece in the processor's cache. Nor
//! can another process end this one by cutting the file short.

use std::io::{ErrorKind, Read, Take};

/// Bytes of a file looked at together; they fit into a second-level cache.
const WINDOW_BYTES: usize = 1 << 17;

/// So many bytes after a message may decide whether to believe in it: those of the message itself and
/// of one that starts inside of it, and a header. Every window but the last has them.
pub(super) const LOOKAHEAD_BYTES: usize = 1024;

/// Bytes of a log, and where they lie in it.
#[derive(Clone, Copy)]
pub(super) struct Window<'a> {
    pub(super) bytes: &'a [u8],
    /// Place of the first of them, from the start of the log.
    pub(super) base: usize,
    /// Size of the log.
    pub(super) size: usize,
    /// Whether the log ends with them.
    pub(super) is_last: bool,
}

impl<'a> Window<'a> {
    /// All of a log.
    pub(super) fn whole(bytes: &'a [u8]) -> Self {
        Self { bytes, base: 0, size: bytes.len(), is_last: true }
    }

    /// Messages that start before this place are looked at here, others in the next window.
    pub(super) fn limit(&self) -> usize {
        let length = self.bytes.len();
        if self.is_last { length } else { length.saturating_sub(LOOKAHEAD_BYTES) }
    }
}

/// The windows of a file, one after another.
pub(super) struct Windows<R> {
    file: Take<R>,
    size: usize,
    buffer: Vec<u8>,
    filled: usize,
    base: usize,
}

impl<R: Read> Windows<R> {
    /// Of the first `size` bytes of a file: what is written to it meanwhile is left alone.
    pub(super) fn new(file: R, size: usize) -> Self {
        Self::of(file, size, WINDOW_BYTES.min(size))
    }

    fn of(file: R, size: usize, window_bytes: usize) -> Self {
        let buffer = vec![0; window_bytes.max(2 * LOOKAHEAD_BYTES)];
        Self { file: file.take(size as u64), size, buffer, filled: 0, base: 0 }
    }

    /// The next window: it begins at `done` of the one before. Where a file ends early or cannot be
    /// read on, is the last one.
    pub(super) fn advance(&mut self, done: usize) -> Window<'_> {
        let done = done.min(self.filled);
        self.buffer.copy_within(done..self.filled, 0);
        self.filled -= done;
        self.base += done;
        let mut is_last = false;
        while self.filled < self.buffer.len() && !is_last {
            match self.file.read(self.buffer.get_mut(self.filled..).unwrap_or_default()) {
                Ok(0) => is_last = true,
                Ok(count) => self.filled += count,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(_) => is_last = true,
            }
        }
        is_last |= self.file.limit() == 0;
        let bytes = self.buffer.get(..self.filled).unwrap_or_default();
        Window { bytes, base: self.base, size: self.size, is_last }
    }
}

#[cfg(test)]
mod tests {
    use super::super::columns::Notes;
    use super::super::inventory::Count;
    use super::super::scan::{scan, scan_windows};
    use super::super::{LogWriter, Select, Value, catalog, inventory};
    use super::*;

    #[test]
    fn windows_hold_every_byte_and_the_last_one_says_so() {
        let sizes = [0, 1, LOOKAHEAD_BYTES, WINDOW_BYTES - 1, WINDOW_BYTES, 3 * WINDOW_BYTES + 7];
        for size in sizes {
            let bytes: Vec<u8> = (0..size).map(|index| (index % 251) as u8).collect();
            let file = [&bytes[..], b"written later"].concat();
            let mut windows = Windows::new(&file[..], size);
            let mut done = 0;
            loop {
                let window = windows.advance(done);
                let end = window.base + window.bytes.len();
                assert_eq!(window.bytes, &bytes[window.base..end], "{size} bytes");
                assert_eq!(window.is_last, end == size, "{size} bytes");
                if window.is_last {
                    break;
                }
                assert_eq!(window.bytes.len() - window.limit(), LOOKAHEAD_BYTES);
                done = window.limit() + 3;
            }
        }
    }
    /// A log of attitudes and texts, damaged here and there.
    fn damaged(seed: u64) -> Vec<u8> {
        let mut state = seed;
        let mut below = |end: usize| {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            ((state >> 33) % end as u64) as usize
        };
        let messages = [&catalog::ATT, &catalog::MSG];
        let mut log = LogWriter::new(Vec::new(), &messages).unwrap();
        for step in 0..400 {
            let time = Value::Int(5_000_000 + step * 20_000);
            let mut attitude = [Value::Float(step as f64 * 0.37); 10];
            attitude[0] = time;
            log.row(&catalog::ATT, &attitude).unwrap();
            if step % 7 == 0 {
                log.row(&catalog::MSG, &[time, Value::Text(&format!("text {step}"))]).unwrap();
            }
        }
        let mut bytes = log.finish().unwrap();
        for _ in 0..below(40) {
            let at = below(bytes.len());
            let end = (at + below(80)).min(bytes.len());
            match below(4) {
                0 => bytes[at] ^= 1 << below(8),
                1 => drop(bytes.drain(at..end)),
                2 => bytes[at..end].fill_with(|| [0xA3, 0x95, 0x80, 0][below(4)]),
                _ => bytes.truncate(bytes.len() - below(60)),
            }
        }
        bytes
    }

    #[test]
    fn a_log_in_small_windows_reads_as_in_one() {
        let wanted = [
            Select { message: "ATT", fields: &["TimeUS", "Roll", "AEKF"] },
            Select { message: "MSG", fields: &["TimeUS", "Message"] },
            Select { message: "FMT", fields: &["Name", "Type"] },
        ];
        let mut hurt = 0;
        for seed in 0..300 {
            let bytes = damaged(seed);
            let windows = || Windows::of(&bytes[..], bytes.len(), 0);
            let (mut whole, mut pieces) = (Notes::new(&wanted), Notes::new(&wanted));
            let of_whole = scan(&bytes, &mut whole);
            let of_pieces = scan_windows(windows(), &mut pieces);
            assert_eq!(of_whole.stats, of_pieces.stats, "seed {seed}");
            let tables = whole.tables(&of_whole.units);
            // NaN is not itself; its text is.
            let (tables, others) = (format!("{tables:?}"), pieces.tables(&of_pieces.units));
            assert_eq!(tables, format!("{others:?}"), "seed {seed}");
            let (mut whole, mut pieces) = (Count::default(), Count::default());
            let of_whole = scan(&bytes, &mut whole);
            let of_pieces = scan_windows(windows(), &mut pieces);
            hurt += usize::from(of_whole.stats.bad_bytes > 0);
            let size = bytes.len() as u64;
            assert_eq!(
                inventory::take(size, &whole, of_whole),
                inventory::take(size, &pieces, of_pieces),
                "seed {seed}"
            );
        }
        assert!(hurt > 200, "{hurt} logs were damaged");
    }
}
