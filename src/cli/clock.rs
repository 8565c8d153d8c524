//! The program's only look at a clock: everything below the command line gets time as an argument.

use std::time::{Duration, Instant};

use crate::link::clock::{Clock, Micros};
#[cfg(debug_assertions)]
use crate::link::clock::{MS, S};

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
        Spent(self.elapsed()).fmt(f)
    }
}

/// A time that was spent, for people.
pub(super) struct Spent(pub(super) Duration);

impl std::fmt::Display for Spent {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
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

/// A clock that stands still while the program works, and for which all waiting is over at once: for
/// tests of what takes minutes. It begins at a time of its own, and is shared by all programs of a test:
/// it is as many milliseconds further as its file is long.
#[cfg(debug_assertions)]
#[derive(Clone, Debug)]
pub(super) struct TrialClock {
    unix_s: u64,
    file: std::sync::Arc<std::fs::File>,
    begun_ms: u64,
}

#[cfg(debug_assertions)]
impl TrialClock {
    /// From `UNIX_S:FILE`.
    ///
    /// # Errors
    /// When there is no such file, or no time before it.
    pub(super) fn parse(text: &str) -> Result<Self, String> {
        let (unix_s, path) = text.split_once(':').ok_or("UNIX_S:FILE is meant")?;
        let unix_s = unix_s.parse().map_err(|_| "its time is no number of seconds".to_owned())?;
        let file = std::fs::File::options().write(true).open(path);
        let file = std::sync::Arc::new(file.map_err(|error| format!("{path}: {error}"))?);
        let begun_ms = length(&file);
        Ok(Self { unix_s, file, begun_ms })
    }
}

#[cfg(debug_assertions)]
fn length(file: &std::fs::File) -> u64 {
    file.metadata().map_or(0, |data| data.len())
}

#[cfg(debug_assertions)]
impl Clock for TrialClock {
    fn now(&self) -> Micros {
        (length(&self.file).saturating_sub(self.begun_ms)) * MS
    }

    fn unix_us(&self) -> u64 {
        self.unix_s * S + length(&self.file) * MS
    }

    fn pause(&self, time: Duration) {
        let further = length(&self.file) + time.as_millis() as u64;
        if self.file.set_len(further).is_err() {
            std::thread::sleep(time);
        }
    }

    fn waited(&self, time: Duration) {
        // Somebody else has worked meanwhile, for as long as it took.
        let _ = self.file.set_len(length(&self.file) + time.as_millis() as u64);
    }
}
