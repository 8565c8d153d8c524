//! Link time: microseconds since the program's start, from an injected clock.

use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// Microseconds of link time, which never goes back.
pub type Micros = u64;

/// One millisecond, us.
pub const MS: Micros = 1_000;
/// One second, us.
pub const S: Micros = 1_000_000;

/// A source of link time and Unix time.
pub trait Clock: Send + Sync {
    /// Time since some fixed instant, us; never goes back.
    fn now(&self) -> Micros;

    /// Unix time, us; the user may set it back.
    fn unix_us(&self) -> u64;

    /// Waits for a duration of the clock.
    fn pause(&self, time: Duration) {
        std::thread::sleep(time);
    }

    /// Waits for input, for a duration of the clock at most. `look` waits for it, for as long as it is
    /// told on the wall, and says whether it came; it may return sooner. A clock that goes by itself calls it once.
    fn wait(&self, time: Duration, look: &mut dyn FnMut(Duration) -> bool) {
        look(time);
    }

    /// Reports that the caller has waited for this duration elsewhere; only a clock that does not
    /// go by itself takes note.
    fn waited(&self, _time: Duration) {}
}

/// The computer's clocks: monotonic time since [`SystemClock::start`], and Unix time.
#[derive(Clone, Copy, Debug)]
pub struct SystemClock(Instant);

impl SystemClock {
    /// A clock whose time begins now.
    #[expect(clippy::disallowed_methods, reason = "the one place where time comes from")]
    pub fn start() -> Self {
        Self(Instant::now())
    }
}

impl Clock for SystemClock {
    fn now(&self) -> Micros {
        self.0.elapsed().as_micros() as Micros
    }

    #[expect(clippy::disallowed_methods, reason = "the one place where time comes from")]
    fn unix_us(&self) -> u64 {
        let since = SystemTime::now().duration_since(UNIX_EPOCH);
        since.map_or(0, |since| since.as_micros() as u64)
    }
}
