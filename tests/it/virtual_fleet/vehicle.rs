//! One vehicle, and nine, in simulated time.

use nalgebra::Vector3;
use updraft::flight::identity::identify;
use updraft::link::frame::MavMessage;
use updraft::link::frame::dialect::{self, MavResult};
use updraft::link::net::Net as _;
use updraft::log::Log;
use updraft::protocol::show::{self, Stage, flag, preflight};
use updraft::virtual_fleet::vehicle::BootTimes;

use super::support::{Crew, Field, GPS_AT_0, file, log_of, show_of, sideways};

#[test]
fn it_boots_as_the_firmware_does() {
    let field = Field::new();
    let world = field.world();
    let mut crew = Crew::new(&world, 1, |setup| setup.boot = BootTimes::default());
    crew.run_until(0.9);
    assert!(crew.heard.is_empty(), "it is silent at first");
    crew.run_until(4.5);
    assert!(crew.count("HEARTBEAT") >= 3);
    assert_eq!(crew.status(1).stage, Stage::Off);
    assert!(!crew.has_folder(1, "/collmot"));
    crew.run_until(6.0);
    assert_eq!(crew.status(1).stage, Stage::WaitForStart);
    assert!(crew.has_folder(1, "/collmot"));
    assert!(crew.status(1).has(flag::NO_GPS_TIME));
    crew.run_until(44.0);
    assert!(!crew.is_ready(1));
    assert!(crew.texts.iter().any(|text| text == "PreArm: Need Position Estimate"));
    crew.run_until(47.0);
    assert!(crew.is_ready(1));
    assert!(!crew.status(1).has(flag::NO_GPS_TIME));
}

#[test]
fn unasked_messages_come_at_the_firmwares_rates() {
    let field = Field::new();
    let world = field.world();
    let mut crew = Crew::new(&world, 1, |_| {});
    crew.run_until(10.0);
    crew.heard.clear();
    crew.run_until(20.0);
    for (name, wanted) in [
        ("HEARTBEAT", 10),
        ("SYS_STATUS", 10),
        ("GPS_RAW_INT", 10),
        ("GLOBAL_POSITION_INT", 20),
        ("DATA16", 20),
        ("SYSTEM_TIME", 0),
    ] {
        assert_eq!(crew.count(name), wanted, "{name}");
    }
    assert_eq!(crew.long(1, 511, [2.0, 200_000.0]), MavResult::MAV_RESULT_ACCEPTED);
    crew.heard.clear();
    crew.run_for(10.0);
    assert_eq!(crew.count("SYSTEM_TIME"), 50);
}

#[test]
fn parameters_are_listed_read_and_set_and_lose_digits() {
    let field = Field::new();
    let world = field.world();
    let mut crew = Crew::new(&world, 1, |_| {});
    crew.run_until(5.0);
    crew.send(
        1,
        MavMessage::PARAM_REQUEST_LIST(dialect::PARAM_REQUEST_LIST_DATA {
            target_system: 1,
            target_component: 1,
        }),
    );
    crew.run_for(2.0);
    let values = crew.params();
    assert_eq!(values.keys().filter(|name| name.starts_with("SHOW_")).count(), 25);
    assert_eq!(crew.count("PARAM_VALUE"), values.len());
    crew.set(1, "SHOW_ORIGIN_LAT", -353_632_610.0);
    assert_eq!(crew.params()["SHOW_ORIGIN_LAT"] as i64, -353_632_608);
    crew.set(1, "RTL_ALT", 2000.0);
    assert_eq!(crew.params()["RTL_ALT"], 2000.0);
    let heard = crew.count("PARAM_VALUE");
    crew.set(1, "NO_SUCH", 1.0);
    assert_eq!(crew.count("PARAM_VALUE"), heard, "an unknown name has no answer");
}

#[test]
fn the_origin_is_exact_only_by_command_int() {
    let field = Field::new();
    let world = field.world();
    let mut crew = Crew::new(&world, 1, |_| {});
    crew.run_until(5.0);
    assert_eq!(crew.long(1, show::SET_ORIGIN, [0.0, 0.0]), MavResult::MAV_RESULT_UNSUPPORTED);
    assert!(!crew.status(1).has(flag::ORIGIN_SET));
    assert_eq!(crew.set_origin(1), MavResult::MAV_RESULT_ACCEPTED);
    crew.run_for(1.0);
    assert!(crew.status(1).has(flag::ORIGIN_SET | flag::ORIENTATION_SET));
}

#[test]
fn a_reload_tells_a_broken_file_but_not_a_missing_one() {
    let field = Field::new();
    let world = field.world();
    let mut crew = Crew::new(&world, 1, |_| {});
    crew.run_until(5.0);
    crew.put_show(1, &file(&show_of([0.0, 0.0], 6.0)));
    assert_eq!(crew.long(1, show::RELOAD, [0.0, 0.0]), MavResult::MAV_RESULT_ACCEPTED);
    crew.run_for(1.0);
    assert!(crew.status(1).has(flag::LOADED));
    let mut broken = file(&show_of([0.0, 0.0], 6.0));
    *broken.last_mut().unwrap() ^= 1;
    crew.put_show(1, &broken);
    assert_eq!(crew.long(1, show::RELOAD, [0.0, 0.0]), MavResult::MAV_RESULT_FAILED);
    crew.run_for(1.0);
    assert!(!crew.status(1).has(flag::LOADED));
    assert_eq!(crew.long(1, show::RELOAD, [1.0, 0.0]), MavResult::MAV_RESULT_ACCEPTED);
    assert_eq!(crew.long(1, show::RELOAD, [0.0, 0.0]), MavResult::MAV_RESULT_ACCEPTED);
    crew.run_for(1.0);
    assert!(!crew.status(1).has(flag::LOADED), "a missing file is accepted, and nothing is loaded");
    // A show that never rises high enough has no take-off time.
    crew.put_show(1, &file(&show_of([0.0, 0.0], 2.0)));
    assert_eq!(crew.long(1, show::RELOAD, [0.0, 0.0]), MavResult::MAV_RESULT_FAILED);
}

#[test]
fn it_flies_the_stages_of_the_firmware_and_logs_what_simulate_does() {
    let field = Field::new();
    let world = field.world();
    let mut crew = Crew::prepared(&world, 1);
    let start = crew.start_in(30.0);
    crew.run_until(start - 8.2 + 2.045);
    assert!(!crew.is_armed(1));
    assert_eq!(crew.log_names(1).len(), 0);
    crew.run_until(start - 7.7 + 2.045);
    assert!(crew.is_armed(1), "it arms 8 s before its take-off time");
    assert_eq!(crew.log_names(1), ["00000001.BIN"]);
    crew.run_until(start + 60.0);
    let at = |stage| crew.stage_times(1).get(&stage).map(|time| time - start);
    let takeoff = at(Stage::Takeoff.number()).unwrap();
    assert!((2.0..2.7).contains(&takeoff), "take-off at {takeoff}");
    let performing = at(Stage::Performing.number()).unwrap();
    assert!((3.0..4.2).contains(&performing), "performing at {performing}");
    let landing = at(Stage::Landing.number()).unwrap();
    assert!((20.0..20.8).contains(&landing), "landing at {landing}");
    let landed = at(Stage::Landed.number()).unwrap();
    assert!((22.0..32.0).contains(&landed), "landed at {landed}");
    let vehicle = crew.vehicle(1);
    assert!(!vehicle.is_busy());
    // The same flight without any radio.
    let show = show_of([0.0, 0.0], 12.0);
    let flown = updraft::show::skyb::read(&file(&show)).unwrap().drone;
    let setup = field.flight(&flown, 1, Vector3::zeros(), crew.start_time(start));
    let log = log_of(&setup, GPS_AT_0);
    assert!(crew.log(1, "00000001.BIN") == log, "the logs differ");
    // Its board time counts from when it was switched on, as its messages do.
    let booted = identify(&Log::from_bytes(log)).boots[0].booted.unwrap();
    assert!((booted.total_ms() - GPS_AT_0.total_ms()).abs() < 50, "{booted:?}");
}

#[test]
fn the_log_grows_on_after_disarming_and_not_with_rotation() {
    let field = Field::new();
    let world = field.world();
    for (rotate, grows) in [(0.0, true), (1.0, false)] {
        let mut crew = Crew::prepared(&world, 1);
        crew.set(1, "LOG_FILE_DSRMROT", rotate);
        crew.start_in(20.0);
        while crew.now() < 30.0 || crew.vehicle(1).is_busy() {
            crew.run_for(1.0);
        }
        let early = crew.log(1, "00000001.BIN").len();
        crew.run_for(16.0);
        let late = crew.log(1, "00000001.BIN").len();
        assert_eq!(early < late, grows, "{early} and {late} bytes");
        crew.run_for(30.0);
        assert_eq!(crew.log(1, "00000001.BIN").len(), late);
    }
}

#[test]
fn a_second_show_is_appended_unless_files_rotate_or_were_downloaded() {
    let field = Field::new();
    let world = field.world();
    for (rotate, download, names) in [(0.0, false, 1), (1.0, false, 2), (0.0, true, 2)] {
        let mut crew = Crew::prepared(&world, 1);
        crew.set(1, "LOG_FILE_DSRMROT", rotate);
        crew.start_in(20.0);
        crew.run_for(80.0);
        let first = crew.log(1, "00000001.BIN");
        if download {
            crew.send(
                1,
                MavMessage::LOG_REQUEST_DATA(dialect::LOG_REQUEST_DATA_DATA {
                    id: 1,
                    ofs: 0,
                    count: 90,
                    target_system: 1,
                    target_component: 1,
                }),
            );
            crew.run_for(1.0);
            assert_eq!(crew.count("LOG_DATA"), 1);
        }
        assert_eq!(crew.status(1).stage, Stage::Landed);
        crew.start_in(30.0);
        crew.run_for(5.0);
        assert_eq!(crew.status(1).stage, Stage::WaitForStart, "a new start makes it wait again");
        crew.run_for(90.0);
        assert_eq!(crew.log_names(1).len(), names);
        if names == 1 {
            let both = crew.log(1, "00000001.BIN");
            assert!(both.len() > first.len() * 3 / 2 && both.starts_with(&first));
        }
    }
}

#[test]
fn logs_are_not_told_while_armed() {
    let field = Field::new();
    let world = field.world();
    let mut crew = Crew::prepared(&world, 1);
    let start = crew.start_in(20.0);
    crew.run_until(start + 5.0);
    crew.ask_for_logs(1);
    crew.run_for(1.0);
    assert_eq!(crew.count("LOG_ENTRY"), 0);
    assert!(crew.texts.iter().any(|text| text == "Disarm for log download"));
    crew.run_until(start + 60.0);
    crew.ask_for_logs(1);
    crew.run_for(1.0);
    assert_eq!(crew.count("LOG_ENTRY"), 1);
}

#[test]
fn a_start_that_nobody_allows_is_missed_in_silence() {
    let field = Field::new();
    let world = field.world();
    let mut crew = Crew::prepared(&world, 1);
    let start = crew.now() + 20.0;
    crew.start_at(start, false);
    crew.texts.clear();
    crew.run_until(start + 2.0 + 5.0);
    assert_eq!(crew.status(1).stage, Stage::WaitForStart);
    crew.run_until(start + 2.0 + 8.0);
    assert_eq!(crew.status(1).stage, Stage::Landed);
    assert!(crew.texts.is_empty(), "{:?}", crew.texts);
    assert!(crew.log_names(1).is_empty());
}

#[test]
fn a_drone_off_its_slot_fails_its_check_and_gives_up() {
    let field = Field::new();
    let world = field.world();
    let mut crew = Crew::prepared(&world, 1);
    crew.net.vehicles.values_mut().next().unwrap().carry_to(Vector3::new(5.0, 0.0, 0.0));
    let start = crew.start_in(20.0);
    crew.run_until(start - 2.0);
    assert_eq!(crew.status(1).preflight, preflight::NOT_AT_TAKEOFF);
    crew.run_until(start + 10.0);
    assert_eq!(crew.status(1).stage, Stage::Error);
    assert!(crew.texts.iter().any(|text| text == "Failed to start motors, giving up"));
    // Only leaving the mode helps.
    crew.net.vehicles.values_mut().next().unwrap().carry_to(Vector3::zeros());
    crew.start_in(30.0);
    crew.run_for(2.0);
    assert_eq!(crew.status(1).stage, Stage::Error);
    crew.long(1, 176, [1.0, 0.0]);
    crew.long(1, 176, [1.0, 127.0]);
    crew.start_in(30.0);
    crew.run_for(2.0);
    assert_eq!((crew.status(1).stage, crew.status(1).preflight), (Stage::WaitForStart, 0));
}

#[test]
fn a_start_in_the_past_is_next_weeks() {
    let field = Field::new();
    let world = field.world();
    let mut crew = Crew::prepared(&world, 1);
    crew.start_at(crew.now() - 10.0, true);
    crew.run_for(20.0);
    let status = crew.status(1);
    assert_eq!((status.stage, status.elapsed_s), (Stage::WaitForStart, None));
    assert!(status.has(flag::START_SET));
}

#[test]
fn a_start_three_seconds_ahead_still_flies() {
    let field = Field::new();
    let world = field.world();
    let mut crew = Crew::prepared(&world, 1);
    let start = crew.start_in(3.0);
    crew.run_until(start + 10.0);
    assert_eq!(crew.status(1).stage, Stage::Performing);
    crew.run_until(start + 60.0);
    assert_eq!(crew.status(1).stage, Stage::Landed);
}

#[test]
fn authorization_alone_can_take_the_mode() {
    let field = Field::new();
    let world = field.world();
    let mut crew = Crew::prepared(&world, 1);
    crew.long(1, 176, [1.0, 0.0]);
    crew.set(1, "SHOW_MODE_BOOT", 2.0);
    crew.run_for(1.0);
    assert_eq!((crew.vehicle(1).mode(), crew.status(1).stage), (0, Stage::Off));
    crew.start_in(40.0);
    crew.run_for(2.0);
    assert_eq!((crew.vehicle(1).mode(), crew.status(1).stage), (127, Stage::WaitForStart));
}

#[test]
fn a_low_fence_sends_it_home() {
    let field = Field::new();
    let world = field.world();
    let mut crew = Crew::prepared(&world, 1);
    crew.set(1, "FENCE_ENABLE", 1.0);
    crew.set(1, "FENCE_TYPE", 1.0);
    crew.set(1, "FENCE_ALT_MAX", 10.0);
    let start = crew.start_in(20.0);
    crew.run_until(start + 17.0);
    assert!(crew.texts.iter().any(|text| text == "Fence Breached"));
    assert_eq!((crew.vehicle(1).mode(), crew.status(1).stage), (6, Stage::Off));
    let high = crew.vehicle(1).position_m().z;
    assert!(high > 12.0, "it rises to RTL_ALT, not only {high} m");
    crew.run_until(start + 120.0);
    assert!(!crew.is_armed(1));
    let place = crew.vehicle(1).position_m();
    assert!(place.norm() < 1.5, "it lands at home, not at {place}");
}

#[test]
fn a_drone_in_flight_returns_or_lands_when_told() {
    let field = Field::new();
    let world = field.world();
    // By mode, as we do, and by the commands of other stations.
    let orders =
        [(176, [1.0, 6.0], 0.0), (176, [1.0, 9.0], 9.0), (20, [0.0; 2], 0.0), (21, [0.0; 2], 9.0)];
    for (order, params, far_m) in orders {
        let mut crew = Crew::prepared_with(&world, 1, &sideways());
        let start = crew.start_in(20.0);
        crew.run_until(start + 18.0);
        assert_eq!(crew.status(1).stage, Stage::Performing);
        assert_eq!(crew.long(1, show::RELOAD, [0.0, 0.0]), MavResult::MAV_RESULT_FAILED);
        assert_eq!(crew.long(1, 246, [1.0, 0.0]), MavResult::MAV_RESULT_FAILED);
        assert_eq!(crew.long(1, order, params), MavResult::MAV_RESULT_ACCEPTED);
        crew.run_for(1.0);
        assert_eq!(crew.status(1).stage, Stage::Off);
        crew.run_for(90.0);
        assert!(!crew.is_armed(1));
        let away_m = crew.vehicle(1).position_m().xy().norm();
        assert!((away_m - far_m).abs() < 2.5, "order {order} {params:?}: {away_m} m from home");
    }
}

#[test]
fn a_reboot_keeps_files_and_parameters_and_forgets_the_rest() {
    let field = Field::new();
    let world = field.world();
    let mut crew = Crew::prepared(&world, 1);
    crew.set(1, "RTL_ALT", 3000.0);
    crew.start_in(200.0);
    crew.run_for(1.0);
    assert!(crew.status(1).has(flag::START_SET | flag::AUTHORIZED));
    assert_eq!(crew.long(1, 246, [1.0, 0.0]), MavResult::MAV_RESULT_ACCEPTED);
    crew.run_for(10.0);
    let status = crew.status(1);
    assert!(status.has(flag::LOADED | flag::ORIGIN_SET));
    assert!(!status.has(flag::START_SET) && !status.has(flag::AUTHORIZED));
    assert_eq!(crew.vehicle(1).params.get("RTL_ALT"), 3000.0);
    assert_eq!(status.boot_count, 2);
}

#[test]
fn a_fence_goes_up_and_comes_down_and_keeps_a_drone_on_the_ground() {
    let field = Field::new();
    let world = field.world();
    let mut crew = Crew::prepared(&world, 1);
    let square = |around: [f64; 2]| {
        [[-30.0, -30.0], [30.0, -30.0], [30.0, 30.0], [-30.0, 30.0]]
            .map(|[x, y]| Vector3::new(x + around[0], y + around[1], 0.0))
    };
    crew.upload_fence(1, &square([0.0, 0.0]), 4);
    // As the firmware asks: Skybrush Server knows no other request.
    assert_eq!((crew.count("MISSION_REQUEST"), crew.count("MISSION_REQUEST_INT")), (4, 0));
    assert_eq!(crew.mission_results(), [0]);
    assert_eq!(crew.download_fence(1).len(), 4);
    crew.set(1, "FENCE_TYPE", 4.0);
    crew.set(1, "FENCE_ENABLE", 1.0);
    crew.run_for(2.0);
    assert!(crew.status(1).has(flag::FENCE_ON));
    assert!(crew.is_ready(1));
    crew.upload_fence(1, &square([100.0, 0.0]), 4);
    crew.run_for(2.0);
    assert!(!crew.is_ready(1));
    // A polygon whose vertices say another number.
    crew.heard.clear();
    crew.upload_fence(1, &square([0.0, 0.0]), 5);
    assert_ne!(crew.mission_results(), [0]);
    assert_eq!(crew.download_fence(1).len(), 4, "the one before stays");
}

#[test]
fn stock_firmware_has_no_show() {
    let field = Field::new();
    let world = field.world();
    let mut crew = Crew::new(&world, 1, |setup| setup.stock = true);
    crew.run_until(5.0);
    assert_eq!(crew.count("DATA16"), 0);
    assert_eq!(crew.long(1, show::RELOAD, [0.0, 0.0]), MavResult::MAV_RESULT_UNSUPPORTED);
    assert_eq!(crew.long(1, 176, [1.0, 127.0]), MavResult::MAV_RESULT_FAILED);
    assert!(!crew.has_folder(1, "/collmot"));
    assert_eq!(crew.long(1, 512, [148.0, 0.0]), MavResult::MAV_RESULT_ACCEPTED);
    assert_eq!(crew.capabilities() & show::CAPABILITY, 0);
}

#[test]
fn the_show_firmware_says_what_it_can() {
    let field = Field::new();
    let world = field.world();
    let mut crew = Crew::new(&world, 1, |_| {});
    crew.run_until(5.0);
    assert_eq!(crew.long(1, 512, [148.0, 0.0]), MavResult::MAV_RESULT_ACCEPTED);
    // ArduCopter 4.4 with show mode, without terrain: a station that misses one of them takes the
    // drone for another.
    assert_eq!(crew.capabilities(), 0x0400_F9EF);
    let version = crew.heard.iter().find_map(|(_, message)| match message {
        MavMessage::AUTOPILOT_VERSION(version) => Some(version.flight_sw_version),
        _ => None,
    });
    assert_eq!(version, Some(0x0404_04FF), "4.4.4, official");
}

#[test]
fn messages_for_another_are_left_alone() {
    let field = Field::new();
    let world = field.world();
    let mut crew = Crew::new(&world, 1, |_| {});
    crew.run_until(5.0);
    crew.send(
        1,
        MavMessage::PARAM_REQUEST_LIST(dialect::PARAM_REQUEST_LIST_DATA {
            target_system: 2,
            target_component: 1,
        }),
    );
    crew.run_for(1.0);
    assert_eq!(crew.count("PARAM_VALUE"), 0);
}

#[test]
fn nine_fly_a_short_show_together() {
    let field = Field::new();
    let world = field.world();
    let mut crew = Crew::prepared(&world, 9);
    let start = crew.start_in(20.0);
    crew.run_until(start + 10.0);
    for system in 1..=9 {
        assert_eq!(crew.status(system).stage, Stage::Performing, "drone {system}");
    }
    crew.run_until(start + 70.0);
    for system in 1..=9 {
        assert_eq!(crew.status(system).stage, Stage::Landed, "drone {system}");
        assert_eq!(crew.vehicle(system).flown.len(), 1);
        assert!(crew.log(system, "00000001.BIN").len() > 50_000);
    }
    assert_eq!(crew.net.heard().len(), 9);
}
