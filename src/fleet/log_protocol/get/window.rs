//! Large requests on their way, and how large the next one is.

use std::collections::VecDeque;

use super::PIECE;
use crate::link::clock::{MS, Micros};

/// A window is as large as comes in so long.
const TAKES: Micros = 600 * MS;
/// Where several drones share a link: together they keep no more than this of it waiting, and the
/// others fill the time until the next window begins.
const SHARED: Micros = 250 * MS;
/// The first: a third of a second at 57,600 baud.
const FIRST: f64 = (16 * PIECE) as f64;
const LEAST: f64 = (8 * PIECE) as f64;
const MOST: f64 = (4 << 20) as f64;
/// The next is larger by this, at most.
const GROWS: f64 = 8.0;
/// Windows smaller than this are served before a copy of their request comes.
const WORTH_A_COPY: u64 = 1024 * PIECE;
/// With less than this share of what was asked for, requests are lost as well.
const LOSSY: f64 = 0.97;
/// A stream that stops for less than this does so for want of processor time.
const HICCUP: Micros = 20 * MS;
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
    /// Share that came of what was asked for, smoothed.
    share: f64,
    /// Windows in a row of which nothing came.
    silent: u32,
    /// Where the last one that was given up begins, and when it was asked for.
    given_up: Option<(u64, Micros)>,
    /// Other drones use the link as well.
    pub(super) is_shared: bool,
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
            share: 1.0,
            silent: 0,
            given_up: None,
            is_shared: false,
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
        (self.size as u64).next_multiple_of(PIECE)
    }

    /// Bytes that fill the way there and back.
    pub(super) fn pipe(&self) -> f64 {
        self.rate * self.least_rtt.unwrap_or(0) as f64
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
            heard: None,
            came: 0,
            reached: start,
        });
        self.share < LOSSY && end - start >= WORTH_A_COPY
    }

    /// Whether the next may be asked for: nothing comes, or what comes is over when the vehicle
    /// hears of it.
    pub(super) fn wants_another(&self) -> bool {
        let Some(first) = self.on_way.front() else { return true };
        let lead = self.pipe();
        // A short way is not worth a request that may be dropped.
        self.on_way.len() == 1
            && first.heard.is_some()
            && lead >= self.size / 16.0
            && ((first.end - first.reached) as f64) <= 0.9 * lead
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
        let still = scatter.max(HICCUP) + (PACKETS * spacing) as Micros;
        Some(match first.heard {
            Some(at) if self.rate > 0.0 => at.max(last) + still,
            Some(at) => at + pause,
            None if first.is_alone => {
                (first.asked + pause + (PACKETS * spacing) as Micros).max(last + still)
            }
            None => first.since.max(last) + still,
        })
    }

    /// The first has fallen silent; where it begins, if nothing of it came.
    pub(super) fn give_up_first(&mut self) -> Option<u64> {
        let first = self.on_way.front()?;
        if let Some(heard) = first.heard {
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
        if span >= 16.0 * PIECE as f64 {
            self.share += (came / span - self.share) / 4.0;
        }
        let takes = if self.is_shared { SHARED } else { TAKES };
        let next = self.rate * takes as f64;
        // A window that was cut short by a gap's end says nothing of larger ones.
        let (low, high) = (self.size / 2.0, (GROWS * span).max(self.size));
        self.size = next.clamp(low.min(high), high).clamp(LEAST, MOST);
    }
}
