//! Destinations of downloaded bytes.

use super::intervals::Intervals;
use crate::link::clock::Micros;

/// Destination of a download, which takes pieces of a file in any order.
pub trait Sink {
    /// Byte ranges that the destination has.
    fn have(&self) -> &Intervals;

    /// Takes a piece at an offset; returns how many of its bytes are new.
    ///
    /// # Errors
    ///
    /// A text for people, with the remedy, if the bytes cannot be kept.
    fn put(&mut self, now: Micros, offset: u64, data: &[u8]) -> Result<u64, String>;
}

/// A downloaded file in memory.
#[derive(Clone, Debug, Default)]
pub struct Memory {
    /// Content of the file; zeros where nothing has come yet.
    pub bytes: Vec<u8>,
    /// Byte ranges that have come.
    pub have: Intervals,
}

impl Sink for Memory {
    fn have(&self) -> &Intervals {
        &self.have
    }

    fn put(&mut self, _now: Micros, offset: u64, data: &[u8]) -> Result<u64, String> {
        let end = offset + data.len() as u64;
        let new = self.have.insert(offset, end);
        if new > 0 {
            let (start, end) = (offset as usize, end as usize);
            if self.bytes.len() < end {
                self.bytes.resize(end, 0);
            }
            self.bytes[start..end].copy_from_slice(data);
        }
        Ok(new)
    }
}
