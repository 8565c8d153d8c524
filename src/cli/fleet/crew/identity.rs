//! The identity of a flight: written when its start is authorized, taken back when nobody took off.

use super::Crew;
use crate::base::crc::ap_crc32;
use crate::base::file::read_whole;
use crate::campaign::start::{Flying, StartRecord, StartedDrone};
use crate::cli::exit::CommandError;
use crate::cli::fleet::crew::load::MOST_SKYB;
use crate::cli::simulate::made_by;
use crate::fleet::start::Start;
use crate::link::clock::Clock as _;

impl Crew<'_> {
    /// Writes down who starts when, and with which show, before anybody is told to: logs are held
    /// against it. Without it nothing is started.
    pub(super) fn write_start(&mut self, start: &Start) -> Result<(), CommandError> {
        let Some(time) = start.time().filter(|_| !self.is_virtual) else { return Ok(()) };
        let flying = if self.is_guided { Flying::Guided } else { Flying::Show };
        let unix_s = self.clock.unix_us() / 1_000_000;
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

    /// The start was taken back before anybody took off: the one before it is the latest again.
    pub(super) fn withdraw_start(&mut self) {
        let Some(record) = self.begun.take() else { return };
        if let Err(error) = record.withdraw(self.folder) {
            self.context.warn(&format!(
                "{error}: logs/start.json still speaks of the start that was taken back"
            ));
        }
    }
}
