//! Time on the link: microseconds since the program's start, from an injected clock.

use std::time::Duration;

/// Microseconds of link time; never goes back.
pub type Micros = u64;

/// One millisecond.
pub const MS: Micros = 1_000;
/// One second.
pub const S: Micros = 1_000_000;

/// A clock.
pub trait Clock: Send + Sync {
    /// Time since some fixed instant; never goes back.
    fn now(&self) -> Micros;

    /// Unix time, us; may be set back by the user.
    fn unix_us(&self) -> u64;

    /// Waits.
    fn pause(&self, time: Duration) {
        std::thread::sleep(time);
    }

    /// So long was waited for somebody else: a clock that goes by itself knows.
    fn waited(&self, _time: Duration) {}
}
