//! Watches a flight, tells what happens, and writes it down.

use std::collections::BTreeMap;

use crate::base::file::FileError;
use crate::cli::clock::SystemClock;
use crate::cli::context::Context;
use crate::fleet::journal::{Entry, Journal};
use crate::fleet::telemetry::Telemetry;
use crate::fleet::watch::Monitor;
use crate::link::clock::{Clock as _, Micros};
use crate::link::drive::Watch;
use crate::link::id::DroneId;
use crate::link::net::Received;

/// A [`Monitor`] whose events are told to people and to the journal.
pub(super) struct Eyes<'a> {
    context: &'a Context,
    monitor: Monitor,
    /// Virtual drones, of which nothing is kept and only alarms are told.
    is_virtual: bool,
    journal: Option<Journal>,
    clock: SystemClock,
    alarms: BTreeMap<DroneId, Vec<String>>,
    failed: Option<FileError>,
    /// Goes on although Ctrl-C was pressed: somebody is being brought down.
    pub(super) finishes: bool,
}

impl<'a> Eyes<'a> {
    pub(super) fn new(
        context: &'a Context,
        monitor: Monitor,
        clock: SystemClock,
        is_virtual: bool,
    ) -> Self {
        let journal = None;
        let (alarms, failed) = (BTreeMap::new(), None);
        Self { context, monitor, is_virtual, journal, clock, alarms, failed, finishes: false }
    }

    /// Writes what happens into a journal, if there is one.
    pub(super) fn write_into(&mut self, journal: Result<Journal, FileError>) {
        match journal {
            Ok(journal) => self.journal = Some(journal),
            Err(error) => {
                self.context.warn(&format!("{error}; the flight is watched all the same"));
                self.failed = Some(error);
            }
        }
    }

    pub(super) fn telemetry(&self) -> &Telemetry {
        &self.monitor.telemetry
    }

    pub(super) fn is_over(&self) -> bool {
        self.monitor.is_over()
    }

    /// Adds an alarm that is not the monitor's.
    pub(super) fn alarm(&mut self, drone: DroneId, text: String) {
        self.context.warn(&format!("drone {drone}: {text}"));
        self.alarms.entry(drone).or_default().push(text);
    }

    fn tell(&mut self) {
        for told in self.monitor.take_events() {
            if let Some(journal) = &mut self.journal {
                let unix_us = self.clock.unix_us();
                let entry = Entry { unix_us, drone: Some(told.drone), event: &told.event };
                // A full disk must not end the watch over drones in the air.
                if let Err(error) = journal.write(&entry) {
                    self.failed.get_or_insert(error);
                }
            }
            if told.event.is_alarm() {
                self.alarm(told.drone, told.event.to_string());
            } else if !self.is_virtual {
                self.context.say(&format!("drone {}: {}", told.drone, told.event));
            }
        }
    }

    /// What is known, and the drones that gave an alarm.
    pub(super) fn close(self) -> (Telemetry, Result<BTreeMap<DroneId, Vec<String>>, FileError>) {
        (self.monitor.telemetry, self.failed.map_or(Ok(self.alarms), Err))
    }
}

impl Watch for Eyes<'_> {
    fn on_message(&mut self, now: Micros, received: &Received) {
        self.monitor.on_message(now, received);
    }

    fn stop(&mut self, now: Micros) -> bool {
        self.monitor.stop(now);
        self.tell();
        !self.finishes && self.context.check_stop().is_err()
    }
}
