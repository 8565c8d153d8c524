//! What a vehicle is, and how it differs from the others of its world.

use nalgebra::Vector3;

use crate::link::clock::{MS, Micros, S};
use crate::virtual_fleet::transfers::Transfers;

/// When a vehicle is how far after it was switched on.
#[derive(Clone, Copy, Debug)]
pub struct BootTimes {
    /// First heartbeat.
    pub heartbeat: Micros,
    /// Files, show mode.
    pub files: Micros,
    /// GPS fix and time.
    pub gps: Micros,
    /// Position estimate; ready to arm.
    pub position: Micros,
}

impl Default for BootTimes {
    /// As the firmware's own simulator.
    fn default() -> Self {
        Self { heartbeat: S, files: 5 * S, gps: 20 * S, position: 45 * S }
    }
}

impl BootTimes {
    /// For those who do not want to wait.
    pub fn short() -> Self {
        Self { heartbeat: 100 * MS, files: 500 * MS, gps: S, position: 2 * S }
    }
}

/// How a vehicle differs from the others of its world.
#[derive(Clone, Debug)]
pub struct VehicleSetup {
    /// Slot in the plan, from 1: its sensors' noise and its clock come from it.
    pub drone: u16,
    /// MAVLink system id.
    pub system: u8,
    /// Network, from 0: system ids are unique in it.
    pub network: u16,
    /// Where it stands, show frame, m.
    pub stands_m: Vector3<f64>,
    /// How long it takes to boot.
    pub boot: BootTimes,
    /// Without the show mode: stock firmware.
    pub stock: bool,
    /// Where its logs are: `/APM/LOGS`, or `logs`.
    pub log_folder: String,
    /// How fast it sends files and logs.
    pub transfers: Transfers,
    /// When it is switched off for good.
    pub gone_at: Option<Micros>,
    /// When it reboots by itself, once.
    pub reboot_at: Option<Micros>,
}

impl VehicleSetup {
    /// A drone with the show firmware that stands at its slot.
    pub fn new(drone: u16, system: u8, stands_m: Vector3<f64>) -> Self {
        Self {
            drone,
            system,
            network: 0,
            stands_m,
            boot: BootTimes::default(),
            stock: false,
            log_folder: "logs".to_owned(),
            transfers: Transfers::FIRMWARE,
            gone_at: None,
            reboot_at: None,
        }
    }
}
