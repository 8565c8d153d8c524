//! The time of a test: it stands still but where somebody waits, and nobody does so for real.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use tempfile::TempDir;
use updraft::workflow::clock::{Clock as _, SharedClock, SystemClock};

/// The first test's time begins here, Unix s.
const BEGINS: u64 = 1_795_300_000;
/// The next one's so much later, s: flights of one test must not begin at the same time.
const APART_S: u64 = 86_400;

static COUNT: AtomicU64 = AtomicU64::new(0);

/// A time that the program under test and the server share. A release build of the program has the
/// real clock only.
#[derive(Clone)]
pub(crate) struct TrialClock {
    clock: SharedClock,
    _folder: Arc<TempDir>,
}

impl TrialClock {
    pub(crate) fn start() -> Self {
        let unix_s = BEGINS + APART_S * COUNT.fetch_add(1, Ordering::SeqCst);
        let folder = tempfile::tempdir().unwrap();
        let clock = SharedClock::open(unix_s, &folder.path().join("time")).unwrap();
        Self { clock, _folder: Arc::new(folder) }
    }

    /// The arguments with which the program goes by it.
    pub(crate) fn args(&self) -> Vec<String> {
        if !cfg!(debug_assertions) {
            return Vec::new();
        }
        vec!["--shared-clock".to_owned(), self.clock.argument().into_string().unwrap()]
    }

    /// Lets so much time pass; the real clock takes its own.
    pub(crate) fn pass(&self, seconds: u64) {
        self.clock.waited(Duration::from_secs(seconds));
    }

    /// Unix time, ms.
    pub(crate) fn unix_ms(&self) -> u64 {
        let us = if cfg!(debug_assertions) {
            self.clock.unix_us()
        } else {
            SystemClock::start().unix_us()
        };
        us / 1000
    }
}
