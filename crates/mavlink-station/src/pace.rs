//! Number of drones of a network that are downloaded from at once.

use crate::link::clock::{Micros, S};

/// What is looked at together.
const LOOK: Micros = 4 * S;
/// Fewer bytes than this share of the best: too many at once.
const HURTS: f64 = 0.6;
/// The best is forgotten at this rate per look: a link may get worse.
const FORGETS: f64 = 0.97;
/// Never fewer, if there are as many: a drone spends most of its time waiting for answers.
const LEAST: f64 = 4.0;

/// Controller of the number of drones that are downloaded from at once.
///
/// It raises the number while that does no harm, and lowers it when clearly fewer bytes come: a radio
/// network carries more in all from several drones than from one, until their packets collide. Loss by
/// itself is no reason: noise takes its share from few drones as from many.
#[derive(Clone, Copy, Debug)]
pub struct Pace {
    at_once: f64,
    most: f64,
    since: Option<Micros>,
    bytes: u64,
    /// Bytes per second, smoothed, and the best of late.
    rate: f64,
    best: f64,
}

impl Pace {
    /// A controller that allows at most this many drones at once.
    pub fn new(most: usize) -> Self {
        let most = most.max(1) as f64;
        Self { at_once: most.min(12.0), most, since: None, bytes: 0, rate: 0.0, best: 0.0 }
    }

    /// Number of drones that may be downloaded from at once now.
    pub fn at_once(&self) -> usize {
        self.at_once as usize
    }

    /// Takes the number of new bytes so far, and of drones that are being downloaded from.
    pub fn look(&mut self, now: Micros, bytes: u64, busy: usize) {
        let since = *self.since.get_or_insert(now);
        let passed = now.saturating_sub(since);
        if passed < LOOK {
            return;
        }
        let rate = bytes.saturating_sub(self.bytes) as f64 / (passed as f64 / 1e6);
        self.since = Some(now);
        self.bytes = bytes;
        self.rate = if self.rate == 0.0 { rate } else { self.rate.midpoint(rate) };
        self.best = (self.best * FORGETS).max(self.rate);
        // With fewer drones than allowed the number is not what limits.
        if busy < self.at_once() {
            return;
        }
        if self.rate < HURTS * self.best {
            self.at_once = (self.at_once * 0.7).max(LEAST.min(self.most));
            self.best = self.rate;
        } else {
            self.at_once = (self.at_once + 1.0).min(self.most);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mean of the rate over the second half, if so many drones give so much.
    fn mean(rate: impl Fn(usize) -> f64) -> f64 {
        let mut pace = Pace::new(50);
        let mut bytes = 0.0;
        for second in 0..2000 {
            let half = if second < 1000 { 0.0 } else { 1.0 };
            bytes += half * rate(pace.at_once());
            pace.look(second * S, 1_000_000 + bytes as u64, 50);
        }
        bytes / 1000.0
    }

    #[test]
    fn it_rises_while_that_does_no_harm_and_falls_when_it_hurts() {
        assert!(mean(|n| 1000.0 * n as f64) > 40_000.0);
        assert!(mean(|n| 1000.0 * (n as f64).min(10.0)) > 9_800.0);
        let collapsing = |n: usize| if n > 12 { 1000.0 } else { 1000.0 * n as f64 };
        assert!(mean(collapsing) > 6_000.0, "{}", mean(collapsing));
    }
}
