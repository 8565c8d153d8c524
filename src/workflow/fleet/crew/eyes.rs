//! Watch of a flight: events are reported and recorded.

use std::collections::{BTreeMap, BTreeSet};

use crate::base::file::FileError;
use crate::fleet::greet::{ask_air, ask_time};
use crate::fleet::journal::{Entry, Journal};
use crate::fleet::telemetry::{Drone, Telemetry};
use crate::fleet::watch::Monitor;
use crate::link::clock::{Micros, S};
use crate::link::conversation::Observer;
use crate::link::error::Refusal;
use crate::link::id::DroneId;
use crate::link::net::{Net, Received};
use crate::workflow::fleet::interrupt::{Choice, Interrupt};
use crate::workflow::host::Host;

/// A [`Monitor`] whose events are told to people and to the journal.
pub(super) struct Eyes<'a> {
    host: &'a dyn Host,
    monitor: Monitor,
    /// Virtual drones, of which nothing is kept and only alarms are told.
    is_virtual: bool,
    journal: Option<Journal>,
    alarms: BTreeMap<DroneId, Vec<String>>,
    failed: Option<FileError>,
    /// Goes on although Ctrl-C was pressed: somebody is being brought down.
    pub(super) finishes: bool,
    interrupt: Interrupt<'a>,
    /// When drones that have restarted are asked for their time again.
    next_ask: Micros,
    /// When drones are asked for streams again, and those that were.
    next_stream: Micros,
    asked: BTreeSet<DroneId>,
}

/// A drone that was to send its outputs and has not for so long is asked again.
const QUIET: Micros = 5 * S;
/// Drones that are asked at a time.
const MOST_ASKED: usize = 64;

impl<'a> Eyes<'a> {
    pub(super) fn new(
        host: &'a dyn Host,
        monitor: Monitor,
        is_virtual: bool,
        interrupt: Interrupt<'a>,
    ) -> Self {
        let journal = None;
        let (alarms, failed) = (BTreeMap::new(), None);
        let finishes = false;
        Self {
            host,
            monitor,
            is_virtual,
            journal,
            alarms,
            failed,
            finishes,
            interrupt,
            next_ask: 0,
            next_stream: 0,
            asked: BTreeSet::new(),
        }
    }

    /// Writes what happens into a journal, if there is one.
    pub(super) fn write_into(&mut self, journal: Result<Journal, FileError>) {
        match journal {
            Ok(journal) => self.journal = Some(journal),
            Err(error) => {
                self.host.warn(&format!("{error}; the flight is still being watched"));
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

    /// Drones that were seen in the air.
    pub(super) fn flew(&self) -> BTreeSet<DroneId> {
        self.monitor.flying().filter(|(_, of)| of.flew).map(|(drone, _)| drone).collect()
    }

    /// Drones that have restarted in the air and were not seen to fly on.
    pub(super) fn fell(&self) -> BTreeSet<DroneId> {
        self.monitor.flying().filter(|(_, of)| of.fell).map(|(drone, _)| drone).collect()
    }

    /// Asks drones that have restarted for their time: without it nobody knows where they should be.
    pub(super) fn ask_times(&mut self, net: &mut dyn Net) {
        let now = net.now();
        if now < self.next_ask {
            return;
        }
        self.next_ask = now + S;
        for drone in self.monitor.telemetry.timeless(now) {
            // It is asked again.
            drop(net.send(drone, &ask_time(drone)));
        }
    }

    /// Asks drones of the flight for what the air is told from, as long as they do not send it.
    pub(super) fn ask_streams(&mut self, net: &mut dyn Net) {
        let now = net.now();
        let Some(every) = self.host.stream_every().filter(|_| now >= self.next_stream) else {
            return;
        };
        self.next_stream = now + S;
        let quiet = |of: &&Drone| of.outputs.is_none_or(|(at, _)| now > at + QUIET);
        let drones: Vec<DroneId> = (self.monitor.slots())
            .map(|(drone, _)| drone)
            .filter(|drone| self.monitor.telemetry.get(*drone).as_ref().is_some_and(quiet))
            .take(MOST_ASKED)
            .collect();
        for drone in drones {
            for message in ask_air(drone, every) {
                // It is asked again.
                drop(net.send(drone, &message));
            }
            self.asked.insert(drone);
        }
    }

    /// Lets drones send as they do by themselves: logs have the link then.
    pub(super) fn end_streams(&mut self, net: &mut dyn Net) {
        for drone in std::mem::take(&mut self.asked) {
            for message in ask_air(drone, 0) {
                drop(net.send(drone, &message));
            }
        }
    }

    /// What Ctrl-C means, once there was one and somebody has said it.
    pub(super) fn choice(&mut self, now: Micros) -> Option<Choice> {
        self.interrupt.poll(now)
    }

    /// Adds an alarm that is not the monitor's.
    pub(super) fn alarm(&mut self, drone: DroneId, text: String) {
        self.host.warn(&format!("drone {drone}: {text}"));
        self.alarms.entry(drone).or_default().push(text);
    }

    fn tell(&mut self) {
        for told in self.monitor.take_events() {
            if let Some(journal) = &mut self.journal {
                let unix_us = self.host.clock().unix_us();
                let entry = Entry { unix_us, drone: Some(told.drone), event: &told.event };
                // A full disk must not end the watch over drones in the air.
                if let Err(error) = journal.write(&entry) {
                    self.failed.get_or_insert(error);
                }
            }
            if told.event.is_alarm() {
                self.alarm(told.drone, told.event.to_string());
            } else if !self.is_virtual {
                self.host.say(&format!("drone {}: {}", told.drone, told.event));
            }
        }
    }

    /// What is known, and the drones that gave an alarm.
    pub(super) fn close(self) -> (Telemetry, Result<BTreeMap<DroneId, Vec<String>>, FileError>) {
        (self.monitor.telemetry, self.failed.map_or(Ok(self.alarms), Err))
    }
}

impl Observer for Eyes<'_> {
    fn on_message(&mut self, now: Micros, received: &Received) {
        self.monitor.on_message(now, received);
    }

    fn on_refused(&mut self, drone: DroneId, refusal: &Refusal) {
        // What is held back for a moment is tried again.
        if !refusal.for_now {
            self.alarm(drone, format!("nothing more is sent to it: {}", refusal.why));
        }
    }

    fn stop(&mut self, now: Micros) -> bool {
        self.monitor.stop(now);
        self.tell();
        !self.finishes && self.interrupt.poll(now).is_some()
    }
}
