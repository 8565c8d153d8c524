//! Stock vehicles in GUIDED: orders, targets, and a station that falls silent.

use nalgebra::Vector3;
use updraft::fleet::messages::{GuidedTarget, command_long, position_target, set_mode};
use updraft::flight::{Flight, FlightOptions};
use updraft::link::frame::MavMessage;
use updraft::link::frame::dialect::{self, MavCmd, MavResult, PositionTargetTypemask};
use updraft::link::id::DroneId;
use updraft::log::{Log, Select};

use super::support::{Crew, Field};

const GUIDED: f32 = 4.0;
const DRONE: DroneId = DroneId { network: 0, system: 1 };

fn stock<'w>(world: &'w updraft::virtual_fleet::world::World<'w>) -> Crew<'w> {
    let mut crew = Crew::new(world, 1, |setup| setup.stock = true);
    crew.run_until(5.0);
    crew
}

fn order(crew: &mut Crew<'_>, command: MavCmd, first: f32, last: f32) -> MavResult {
    let params = [first, 0.0, 0.0, 0.0, 0.0, 0.0, last];
    crew.send(1, command_long(DRONE, command, params, 0));
    let acks = crew.heard.iter().rev().find_map(|(_, message)| match message {
        MavMessage::COMMAND_ACK(ack) => Some(ack.result),
        _ => None,
    });
    acks.unwrap()
}

fn in_the_air(crew: &mut Crew<'_>) {
    assert_eq!(crew.long(1, 176, [1.0, GUIDED]), MavResult::MAV_RESULT_ACCEPTED);
    let arm = MavCmd::MAV_CMD_COMPONENT_ARM_DISARM;
    assert_eq!(order(crew, arm, 1.0, 0.0), MavResult::MAV_RESULT_ACCEPTED);
    crew.run_for(4.0);
    let takeoff = MavCmd::MAV_CMD_NAV_TAKEOFF;
    assert_eq!(order(crew, takeoff, 0.0, 5.0), MavResult::MAV_RESULT_ACCEPTED);
    crew.run_for(10.0);
    assert!((crew.vehicle(1).position_m().z - 5.0).abs() < 0.3);
}

fn target(field: &Field, place_m: Vector3<f64>, velocity_mps: Vector3<f64>) -> MavMessage {
    let place = field.frame.to_geodetic(place_m);
    let neu = field.frame.to_neu(velocity_mps);
    let target = GuidedTarget {
        lat_1e7: (place.lat_deg * 1e7).round() as i32,
        lon_1e7: (place.lon_deg * 1e7).round() as i32,
        above_home_m: place_m.z,
        neu_mps: [neu.x, neu.y, neu.z],
        yaw_rad: 0.0,
    };
    position_target(DRONE, 0, &target)
}

#[test]
fn stock_firmware_knows_no_show() {
    let field = Field::new();
    let world = field.world();
    let mut crew = stock(&world);
    assert_eq!(crew.long(1, 176, [1.0, 127.0]), MavResult::MAV_RESULT_FAILED);
    assert_eq!(crew.long(1, 31_010, [0.0, 0.0]), MavResult::MAV_RESULT_UNSUPPORTED);
    assert_eq!(crew.set_origin(1), MavResult::MAV_RESULT_UNSUPPORTED);
    crew.run_for(2.0);
    assert_eq!(crew.count("DATA16"), 0);
    assert!(!crew.has_folder(1, "/collmot"));
}

#[test]
fn it_arms_in_guided_alone_and_disarms_when_nobody_wants_it() {
    let field = Field::new();
    let world = field.world();
    let mut crew = stock(&world);
    let (arm, takeoff) = (MavCmd::MAV_CMD_COMPONENT_ARM_DISARM, MavCmd::MAV_CMD_NAV_TAKEOFF);
    assert_eq!(order(&mut crew, arm, 1.0, 0.0), MavResult::MAV_RESULT_FAILED);
    assert_eq!(order(&mut crew, takeoff, 0.0, 5.0), MavResult::MAV_RESULT_FAILED);
    assert_eq!(crew.long(1, 176, [1.0, GUIDED]), MavResult::MAV_RESULT_ACCEPTED);
    assert_eq!(order(&mut crew, takeoff, 0.0, 5.0), MavResult::MAV_RESULT_FAILED, "not armed");
    assert_eq!(order(&mut crew, arm, 1.0, 0.0), MavResult::MAV_RESULT_ACCEPTED);
    assert_eq!(order(&mut crew, takeoff, 0.0, f32::NAN), MavResult::MAV_RESULT_DENIED);
    // Targets do not lift it.
    crew.send(1, target(&field, Vector3::new(0.0, 0.0, 20.0), Vector3::z()));
    crew.run_for(9.0);
    assert!(crew.is_armed(1));
    assert!(crew.vehicle(1).position_m().z < 0.05);
    crew.run_for(3.0);
    assert!(!crew.is_armed(1));
}

#[test]
fn it_follows_targets_stops_without_and_lands() {
    let field = Field::new();
    let world = field.world();
    let mut crew = stock(&world);
    in_the_air(&mut crew);
    let takeoff = MavCmd::MAV_CMD_NAV_TAKEOFF;
    assert_eq!(order(&mut crew, takeoff, 0.0, 5.0), MavResult::MAV_RESULT_FAILED, "in the air");
    let begun = crew.now();
    let velocity = Vector3::new(1.0, 0.0, 1.0);
    let mut wanted = Vector3::zeros();
    for _ in 0..100 {
        wanted = Vector3::new(0.0, 0.0, 5.0) + velocity * (crew.now() - begun);
        crew.send(1, target(&field, wanted, velocity));
        crew.run_for(0.08);
    }
    let miss = (crew.vehicle(1).position_m() - wanted).norm();
    assert!(miss < 0.5, "{miss} m off");
    // Without targets it goes on for 3 s, and stays there.
    crew.run_for(8.0);
    let there = crew.vehicle(1).position_m();
    assert!((there - (wanted + velocity * 3.0)).norm() < 0.6, "{there} after {wanted}");
    // From home: north 2, east 0, up 6.
    crew.send(
        1,
        MavMessage::SET_POSITION_TARGET_LOCAL_NED(dialect::SET_POSITION_TARGET_LOCAL_NED_DATA {
            x: 2.0,
            z: -6.0,
            type_mask: PositionTargetTypemask::from_bits_retain(0b1101_1111_1000),
            target_system: 1,
            coordinate_frame: dialect::MavFrame::MAV_FRAME_LOCAL_NED,
            ..Default::default()
        }),
    );
    crew.run_for(20.0);
    let wanted = field.frame.from_neu(Vector3::new(2.0, 0.0, 6.0));
    let there = crew.vehicle(1).position_m();
    assert!((there - wanted).norm() < 0.5, "{there}, not {wanted}");
    crew.send(1, set_mode(DRONE, 9, 0));
    crew.run_for(40.0);
    assert!(!crew.is_armed(1));

    let names = crew.log_names(1);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("1.BIN");
    std::fs::write(&path, crew.log(1, &names[0])).unwrap();
    let log = Log::open(&path).unwrap();
    let wanted = Select { message: "GUIP", fields: &["Type", "vZ"] };
    let (tables, _) = log.select(&[wanted, Select { message: "SHOW", fields: &["Stage"] }]);
    let targets = tables.iter().find(|table| table.message == "GUIP").unwrap();
    // A hundred with velocity 1 m/s up, and one to stay.
    let up = targets.number("vZ").unwrap();
    assert_eq!((up.len(), up.iter().filter(|cm_s| **cm_s > 99.9).count()), (101, 100));
    assert!(targets.number("Type").unwrap().iter().all(|kind| *kind == 3.0));
    assert!(!tables.iter().any(|table| table.message == "SHOW" && table.rows > 0));
    let flight = Flight::open(&path, FlightOptions::default()).unwrap();
    assert!(flight.losses().is_empty(), "{:?}", flight.losses());
}

#[test]
fn it_returns_when_its_station_falls_silent() {
    let field = Field::new();
    let world = field.world();
    for (own, enabled, returns) in [(254.0, 1.0, true), (255.0, 1.0, false), (254.0, 0.0, false)] {
        let mut crew = stock(&world);
        crew.set(1, "SYSID_MYGCS", own);
        crew.set(1, "FS_GCS_ENABLE", enabled);
        in_the_air(&mut crew);
        // The station's last heartbeat was up to a second before.
        crew.net.faults.loss = 1.0;
        crew.run_for(3.5);
        assert_eq!(crew.vehicle(1).mode(), 4);
        crew.run_for(2.5);
        let mode = crew.vehicle(1).mode();
        assert_eq!(mode == 6, returns, "SYSID_MYGCS {own}, FS_GCS_ENABLE {enabled}: mode {mode}");
    }
}
