//! Sets of slots.

use std::collections::BTreeSet;

use crate::mission::Plan;

/// A set of slots, as a user names them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SlotSet(BTreeSet<u16>);

impl std::str::FromStr for SlotSet {
    type Err = String;

    /// From numbers and ranges: `1-10,12`.
    fn from_str(text: &str) -> Result<Self, String> {
        let bad = || "write slots as 1-10,12,20-29".to_owned();
        let mut slots = BTreeSet::new();
        for part in text.split(',') {
            let (first, last) = part.split_once('-').unwrap_or((part, part));
            let first: u16 = first.trim().parse().map_err(|_| bad())?;
            let last: u16 = last.trim().parse().map_err(|_| bad())?;
            if first == 0 || last < first {
                return Err(bad());
            }
            slots.extend(first..=last);
        }
        Ok(Self(slots))
    }
}

impl FromIterator<u16> for SlotSet {
    fn from_iter<I: IntoIterator<Item = u16>>(slots: I) -> Self {
        Self(slots.into_iter().collect())
    }
}

impl SlotSet {
    /// First slot of the set that a plan does not have, if there is one.
    pub fn stray(&self, plan: &Plan) -> Option<u16> {
        self.0.iter().copied().find(|slot| plan.slot(*slot).is_none())
    }

    /// Whether a slot is in the set.
    pub fn contains(&self, slot: u16) -> bool {
        self.0.contains(&slot)
    }
}
