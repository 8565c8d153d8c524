//! Large requests on their way, and the size of the next one.

use std::collections::VecDeque;

use super::PIECE;
use crate::link::clock::{MS, Micros};

/// A window is as large as comes in so long.
const TAKES: Micros = 450 * MS;
/// Of a slow link longer, if it has fewer packets than this, so that little is lost between windows.
const MANY: f64 = 32.0;
const MOST_TAKES: Micros = 600 * MS;
/// The first: a third of a second at 57,600 baud.
const FIRST: f64 = (16 * PIECE) as f64;
const LEAST: f64 = (8 * PIECE) as f64;
const MOST: f64 = (4 << 20) as f64;
/// The next is larger by this, at most.
const GROWS: f64 = 8.0;
/// Windows smaller than this are served before a copy of their request comes, until one that was
/// larger has come twice.
const WORTH_A_COPY: u64 = 256 * PIECE;
/// A window that lacks so much of its end, bytes, was too large for a queue on its way.
const CUT: u64 = 32 * PIECE;
/// Of what came of it so much is asked for from then on.
const UNCUT: f64 = 0.9;
/// And more again by this share with each window; by a quarter of it after each that was cut.
const REGAINS: f64 = 1.0 / 8.0;
const LEAST_REGAINS: f64 = 1.0 / 512.0;
/// With less than this share of what was asked for, requests are lost as well.
const LOSSY: f64 = 0.97;
/// A stream that stops for less than this does so for want of processor time.
const HICCUP: Micros = 20 * MS;
/// Fewer bytes tell nothing of how fast they pass.
const TELLING: u64 = 8 * PIECE;
/// And for less than so many packets, by itself.
const PACKETS: f64 = 8.0;

/// Windows on their way: one that comes, and the next.
#[derive(Debug)]
pub(super) struct Windows {
    on_way: VecDeque<Window>,
    /// Of the next, bytes.
    size: f64,
    /// Shortest time to an answer.
    least_rtt: Option<Micros>,
    /// Bytes per microsecond, of the last window.
    rate: f64,
    /// Bytes per microsecond of the last window, lost ones included: how fast it passes.
    passes: f64,
    /// Larger ones lose their end, and by how much that grows again.
    uncut: f64,
    regains: f64,
    /// Smaller ones are not asked for twice; how large the last one was, and what has come again
    /// since, bytes.
    copies_from: u64,
    before: u64,
    again: u64,
    /// Share that came of what was asked for, smoothed.
    share: f64,
    /// Windows in a row of which nothing came.
    silent: u32,
    /// Where the last one that was given up begins, and when it was asked for.
    given_up: Option<(u64, Micros)>,
    /// What may be on its way of this download where others use the link as well, bytes.
    pub(super) share_of_link: Option<f64>,
    /// What is on its way to others takes so long.
    pub(super) delay: Micros,
}

#[derive(Debug)]
struct Window {
    start: u64,
    end: u64,
    asked: Micros,
    /// It was asked for in vain before, then.
    before: Option<Micros>,
    /// When it could begin to come.
    since: Micros,
    /// Nothing was on its way when it was asked for.
    is_alone: bool,
    /// Its first packet: when, and where that ends.
    first: Option<(Micros, u64)>,
    heard: Option<Micros>,
    came: u64,
    /// Behind the last byte that came.
    reached: u64,
}

impl Default for Windows {
    fn default() -> Self {
        Self {
            on_way: VecDeque::new(),
            size: FIRST,
            least_rtt: None,
            rate: 0.0,
            passes: 0.0,
            uncut: MOST,
            regains: REGAINS,
            copies_from: WORTH_A_COPY,
            before: 0,
            again: 0,
            share: 1.0,
            silent: 0,
            given_up: None,
            share_of_link: None,
            delay: 0,
        }
    }
}

impl Windows {
    pub(super) fn is_empty(&self) -> bool {
        self.on_way.is_empty()
    }

    /// Windows in a row of which nothing came.
    pub(super) fn silent(&self) -> u32 {
        self.silent
    }

    /// Of the next one, bytes.
    pub(super) fn size(&self) -> u64 {
        let share = self.share_of_link.unwrap_or(MOST);
        (self.size.min(share.max(LEAST)) as u64).next_multiple_of(PIECE)
    }

    /// Bytes that may still come.
    pub(super) fn on_way(&self) -> u64 {
        self.on_way.iter().map(|window| window.end.saturating_sub(window.reached)).sum()
    }

    /// Whether packets are lost.
    pub(super) fn is_lossy(&self) -> bool {
        self.share < LOSSY
    }

    /// Bytes came that were there.
    pub(super) fn repeated(&mut self, bytes: u64) {
        self.again += bytes;
    }

    /// Bytes that fill the way there and back.
    pub(super) fn pipe(&self) -> f64 {
        self.passes * self.least_rtt.unwrap_or(0) as f64
    }

    /// Asks; whether a copy of the request is worth its bytes.
    pub(super) fn ask(&mut self, now: Micros, start: u64, end: u64) -> bool {
        self.on_way.push_back(Window {
            start,
            end,
            asked: now,
            before: self.given_up.take().filter(|(of, _)| *of == start).map(|(_, asked)| asked),
            since: now,
            is_alone: self.on_way.is_empty(),
            first: None,
            heard: None,
            came: 0,
            reached: start,
        });
        self.is_lossy() && end - start >= self.copies_from
    }

    /// Whether the next may be asked for: nothing comes, or what comes is over when the vehicle
    /// hears of it.
    pub(super) fn wants_another(&self) -> bool {
        let Some(first) = self.on_way.front() else { return true };
        let lead = self.pipe();
        // A short way is not worth a request that may be dropped.
        self.on_way.len() == 1
            && first.heard.is_some()
            && lead >= (first.end - first.start) as f64 / 16.0
            && ((first.end - first.reached + PIECE) as f64) <= 0.9 * lead
    }

    /// A packet; the time to an answer, if it tells one.
    pub(super) fn heard(&mut self, now: Micros, start: u64, end: u64) -> Option<Micros> {
        let is_of = |window: &Window| (window.start..window.end).contains(&start);
        let index = self.on_way.iter().position(is_of)?;
        // The vehicle serves one after another.
        for _ in 0..index {
            self.end_first(now);
        }
        self.silent = 0;
        let first = self.on_way.front_mut()?;
        let tells = first.is_alone && first.heard.is_none() && start == first.start;
        let least = self.least_rtt.unwrap_or(0);
        let took = match now.saturating_sub(first.asked) {
            // Too soon: what was given up comes, late.
            took if took < least / 4 * 3 => now - first.before.unwrap_or(first.asked),
            took => took,
        };
        let is_first = first.before.is_none();
        first.first.get_or_insert((now, end));
        first.heard = Some(now);
        first.came += end - start;
        first.reached = first.reached.max(end);
        let is_over = first.reached >= first.end;
        if tells && is_first {
            self.least_rtt = Some(self.least_rtt.map_or(took, |least| least.min(took)));
        }
        if is_over {
            self.end_first(now);
        }
        tells.then_some(took)
    }

    /// When the silence of the first is the end of it; `pause` is for an answer to begin, and what
    /// was heard last may be of earlier ones that came twice.
    pub(super) fn silent_at(&self, pause: Micros, timeout: Micros, last: Micros) -> Option<Micros> {
        let first = self.on_way.front()?;
        let spacing = if self.rate > 0.0 { PIECE as f64 / self.rate } else { 0.0 };
        let scatter = timeout.saturating_sub(self.least_rtt.unwrap_or(0)).min(timeout / 2);
        let still = scatter.max(HICCUP) + (PACKETS * spacing) as Micros + self.delay;
        Some(match first.heard {
            Some(at) if self.rate > 0.0 => at.max(last) + still,
            Some(at) => at + pause,
            None if first.is_alone => {
                (first.asked + pause + (PACKETS * spacing) as Micros + self.delay).max(last + still)
            }
            None => first.since.max(last) + still,
        })
    }

    /// The first has fallen silent; where it begins, if nothing of it came.
    pub(super) fn give_up_first(&mut self) -> Option<u64> {
        let first = self.on_way.front()?;
        if let Some(heard) = first.heard {
            if first.end - first.reached >= CUT {
                let came = (first.reached - first.start) as f64;
                self.uncut = (UNCUT * came).max(LEAST);
                self.regains = (self.regains / 4.0).max(LEAST_REGAINS);
            }
            self.end_first(heard);
            return None;
        }
        let start = first.start;
        self.given_up = Some((first.start, first.before.unwrap_or(first.asked)));
        // One that was asked for too early was dropped; that says nothing of the vehicle.
        if first.is_alone {
            self.silent += 1;
            if self.silent >= 3 {
                self.size = FIRST;
            }
        }
        self.on_way.clear();
        Some(start)
    }

    /// The first is over; the size of the next follows from how long it took.
    fn end_first(&mut self, now: Micros) {
        let Some(first) = self.on_way.pop_front() else { return };
        if let Some(next) = self.on_way.front_mut() {
            next.since = now;
        }
        if first.came == 0 {
            return;
        }
        let span = (first.end - first.start) as f64;
        let came = (first.came as f64).min(span);
        // Of one that was alone the way there and back does not count; a few packets tell little.
        let way = if first.is_alone { self.least_rtt.unwrap_or(0) } else { 0 };
        let took = now.saturating_sub(first.since);
        let took = took.saturating_sub(way).max(took / GROWS as u64).max(1) as f64;
        self.rate = came / took;
        let passed = first.first.zip(first.heard).and_then(|((began, from), ended)| {
            let passed = first.reached.checked_sub(from).filter(|passed| *passed >= TELLING)?;
            Some(passed as f64 / ended.saturating_sub(began).max(1) as f64)
        });
        self.passes = passed.unwrap_or(self.rate);
        // What comes twice comes after what came once.
        if self.before > 0 && 2 * self.again >= self.before {
            self.copies_from = self.copies_from.max(2 * self.before);
        }
        (self.before, self.again) = (first.end - first.start, 0);
        if span >= 16.0 * PIECE as f64 {
            self.share += (came / span - self.share) / 4.0;
        }
        // What others take of the link is no reason for a smaller share of it.
        let rate = if self.share_of_link.is_some() { self.passes } else { self.rate };
        let takes = (MANY * PIECE as f64 / rate).clamp(TAKES as f64, MOST_TAKES as f64);
        let next = rate * takes;
        self.uncut = (self.uncut * (1.0 + self.regains)).min(MOST);
        // A window that was cut short by a gap's end says nothing of larger ones.
        let (low, high) = (self.size / 2.0, (GROWS * span).max(self.size));
        self.size = next.clamp(low.min(high), high).min(self.uncut).clamp(LEAST, MOST);
    }
}
