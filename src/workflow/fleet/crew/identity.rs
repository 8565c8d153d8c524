//! Identity of a flight: recorded when its start is authorized, withdrawn when no drone took off.

use std::collections::BTreeMap;

use super::Crew;
use crate::base::crc::ap_crc32;
use crate::base::file::read_whole;
use crate::campaign::start::{Flying, StartRecord, StartedDrone};
use crate::fleet::abort::Aborted;
use crate::fleet::start::Start;
use crate::link::id::DroneId;
use crate::link::net::Net as _;
use crate::workflow::error::WorkflowError;
use crate::workflow::fleet::crew::load::MOST_SKYB;
use crate::workflow::made_by;

impl Crew<'_> {
    /// Writes down who starts when, and with which show, before anybody is told to: logs are held
    /// against it. Without it nothing is started.
    pub(super) fn write_start(&mut self, start: &Start) -> Result<(), WorkflowError> {
        let Some(time) = start.time().filter(|_| !self.is_virtual) else { return Ok(()) };
        let flying = if self.is_guided { Flying::Guided } else { Flying::Show };
        let unix_s = self.host.clock().unix_us() / 1_000_000;
        let drones = self.started_drones();
        let record = StartRecord::new(made_by(), time, unix_s, flying, drones);
        self.begun = Some(record.begin(self.folder)?);
        Ok(())
    }

    fn started_drones(&self) -> Vec<StartedDrone> {
        let count = self.plan.slots.len();
        let drone = |line: &crate::fleet::slots::Assignment| {
            let skyb = self.folder.skyb(line.slot, count);
            let skyb = Some(skyb).filter(|_| !self.is_guided);
            StartedDrone {
                slot: line.slot,
                drone: line.drone.to_string(),
                show_crc32: skyb
                    .and_then(|path| read_whole(&path, MOST_SKYB).ok())
                    .map(|bytes| ap_crc32(&bytes)),
                booted: self.telemetry.get(line.drone).and_then(|known| known.booted),
            }
        };
        self.table.drones.iter().map(drone).collect()
    }

    /// After an order from outside of the station that started them: the start that was written down is
    /// taken back if it is still to come, and none of its drones flies it any more.
    pub(crate) fn withdraw_unflown(&mut self, done: &BTreeMap<DroneId, Aborted>) {
        let Ok(Some(record)) = StartRecord::read(self.folder) else { return };
        let now = self.net.now();
        let is_off = |line: &StartedDrone| {
            let drone: Option<DroneId> = line.drone.parse().ok();
            let clock = drone.and_then(|drone| self.telemetry.get(drone)?.clock.gps_ms(now));
            let is_ahead = clock.is_some_and(|now_ms| now_ms < record.start.total_ms() as f64);
            is_ahead && drone.and_then(|drone| done.get(&drone)) == Some(&Aborted::Grounded)
        };
        if !record.drones.is_empty() && record.drones.iter().all(is_off) {
            self.begun = Some(record);
            self.withdraw_start();
        }
    }

    /// The start was taken back before anybody took off: the one before it is the latest again.
    pub(super) fn withdraw_start(&mut self) {
        let Some(record) = self.begun.take() else { return };
        if let Err(error) = record.withdraw(self.folder) {
            self.host.warn(&format!(
                "{error}: logs/start.json still describes the start that was cancelled"
            ));
        }
    }
}
