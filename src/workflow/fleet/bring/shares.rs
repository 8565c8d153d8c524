//! Progress of a pull of logs: every drone's share, finished or not.

use std::collections::{BTreeMap, BTreeSet};

use crate::link::conversation::Progress as Share;
use crate::link::id::DroneId;

/// The shares of all drones, and their sum.
#[derive(Debug, Default)]
pub(super) struct Shares {
    of: BTreeMap<DroneId, Share>,
    /// Adding them up at every message would cost more than the message.
    sum: Share,
    over: BTreeSet<DroneId>,
}

impl Shares {
    /// A drone has come so far. What came once is not taken back: a log that is begun anew stands
    /// still until it has caught up.
    pub(super) fn note(&mut self, drone: DroneId, share: Share, over: bool) {
        let before = self.of.get(&drone).copied().unwrap_or_default();
        let total = share.total.max(before.total);
        let done = share.done.max(before.done);
        self.of.insert(drone, Share { done, total });
        self.sum.done += done - before.done;
        self.sum.total += total - before.total;
        if over {
            self.over.insert(drone);
        }
    }

    /// Bytes that came, and bytes of the logs whose sizes are known.
    pub(super) fn sum(&self) -> Share {
        self.sum
    }

    /// Drones that are done.
    pub(super) fn over(&self) -> usize {
        self.over.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_came_is_never_taken_back() {
        let drone = |system| DroneId { network: 0, system };
        let mut shares = Shares::default();
        shares.note(drone(1), Share { done: 70, total: 100 }, false);
        shares.note(drone(2), Share { done: 10, total: 50 }, false);
        // It is compared, begun anew, and over.
        for done in [0, 20] {
            shares.note(drone(1), Share { done, total: 100 }, false);
            assert_eq!(shares.sum(), Share { done: 80, total: 150 });
        }
        shares.note(drone(1), Share { done: 0, total: 0 }, true);
        assert_eq!((shares.sum(), shares.over()), (Share { done: 80, total: 150 }, 1));
    }
}
