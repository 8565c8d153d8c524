//! Clocks and durations. The program that runs a workflow provides the clock ([`Host::clock`]):
//! [`SystemClock`], if it needs no other, or [`SharedClock`] in tests.

use std::fmt;
use std::sync::Arc;
use std::time::Duration;

use super::host::Host;
pub use super::shared_clock::SharedClock;
pub use crate::link::clock::{Clock, MS, Micros, S, SystemClock};

/// Stopwatch for a step, by the host's clock; printed as [`Spent`].
#[derive(Clone)]
pub struct Stopwatch {
    clock: Arc<dyn Clock>,
    begun: Micros,
}

impl fmt::Debug for Stopwatch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Stopwatch").field("begun", &self.begun).finish_non_exhaustive()
    }
}

impl Stopwatch {
    /// A stopwatch that starts now, by the host's clock.
    pub fn start(host: &dyn Host) -> Self {
        let clock = Arc::clone(host.clock());
        let begun = clock.now();
        Self { clock, begun }
    }

    /// Time since the stopwatch was started.
    pub fn elapsed(&self) -> Duration {
        Duration::from_micros(self.clock.now().saturating_sub(self.begun))
    }
}

impl fmt::Display for Stopwatch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        Spent(self.elapsed()).fmt(f)
    }
}

/// A duration that is printed as people read it: `340 ms`, `12.3 s`, `2 min 5 s`.
#[derive(Clone, Copy, Debug)]
pub struct Spent(pub Duration);

impl fmt::Display for Spent {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let seconds = self.0.as_secs_f64();
        if seconds < 1.0 {
            write!(f, "{:.0} ms", seconds * 1000.0)
        } else if seconds < 60.0 {
            write!(f, "{seconds:.1} s")
        } else {
            write!(f, "{} min {:.0} s", (seconds / 60.0).floor(), seconds % 60.0)
        }
    }
}

/// A clock whose time begins when it is made: links count from their opening.
#[derive(Clone)]
pub struct SinceNow {
    clock: Arc<dyn Clock>,
    begun: Micros,
}

impl SinceNow {
    /// A clock whose time is 0 now, and goes on as that of `clock`.
    pub fn of(clock: &Arc<dyn Clock>) -> Self {
        Self { clock: Arc::clone(clock), begun: clock.now() }
    }
}

impl fmt::Debug for SinceNow {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("SinceNow").field("begun", &self.begun).finish_non_exhaustive()
    }
}

impl Clock for SinceNow {
    fn now(&self) -> Micros {
        self.clock.now().saturating_sub(self.begun)
    }

    fn unix_us(&self) -> u64 {
        self.clock.unix_us()
    }

    fn pause(&self, time: Duration) {
        self.clock.pause(time);
    }

    fn wait(&self, time: Duration, look: &mut dyn FnMut(Duration) -> bool) {
        self.clock.wait(time, look);
    }

    fn waited(&self, time: Duration) {
        self.clock.waited(time);
    }
}
