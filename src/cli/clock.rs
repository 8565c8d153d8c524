//! A clock for tests of the whole program: everything that takes minutes is over at once.

use std::time::Duration;

use crate::link::clock::{Clock, MS, Micros, S};

/// A clock that stands still while the program works, and for which all waiting is over at once: for
/// tests of what takes minutes. It begins at a time of its own, and is shared by all programs of a test:
/// it is as many milliseconds further as its file is long.
#[derive(Clone, Debug)]
pub(super) struct TrialClock {
    unix_s: u64,
    file: std::sync::Arc<std::fs::File>,
    begun_ms: u64,
}

impl TrialClock {
    /// From `UNIX_S:FILE`.
    ///
    /// # Errors
    /// When there is no such file, or no time before it.
    pub(super) fn parse(text: &str) -> Result<Self, String> {
        let (unix_s, path) = text.split_once(':').ok_or("UNIX_S:FILE is meant")?;
        let unix_s =
            unix_s.parse().map_err(|_| "its time is not a number of seconds".to_owned())?;
        let file = std::fs::File::options().write(true).open(path);
        let file = std::sync::Arc::new(file.map_err(|error| format!("{path}: {error}"))?);
        let begun_ms = length(&file);
        Ok(Self { unix_s, file, begun_ms })
    }
}

fn length(file: &std::fs::File) -> u64 {
    file.metadata().map_or(0, |data| data.len())
}

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
