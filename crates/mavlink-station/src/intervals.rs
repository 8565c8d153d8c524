//! Sets of byte ranges: the parts of a file that have come.

use std::collections::BTreeMap;

/// A set of byte ranges, `start..end`. Ranges that touch become one.
///
/// ```
/// use mavlink_station::intervals::Intervals;
///
/// let mut have = Intervals::default();
/// assert_eq!(have.insert(0, 100), 100);
/// assert_eq!(have.insert(80, 200), 100); // 20 bytes were there
/// assert_eq!(have.insert(300, 400), 100);
/// assert_eq!(have.gap(0, 1_000), Some((200, 300)));
/// ```
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Intervals {
    /// End by start; neither overlapping nor touching.
    ranges: BTreeMap<u64, u64>,
    total: u64,
}

/// Largest number of separate ranges: a peer that sends crumbs is not worth more memory.
pub const MOST_RANGES: usize = 1 << 18;

impl Intervals {
    /// Number of bytes in the set.
    pub fn total(&self) -> u64 {
        self.total
    }

    /// Number of separate ranges in the set.
    pub fn count(&self) -> usize {
        self.ranges.len()
    }

    /// Adds a range; returns how many of its bytes are new. A range that would exceed
    /// [`MOST_RANGES`] is not added.
    pub fn insert(&mut self, start: u64, end: u64) -> u64 {
        if start >= end {
            return 0;
        }
        let before = self.total;
        let (mut start, mut end) = (start, end);
        if let Some((&other, &other_end)) = self.ranges.range(..=start).next_back()
            && other_end >= start
        {
            if other_end >= end {
                return 0;
            }
            self.ranges.remove(&other);
            self.total -= other_end - other;
            start = other;
        }
        while let Some((&other, &other_end)) = self.ranges.range(start..=end).next() {
            self.ranges.remove(&other);
            self.total -= other_end - other;
            end = end.max(other_end);
        }
        if self.ranges.len() >= MOST_RANGES {
            return 0;
        }
        self.ranges.insert(start, end);
        self.total += end - start;
        self.total - before
    }

    /// Whether a whole range is in the set.
    pub fn contains(&self, start: u64, end: u64) -> bool {
        start >= end || self.ranges.range(..=start).next_back().is_some_and(|(_, &its)| its >= end)
    }

    /// First range at or behind `from`, below `limit`, that is not in the set.
    pub fn gap(&self, from: u64, limit: u64) -> Option<(u64, u64)> {
        let mut start = from;
        if let Some((_, &end)) = self.ranges.range(..=start).next_back()
            && end > start
        {
            start = end;
        }
        if start >= limit {
            return None;
        }
        let end = self.ranges.range(start..).next().map_or(limit, |(&next, _)| next.min(limit));
        Some((start, end))
    }

    /// Starts and ends of the ranges, in order.
    pub fn iter(&self) -> impl Iterator<Item = (u64, u64)> + '_ {
        self.ranges.iter().map(|(&start, &end)| (start, end))
    }

    /// End of the last range; 0 if the set is empty.
    pub fn end(&self) -> u64 {
        self.ranges.last_key_value().map_or(0, |(_, &end)| end)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn is_a_set_of_bytes(pieces in proptest::collection::vec((0u64..200, 0u64..30), 0..60)) {
            let mut set = Intervals::default();
            let mut plain = vec![false; 300];
            for (start, length) in pieces {
                let new = (start..start + length).filter(|at| !plain[*at as usize]).count();
                prop_assert_eq!(set.insert(start, start + length), new as u64);
                plain[start as usize..(start + length) as usize].fill(true);
            }
            prop_assert_eq!(set.total(), plain.iter().filter(|at| **at).count() as u64);
            let mut at = 0;
            let mut missing = 0;
            while let Some((start, end)) = set.gap(at, 300) {
                prop_assert!(start >= at && end > start);
                prop_assert!((start..end).all(|at| !plain[at as usize]));
                prop_assert!(end == 300 || plain[end as usize]);
                missing += end - start;
                at = end;
            }
            prop_assert_eq!(missing + set.total(), 300);
            let ranges: Vec<_> = set.iter().collect();
            prop_assert!(ranges.windows(2).all(|two| two[0].1 < two[1].0));
        }
    }
}
