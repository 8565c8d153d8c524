//! Time on the link: microseconds since the program's start, from an injected clock.

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
}
