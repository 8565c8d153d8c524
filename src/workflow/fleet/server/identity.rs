//! Identity of a flight through a server: recorded when its start is authorized, withdrawn when no
//! drone took off.

use super::ServedFlight;
use crate::base::time::GpsTime;
use crate::campaign::FlightFolder;
use crate::campaign::start::{Flying, StartRecord, StartedDrone};
use crate::workflow::error::WorkflowError;
use crate::workflow::host::Host;
use crate::workflow::made_by;

/// The record of a start, if one could be written.
#[derive(Default)]
pub(super) struct Begun(Option<StartRecord>);

impl Begun {
    /// Writes down who starts when, before anybody is told to. The files on the drones are made by the
    /// server, which scales and splits trajectories otherwise than we do: their checksums are not known.
    pub(super) fn write(
        host: &dyn Host,
        flight: &ServedFlight<'_>,
        unix_s: i64,
    ) -> Result<Self, WorkflowError> {
        let start = GpsTime::from_unix_ms(unix_s * 1000).ok_or_else(|| {
            WorkflowError::Failed("this computer's clock is not set to any GPS time".to_owned())
        })?;
        let drone = |(slot, drone): (&u16, &String)| StartedDrone {
            slot: *slot,
            drone: drone.clone(),
            show_crc32: None,
            booted: None,
        };
        let drones = flight.drones.iter().map(drone).collect();
        let now_s = host.clock().unix_us() / 1_000_000;
        let record = StartRecord::new(made_by(), start, now_s, Flying::SkybrushServer, drones);
        Ok(Self(Some(record.begin(flight.folder)?)))
    }

    /// The one of a flight that is taken over.
    pub(super) fn of(record: StartRecord) -> Self {
        Self(Some(record))
    }

    /// Nobody took off: the start before it is the latest again.
    pub(super) fn withdraw(self, host: &dyn Host, folder: &FlightFolder) {
        let Some(record) = self.0 else { return };
        if let Err(error) = record.withdraw(folder) {
            host.warn(&format!(
                "{error}: logs/start.json still describes the start that was cancelled"
            ));
        }
    }
}
