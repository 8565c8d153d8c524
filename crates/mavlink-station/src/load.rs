//! Load of a link that many downloads share: the data on its way, and its rate. Each download keeps
//! a fair share on its way, so that the link is never empty and never holds more than it can; and
//! whoever waits for an answer knows how much data comes before it.

use std::cell::RefCell;
use std::collections::{BTreeMap, VecDeque};
use std::rc::Rc;

use crate::link::clock::{MS, Micros};

/// All drones together keep what the link carries in so long waiting, besides what fills the way
/// there and back; at first, at least, and at most. Requests that are lost hold their room until they
/// are missed, so that it must be the larger the more is lost.
const ROOM: f64 = (300 * MS) as f64;
const LEAST_ROOM: f64 = (100 * MS) as f64;
const MOST_ROOM: f64 = (2_000 * MS) as f64;
/// There is more room while the quickest answers take no longer than on an empty link and this; less
/// when they take longer by that: what is lost makes no queue.
const IDLE: Micros = 150 * MS;
const QUEUE: Micros = 300 * MS;
/// Looks after which the room changes, and by how much.
const STEER: u32 = 10;
const MORE: f64 = 1.25;
const LESS: f64 = 0.8;
/// The rate is looked at over so long, and the best of so many looks counts.
const LOOK: Micros = 50 * MS;
const LOOKS: usize = 20;
/// Each may have so much on its way while the link is not known yet, bytes: a third of a second at
/// 57,600 baud.
const FIRST: f64 = 1_440.0;

/// Load of a link; clones share it.
#[derive(Clone, Debug, Default)]
pub struct LinkLoad(Rc<RefCell<Inner>>);

#[derive(Debug)]
struct Inner {
    /// Bytes on their way, of each place.
    on_way: BTreeMap<u64, u64>,
    next: u64,
    since: Micros,
    came: u64,
    /// Bytes per microsecond.
    rates: VecDeque<f64>,
    /// Shortest time to an answer: ever, and of late.
    least_rtt: Option<Micros>,
    quickest: Option<Micros>,
    /// What may wait, us of the link's time.
    room: f64,
    looks: u32,
}

impl Default for Inner {
    fn default() -> Self {
        Self {
            on_way: BTreeMap::new(),
            next: 0,
            since: 0,
            came: 0,
            rates: VecDeque::new(),
            least_rtt: None,
            quickest: None,
            room: ROOM,
            looks: 0,
        }
    }
}

impl Inner {
    fn rate(&self) -> f64 {
        self.rates.iter().copied().fold(0.0, f64::max)
    }

    /// More room for a link without a queue, less for one with a long one.
    fn steer(&mut self) {
        self.looks += 1;
        if !self.looks.is_multiple_of(STEER) {
            return;
        }
        let (Some(quickest), Some(least)) = (self.quickest.take(), self.least_rtt) else { return };
        let factor = match quickest.saturating_sub(least) {
            queue if queue < IDLE => MORE,
            queue if queue > QUEUE => LESS,
            _ => 1.0,
        };
        self.room = (self.room * factor).clamp(LEAST_ROOM, MOST_ROOM);
    }
}

impl LinkLoad {
    /// Registers a download on the link.
    pub fn place(&self) -> Place {
        let mut inner = self.0.borrow_mut();
        inner.next += 1;
        let number = inner.next;
        inner.on_way.insert(number, 0);
        Place { load: self.clone(), number }
    }
}

/// Registration of a download on its link, until it is dropped.
#[derive(Debug)]
pub struct Place {
    load: LinkLoad,
    number: u64,
}

impl Place {
    /// Sets the data of this download that is on its way now, bytes.
    pub fn tell(&self, bytes: u64) {
        self.load.0.borrow_mut().on_way.insert(self.number, bytes);
    }

    /// Counts data of this download that has come, bytes.
    pub fn came(&self, now: Micros, bytes: u64) {
        let mut inner = self.load.0.borrow_mut();
        inner.came += bytes;
        let passed = now.saturating_sub(inner.since);
        if passed >= LOOK {
            let rate = inner.came as f64 / passed as f64;
            if inner.rates.len() == LOOKS {
                inner.rates.pop_front();
            }
            inner.rates.push_back(rate);
            inner.steer();
            (inner.since, inner.came) = (now, 0);
        }
    }

    /// Data that this download may keep on its way, bytes; `None` if no other download uses the
    /// link.
    pub fn share(&self) -> Option<f64> {
        let inner = self.load.0.borrow();
        let count = inner.on_way.len();
        let least = if inner.rates.len() < LOOKS { FIRST } else { 0.0 };
        let room = inner.room + inner.least_rtt.unwrap_or(0) as f64;
        (count > 1).then(|| (inner.rate() * room / count as f64).max(least))
    }

    /// Counts the time that an answer took, us.
    pub fn took(&self, took: Micros) {
        let mut inner = self.load.0.borrow_mut();
        inner.least_rtt = Some(inner.least_rtt.map_or(took, |least| least.min(took)));
        inner.quickest = Some(inner.quickest.map_or(took, |least| least.min(took)));
    }

    /// Delay of an answer by the data of other downloads on its way, us.
    pub fn delay(&self) -> Micros {
        let inner = self.load.0.borrow();
        let others = inner.on_way.iter().filter(|(number, _)| **number != self.number);
        let bytes: u64 = others.map(|(_, bytes)| bytes).sum();
        let rate = inner.rate();
        let takes = if rate > 0.0 { (bytes as f64 / rate) as Micros } else { 0 };
        takes.saturating_sub(inner.least_rtt.unwrap_or(0)).min(2 * inner.room as Micros)
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        self.load.0.borrow_mut().on_way.remove(&self.number);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_has_a_share_of_what_the_link_carries_and_knows_what_comes_before() {
        let load = LinkLoad::default();
        let one = load.place();
        assert_eq!((one.share(), one.delay()), (None, 0));
        let two = load.place();
        for step in 1..=20 {
            one.came(step * 50 * MS, 30_000);
            two.tell(100_000);
            two.came(step * 50 * MS, 20_000);
        }
        // A megabyte per second, the best of late.
        let share = one.share().unwrap();
        assert!((120_000.0..=180_000.0).contains(&share), "{share}");
        assert!((80 * MS..=120 * MS).contains(&one.delay()), "{}", one.delay());
        // A long way holds as much again.
        one.took(100 * MS);
        assert!(two.share().unwrap() > 1.2 * share);
        assert!(one.delay() < 20 * MS, "{}", one.delay());
        drop(two);
        assert_eq!((one.share(), one.delay()), (None, 0));
    }

    #[test]
    fn requests_that_are_lost_do_not_narrow_the_room_and_a_queue_does() {
        let load = LinkLoad::default();
        let (one, two) = (load.place(), load.place());
        two.took(450 * MS);
        let mut step = 0;
        let mut share_after = |took: Micros, looks: u64| {
            for _ in 0..looks {
                step += 1;
                one.took(took);
                one.came(step * 50 * MS, 7_500);
            }
            one.share().unwrap()
        };
        let first = share_after(460 * MS, 20);
        let later = share_after(460 * MS, 60);
        assert!(later > 2.0 * first, "{first}, {later}");
        assert!(share_after(900 * MS, 100) < 0.6 * later);
    }
}
