//! Progress of long work: a bar on a terminal, a line now and then in a log file.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::context::Context;
use crate::base::plain::plain;
use crate::workflow::clock::Stopwatch;
use crate::workflow::host::Progress;

/// How often a run without a terminal says where it is.
const LINE_EVERY: Duration = Duration::from_secs(10);

/// Counts units of work; may be shared between threads.
#[derive(Debug)]
pub(super) struct Bar {
    line: ProgressBar,
    what: String,
    watch: Stopwatch,
    lines: Option<Context>,
    said: AtomicU64,
}

impl Bar {
    /// Progress over `total` units; `what` is a short verb phrase: `flying`.
    pub(super) fn new(context: &Context, what: &str, total: u64) -> Self {
        let target = if context.interactive {
            ProgressDrawTarget::stderr()
        } else {
            ProgressDrawTarget::hidden()
        };
        let bar = ProgressBar::with_draw_target(Some(total), target);
        if let Ok(style) = ProgressStyle::with_template(
            "{msg:12} [{bar:40.cyan/blue}] {pos}/{len}  {elapsed} (eta {eta})",
        ) {
            bar.set_style(style.progress_chars("━╸ "));
        }
        bar.set_message(plain(what).into_owned());
        Self {
            line: bar,
            what: what.to_owned(),
            watch: Stopwatch::start(context),
            lines: (!context.interactive && !context.quiet).then(|| context.clone()),
            said: AtomicU64::new(0),
        }
    }
}

impl Progress for Bar {
    fn advance(&self) {
        self.line.inc(1);
        if let Some(context) = &self.lines {
            let period = self.watch.elapsed().as_secs() / LINE_EVERY.as_secs();
            if self.said.fetch_max(period, Ordering::Relaxed) < period {
                let (done, total) = (self.line.position(), self.line.length().unwrap_or(0));
                context.say(&format!("{} {done}/{total} after {}", self.what, self.watch));
            }
        }
    }

    fn finish(&self) {
        self.line.finish_and_clear();
    }
}
