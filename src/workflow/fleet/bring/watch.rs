//! Display of a pull in progress: how much has come, and which drones are waited for.

use std::collections::BTreeMap;

use super::shares::Shares;
use crate::link::clock::{Micros, S};
use crate::link::conversation::{Observer, Progress as Share};
use crate::link::id::DroneId;
use crate::link::net::Received;
use crate::workflow::host::{Host, Transfer};

/// Who was not heard for so long is waited for, aloud.
const SAID_AFTER: Micros = 3 * S;

/// Watches a pull, and tells the host.
pub(super) struct Watching<'a> {
    host: &'a dyn Host,
    transfer: Box<dyn Transfer + 'a>,
    shares: Shares,
    /// Slots of the drones that were not heard yet.
    absent: BTreeMap<DroneId, u16>,
    begun: Option<Micros>,
    names_absent: bool,
}

impl<'a> Watching<'a> {
    /// `absent`: drones that were not heard yet, with their slots; they are named unless `quiet`.
    pub(super) fn new(host: &'a dyn Host, absent: BTreeMap<DroneId, u16>, quiet: bool) -> Self {
        Self {
            host,
            transfer: host.transfer(),
            shares: Shares::default(),
            absent,
            begun: None,
            names_absent: !quiet,
        }
    }

    /// The pull is over.
    pub(super) fn finish(&self) {
        self.transfer.finish();
    }
}

impl Observer for Watching<'_> {
    fn on_message(&mut self, _: Micros, received: &Received) {
        self.absent.remove(&received.from);
    }

    fn on_progress(&mut self, drone: DroneId, progress: Share, over: bool) {
        self.shares.note(drone, progress, over);
        let sum = self.shares.sum();
        self.transfer.advance(sum.done, sum.total, self.shares.over());
    }

    fn stop(&mut self, now: Micros) -> bool {
        let begun = *self.begun.get_or_insert(now);
        if self.names_absent && now >= begun + SAID_AFTER {
            self.names_absent = false;
            for (drone, slot) in &self.absent {
                self.transfer.say(&format!("waiting for drone {drone} (slot {slot})"));
            }
        }
        self.host.is_stopped()
    }
}
