//! Display of logs that come home: a bar on a terminal, otherwise a line now and then.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::cli::context::Context;
use crate::cli::words;
use crate::workflow::clock::Stopwatch;
use crate::workflow::host::Transfer;

/// Shows how a pull goes on.
pub(in crate::cli) struct LogsBar<'a> {
    context: &'a Context,
    line: ProgressBar,
    /// Since the beginning.
    watch: Stopwatch,
    said: AtomicU64,
    is_drawn: AtomicBool,
}

impl<'a> LogsBar<'a> {
    pub(in crate::cli) fn new(context: &'a Context) -> Self {
        // Drawn once a size is known: a bar of 0 B of 0 B says nothing.
        let line = ProgressBar::with_draw_target(None, ProgressDrawTarget::hidden());
        if let Ok(style) = ProgressStyle::with_template(
            "logs [{bar:40.cyan/blue}] {bytes}/{total_bytes} {bytes_per_sec} (eta {eta})",
        ) {
            line.set_style(style.progress_chars("━╸ "));
        }
        Self {
            context,
            line,
            watch: Stopwatch::start(context),
            said: AtomicU64::new(0),
            is_drawn: AtomicBool::new(false),
        }
    }
}

impl Transfer for LogsBar<'_> {
    fn advance(&self, done: u64, total: u64, drones_done: usize) {
        if total > 0 {
            if !self.is_drawn.swap(true, Ordering::Relaxed) && self.context.interactive {
                self.line.set_draw_target(ProgressDrawTarget::stderr());
            }
            self.line.set_length(total);
            self.line.set_position(done);
        }
        let tens = self.watch.elapsed().as_secs() / 10;
        if !self.context.interactive && self.said.fetch_max(tens, Ordering::Relaxed) < tens {
            self.context.say(&format!(
                "downloading logs: {:.1} of {:.1} MB, {} done after {}",
                done as f64 / 1e6,
                total as f64 / 1e6,
                words::count(drones_done, "drone"),
                self.watch
            ));
        }
    }

    fn say(&self, text: &str) {
        self.line.suspend(|| self.context.say(text));
    }

    fn finish(&self) {
        self.line.finish_and_clear();
    }
}
