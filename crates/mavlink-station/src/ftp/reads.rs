//! Single reads on their way: their number, and the choice of the next bytes.
//!
//! Shared by both protocols of download: a read is repaired by a read.

use std::collections::BTreeMap;

use crate::intervals::Intervals;
use crate::link::clock::{Micros, S};

/// Answers and losses that are looked at together.
const LOOK: u32 = 24;
/// With so large a share lost, the window was too large for the link, not only the link bad.
const TOO_LOSSY: f64 = 0.65;

/// Never fewer because of a queue: the reads of others may be what waits in it.
const FEWEST: f64 = 4.0;

/// They are asked for so much faster than a burst came.
const SPARES: f64 = 0.9;
/// So many may follow each other at once: autopilots keep five that wait.
const AT_ONCE: f64 = 3.0;
/// More lost than usual by this share: they were asked for too fast.
const WORSE: f64 = 0.2;

/// The last ones are asked for so often besides.
const COPIES: u32 = 2;

/// Longest wait for an answer.
const MOST_PAUSE: Micros = 4 * S;
/// Reads that wait in queues for longer than this are too many: more would bring nothing, and only
/// be lost where a queue ends.
const QUEUES: f64 = 120e3;
/// The shortest time to an answer is forgotten at this rate per answer: a link may get longer.
const FORGETS: f64 = 1.0 + 1.0 / 1024.0;
/// Within the patience of whoever asks, a probe is repeated at least so often: with a fifth of the
/// frames lost each way, one in 200,000 drones that are there is given up.
const TRIES: Micros = 12;

/// Reads on their way.
#[derive(Clone, Debug)]
pub(crate) struct Reads {
    /// By offset: end, and when asked.
    on_way: BTreeMap<u64, Read>,
    window: f64,
    most: f64,
    /// Never fewer because of a queue.
    fewest: f64,
    /// Of the link, where others use it as well.
    share: f64,
    /// Copies of the last ones, in order.
    copied: u64,
    most_pause: Micros,
    answered: u32,
    lost: u32,
    /// Losses in a row, for the pause.
    silent: u32,
    /// Time to an answer, us: the shortest of late, and smoothed.
    least: f64,
    smooth: f64,
    /// Time between two of them, us, and when the next may go.
    spacing: f64,
    next_at: f64,
    /// Share that is lost as a rule.
    usual: f64,
    cursor: u64,
    piece: u64,
    /// Reads that were asked for.
    pub(crate) asked: u64,
}

/// One on its way.
#[derive(Clone, Copy, Debug)]
struct Read {
    end: u64,
    asked: Micros,
    copies: u32,
}

impl Reads {
    /// Of at most `piece` bytes each, at most `most` at once; a vehicle that is silent for
    /// `patience` is given up by whoever asks.
    pub(crate) fn new(piece: u64, most: usize, patience: Micros) -> Self {
        Self {
            on_way: BTreeMap::new(),
            window: 4.0,
            most: most as f64,
            fewest: FEWEST,
            share: f64::MAX,
            copied: 0,
            most_pause: MOST_PAUSE.min(patience / TRIES),
            answered: 0,
            lost: 0,
            silent: 0,
            least: f64::MAX,
            smooth: 0.0,
            spacing: 0.0,
            next_at: 0.0,
            usual: 0.3,
            cursor: 0,
            piece,
            asked: 0,
        }
    }

    /// The vehicle takes so long for each, us: it keeps few that wait, and drops more.
    pub(crate) fn pace(&mut self, spacing: f64) {
        self.spacing = SPARES * spacing;
    }

    /// So many at once have been seen to be right.
    pub(crate) fn at_least(&mut self, window: f64) {
        self.window = self.window.max(window).min(self.most);
    }

    /// When the next may go.
    pub(crate) fn not_before(&self) -> Micros {
        self.next_at as Micros
    }

    /// So many may be on their way where others use the link as well: their queue is no reason
    /// for fewer than half of that.
    pub(crate) fn share(&mut self, share: Option<f64>) {
        self.share = share.map_or(f64::MAX, |share| share.max(FEWEST));
        self.fewest = share.map_or(FEWEST, |share| (share / 2.0).max(FEWEST));
    }

    pub(crate) fn count(&self) -> usize {
        self.on_way.len()
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
        let Read { asked, copies, .. } = self.on_way.remove(&offset)?;
        self.silent = 0;
        self.answered += 1;
        let took = now.saturating_sub(asked);
        self.least = (self.least * FORGETS).min(took as f64);
        let weight = if self.smooth > 0.0 { 0.125 } else { 1.0 };
        self.smooth += (took as f64 - self.smooth) * weight;
        if self.smooth < self.least + QUEUES {
            self.window = (self.window + 0.5).min(self.most);
        } else if self.smooth > self.least + 2.0 * QUEUES {
            self.window = (self.window - 0.5).max(self.fewest.min(self.most));
        }
        self.look();
        (copies == 0).then_some(took)
    }

    /// Forgets what is late; returns when the next one will be. When `probing`, one read stands
    /// for all, and is repeated less and less often.
    pub(crate) fn expire(&mut self, now: Micros, timeout: Micros, probing: bool) -> Micros {
        let losses = if probing { self.silent } else { self.silent / self.many(16) };
        let pause = (timeout << losses.min(4)).min(self.most_pause.max(timeout)).min(MOST_PAUSE);
        let before = self.on_way.len();
        let mut next = Micros::MAX;
        self.on_way.retain(|_, read| {
            let is_late = now >= read.asked + pause;
            if !is_late {
                next = next.min(read.asked + pause);
            }
            !is_late
        });
        let late = (before - self.on_way.len()) as u32;
        self.lost += late;
        self.silent += late;
        self.look();
        next
    }

    /// Losses in a row that are no sign of anything: a window's worth, or so many.
    fn many(&self, least: u32) -> u32 {
        least.max(self.window as u32)
    }

    fn look(&mut self) {
        let all = self.answered + self.lost;
        // What is late is found late together.
        if all >= self.many(LOOK) {
            if f64::from(self.lost) > TOO_LOSSY * f64::from(all) {
                self.window = (self.window / 2.0).max(2.0);
            }
            let share = f64::from(self.lost) / f64::from(all);
            let is_worse = share > self.usual + WORSE;
            // Others may have left the link since it was measured.
            self.spacing *= if is_worse { 1.5 } else { 0.95 };
            self.usual += (share - self.usual) / 8.0;
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
            silent if silent <= self.many(48) && self.share < f64::MAX => {
                self.window.max(self.fewest).min(self.share)
            }
            silent if silent <= self.many(48) => self.window,
            _ => 2.0,
        };
        if self.on_way.len() as f64 >= room || (!probing && now < self.not_before()) {
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
            if let Some((_, read)) = asked.filter(|(_, read)| read.end > start) {
                self.cursor = read.end;
                continue;
            }
            let end = end.min(start + self.piece);
            let end = self.on_way.range(start..end).next().map_or(end, |(&next, _)| next.min(end));
            self.cursor = end;
            let earliest = now as f64 - AT_ONCE * self.spacing;
            self.next_at = self.next_at.max(earliest) + self.spacing;
            self.on_way.insert(start, Read { end, asked: now, copies: 0 });
            self.copied = 0;
            self.asked += 1;
            return Some((start, end));
        }
    }

    /// When nothing else is left to ask for, and few are on their way: the next of them again. One
    /// that is lost costs a timeout, and then there is nothing to fill it with.
    pub(crate) fn once_more(&mut self) -> Option<(u64, u64)> {
        if self.on_way.len() as f64 > self.window / 4.0 {
            return None;
        }
        let (start, read) =
            self.on_way.range_mut(self.copied..).find(|(_, read)| read.copies < COPIES)?;
        read.copies += 1;
        self.copied = *start;
        Some((*start, read.end))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_ones_are_asked_for_again_and_what_is_on_its_way_is_not() {
        let (mut reads, mut have) = (Reads::new(90, 48, S), Intervals::default());
        have.insert(90, 1_000);
        assert_eq!(reads.next(0, &have, 1_000, false), Some((0, 90)));
        assert_eq!(reads.next(0, &have, 1_000, false), None);
        let again: Vec<_> = std::iter::from_fn(|| reads.once_more()).collect();
        assert_eq!(again, [(0, 90), (0, 90)]);
        // Which of them is answered nobody knows.
        assert_eq!(reads.answered(50_000, 0), None);
        assert_eq!(reads.once_more(), None);
        // Many are on their way: the link has better things to do.
        let have = Intervals::default();
        while reads.next(0, &have, 1_000, false).is_some() {}
        assert_eq!(reads.once_more(), None);
    }

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
