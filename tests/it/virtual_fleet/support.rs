//! A crew on the ground that talks to virtual vehicles in simulated time.

use std::collections::BTreeMap;

use nalgebra::Vector3;
use updraft::base::frame::{Geodetic, ShowFrame};
use updraft::base::time::GpsTime;
use updraft::link::frame::MavMessage;
use updraft::link::frame::dialect::{self, MavCmd, MavMissionType, MavResult};
use updraft::link::id::DroneId;
use updraft::link::net::Net as _;
use updraft::protocol::show::{FROM_DRONE, SHOW_FILE, StartConfig, Status, TO_DRONE};
use updraft::show::skyb::{self, SkybOptions};
use updraft::show::{Segment, SegmentPath, ShowDrone, Trajectory};
use updraft::sim::{FlightSetup, Hooks, RecordedFlight, Uniform};
use updraft::vehicle::Vehicle;
use updraft::vehicle::library::builtin;
use updraft::virtual_fleet::lossy::{Faults, LossyNet};
use updraft::virtual_fleet::storage::{MemoryStorage, Storage};
use updraft::virtual_fleet::vehicle::{BootTimes, VehicleSetup, VirtualVehicle};
use updraft::virtual_fleet::world::World;

const TOW_AT_0: u32 = 100_000;
pub(crate) const GPS_AT_0: GpsTime = GpsTime { week: 2445, tow_ms: TOW_AT_0 * 1000 };

pub(crate) struct Field {
    vehicle: Vehicle,
    air: Uniform,
    pub(crate) frame: ShowFrame,
}

impl Field {
    pub(crate) fn new() -> Self {
        let origin = Geodetic { lat_deg: 47.473_313_1, lon_deg: 19.062_057_4, amsl_m: 150.0 };
        Self {
            vehicle: builtin("airsim-generic-quad").unwrap(),
            air: Uniform(Vector3::new(1.0, 0.0, 0.3)),
            frame: ShowFrame { origin, orientation_deg: 59.0 },
        }
    }

    pub(crate) fn world(&self) -> World<'_> {
        World::new(&self.vehicle, &self.air, self.frame, 7, GPS_AT_0)
    }

    pub(crate) fn flight<'a>(
        &'a self,
        drone: &'a ShowDrone,
        slot: u16,
        home_m: Vector3<f64>,
        start: GpsTime,
    ) -> FlightSetup<'a> {
        FlightSetup {
            vehicle: &self.vehicle,
            trajectory: &drone.trajectory,
            home_m,
            frame: self.frame,
            atmosphere: &self.air,
            seed: 7,
            drone: slot,
            start,
            lights: &drone.lights,
            full_logs: false,
            hooks: Hooks::default(),
        }
    }
}

/// The log of a flight without any radio.
pub(crate) fn log_of(setup: &FlightSetup<'_>, booted: GpsTime) -> Vec<u8> {
    let mut flight = RecordedFlight::armed(setup, None, Some(booted)).unwrap();
    assert!(flight.step_until(600.0).unwrap(), "it has not landed");
    flight.take_log()
}

/// Climbs at 1 m/s, waits 3 s, and comes down to 2.5 m in 5 s.
pub(crate) fn show_of([x, y]: [f64; 2], height_m: f64) -> ShowDrone {
    let at = |z| SegmentPath::Line(Vector3::new(x, y, z));
    let segments = vec![
        Segment { duration_ms: (height_m * 1000.0) as u32, path: at(height_m) },
        Segment { duration_ms: 3_000, path: SegmentPath::Hold },
        Segment { duration_ms: 5_000, path: at(height_m.min(2.5)) },
    ];
    let trajectory = Trajectory { start_m: Vector3::new(x, y, 0.0), segments };
    ShowDrone { trajectory, lights: vec![4, 0, 255, 0, 0x90, 0x1C, 0], ..ShowDrone::default() }
}

/// Climbs to 10 m, and goes 20 m along x at 1 m/s.
pub(crate) fn sideways() -> ShowDrone {
    let segments = [(10_000, 0.0), (20_000, 20.0)].map(|(duration_ms, x)| Segment {
        duration_ms,
        path: SegmentPath::Line(Vector3::new(x, 0.0, 10.0)),
    });
    let trajectory = Trajectory { start_m: Vector3::zeros(), segments: segments.to_vec() };
    ShowDrone { trajectory, ..ShowDrone::default() }
}

/// Up and down between 20 and 60 m at 2 m/s for eight minutes.
pub(crate) fn ladder([x, y]: [f64; 2]) -> ShowDrone {
    let to =
        |z, duration_ms| Segment { duration_ms, path: SegmentPath::Line(Vector3::new(x, y, z)) };
    let mut segments = vec![to(20.0, 10_000)];
    for _ in 0..8 {
        segments.extend([to(60.0, 20_000), to(60.0, 10_000), to(20.0, 20_000), to(20.0, 10_000)]);
    }
    segments.push(to(2.5, 8_750));
    let trajectory = Trajectory { start_m: Vector3::new(x, y, 0.0), segments };
    ShowDrone { trajectory, ..ShowDrone::default() }
}

/// GPS second of week, and GPS time, of a link time in s.
pub(crate) fn tow_at(seconds: i64) -> i32 {
    TOW_AT_0 as i32 + seconds as i32
}

pub(crate) fn gps_at(seconds: i64) -> GpsTime {
    GpsTime::from_total_ms(GPS_AT_0.total_ms() + seconds * 1000).unwrap()
}

pub(crate) fn read(storage: &dyn Storage, name: &str) -> Vec<u8> {
    let mut bytes = vec![0; storage.size(name).unwrap() as usize];
    assert_eq!(storage.read_at(name, 0, &mut bytes), Ok(bytes.len()));
    bytes
}

pub(crate) fn file(drone: &ShowDrone) -> Vec<u8> {
    skyb::write(drone, &SkybOptions::default()).unwrap().bytes
}

pub(crate) fn slot_m(system: u8) -> [f64; 2] {
    let index = f64::from(system - 1);
    [(index % 3.0).floor() * 5.0, (index / 3.0).floor() * 5.0]
}

pub(crate) struct Crew<'w> {
    pub(crate) net: LossyNet<VirtualVehicle<'w>>,
    pub(crate) heard: Vec<(u8, MavMessage)>,
    pub(crate) texts: Vec<String>,
    statuses: BTreeMap<u8, Status>,
    ready: BTreeMap<u8, bool>,
    stages: BTreeMap<u8, BTreeMap<u8, f64>>,
    frame: ShowFrame,
}

fn id(system: u8) -> DroneId {
    DroneId { network: 0, system }
}

impl<'w> Crew<'w> {
    pub(crate) fn new(world: &'w World<'w>, count: u8, change: impl Fn(&mut VehicleSetup)) -> Self {
        let vehicles = (1..=count).map(|system| {
            let [x, y] = slot_m(system);
            let mut setup = VehicleSetup::new(system.into(), system, Vector3::new(x, y, 0.0));
            setup.boot = BootTimes::short();
            change(&mut setup);
            let storage = Box::new(MemoryStorage::default());
            (id(system), VirtualVehicle::new(world, setup, storage, 0))
        });
        Self {
            net: LossyNet::new(vehicles.collect(), Faults::default(), 1),
            heard: Vec::new(),
            texts: Vec::new(),
            statuses: BTreeMap::new(),
            ready: BTreeMap::new(),
            stages: BTreeMap::new(),
            frame: world.frame,
        }
    }

    /// Uploaded, and ready to fly.
    pub(crate) fn prepared(world: &'w World<'w>, count: u8) -> Self {
        let mut crew = Self::new(world, count, |_| {});
        crew.run_until(5.0);
        for system in 1..=count {
            crew.load(system, &show_of(slot_m(system), 12.0));
        }
        crew
    }

    pub(crate) fn prepared_with(world: &'w World<'w>, system: u8, show: &ShowDrone) -> Self {
        let mut crew = Self::new(world, system, |_| {});
        crew.run_until(5.0);
        crew.load(system, show);
        crew
    }

    fn load(&mut self, system: u8, show: &ShowDrone) {
        self.put_show(system, &file(show));
        assert_eq!(self.long(system, 31_010, [0.0, 0.0]), MavResult::MAV_RESULT_ACCEPTED);
        assert_eq!(self.set_origin(system), MavResult::MAV_RESULT_ACCEPTED);
        self.run_for(1.5);
        let status = self.status(system);
        assert_eq!(status.preflight, 0);
        assert!(self.is_ready(system), "{:?}", self.texts);
    }

    pub(crate) fn now(&self) -> f64 {
        self.net.now() as f64 * 1e-6
    }

    pub(crate) fn run_for(&mut self, seconds: f64) {
        self.run_until(self.now() + seconds);
    }

    pub(crate) fn run_until(&mut self, seconds: f64) {
        let until = (seconds * 1e6) as u64;
        while let Some(received) = self.net.recv(until).unwrap() {
            let system = received.from.system;
            match &received.message {
                MavMessage::DATA16(packet) if packet.mavtype == FROM_DRONE => {
                    let status = Status::from_data(&packet.data[..]);
                    let time = self.now();
                    let stages = self.stages.entry(system).or_default();
                    stages.entry(status.stage.number()).or_insert(time);
                    self.statuses.insert(system, status);
                }
                MavMessage::SYS_STATUS(status) => {
                    let bit = dialect::MavSysStatusSensor::MAV_SYS_STATUS_PREARM_CHECK;
                    self.ready.insert(system, status.onboard_control_sensors_health.contains(bit));
                }
                MavMessage::STATUSTEXT(text) => {
                    let text = String::from_utf8_lossy(&text.text[..]).into_owned();
                    self.texts.push(text.trim_end_matches('\0').to_owned());
                }
                _ => {}
            }
            self.heard.push((system, received.message));
        }
    }

    pub(crate) fn status(&self, system: u8) -> Status {
        self.statuses[&system]
    }

    pub(crate) fn is_ready(&self, system: u8) -> bool {
        self.ready[&system]
    }

    /// When each stage was told first, link time s.
    pub(crate) fn stage_times(&self, system: u8) -> &BTreeMap<u8, f64> {
        &self.stages[&system]
    }

    pub(crate) fn vehicle(&self, system: u8) -> &VirtualVehicle<'w> {
        &self.net.vehicles[&id(system)]
    }

    pub(crate) fn is_armed(&self, system: u8) -> bool {
        self.vehicle(system).is_armed()
    }

    pub(crate) fn has_folder(&self, system: u8, name: &str) -> bool {
        self.vehicle(system).storage.list(name).is_ok()
    }

    pub(crate) fn log_names(&self, system: u8) -> Vec<String> {
        let entries = self.vehicle(system).storage.list("logs").unwrap();
        entries.into_iter().map(|entry| entry.name).collect()
    }

    pub(crate) fn log(&self, system: u8, name: &str) -> Vec<u8> {
        read(self.vehicle(system).storage.as_ref(), &format!("logs/{name}"))
    }

    pub(crate) fn put_show(&mut self, system: u8, bytes: &[u8]) {
        let storage = &mut self.net.vehicles.get_mut(&id(system)).unwrap().storage;
        storage.create(SHOW_FILE).unwrap();
        storage.write_at(SHOW_FILE, 0, bytes).unwrap();
    }

    pub(crate) fn count(&self, name: &str) -> usize {
        let starts = |message: &MavMessage| {
            let text = format!("{message:?}");
            text.starts_with(&format!("{name}("))
        };
        self.heard.iter().filter(|(_, message)| starts(message)).count()
    }

    #[expect(clippy::needless_pass_by_value, reason = "messages are made where they are sent")]
    pub(crate) fn send(&mut self, system: u8, message: MavMessage) {
        self.net.send(id(system), &message).unwrap();
        self.run_for(0.02);
    }

    fn result(&self) -> MavResult {
        let ack = self.heard.iter().rev().find_map(|(_, message)| match message {
            MavMessage::COMMAND_ACK(ack) => Some(ack.result),
            _ => None,
        });
        ack.unwrap()
    }

    pub(crate) fn long(
        &mut self,
        system: u8,
        number: u16,
        [param1, param2]: [f32; 2],
    ) -> MavResult {
        let command = match number {
            20 => MavCmd::MAV_CMD_NAV_RETURN_TO_LAUNCH,
            21 => MavCmd::MAV_CMD_NAV_LAND,
            176 => MavCmd::MAV_CMD_DO_SET_MODE,
            246 => MavCmd::MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN,
            511 => MavCmd::MAV_CMD_SET_MESSAGE_INTERVAL,
            512 => MavCmd::MAV_CMD_REQUEST_MESSAGE,
            31_010 => MavCmd::MAV_CMD_USER_1,
            31_011 => MavCmd::MAV_CMD_USER_2,
            other => panic!("command {other}"),
        };
        let target = (system, 1);
        self.send(
            system,
            MavMessage::COMMAND_LONG(dialect::COMMAND_LONG_DATA {
                param1,
                param2,
                command,
                target_system: target.0,
                target_component: target.1,
                ..Default::default()
            }),
        );
        self.result()
    }

    pub(crate) fn set_origin(&mut self, system: u8) -> MavResult {
        let origin = self.frame.origin;
        self.send(
            system,
            MavMessage::COMMAND_INT(dialect::COMMAND_INT_DATA {
                param4: self.frame.orientation_deg as f32,
                x: (origin.lat_deg * 1e7).round() as i32,
                y: (origin.lon_deg * 1e7).round() as i32,
                z: -32_768_000.0,
                command: MavCmd::MAV_CMD_USER_2,
                target_system: system,
                target_component: 1,
                ..Default::default()
            }),
        );
        self.result()
    }

    pub(crate) fn set(&mut self, system: u8, name: &str, value: f32) {
        self.send(
            system,
            MavMessage::PARAM_SET(dialect::PARAM_SET_DATA {
                param_value: value,
                target_system: system,
                target_component: 1,
                param_id: name.into(),
                ..Default::default()
            }),
        );
    }

    pub(crate) fn params(&self) -> BTreeMap<String, f32> {
        let values = self.heard.iter().filter_map(|(_, message)| match message {
            MavMessage::PARAM_VALUE(value) => {
                let name = String::from_utf8_lossy(&value.param_id[..]).into_owned();
                Some((name.trim_end_matches('\0').to_owned(), value.param_value))
            }
            _ => None,
        });
        values.collect()
    }

    /// Allows a start so many seconds ahead (in whole seconds); when it will be, link time s.
    pub(crate) fn start_in(&mut self, seconds: f64) -> f64 {
        let start = (self.now() + seconds).ceil();
        self.start_at(start, true);
        start
    }

    pub(crate) fn start_at(&mut self, start: f64, authorized: bool) {
        let start = StartConfig {
            start_tow_s: tow_at(start as i64),
            authorization: u8::from(authorized),
            countdown_ms: updraft::protocol::show::LEAVE_TIME,
        };
        let (data, len) = start.to_data();
        let packet = dialect::DATA16_DATA { mavtype: TO_DRONE, len, data };
        self.net.broadcast(&MavMessage::DATA16(packet)).unwrap();
    }

    #[expect(clippy::unused_self, reason = "reads as the crew's other words")]
    pub(crate) fn start_time(&self, start: f64) -> GpsTime {
        gps_at(start as i64)
    }

    pub(crate) fn ask_for_logs(&mut self, system: u8) {
        let wanted = dialect::LOG_REQUEST_LIST_DATA {
            start: 0,
            end: 0xFFFF,
            target_system: system,
            target_component: 1,
        };
        self.send(system, MavMessage::LOG_REQUEST_LIST(wanted));
    }

    pub(crate) fn capabilities(&self) -> u64 {
        let found = self.heard.iter().find_map(|(_, message)| match message {
            MavMessage::AUTOPILOT_VERSION(version) => Some(version.capabilities.bits()),
            _ => None,
        });
        found.unwrap()
    }

    pub(crate) fn upload_fence(&mut self, system: u8, corners: &[Vector3<f64>], says: u8) {
        let fence = MavMissionType::MAV_MISSION_TYPE_FENCE;
        self.send(
            system,
            MavMessage::MISSION_COUNT(dialect::MISSION_COUNT_DATA {
                count: corners.len() as u16,
                target_system: system,
                target_component: 1,
                mission_type: fence,
                ..Default::default()
            }),
        );
        for (seq, corner) in corners.iter().enumerate() {
            let place = self.frame.to_geodetic(*corner);
            self.send(
                system,
                MavMessage::MISSION_ITEM_INT(dialect::MISSION_ITEM_INT_DATA {
                    param1: says.into(),
                    x: (place.lat_deg * 1e7) as i32,
                    y: (place.lon_deg * 1e7) as i32,
                    seq: seq as u16,
                    command: MavCmd::MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION,
                    target_system: system,
                    target_component: 1,
                    mission_type: fence,
                    ..Default::default()
                }),
            );
        }
    }

    pub(crate) fn mission_results(&self) -> Vec<u8> {
        let results = self.heard.iter().filter_map(|(_, message)| match message {
            MavMessage::MISSION_ACK(ack) => Some(ack.mavtype as u8),
            _ => None,
        });
        results.collect()
    }

    pub(crate) fn download_fence(&mut self, system: u8) -> Vec<u16> {
        let fence = MavMissionType::MAV_MISSION_TYPE_FENCE;
        self.heard.clear();
        self.send(
            system,
            MavMessage::MISSION_REQUEST_LIST(dialect::MISSION_REQUEST_LIST_DATA {
                target_system: system,
                target_component: 1,
                mission_type: fence,
            }),
        );
        let count = self.heard.iter().find_map(|(_, message)| match message {
            MavMessage::MISSION_COUNT(count) => Some(count.count),
            _ => None,
        });
        for seq in 0..count.unwrap() {
            self.send(
                system,
                MavMessage::MISSION_REQUEST_INT(dialect::MISSION_REQUEST_INT_DATA {
                    seq,
                    target_system: system,
                    target_component: 1,
                    mission_type: fence,
                }),
            );
        }
        let items = self.heard.iter().filter_map(|(_, message)| match message {
            MavMessage::MISSION_ITEM_INT(item) => Some(item.seq),
            _ => None,
        });
        items.collect()
    }
}
