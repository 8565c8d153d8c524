//! One virtual vehicle: the embedded simulator behind real MAVLink, behaving as ArduCopter 4.4
//! with the show mode does on the wire, or without it.
//!
//! Everything happens on a fixed grid of ticks in the vehicle's own time, so that a flight and its
//! log do not depend on how often the vehicle is polled. The simulator gets the show's place and
//! the drone's slot exactly, from the [`World`]; of what came over the wire it flies the show file.

mod airborne;
mod commands;
mod endpoint;
mod fence;
mod guided;
mod logbook;
pub mod params;
mod setup;
mod show_mode;
mod telemetry;
mod words;

use nalgebra::Vector3;

use self::airborne::Airborne;
use self::fence::Fence;
use self::logbook::Logbook;
use self::params::Params;
pub use self::setup::{BootTimes, VehicleSetup};
use self::show_mode::{Reload, ShowMode, Wish};
pub use self::telemetry::REVISION;
use self::telemetry::Streams;
use self::words::{error, warning};
use super::ftp_server::FtpServer;
use super::log_server::LogServer;
use super::storage::Storage;
use super::world::{LoadedShow, World};
use crate::base::time::GpsTime;
use crate::link::clock::{MS, Micros, S};
use crate::link::frame::MavMessage;
use crate::protocol::show::{SHOW_MODE, Stage};
use crate::sim::FlightSummary;

/// Grid of everything that happens by itself.
const TICK: Micros = 100 * MS;
/// Texts about failing checks are repeated so often.
const REPEAT_TEXT: Micros = 30 * S;
/// The folder of the show file.
const SHOW_FOLDER: &str = "/collmot";
/// Mode after boot without SHOW_MODE_BOOT: stabilize.
const STABILIZE: u32 = 0;

/// A virtual vehicle: it speaks as the show firmware does, keeps files, and flies in simulation.
pub struct VirtualVehicle<'w> {
    /// Properties that distinguish the vehicle from others of its world.
    pub setup: VehicleSetup,
    /// Storage of its shows and logs.
    pub storage: Box<dyn Storage + Send>,
    /// Parameters of its autopilot.
    pub params: Params,
    /// Outcomes of its flights, from the first since it was made.
    pub flown: Vec<FlightSummary>,
    world: &'w World<'w>,
    boot_at: Micros,
    has_files: bool,
    boots: u8,
    mode: u32,
    show: ShowMode<'w>,
    airborne: Option<Airborne<'w>>,
    stands_m: Vector3<f64>,
    fence: Fence,
    breached: bool,
    ftp: FtpServer,
    logs: LogServer,
    logbook: Logbook,
    streams: Streams,
    next_tick: Micros,
    next_text: Micros,
    used_share: f64,
    /// When the station that SYSID_MYGCS names was heard last.
    station_heard: Option<Micros>,
}

impl<'w> VirtualVehicle<'w> {
    /// A vehicle that is switched on at link time `now`.
    pub fn new(
        world: &'w World<'w>,
        setup: VehicleSetup,
        storage: Box<dyn Storage + Send>,
        now: Micros,
    ) -> Self {
        Self {
            params: Params::new(world.vehicle, setup.system, setup.stock),
            ftp: FtpServer::new(setup.transfers.ftp_per_s),
            logs: LogServer::new(&setup.log_folder, setup.transfers.logs_per_s),
            logbook: Logbook::new(&setup.log_folder),
            streams: Streams::new(now + setup.boot.heartbeat, setup.stock),
            stands_m: setup.stands_m,
            setup,
            storage,
            flown: Vec::new(),
            world,
            boot_at: now,
            has_files: false,
            boots: 1,
            mode: STABILIZE,
            show: ShowMode::new(),
            airborne: None,
            fence: Fence::default(),
            breached: false,
            next_tick: now,
            next_text: 0,
            used_share: 0.0,
            station_heard: None,
        }
    }

    /// Whether the motors are armed.
    pub fn is_armed(&self) -> bool {
        self.airborne.as_ref().is_some_and(Airborne::is_armed)
    }

    /// Whether the vehicle flies, or has just landed.
    pub fn is_busy(&self) -> bool {
        self.airborne.is_some() || self.show.is_counting_down()
    }

    /// Whether the log still grows, though the vehicle has landed.
    pub fn is_writing(&self) -> bool {
        self.logbook.is_growing()
    }

    /// Stage of the show.
    pub fn stage(&self) -> Stage {
        match &self.airborne {
            Some(airborne) if airborne.is_armed() => airborne.stage(),
            _ => self.show.stage,
        }
    }

    /// Position of the vehicle, show frame, m.
    pub fn position_m(&self) -> Vector3<f64> {
        self.airborne.as_ref().map_or(self.stands_m, Airborne::position_m)
    }

    /// Carries the vehicle to another place (show frame, m), as a crew does on the ground.
    pub fn carry_to(&mut self, stands_m: Vector3<f64>) {
        self.stands_m = stands_m;
    }

    /// Flight mode, as ArduPilot's custom mode number.
    pub fn mode(&self) -> u32 {
        self.mode
    }

    /// Show that the vehicle would fly, as it was when the file was last read.
    pub fn loaded(&self) -> Option<&LoadedShow> {
        self.show.loaded
    }

    /// Corners of the vehicle's fence: latitude and longitude, 1e-7 degrees.
    pub fn fence_1e7(&self) -> Vec<(i32, i32)> {
        self.fence.corners_1e7()
    }

    /// Sets the share of the battery's charge that is used, 0 to 1, from now on.
    pub fn use_charge(&mut self, share: f64) {
        self.used_share = share.clamp(0.0, 1.0);
    }

    /// Switches it off and on again: files and parameters stay.
    fn reboot(&mut self, now: Micros) {
        self.boot_at = now;
        self.has_files = false;
        self.boots = self.boots.wrapping_add(1);
        self.params.put("STAT_BOOTCNT", self.boots.into());
        self.params.put("SHOW_START_TIME", -1.0);
        self.params.put("SHOW_START_AUTH", 0.0);
        self.mode = STABILIZE;
        let before = std::mem::replace(&mut self.show, ShowMode::new());
        self.show.origin = before.origin;
        self.show.amsl_mm = before.amsl_mm;
        self.show.orientation_deg = before.orientation_deg;
        self.breached = false;
        self.station_heard = None;
        self.ftp = FtpServer::new(self.setup.transfers.ftp_per_s);
        self.logs = LogServer::new(&self.setup.log_folder, self.setup.transfers.logs_per_s);
        self.logbook.flush(self.storage.as_mut());
        self.logbook = Logbook::new(&self.setup.log_folder);
        self.streams = Streams::new(now + self.setup.boot.heartbeat, self.setup.stock);
    }

    /// Whether it has been switched off for good.
    fn is_gone(&self, now: Micros) -> bool {
        self.setup.gone_at.is_some_and(|at| now >= at)
    }

    fn age(&self, now: Micros) -> Micros {
        now.saturating_sub(self.boot_at)
    }

    /// Instant at which it was switched on, from which the times in its messages and its log count.
    pub fn booted(&self) -> Option<GpsTime> {
        GpsTime::from_total_ms(self.world.gps_us(self.boot_at).div_euclid(1000))
    }

    /// Time 0 of its logs; `None`: one of the seed's.
    fn booted_in_log(&self) -> Option<GpsTime> {
        self.booted().filter(|_| !self.world.boots_by_seed)
    }

    fn gps(&self, now: Micros) -> Option<GpsTime> {
        let gps_ms = self.world.gps_us(now).div_euclid(1000);
        (self.age(now) >= self.setup.boot.gps).then(|| GpsTime::from_total_ms(gps_ms))?
    }

    /// Why it would not arm now; `None`: it would.
    fn obstacle(&self, now: Micros) -> Option<&'static str> {
        if self.age(now) < self.setup.boot.position {
            Some("PreArm: Need Position Estimate")
        } else if self.logs.is_sending() {
            Some("PreArm: Downloading logs")
        } else if self.is_outside() {
            Some("PreArm: vehicle outside fence")
        } else if self.battery_percent() < 5.0 {
            Some("PreArm: Battery 1 low voltage failsafe")
        } else {
            None
        }
    }

    fn is_outside(&self) -> bool {
        let (here, home) = (self.position_m(), self.stands_m);
        self.fence.is_breached(&self.params, &self.world.frame, &here, &home)
    }

    fn battery_percent(&self) -> f64 {
        let reading = self.airborne.as_ref().and_then(Airborne::battery);
        let share = reading.map_or(self.used_share, |battery| {
            self.used_share.max(battery.used_ah / battery.capacity_ah.max(1e-3))
        });
        100.0 * (1.0 - share)
    }

    fn enter_show_mode(&mut self) {
        self.mode = SHOW_MODE;
        self.show.enter();
    }

    /// One tick of the grid.
    fn tick(&mut self, now: Micros, out: &mut Vec<MavMessage>) {
        let age = self.age(now);
        if age < self.setup.boot.files {
            return;
        }
        if !self.has_files {
            self.has_files = true;
            let _ = self.storage.create_folder(&self.setup.log_folder);
            if !self.setup.stock {
                let _ = self.storage.create_folder(SHOW_FOLDER);
                self.show.reload(self.world, self.storage.as_ref());
                if self.params.whole("SHOW_MODE_BOOT") & 1 != 0 {
                    self.enter_show_mode();
                }
            }
        }
        if now >= self.next_text && !self.is_armed() {
            self.next_text = now + REPEAT_TEXT;
            out.extend(self.obstacle(now).map(warning));
        }
        self.fly(now, out);
        self.watch_station(now, out);
        let rotate = self.params.whole("LOG_FILE_DSRMROT") != 0;
        if self.airborne.is_none() {
            self.logbook.poll(now, rotate, self.storage.as_mut());
        }
        if !self.is_armed() && !self.setup.stock && self.mode == SHOW_MODE {
            self.wait_for_start(now, out);
        }
    }

    /// The show mode on the ground.
    fn wait_for_start(&mut self, now: Micros, out: &mut Vec<MavMessage>) {
        let gps_us = self.world.gps_us(now);
        let place = self.world.frame.to_geodetic(self.stands_m);
        if self.gps(now).is_none() {
            if self.show.stage == Stage::Init {
                self.show.tick(gps_us, place, &self.params);
            }
            return;
        }
        match self.show.tick(gps_us, place, &self.params) {
            Wish::Nothing => {}
            Wish::GiveUp => out.push(error("Failed to start motors, giving up")),
            Wish::Arm => {
                let fails = if self.show.preflight != 0 {
                    Some("Arm: show preflight checks fail")
                } else {
                    self.obstacle(now)
                };
                match fails {
                    Some(reason) => out.push(error(reason)),
                    None => self.arm(now, out),
                }
            }
        }
    }

    /// Reads the show file again.
    fn reload(&mut self) -> Reload {
        self.show.reload(self.world, self.storage.as_ref())
    }
}
