//! Single reads on their way, how many at once, and which bytes next.
//!
//! Shared by both protocols of download: a read is repaired by a read.

use std::collections::BTreeMap;

use crate::fleet::intervals::Intervals;
use crate::link::clock::{Micros, S};

/// Answers and losses that are looked at together.
const LOOK: u32 = 24;
/// With so large a share lost, the window was too large for the link, not only the link bad.
const TOO_LOSSY: f64 = 0.65;

/// Longest wait for an answer.
const MOST_PAUSE: Micros = 4 * S;
/// Within the patience of whoever asks, a probe is repeated at least so often: with a fifth of the
/// frames lost each way, one in 200,000 drones that are there is given up.
const TRIES: Micros = 12;

/// Reads on their way.
#[derive(Clone, Debug)]
pub(crate) struct Reads {
    /// By offset: end, and when asked.
    on_way: BTreeMap<u64, (u64, Micros)>,
    window: f64,
    most: f64,
    most_pause: Micros,
    answered: u32,
    lost: u32,
    /// Losses in a row, for the pause.
    silent: u32,
    cursor: u64,
    piece: u64,
    /// Reads that were asked for.
    pub(crate) asked: u64,
}

impl Reads {
    /// Of at most `piece` bytes each, at most `most` at once; a vehicle that is silent for
    /// `patience` is given up by whoever asks.
    pub(crate) fn new(piece: u64, most: usize, patience: Micros) -> Self {
        Self {
            on_way: BTreeMap::new(),
            window: 4.0,
            most: most as f64,
            most_pause: MOST_PAUSE.min(patience / TRIES),
            answered: 0,
            lost: 0,
            silent: 0,
            cursor: 0,
            piece,
            asked: 0,
        }
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.on_way.is_empty()
    }

    /// Nothing is on its way any more; where it was lost.
    pub(crate) fn clear(&mut self) {
        self.on_way.clear();
        self.silent = 0;
    }

    /// An answer to the read at `offset`; how long it took, if one was waited for.
    pub(crate) fn answered(&mut self, now: Micros, offset: u64) -> Option<Micros> {
        let (_, asked) = self.on_way.remove(&offset)?;
        self.silent = 0;
        self.answered += 1;
        self.window = (self.window + 0.5).min(self.most);
        self.look();
        Some(now.saturating_sub(asked))
    }

    /// Forgets what is late; returns when the next one will be. When `probing`, one read stands
    /// for all, and is repeated less and less often.
    pub(crate) fn expire(&mut self, now: Micros, timeout: Micros, probing: bool) -> Micros {
        let losses = if probing { self.silent } else { self.silent / 16 };
        let pause = (timeout << losses.min(4)).min(self.most_pause.max(timeout)).min(MOST_PAUSE);
        let before = self.on_way.len();
        let mut next = Micros::MAX;
        self.on_way.retain(|_, (_, asked)| {
            let is_late = now >= *asked + pause;
            if !is_late {
                next = next.min(*asked + pause);
            }
            !is_late
        });
        let late = (before - self.on_way.len()) as u32;
        self.lost += late;
        self.silent += late;
        self.look();
        next
    }

    fn look(&mut self) {
        let all = self.answered + self.lost;
        if all >= LOOK {
            if f64::from(self.lost) > TOO_LOSSY * f64::from(all) {
                self.window = (self.window / 2.0).max(2.0);
            }
            (self.answered, self.lost) = (0, 0);
        }
    }

    /// The next range to ask for, if there is room: missing, below `limit`, not on its way.
    pub(crate) fn next(
        &mut self,
        now: Micros,
        have: &Intervals,
        limit: u64,
        probing: bool,
    ) -> Option<(u64, u64)> {
        // Many drones at once that hear nothing ask less each.
        let room = match self.silent {
            _ if probing => 1.0,
            0..=48 => self.window,
            _ => 2.0,
        };
        if self.on_way.len() as f64 >= room {
            return None;
        }
        let mut wrapped = false;
        loop {
            let Some((start, end)) = have.gap(self.cursor, limit) else {
                if wrapped {
                    return None;
                }
                wrapped = true;
                self.cursor = 0;
                continue;
            };
            let asked = self.on_way.range(..=start).next_back();
            if let Some((_, &(asked_end, _))) = asked.filter(|(_, (end, _))| *end > start) {
                self.cursor = asked_end;
                continue;
            }
            let end = end.min(start + self.piece);
            let end = self.on_way.range(start..end).next().map_or(end, |(&next, _)| next.min(end));
            self.cursor = end;
            self.on_way.insert(start, (end, now));
            self.asked += 1;
            return Some((start, end));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_silent_vehicle_is_asked_often_enough_before_it_is_given_up() {
        for patience in [10 * S, 60 * S] {
            let (mut reads, have) = (Reads::new(239, 48, patience), Intervals::default());
            let mut now = 0;
            while now < patience {
                let next = reads.expire(now, 600_000, true);
                if reads.next(now, &have, 100_000, true).is_none() {
                    now = next;
                }
            }
            assert!((12..40).contains(&reads.asked), "{} in {patience} us", reads.asked);
        }
    }
}
