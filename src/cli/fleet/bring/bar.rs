//! What is seen of a pull while it runs: a bar on a terminal, else a line now and then, and who is
//! waited for.

use std::collections::BTreeMap;
use std::sync::atomic::Ordering;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::shares::Shares;
use crate::cli::clock::Stopwatch;
use crate::cli::context::Context;
use crate::cli::words;
use crate::link::clock::{Micros, S};
use crate::link::conversation::{Observer, Progress as Share};
use crate::link::id::DroneId;
use crate::link::net::Received;

/// Who was not heard for so long is waited for, aloud.
const SAID_AFTER: Micros = 3 * S;

/// Shows how a pull goes on.
pub(super) struct Bar<'a> {
    context: &'a Context,
    line: ProgressBar,
    /// Since the beginning.
    pub(super) watch: Stopwatch,
    shares: Shares,
    said: u64,
    /// Slots of the drones that were not heard yet.
    absent: BTreeMap<DroneId, u16>,
    begun: Option<Micros>,
    names_absent: bool,
}

impl<'a> Bar<'a> {
    /// `absent`: drones that were not heard yet, with their slots; they are named unless `quiet`.
    pub(super) fn new(context: &'a Context, absent: BTreeMap<DroneId, u16>, quiet: bool) -> Self {
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
            watch: Stopwatch::start(),
            shares: Shares::default(),
            said: 0,
            absent,
            begun: None,
            names_absent: !quiet,
        }
    }

    /// Removes the bar.
    pub(super) fn finish(&self) {
        self.line.finish_and_clear();
    }

    fn name_absent(&mut self) {
        self.names_absent = false;
        for (drone, slot) in &self.absent {
            let text = format!("waiting for drone {drone} (slot {slot})");
            self.line.suspend(|| self.context.say(&text));
        }
    }
}

impl Observer for Bar<'_> {
    fn on_message(&mut self, _: Micros, received: &Received) {
        self.absent.remove(&received.from);
    }

    fn on_progress(&mut self, drone: DroneId, progress: Share, over: bool) {
        let knew_size = self.shares.sum().total > 0;
        self.shares.note(drone, progress, over);
        let sum = self.shares.sum();
        if sum.total > 0 {
            if !knew_size && self.context.interactive {
                self.line.set_draw_target(ProgressDrawTarget::stderr());
            }
            self.line.set_length(sum.total);
            self.line.set_position(sum.done);
        }
        let tens = self.watch.elapsed().as_secs() / 10;
        if !self.context.interactive && tens > self.said {
            self.said = tens;
            self.context.say(&format!(
                "downloading logs: {:.1} of {:.1} MB, {} done after {}",
                sum.done as f64 / 1e6,
                sum.total as f64 / 1e6,
                words::count(self.shares.over(), "drone"),
                self.watch
            ));
        }
    }

    fn stop(&mut self, now: Micros) -> bool {
        let begun = *self.begun.get_or_insert(now);
        if self.names_absent && now >= begun + SAID_AFTER {
            self.name_absent();
        }
        self.context.stop_flag().load(Ordering::SeqCst)
    }
}
