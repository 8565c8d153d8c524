//! Results that were computed before. Searches of one flight begin alike: with the same logs, the same model and the same updrafts,
//! each looks for something else, and the best of them is taken up once more. What follows from the same numbers, bit by
//! bit, is computed once.

use std::collections::BTreeMap;
use std::fmt::{self, Write as _};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Odd numbers with as many ones as zeros, by which the halves of a digest differ.
const FACTORS: [u64; 2] = [0x9E37_79B9_7F4A_7C15, 0xC2B2_AE3D_27D4_EB4F];

/// Everything that a result follows from, in 128 bits: chance does not make two of some ten thousand alike.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Digest([u64; 2]);

impl Digest {
    /// Of nothing yet.
    pub(super) fn new() -> Self {
        Self(FACTORS)
    }

    /// Takes in a whole number.
    pub(super) fn add(&mut self, bits: u64) {
        for (sum, factor) in self.0.iter_mut().zip(FACTORS) {
            *sum = (*sum ^ bits).wrapping_mul(factor);
            *sum ^= *sum >> 29;
        }
    }

    /// Takes in values, and how many they are.
    pub(super) fn add_all<'v>(&mut self, values: impl IntoIterator<Item = &'v f64>) {
        let mut count = 0;
        for value in values {
            self.add(value.to_bits());
            count += 1;
        }
        self.add(count);
    }

    /// Takes in something by all that its text for programmers says: of numbers that is every bit.
    pub(super) fn add_debug(&mut self, of: &impl fmt::Debug) {
        // Writing into a digest cannot fail.
        let _ = write!(self, "{of:?}");
        self.add(u64::MAX);
    }
}

impl fmt::Write for Digest {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        text.bytes().for_each(|byte| self.add(u64::from(byte)));
        Ok(())
    }
}

/// Results by what they follow from, of all threads.
pub(super) struct Memory<T> {
    known: Mutex<BTreeMap<Digest, T>>,
    most: usize,
}

impl<T: Clone> Memory<T> {
    /// Of so many results at most.
    pub(super) const fn of(most: usize) -> Self {
        Self { known: Mutex::new(BTreeMap::new()), most }
    }

    /// The result that belongs to a digest, if it is known.
    pub(super) fn get(&self, of: Digest) -> Option<T> {
        self.locked().get(&of).cloned()
    }

    /// The result that belongs to a digest, computed if it is not known; errors are not kept.
    ///
    /// # Errors
    /// Those of `compute`.
    pub(super) fn or_computed<E>(
        &self,
        of: Digest,
        compute: impl FnOnce() -> Result<T, E>,
    ) -> Result<T, E> {
        if let Some(known) = self.get(of) {
            return Ok(known);
        }
        let result = compute()?;
        self.keep(of, result.clone());
        Ok(result)
    }

    /// Keeps a result; all others are forgotten when they become too many.
    pub(super) fn keep(&self, of: Digest, result: T) {
        let mut known = self.locked();
        if known.len() >= self.most {
            known.clear();
        }
        known.insert(of, result);
    }

    /// Who panicked leaves whole entries behind.
    fn locked(&self) -> MutexGuard<'_, BTreeMap<Digest, T>> {
        self.known.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn digest(parts: &[&[f64]]) -> Digest {
        let mut digest = Digest::new();
        for part in parts {
            digest.add_all(*part);
        }
        digest
    }

    #[test]
    fn a_digest_is_of_each_bit_and_of_the_order() {
        let first = digest(&[&[1.5, -2.0], &[3.0]]);
        assert_eq!(digest(&[&[1.5, -2.0], &[3.0]]), first);
        for other in [
            digest(&[&[1.5], &[-2.0, 3.0]]),
            digest(&[&[-2.0, 1.5], &[3.0]]),
            digest(&[&[1.5, -2.0], &[3.0 + 1e-15]]),
            digest(&[&[1.5, -2.0], &[3.0], &[]]),
        ] {
            assert_ne!(other, first);
        }
        let of_text = |text: &str, value: f64| {
            let mut digest = Digest::new();
            digest.add_debug(&(text, value));
            digest
        };
        assert_eq!(of_text("drag", 0.1), of_text("drag", 0.1));
        assert_ne!(of_text("drag", 0.1), of_text("drag", 0.1 + 2e-17));
        assert_ne!(of_text("drag", 0.1), of_text("lag", 0.1));
    }

    #[test]
    fn a_result_is_known_until_there_are_too_many() {
        let memory = Memory::of(2);
        let of = [1.0, 2.0, 3.0].map(|value| digest(&[&[value]]));
        assert_eq!(memory.get(of[0]), None);
        memory.keep(of[0], "first");
        memory.keep(of[1], "second");
        assert_eq!([memory.get(of[0]), memory.get(of[1])], [Some("first"), Some("second")]);
        memory.keep(of[2], "third");
        assert_eq!(of.map(|of| memory.get(of)), [None, None, Some("third")]);
    }
}
