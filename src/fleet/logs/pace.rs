//! How many drones of a network are asked at once.

use crate::link::clock::{Micros, S};

/// What is looked at together.
const LOOK: Micros = 2 * S;

/// Raises the number while that brings more bytes, and lowers it when it brings clearly fewer: a
/// radio network carries more in all from several drones than from one, until their packets
/// collide. Loss by itself is no reason: noise takes its share from few drones as from many.
#[derive(Clone, Copy, Debug)]
pub struct Pace {
    at_once: f64,
    most: f64,
    since: Option<Micros>,
    bytes: u64,
    /// Bytes per second at the last look, and the best of late.
    last: f64,
    best: f64,
}

impl Pace {
    /// At most so many.
    pub fn new(most: usize) -> Self {
        let most = most.max(1) as f64;
        Self { at_once: most.min(8.0), most, since: None, bytes: 0, last: 0.0, best: 0.0 }
    }

    /// So many now.
    pub fn at_once(&self) -> usize {
        self.at_once as usize
    }

    /// Tells all new bytes so far, and how many drones are being asked.
    pub fn look(&mut self, now: Micros, bytes: u64, busy: usize) {
        let since = *self.since.get_or_insert(now);
        let passed = now.saturating_sub(since);
        if passed < LOOK {
            return;
        }
        let rate = bytes.saturating_sub(self.bytes) as f64 / (passed as f64 / 1e6);
        self.since = Some(now);
        self.bytes = bytes;
        let is_full = busy >= self.at_once();
        if is_full && rate < 0.7 * self.best {
            self.at_once = (self.at_once * 0.7).max(1.0);
            // What was best then may not be possible any more.
            self.best = rate;
        } else if is_full && rate > 1.03 * self.last {
            self.at_once = (self.at_once + 1.0).min(self.most);
        }
        self.last = rate;
        self.best = self.best.max(rate);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The number that it comes to when so many drones give so much.
    fn settles(rate: impl Fn(usize) -> f64) -> usize {
        let mut pace = Pace::new(50);
        let mut bytes = 0;
        for second in 0..400 {
            bytes += rate(pace.at_once()) as u64;
            pace.look(second * S, bytes, 50);
        }
        pace.at_once()
    }

    #[test]
    fn it_rises_while_that_helps_and_falls_when_it_hurts() {
        assert_eq!(settles(|n| 1000.0 * n as f64), 50);
        assert!(settles(|n| 1000.0 * (n as f64).min(10.0)) < 14);
        let collapsing = |n: usize| if n > 8 { 2000.0 } else { 1000.0 * n as f64 };
        assert!(settles(collapsing) <= 9);
    }
}
