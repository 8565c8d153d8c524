//! A vehicle's files behind MAVFTP and the log messages: a vehicle that does nothing else.

use super::endpoint::Endpoint;
use super::ftp_server::FtpServer;
use super::log_server::LogServer;
use super::storage::Storage;
use super::transfers::Transfers;
use crate::link::clock::{Micros, S};
use crate::link::frame::{MavMessage, dialect};
use crate::link::station::STATION;

/// A vehicle that is only its storage with its MAVFTP and log servers.
#[derive(Debug)]
pub struct FileVehicle<S> {
    /// Storage that holds the vehicle's files and logs.
    pub storage: S,
    /// Server of MAVFTP; `None` if the vehicle does not have one.
    pub ftp: Option<FtpServer>,
    /// Server of the MAVLink log messages.
    pub logs: LogServer,
    /// Whether the vehicle is armed, which keeps it from sending logs.
    pub is_armed: bool,
    /// End of the boot, during which the vehicle is silent, us.
    pub boots_until: Micros,
    /// For servers after a boot.
    transfers: Transfers,
    log_folder: String,
    next_heartbeat: Micros,
}

impl<S: Storage> FileVehicle<S> {
    /// A vehicle with these files and its logs in `log_folder`, sending at most `packets_per_s`
    /// packets per second (0: no limit).
    pub fn new(storage: S, log_folder: &str, packets_per_s: f64) -> Self {
        Self::with_transfers(storage, log_folder, Transfers::both(packets_per_s))
    }

    /// Makes a vehicle with an explicit packet rate for each of the two protocols.
    pub fn with_transfers(storage: S, log_folder: &str, transfers: Transfers) -> Self {
        Self {
            storage,
            ftp: Some(FtpServer::new(transfers.ftp_per_s)),
            logs: LogServer::new(log_folder, transfers.logs_per_s),
            is_armed: false,
            boots_until: 0,
            transfers,
            log_folder: log_folder.to_owned(),
            next_heartbeat: 0,
        }
    }

    /// Reboots: loses everything but the files, and is silent for `lasts`, us.
    pub fn reboot(&mut self, now: Micros, lasts: Micros) {
        self.ftp = self.ftp.as_ref().map(|_| FtpServer::new(self.transfers.ftp_per_s));
        self.logs = LogServer::new(&self.log_folder, self.transfers.logs_per_s);
        self.boots_until = now + lasts;
    }
}

impl<S: Storage> Endpoint for FileVehicle<S> {
    fn on_message(&mut self, now: Micros, message: &MavMessage, out: &mut Vec<MavMessage>) {
        if now < self.boots_until {
            return;
        }
        if let Some(ftp) = &mut self.ftp {
            ftp.on_message(STATION, message);
        }
        // Until now.
        self.logs.poll(now, self.is_armed, &self.storage, out);
        self.logs.on_message(message, self.is_armed, &self.storage, out);
        // Served as it is heard.
        self.logs.poll(now, self.is_armed, &self.storage, out);
    }

    fn poll(&mut self, now: Micros, out: &mut Vec<MavMessage>) -> Micros {
        if now < self.boots_until {
            return self.boots_until;
        }
        if now >= self.next_heartbeat {
            self.next_heartbeat = now + S;
            out.push(heartbeat(self.is_armed));
        }
        let ftp =
            self.ftp.as_mut().map_or(Micros::MAX, |ftp| ftp.poll(now, &mut self.storage, out));
        let logs = self.logs.poll(now, self.is_armed, &self.storage, out);
        ftp.min(logs).min(self.next_heartbeat)
    }
}

fn heartbeat(is_armed: bool) -> MavMessage {
    let mut base_mode = dialect::MavModeFlag::empty();
    if is_armed {
        base_mode |= dialect::MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED;
    }
    MavMessage::HEARTBEAT(dialect::HEARTBEAT_DATA {
        custom_mode: 0,
        mavtype: dialect::MavType::MAV_TYPE_QUADROTOR,
        autopilot: dialect::MavAutopilot::MAV_AUTOPILOT_ARDUPILOTMEGA,
        base_mode,
        system_status: dialect::MavState::MAV_STATE_STANDBY,
        mavlink_version: 3,
    })
}
