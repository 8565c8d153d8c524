//! One virtual vehicle: the embedded simulator behind real MAVLink, behaving as ArduCopter 4.4
//! with the show mode does on the wire.
//!
//! Everything happens on a fixed grid of ticks in the vehicle's own time, so that a flight and its
//! log do not depend on how often the vehicle is polled. The simulator gets the show's place and
//! the drone's slot exactly, from the [`World`]; of what came over the wire it flies the show file.

mod airborne;
mod commands;
mod fence;
mod logbook;
pub mod params;
mod show_mode;
mod telemetry;

use nalgebra::Vector3;

use self::airborne::Airborne;
use self::fence::Fence;
use self::logbook::Logbook;
use self::params::Params;
use self::show_mode::{Reload, ShowMode, Wish};
use self::telemetry::{Streams, Telling, rgb565};
use super::endpoint::Endpoint;
use super::ftp_server::FtpServer;
use super::log_server::LogServer;
use super::storage::Storage;
use super::world::{LoadedShow, World};
use crate::base::time::GpsTime;
use crate::link::clock::{MS, Micros, S};
use crate::link::frame::{MavMessage, Sender, dialect};
use crate::link::station::STATION;
use crate::protocol::show::{self, SHOW_MODE, Stage, StartConfig, Status, flag};
use crate::show::lights;
use crate::sim::FlightSummary;

/// Grid of everything that happens by itself.
const TICK: Micros = 100 * MS;
/// Texts about failing checks are repeated so often.
const REPEAT_TEXT: Micros = 30 * S;
/// The folder of the show file.
const SHOW_FOLDER: &str = "/collmot";
/// Mode after boot without SHOW_MODE_BOOT: stabilize.
const STABILIZE: u32 = 0;

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
    /// Packets per second of its file and log transfers; 0: no limit.
    pub packets_per_s: f64,
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
            packets_per_s: 0.0,
            gone_at: None,
            reboot_at: None,
        }
    }
}

/// One vehicle.
pub struct VirtualVehicle<'w> {
    /// What it is.
    pub setup: VehicleSetup,
    /// Its files.
    pub storage: Box<dyn Storage + Send>,
    /// Its parameters.
    pub params: Params,
    /// What became of its flights since it was made.
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
}

impl<'w> VirtualVehicle<'w> {
    /// A vehicle that is switched on at this time.
    pub fn new(
        world: &'w World<'w>,
        setup: VehicleSetup,
        storage: Box<dyn Storage + Send>,
        now: Micros,
    ) -> Self {
        Self {
            params: Params::new(world.vehicle, setup.system, setup.stock),
            ftp: FtpServer::new(setup.packets_per_s),
            logs: LogServer::new(&setup.log_folder, setup.packets_per_s),
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
        }
    }

    /// Whether its motors are armed.
    pub fn is_armed(&self) -> bool {
        self.airborne.as_ref().is_some_and(Airborne::is_armed)
    }

    /// Whether it flies, or has just landed.
    pub fn is_busy(&self) -> bool {
        self.airborne.is_some() || self.show.is_counting_down()
    }

    /// Whether its log still grows, though it has landed.
    pub fn is_writing(&self) -> bool {
        self.logbook.is_growing()
    }

    /// Stage of its show.
    pub fn stage(&self) -> Stage {
        match &self.airborne {
            Some(airborne) if airborne.is_armed() => airborne.stage(),
            _ => self.show.stage,
        }
    }

    /// Where it is, show frame, m.
    pub fn position_m(&self) -> Vector3<f64> {
        self.airborne.as_ref().map_or(self.stands_m, Airborne::position_m)
    }

    /// Puts it somewhere else (show frame, m), as a crew does; not while it flies.
    pub fn carry_to(&mut self, stands_m: Vector3<f64>) {
        self.stands_m = stands_m;
    }

    /// Custom mode.
    pub fn mode(&self) -> u32 {
        self.mode
    }

    /// The show that it would fly, as it was when the file was read last.
    pub fn loaded(&self) -> Option<&LoadedShow> {
        self.show.loaded
    }

    /// Corners of the fence that it has: latitude and longitude, 1e-7 degrees.
    pub fn fence_1e7(&self) -> Vec<(i32, i32)> {
        self.fence.corners_1e7()
    }

    /// Takes the battery's charge into its own hands: share that is used, 0..1.
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
        self.ftp = FtpServer::new(self.setup.packets_per_s);
        self.logs = LogServer::new(&self.setup.log_folder, self.setup.packets_per_s);
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

    fn telling(&self, now: Micros) -> Telling {
        let frame = &self.world.frame;
        let position_m = self.position_m();
        let (velocity_mps, battery) = match &self.airborne {
            Some(airborne) => (airborne.velocity_mps(), airborne.battery()),
            None => (Vector3::zeros(), None),
        };
        let percent = self.battery_percent();
        Telling {
            boot_ms: (self.age(now) / 1000) as u32,
            gps: self.gps(now),
            mode: self.mode,
            armed: self.is_armed(),
            booting: !self.has_files,
            ready: self.has_files && self.obstacle(now).is_none(),
            place: frame.to_geodetic(position_m),
            height_m: position_m.z - self.stands_m.z,
            velocity_mps: frame.to_neu(velocity_mps),
            heading_deg: frame.orientation_deg,
            volts: battery.map_or(10.5 + 0.02 * percent, |battery| battery.volts),
            amps: battery.map_or(0.5, |battery| battery.amps),
            percent,
            fence_on: self.params.whole("FENCE_ENABLE") != 0,
            status: (!self.setup.stock).then(|| self.status(now)),
        }
    }

    /// The show's status packet.
    fn status(&self, now: Micros) -> Status {
        let gps_us = self.world.gps_us(now);
        let gps = self.gps(now);
        let mut flags = 0;
        for (bit, is_set) in [
            (flag::LOADED, self.show.loaded.is_some()),
            (flag::START_SET, self.show.start_us.is_some()),
            (flag::ORIGIN_SET, self.show.origin.is_some()),
            (flag::ORIENTATION_SET, self.show.orientation_deg.is_some()),
            (flag::FENCE_ON, self.params.whole("FENCE_ENABLE") != 0),
            (flag::AUTHORIZED, self.show.authorized),
            (flag::NO_GPS_TIME, gps.is_none()),
            (flag::FENCE_BREACHED, self.breached),
        ] {
            if is_set {
                flags |= bit;
            }
        }
        let stage = self.stage();
        let colour = match (stage, self.show.loaded, self.show.show_time_s(gps_us)) {
            (Stage::Takeoff | Stage::Performing, Some(show), Some(time_s)) => {
                lights::color_at(&show.lights, (time_s.max(0.0) * 1000.0) as u64)
            }
            (Stage::Landing | Stage::Off, ..) if self.is_armed() => [255, 128, 0],
            (Stage::WaitForStart, ..) if self.show.preflight == 0 => [0, 127, 0],
            (Stage::Error, ..) => [255, 0, 0],
            _ => [0; 3],
        };
        let miss_m = self.airborne.as_ref().and_then(Airborne::miss_m);
        let start = GpsTime::from_total_ms(self.show.start_us.unwrap_or(-1).div_euclid(1000));
        Status {
            start_tow_s: start.map_or(-1, |start| (start.tow_ms / 1000) as i32),
            colour: rgb565(colour),
            flags,
            preflight: if stage == Stage::WaitForStart { self.show.preflight } else { 0 },
            stage: if self.has_files { stage } else { Stage::Off },
            gps_fix: if gps.is_some() { 6 } else { 1 },
            satellites: if gps.is_some() { 10 } else { 0 },
            boot_count: self.boots & 3,
            is_far: miss_m.is_some_and(|miss| miss > f64::from(self.params.get("SHOW_MAX_XY_ERR"))),
            elapsed_s: self.show.elapsed_s(gps_us).filter(|_| gps.is_some()),
        }
    }

    fn take_start_packet(&mut self, now: Micros, packet: &dialect::DATA16_DATA) {
        if self.setup.stock || packet.mavtype != show::TO_DRONE {
            return;
        }
        let Some(start) = StartConfig::from_data(&packet.data, packet.len) else { return };
        let was_authorized = self.show.authorized;
        self.show.configure(&start, self.world.gps_us(now), &mut self.params);
        self.on_authorized(was_authorized);
    }

    fn on_authorized(&mut self, was_authorized: bool) {
        let by_itself = self.params.whole("SHOW_MODE_BOOT") & 2 != 0;
        if by_itself
            && self.show.authorized
            && !was_authorized
            && !self.is_armed()
            && self.mode != SHOW_MODE
        {
            self.enter_show_mode();
        }
    }

    /// What setting a parameter changes elsewhere.
    fn on_parameter(&mut self, now: Micros, name: &str) {
        let whole = |name| self.params.whole(name) as i32;
        match name {
            "SHOW_START_TIME" => {
                let tow_s = whole(name);
                self.show.set_start(tow_s, self.world.gps_us(now), &mut self.params);
            }
            "SHOW_START_AUTH" => {
                let was_authorized = self.show.authorized;
                self.show.authorized = whole(name) != 0;
                self.on_authorized(was_authorized);
            }
            "SHOW_ORIGIN_LAT" | "SHOW_ORIGIN_LNG" => {
                let place = [whole("SHOW_ORIGIN_LAT"), whole("SHOW_ORIGIN_LNG")];
                self.show.origin = (place != [0, 0]).then_some(place);
            }
            "SHOW_ORIGIN_AMSL" => self.show.amsl_mm = whole(name),
            "SHOW_ORIENTATION" => {
                let orientation = self.params.get(name);
                self.show.orientation_deg = (orientation >= 0.0).then_some(orientation);
            }
            _ => {}
        }
    }

    /// Reads the show file again.
    fn reload(&mut self) -> Reload {
        self.show.reload(self.world, self.storage.as_ref())
    }
}

impl Endpoint for VirtualVehicle<'_> {
    fn on_message(&mut self, now: Micros, message: &MavMessage, out: &mut Vec<MavMessage>) {
        self.on_frame(now, STATION, message, out);
    }

    fn on_frame(
        &mut self,
        now: Micros,
        sender: Sender,
        message: &MavMessage,
        out: &mut Vec<MavMessage>,
    ) {
        if self.is_gone(now) || self.age(now) < self.setup.boot.heartbeat {
            return;
        }
        if target(message).is_some_and(|system| system != 0 && system != self.setup.system) {
            return;
        }
        match message {
            MavMessage::COMMAND_LONG(command) => self.on_command(now, &command.into(), out),
            MavMessage::COMMAND_INT(command) => self.on_command(now, &command.into(), out),
            MavMessage::DATA16(packet) => self.take_start_packet(now, packet),
            MavMessage::FILE_TRANSFER_PROTOCOL(_) => self.ftp.on_message(sender, message),
            _ => {
                if let MavMessage::LOG_REQUEST_DATA(_) = message
                    && self.airborne.is_none()
                {
                    self.logbook.close(self.storage.as_mut());
                }
                let armed = self.is_armed();
                self.logs.on_message(message, armed, self.storage.as_ref(), out);
                self.fence.on_message(now, message, out);
                self.params.put("FENCE_TOTAL", self.fence.len() as f32);
                if let Some(name) = self.params.on_message(message, out) {
                    self.on_parameter(now, name);
                }
            }
        }
    }

    fn poll(&mut self, now: Micros, out: &mut Vec<MavMessage>) -> Micros {
        if self.is_gone(now) {
            return Micros::MAX;
        }
        if self.setup.reboot_at.is_some_and(|at| now >= at) && !self.is_armed() {
            self.setup.reboot_at = None;
            self.reboot(now);
        }
        while self.next_tick <= now {
            let tick = self.next_tick;
            self.next_tick += TICK;
            self.tick(tick, out);
        }
        let mut next = self.next_tick;
        let due = self.streams.due(now);
        if !due.is_empty() {
            let telling = self.telling(now);
            out.extend(due.into_iter().filter_map(|id| telling.message(id)));
        }
        next = next.min(self.streams.next());
        next = next.min(self.ftp.poll(now, self.storage.as_mut(), out));
        let armed = self.is_armed();
        next = next.min(self.logs.poll(now, armed, self.storage.as_ref(), out));
        self.fence.poll(now, out);
        if self.params.poll(out) {
            next = next.min(now + 10 * MS);
        }
        next
    }
}

/// Whom a message is for, if it says so.
fn target(message: &MavMessage) -> Option<u8> {
    Some(match message {
        MavMessage::COMMAND_LONG(it) => it.target_system,
        MavMessage::COMMAND_INT(it) => it.target_system,
        MavMessage::PARAM_SET(it) => it.target_system,
        MavMessage::PARAM_REQUEST_LIST(it) => it.target_system,
        MavMessage::PARAM_REQUEST_READ(it) => it.target_system,
        MavMessage::MISSION_COUNT(it) => it.target_system,
        MavMessage::MISSION_ITEM_INT(it) => it.target_system,
        MavMessage::MISSION_REQUEST_LIST(it) => it.target_system,
        MavMessage::MISSION_REQUEST_INT(it) => it.target_system,
        MavMessage::MISSION_CLEAR_ALL(it) => it.target_system,
        MavMessage::FILE_TRANSFER_PROTOCOL(it) => it.target_system,
        MavMessage::LOG_REQUEST_LIST(it) => it.target_system,
        MavMessage::LOG_REQUEST_DATA(it) => it.target_system,
        MavMessage::LOG_REQUEST_END(it) => it.target_system,
        _ => return None,
    })
}

fn text(severity: dialect::MavSeverity, text: &str) -> MavMessage {
    MavMessage::STATUSTEXT(dialect::STATUSTEXT_DATA {
        severity,
        text: text.into(),
        ..Default::default()
    })
}

fn warning(message: &str) -> MavMessage {
    text(dialect::MavSeverity::MAV_SEVERITY_WARNING, message)
}

fn error(message: &str) -> MavMessage {
    text(dialect::MavSeverity::MAV_SEVERITY_CRITICAL, message)
}
