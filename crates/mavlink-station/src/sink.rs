//! Where downloaded bytes go.

use super::intervals::Intervals;
use crate::link::clock::Micros;

/// Takes pieces of a file in any order.
pub trait Sink {
    /// What is there.
    fn have(&self) -> &Intervals;

    /// Takes a piece; returns how many of its bytes are new. An error's text says what to do.
    fn put(&mut self, now: Micros, offset: u64, data: &[u8]) -> Result<u64, String>;
}

/// A file in memory.
#[derive(Clone, Debug, Default)]
pub struct Memory {
    /// The bytes; zeros where there are none yet.
    pub bytes: Vec<u8>,
    /// Which are there.
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
