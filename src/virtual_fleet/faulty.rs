//! A bad link between real sockets: frames are lost, duplicated and delayed.

use std::collections::BTreeMap;

use rand::RngExt as _;
use rand_pcg::Pcg64;

use super::lossy::Faults;
use crate::base::rng::{Purpose, stream};
use crate::link::clock::Micros;

/// Frames on their way, by arrival. The limit of bytes per second is shared by all that pass.
#[derive(Debug)]
pub(super) struct FaultyLink<T> {
    faults: Faults,
    flying: BTreeMap<(Micros, u64), T>,
    count: u64,
    free: Micros,
    rng: Pcg64,
}

impl<T: Clone> FaultyLink<T> {
    pub(super) fn new(faults: Faults, seed: u64, direction: u64) -> Self {
        let rng = stream(seed, direction, Purpose::Link);
        Self { faults, flying: BTreeMap::new(), count: 0, free: 0, rng }
    }

    /// Puts a frame of so many bytes on its way.
    pub(super) fn send(&mut self, now: Micros, bytes: usize, frame: &T) {
        let mut leaves = now;
        if self.faults.bytes_per_s > 0.0 {
            leaves = leaves.max(self.free);
            if leaves - now > self.faults.queue {
                return;
            }
            leaves += (bytes as f64 / self.faults.bytes_per_s * 1e6) as Micros;
            self.free = leaves;
        }
        let copies = 1 + usize::from(self.chance(self.faults.repeat));
        for _ in 0..copies {
            if self.chance(self.faults.loss) {
                continue;
            }
            let jitter = match self.faults.jitter {
                0 => 0,
                most => self.rng.random_range(0..=most),
            };
            self.count += 1;
            self.flying.insert((leaves + self.faults.delay + jitter, self.count), frame.clone());
        }
    }

    fn chance(&mut self, share: f64) -> bool {
        share > 0.0 && self.rng.random_bool(share.min(1.0))
    }

    /// When the next frame arrives.
    pub(super) fn next(&self) -> Option<Micros> {
        self.flying.first_key_value().map(|((arrives, _), _)| *arrives)
    }

    /// The next frame that has arrived.
    pub(super) fn arrived(&mut self, now: Micros) -> Option<T> {
        let entry = self.flying.first_entry()?;
        (entry.key().0 <= now).then(|| entry.remove())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_perfect_link_keeps_all_in_order_and_a_bad_one_does_not() {
        let pass = |faults| {
            let mut link = FaultyLink::new(faults, 1, 0);
            (0..1000).for_each(|number| link.send(number * 100, 10, &number));
            std::iter::from_fn(|| link.arrived(Micros::MAX)).collect::<Vec<_>>()
        };
        assert_eq!(pass(Faults::default()), (0..1000).collect::<Vec<_>>());
        let bad = Faults { loss: 0.2, repeat: 0.1, jitter: 1_000, ..Faults::default() };
        let got = pass(bad);
        assert!((820..940).contains(&got.len()), "{} of 1000", got.len());
        assert!(!got.is_sorted());
        let slow = Faults { bytes_per_s: 10_000.0, queue: 1_000, ..Faults::default() };
        assert!(pass(slow).len() < 120);
    }
}
