//! The time of a test: it stands still but where somebody waits, and nobody does so for real.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use tempfile::NamedTempFile;

/// The first test's time begins here, Unix s.
const BEGINS: u64 = 1_795_300_000;
/// The next one's so much later, s: flights of one test must not begin at the same time.
const APART_S: u64 = 86_400;

static COUNT: AtomicU64 = AtomicU64::new(0);

/// A time that the program under test and the server share: as many milliseconds have passed as its
/// file is long. A release build of the program has the real clock only.
#[derive(Clone)]
pub(crate) struct TrialClock {
    unix_s: u64,
    file: Arc<NamedTempFile>,
}

impl TrialClock {
    pub(crate) fn start() -> Self {
        let unix_s = BEGINS + APART_S * COUNT.fetch_add(1, Ordering::SeqCst);
        Self { unix_s, file: Arc::new(NamedTempFile::new().unwrap()) }
    }

    /// The arguments with which the program goes by it.
    pub(crate) fn args(&self) -> Vec<String> {
        if !cfg!(debug_assertions) {
            return Vec::new();
        }
        let path = self.file.path().to_str().unwrap();
        vec!["--trial-clock".to_owned(), format!("{}:{path}", self.unix_s)]
    }

    /// Lets so much time pass; the real clock takes its own.
    pub(crate) fn pass(&self, seconds: u64) {
        let file = self.file.as_file();
        file.set_len(file.metadata().unwrap().len() + seconds * 1000).unwrap();
    }

    /// Unix time, ms.
    pub(crate) fn unix_ms(&self) -> u64 {
        if !cfg!(debug_assertions) {
            return real_ms();
        }
        self.unix_s * 1000 + self.file.as_file().metadata().unwrap().len()
    }
}

#[expect(clippy::disallowed_methods, reason = "the program under test has the real clock")]
fn real_ms() -> u64 {
    let now = std::time::SystemTime::now();
    now.duration_since(std::time::SystemTime::UNIX_EPOCH).unwrap().as_millis() as u64
}
