//! The program's only look at a clock: everything below the command line gets time as an argument.

use std::time::{Duration, Instant};

use crate::link::clock::{Clock, Micros};

/// Measures how long a step takes, for people.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stopwatch(Instant);

impl Stopwatch {
    /// Starts now.
    #[expect(clippy::disallowed_methods, reason = "the command line is where time comes from")]
    pub(super) fn start() -> Self {
        Self(Instant::now())
    }

    /// Time since the start.
    pub(super) fn elapsed(self) -> Duration {
        self.0.elapsed()
    }
}

/// Prints the time since the start: `340 ms`, `12.3 s`, `2 min 5 s`.
impl std::fmt::Display for Stopwatch {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let seconds = self.elapsed().as_secs_f64();
        if seconds < 1.0 {
            write!(f, "{:.0} ms", seconds * 1000.0)
        } else if seconds < 60.0 {
            write!(f, "{seconds:.1} s")
        } else {
            write!(f, "{} min {:.0} s", (seconds / 60.0).floor(), seconds % 60.0)
        }
    }
}

/// The computer's clocks, for everything that talks.
#[derive(Clone, Copy, Debug)]
pub(super) struct SystemClock(Instant);

impl SystemClock {
    /// Link time begins now.
    #[expect(clippy::disallowed_methods, reason = "the command line is where time comes from")]
    pub(super) fn start() -> Self {
        Self(Instant::now())
    }
}

impl Clock for SystemClock {
    fn now(&self) -> Micros {
        self.0.elapsed().as_micros() as Micros
    }

    #[expect(clippy::disallowed_methods, reason = "the command line is where time comes from")]
    fn unix_us(&self) -> u64 {
        let since = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
        since.map_or(0, |since| since.as_micros() as u64)
    }
}
