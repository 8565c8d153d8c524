//! Properties of a virtual vehicle that distinguish it from others of its world.

use nalgebra::Vector3;

use crate::link::clock::{MS, Micros, S};
use crate::virtual_fleet::transfers::Transfers;

/// Milestones of a boot, us after switching on.
#[derive(Clone, Copy, Debug)]
pub struct BootTimes {
    /// Time until the first heartbeat, us.
    pub heartbeat: Micros,
    /// Time until files and the show mode are available, us.
    pub files: Micros,
    /// Time until there are a GPS fix and GPS time, us.
    pub gps: Micros,
    /// Time until there is a position estimate and the vehicle can be armed, us.
    pub position: Micros,
}

impl Default for BootTimes {
    /// As the firmware's own simulator.
    fn default() -> Self {
        Self { heartbeat: S, files: 5 * S, gps: 20 * S, position: 45 * S }
    }
}

impl BootTimes {
    /// A boot of two seconds, for practice and tests.
    pub fn short() -> Self {
        Self { heartbeat: 100 * MS, files: 500 * MS, gps: S, position: 2 * S }
    }
}

/// Properties of a virtual vehicle that distinguish it from others of its world.
#[derive(Clone, Debug)]
pub struct VehicleSetup {
    /// Slot in the plan, from 1, which also determines the noise of its sensors and its clock.
    pub drone: u16,
    /// MAVLink system id, unique in its network.
    pub system: u8,
    /// Network, from 0: system ids are unique in it.
    pub network: u16,
    /// Place where the vehicle stands at first, show frame, m.
    pub stands_m: Vector3<f64>,
    /// Duration of the stages of booting.
    pub boot: BootTimes,
    /// Whether it has stock firmware, without the show mode.
    pub stock: bool,
    /// Folder of the logs in its storage: `/APM/LOGS`, or `logs`.
    pub log_folder: String,
    /// Rates at which it sends files and logs.
    pub transfers: Transfers,
    /// Time at which it is switched off for good, us.
    pub gone_at: Option<Micros>,
    /// Time at which it reboots by itself, once, us.
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
