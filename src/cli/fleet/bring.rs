//! Bringing logs home: `logs pull` and the end of `fly`.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::atomic::Ordering;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde::Serialize;

use super::connect::run_number;
use crate::base::file::create_folder;
use crate::campaign::FlightFolder;
use crate::cli::clock::{Stopwatch, SystemClock};
use crate::cli::context::Context;
use crate::cli::exit::{CommandError, with_reasons};
use crate::cli::simulate::made_by;
use crate::fleet::logs::one::{OneOptions, Which};
use crate::fleet::logs::pull::{Outcome, PullOptions, Wanted, pull};
use crate::fleet::slots::FleetTable;
use crate::link::clock::{Clock as _, Micros, S};
use crate::link::drive::{Progress as Share, Watch};
use crate::link::id::DroneId;
use crate::link::net::Net;
use crate::mission::Plan;

/// What is wanted of the drones' logs.
#[derive(Clone, Debug)]
pub(in crate::cli) struct Wish {
    pub(in crate::cli) which: Which,
    pub(in crate::cli) again: bool,
    pub(in crate::cli) most_bytes: u64,
    /// Bytes per second and network; none: what it carries.
    pub(in crate::cli) rate: Option<f64>,
    pub(in crate::cli) at_once: usize,
    pub(in crate::cli) patience_s: f64,
    /// Waits for the disk.
    pub(in crate::cli) is_durable: bool,
    /// Says nothing: the caller tells what is missing.
    pub(in crate::cli) quiet: bool,
}

impl Default for Wish {
    fn default() -> Self {
        Self {
            which: Which::Newest,
            again: false,
            most_bytes: 2 << 30,
            rate: None,
            at_once: 12,
            patience_s: 60.0,
            is_durable: true,
            quiet: false,
        }
    }
}

/// What became of a drone's log, for `--json`.
#[derive(Clone, Debug, Serialize)]
pub(in crate::cli) struct Brought {
    pub(in crate::cli) slot: u16,
    pub(in crate::cli) drone: DroneId,
    /// `pulled`, `there` or `missing`.
    pub(in crate::cli) state: &'static str,
    pub(in crate::cli) bytes: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(in crate::cli) reason: Option<String>,
}

impl Brought {
    /// In a sentence why there is no log; `None`: there is one.
    pub(in crate::cli) fn loss(&self) -> Option<String> {
        let reason = self.reason.as_deref().unwrap_or("unknown");
        (self.state == "missing")
            .then(|| format!("no log of drone {} (slot {}): {reason}", self.drone, self.slot))
    }
}

struct Bar<'a> {
    context: &'a Context,
    line: ProgressBar,
    watch: Stopwatch,
    shares: BTreeMap<DroneId, Share>,
    /// Of all drones: adding them up at every message would cost more than the message.
    sum: Share,
    over: BTreeSet<DroneId>,
    said: u64,
}

impl Watch for Bar<'_> {
    fn on_progress(&mut self, drone: DroneId, progress: Share, over: bool) {
        let before = self.shares.insert(drone, progress).unwrap_or_default();
        let sum = &mut self.sum;
        sum.done = (sum.done + progress.done).saturating_sub(before.done);
        sum.total = (sum.total + progress.total).saturating_sub(before.total);
        if over {
            self.over.insert(drone);
        }
        let done = self.sum.done;
        self.line.set_length(self.sum.total);
        self.line.set_position(done);
        let tens = self.watch.elapsed().as_secs() / 10;
        if !self.context.interactive && tens > self.said {
            self.said = tens;
            self.context.say(&format!(
                "bringing logs home: {:.1} MB, {} drones done after {}",
                done as f64 / 1e6,
                self.over.len(),
                self.watch
            ));
        }
    }

    fn stop(&mut self, _: Micros) -> bool {
        self.context.stop_flag().load(Ordering::SeqCst)
    }
}

/// Brings the logs of the table's drones into the flight's folder.
pub(in crate::cli) fn bring(
    context: &Context,
    net: &mut dyn Net,
    folder: &FlightFolder,
    plan: &Plan,
    table: &FleetTable,
    wish: &Wish,
) -> Result<Vec<Brought>, CommandError> {
    let quiet = wish.quiet;
    create_folder(&folder.logs())?;
    let count = plan.slots.len();
    let file = |slot: u16| {
        let path = folder.log(slot, count);
        path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned())
    };
    let wanted: Vec<Wanted> = table
        .drones
        .iter()
        .map(|line| Wanted { drone: line.drone, slot: line.slot, file: file(line.slot) })
        .collect();
    let options = PullOptions {
        each: OneOptions {
            which: wish.which,
            patience: (wish.patience_s * S as f64) as Micros,
            most_size: wish.most_bytes,
            again: wish.again,
            is_durable: wish.is_durable,
            start_number: run_number(),
            unix_s: SystemClock::start().unix_us() / 1_000_000,
            ..OneOptions::default()
        },
        at_once: wish.at_once,
        bytes_per_s: wish.rate,
        made_by: made_by(),
    };
    let target = if context.interactive {
        ProgressDrawTarget::stderr()
    } else {
        ProgressDrawTarget::hidden()
    };
    let bar = ProgressBar::with_draw_target(None, target);
    if let Ok(style) = ProgressStyle::with_template(
        "logs [{bar:40.cyan/blue}] {bytes}/{total_bytes} {bytes_per_sec} (eta {eta})",
    ) {
        bar.set_style(style.progress_chars("━╸ "));
    }
    let mut watch = Bar {
        context,
        line: bar,
        watch: Stopwatch::start(),
        shares: BTreeMap::new(),
        sum: Share::default(),
        over: BTreeSet::new(),
        said: 0,
    };
    let outcomes = pull(net, &folder.logs(), &wanted, &options, &mut watch)
        .map_err(|error| CommandError::Failed(with_reasons(&error)))?;
    watch.line.finish_and_clear();
    let brought: Vec<Brought> = wanted
        .iter()
        .map(|wanted| {
            let (state, bytes, reason) = match outcomes.get(&wanted.drone) {
                Some(Outcome::Done(done)) => {
                    let bytes = done.pulled.iter().map(|entry| entry.size_bytes).sum();
                    let reason = done.failure.as_ref().map(|failure| {
                        let kept = match failure.kept_bytes {
                            0 => String::new(),
                            bytes => format!(" ({:.1} MB are kept)", bytes as f64 / 1e6),
                        };
                        format!("{}; {}{kept}", failure.reason, failure.advice)
                    });
                    let there = done.pulled.is_empty() && !done.there.is_empty();
                    let state = match (&reason, there) {
                        (Some(_), _) => "missing",
                        (None, true) => "there",
                        (None, false) => "pulled",
                    };
                    (state, bytes, reason)
                }
                Some(Outcome::Stopped) | None => ("missing", 0, Some("interrupted".to_owned())),
            };
            Brought { slot: wanted.slot, drone: wanted.drone, state, bytes, reason }
        })
        .collect();
    for loss in brought.iter().filter_map(Brought::loss).filter(|_| !quiet) {
        context.warn(&loss);
    }
    let bytes: u64 = brought.iter().map(|one| one.bytes).sum();
    let state = |state: &str| brought.iter().filter(|one| one.state == state).count();
    let say = |text: &str| {
        if !quiet {
            context.say(text);
        }
    };
    say(&format!(
        "Brought {} of {} logs home, {:.1} MB in {}{}",
        state("pulled") + state("there"),
        brought.len(),
        bytes as f64 / 1e6,
        watch.watch,
        match state("there") {
            0 => String::new(),
            there => format!(" ({there} had come before)"),
        }
    ));
    context.check_stop()?;
    Ok(brought)
}
