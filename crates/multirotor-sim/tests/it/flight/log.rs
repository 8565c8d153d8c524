//! What the simulator writes: repeatable bytes, and rows that say what was flown.

use std::sync::atomic::{AtomicBool, Ordering};

use dataflash::time::GpsTime;
use dataflash::{Log, Select, Table};
use multirotor_sim::sim::{
    FlightSetup, FlightSummary, Hooks, SimError, Uniform, fly, fly_to_file, fly_without_log,
};
use multirotor_sim::vehicle::Vehicle;
use multirotor_sim::vehicle::library::builtin;
use nalgebra::Vector3;
use skybrush_show::frame::{Geodetic, ShowFrame};
use skybrush_show::{Segment, SegmentPath, Trajectory};

fn vehicle() -> Vehicle {
    builtin("airsim-generic-quad").expect("a built-in vehicle")
}

/// Up to 10 m, a 20 m leg along show x, up 1 m/s, down again, 2.5 m at the end.
fn short_show(home_m: Vector3<f64>) -> Trajectory {
    let at = |x: f64, z: f64| SegmentPath::Line(home_m + Vector3::new(x, 0.0, z));
    let piece = |duration_ms, path| Segment { duration_ms, path };
    Trajectory {
        start_m: home_m,
        segments: vec![
            piece(5_000, at(0.0, 10.0)),
            piece(5_000, SegmentPath::Hold),
            piece(10_000, at(20.0, 10.0)),
            piece(5_000, SegmentPath::Hold),
            piece(10_000, at(20.0, 20.0)),
            piece(5_000, SegmentPath::Hold),
            piece(7_000, at(20.0, 2.5)),
        ],
    }
}

fn setup<'a>(
    vehicle: &'a Vehicle,
    trajectory: &'a Trajectory,
    atmosphere: &'a Uniform,
    drone: u16,
) -> FlightSetup<'a> {
    let origin = Geodetic { lat_deg: 47.4733, lon_deg: 19.0621, amsl_m: 190.0 };
    FlightSetup {
        vehicle,
        trajectory,
        home_m: trajectory.start_m,
        frame: ShowFrame { origin, orientation_deg: 90.0 },
        atmosphere,
        seed: 7,
        drone,
        start: GpsTime { week: 2445, tow_ms: 442_755_000 },
        lights: &[],
        full_logs: false,
        hooks: Hooks::default(),
    }
}

fn flown(seed: u64, drone: u16, full_logs: bool) -> (Vec<u8>, FlightSummary) {
    let (vehicle, air) = (vehicle(), Uniform::default());
    let trajectory = short_show(Vector3::new(7.0, 14.0, 0.0));
    let setup = FlightSetup { seed, full_logs, ..setup(&vehicle, &trajectory, &air, drone) };
    let mut bytes = Vec::new();
    let summary = fly(&setup, &mut bytes).expect("a flight");
    (bytes, summary)
}

fn table(bytes: &[u8], message: &str, fields: &[&str]) -> Table {
    let log = Log::from_bytes(bytes.to_vec());
    let (mut tables, stats) = log.select(&[Select { message, fields }]);
    assert_eq!(stats.bad_bytes, 0);
    tables.remove(0)
}

fn column(table: &Table, field: &str) -> Vec<f64> {
    table.number(field).unwrap_or_else(|| panic!("{} has no {field}", table.message)).to_vec()
}

#[test]
fn same_seed_same_bytes() {
    let (first, _) = flown(7, 3, false);
    assert!(first == flown(7, 3, false).0, "two runs of one setup differ");
    assert!(first != flown(8, 3, false).0, "another seed gives the same log");
    assert!(first != flown(7, 4, false).0, "another drone gives the same log");
}

#[test]
fn the_log_says_what_was_flown() {
    let (bytes, summary) = flown(7, 3, false);
    let show = table(&bytes, "SHOW", &["TimeUS", "ClockMS", "Stage", "HDist", "VDist"]);
    let (time, clock) = (column(&show, "TimeUS"), column(&show, "ClockMS"));
    let offset_s = time[0] / 1e6 - clock[0] / 1e3;
    for (time, clock) in time.iter().zip(&clock) {
        assert!((time / 1e6 - clock / 1e3 - offset_s).abs() < 1.1e-3);
    }
    // Armed 8 s before the take-off time; 25 Hz.
    assert!((clock[0] / 1e3 - (summary.takeoff_s - 8.0)).abs() < 3e-3, "{}", clock[0]);
    assert!((time[1] - time[0] - 40_000.0).abs() < 1.0);
    let mut stages = column(&show, "Stage");
    stages.dedup();
    assert_eq!(stages, [2.0, 3.0, 4.0, 7.0, 8.0]);

    // In the climb of 1 m/s from 25 to 35 s: up is negative down, and height rises.
    let ekf = table(&bytes, "XKF1", &["TimeUS", "C", "VD", "PD", "PN", "PE", "Yaw"]);
    let at = |table: &Table, show_s: f64| {
        let times = column(table, "TimeUS");
        times.iter().position(|time| time / 1e6 - offset_s >= show_s).unwrap()
    };
    let row = at(&ekf, 33.0);
    assert!((column(&ekf, "VD")[row] + 1.0).abs() < 0.1);
    assert!((column(&ekf, "PD")[row] + 18.0).abs() < 0.3);
    // Show x points east; home is the origin of the EKF.
    assert!((column(&ekf, "PE")[row] - 20.0).abs() < 0.3);
    assert!(column(&ekf, "PN")[row].abs() < 0.3);
    assert!((column(&ekf, "Yaw")[row] - 90.0).abs() < 3.0);

    let pulses = table(&bytes, "RCOU", &["TimeUS", "C1", "C2", "C3", "C4", "C5"]);
    let row = at(&pulses, 33.0);
    let mean = ["C1", "C2", "C3", "C4"].map(|c| column(&pulses, c)[row]).iter().sum::<f64>() / 4.0;
    assert!((mean - 1606.0).abs() < 8.0, "{mean}");
    assert_eq!(column(&pulses, "C5")[row], 0.0);
    assert!(column(&pulses, "C1").iter().all(|pulse| pulse.fract() == 0.0));

    // GPS time and the show clock agree to the age of a fix.
    let gps = table(&bytes, "GPS", &["TimeUS", "GMS", "GWk", "Alt", "VZ"]);
    for (time, ms) in column(&gps, "TimeUS").iter().zip(column(&gps, "GMS")) {
        let late_s = (time / 1e6 - offset_s) - (ms / 1e3 - 442_755.0);
        assert!((0.015..0.04).contains(&late_s), "{late_s}");
    }
    let control = table(&bytes, "PSCD", &["TimeUS", "TPD", "PD", "DVD", "VD"]);
    assert!((column(&control, "DVD")[at(&control, 33.0)] + 1.0).abs() < 0.05);
    let target = table(&bytes, "GUIP", &["TimeUS", "Type", "pX", "pY", "pZ", "vZ"]);
    let row = at(&target, 33.0);
    assert!((column(&target, "pZ")[row] - 1800.0).abs() < 15.0);
    assert!((column(&target, "pY")[row] - 2000.0).abs() < 1.0);
    assert_eq!(column(&target, "vZ")[row], 100.0);

    let parameters = table(&bytes, "PARM", &["Name", "Value"]);
    let names = parameters.text("Name").unwrap();
    let id = names.iter().position(|name| name == "SYSID_THISMAV").unwrap();
    assert_eq!(column(&parameters, "Value")[id], 3.0);
    assert!(names.is_sorted(), "parameters are listed in order");
    let events = column(&table(&bytes, "EV", &["Id"]), "Id");
    assert_eq!(events, [57.0, 15.0, 28.0, 17.0, 18.0, 11.0, 56.0]);
    assert!(summary.log_rows > 1_000);
}

#[test]
fn rates_are_the_firmwares() {
    let (bytes, _) = flown(7, 3, true);
    let rate = |message: &str, field: &str| {
        let table = table(&bytes, message, &["TimeUS", field]);
        let time = column(&table, "TimeUS");
        (time.len() - 1) as f64 / (time[time.len() - 1] - time[0]) * 1e6
    };
    for (message, field, hz) in [
        ("SHOW", "Stage", 25.0),
        ("ATT", "Roll", 10.0),
        ("RATE", "R", 10.0),
        ("RCOU", "C1", 10.0),
        ("RCIN", "C1", 10.0),
        ("BAT", "Volt", 10.0),
        ("CTUN", "Alt", 10.0),
        ("POS", "Lat", 10.0),
        ("PSCD", "VD", 10.0),
        ("GUIP", "pZ", 10.0),
        ("GPS", "GMS", 5.0),
        ("GPA", "HAcc", 5.0),
        ("IMU", "AccZ", 50.0),
        ("BARO", "Alt", 20.0),
        ("VIBE", "VibeX", 20.0),
        ("MAG", "MagX", 30.0),
        ("XKF1", "VD", 20.0),
        ("XKF4", "SV", 20.0),
        ("XKV1", "V00", 2.0),
        ("SIM2", "VD", 400.0),
    ] {
        let got = rate(message, field);
        assert!((got / hz - 1.0).abs() < 0.02, "{message}: {got} Hz instead of {hz}");
    }
    let imu = table(&bytes, "IMU", &["AccZ"]);
    assert!((column(&imu, "AccZ")[0] + 9.8).abs() < 0.3);
}

#[test]
fn a_full_log_is_of_the_same_flight() {
    let pulses = |full| column(&table(&flown(7, 3, full).0, "RCOU", &["C1"]), "C1");
    assert_eq!(pulses(false), pulses(true));
}

#[test]
fn a_stopped_flight_is_an_error() {
    let (vehicle, air) = (vehicle(), Uniform::default());
    let trajectory = short_show(Vector3::zeros());
    let stop = AtomicBool::new(false);
    let seen = std::sync::Mutex::new(Vec::new());
    let progress = |share: f64| {
        seen.lock().unwrap().push(share);
        stop.store(share > 0.5, Ordering::Relaxed);
    };
    let hooks = Hooks { progress: Some(&progress), stop: Some(&stop) };
    let setup = FlightSetup { hooks, ..setup(&vehicle, &trajectory, &air, 1) };
    let error = fly(&setup, Vec::new()).unwrap_err();
    assert!(matches!(error, SimError::Stopped { drone: 1, .. }), "{error}");
    assert!(seen.lock().unwrap().is_sorted());

    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("01.BIN");
    assert!(matches!(fly_to_file(&setup, &path), Err(SimError::Stopped { .. })));
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0, "nothing half-written");
}

#[test]
fn a_file_holds_what_was_flown() {
    let (vehicle, air) = (vehicle(), Uniform::default());
    let trajectory = short_show(Vector3::new(7.0, 14.0, 0.0));
    let setup = setup(&vehicle, &trajectory, &air, 3);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("logs/03.BIN");
    let summary = fly_to_file(&setup, &path).unwrap();
    assert!(std::fs::read(&path).unwrap() == flown(7, 3, false).0);
    assert_eq!(summary, flown(7, 3, false).1);

    let blocked = folder.path().join("logs/03.BIN/04.BIN");
    let error = fly_to_file(&setup, &blocked).unwrap_err();
    assert!(matches!(error, SimError::File { .. }), "{error}");
}

#[test]
fn a_full_disk_is_an_error() {
    struct Full(usize);
    impl std::io::Write for Full {
        fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
            if bytes.len() > self.0 {
                return Err(std::io::ErrorKind::StorageFull.into());
            }
            self.0 -= bytes.len();
            Ok(bytes.len())
        }
        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }
    let (vehicle, air) = (vehicle(), Uniform::default());
    let trajectory = short_show(Vector3::zeros());
    let setup = setup(&vehicle, &trajectory, &air, 1);
    for room in [0, 100_000] {
        let error = fly(&setup, Full(room)).unwrap_err();
        assert!(matches!(error, SimError::Log { .. }), "{error}");
    }
}

#[test]
fn refuses_what_the_firmware_refuses() {
    let (vehicle, air) = (vehicle(), Uniform::default());
    let mut low = short_show(Vector3::zeros());
    low.segments.truncate(0);
    let error = fly_without_log(&setup(&vehicle, &low, &air, 5)).unwrap_err();
    assert!(matches!(error, SimError::NoTakeoff { drone: 5, .. }), "{error}");
    assert!(matches!(
        fly(&setup(&vehicle, &low, &air, 5), Vec::new()),
        Err(SimError::NoTakeoff { .. })
    ));

    let trajectory = short_show(Vector3::zeros());
    let away = FlightSetup {
        home_m: Vector3::new(5.0, 0.0, 0.0),
        ..setup(&vehicle, &trajectory, &air, 5)
    };
    assert!(matches!(fly_without_log(&away), Err(SimError::NotAtStart { .. })));
    let nowhere =
        FlightSetup { home_m: Vector3::repeat(f64::NAN), ..setup(&vehicle, &trajectory, &air, 5) };
    assert!(matches!(fly_without_log(&nowhere), Err(SimError::NotFinite { .. })));
}

#[test]
fn a_horizontal_step_makes_the_firmwares_transient() {
    // Measured on the firmware: 0 to 1 m/s at most 0.37-0.43 m, 0 to 3.5 m/s 2.15-2.26 m.
    let (vehicle, air) = (vehicle(), Uniform::default());
    for (speed, low_m, high_m) in [(1.0, 0.3, 0.6), (3.5, 1.6, 2.8)] {
        let at = |x: f64, z: f64| SegmentPath::Line(Vector3::new(x, 0.0, z));
        let piece = |duration_ms, path| Segment { duration_ms, path };
        let trajectory = Trajectory {
            start_m: Vector3::zeros(),
            segments: vec![
                piece(10_000, at(0.0, 10.0)),
                piece(5_000, SegmentPath::Hold),
                piece(10_000, at(10.0 * speed, 10.0)),
                piece(5_000, SegmentPath::Hold),
                piece(7_500, at(10.0 * speed, 2.5)),
            ],
        };
        let summary = fly_without_log(&setup(&vehicle, &trajectory, &air, 1)).unwrap();
        let error_m = summary.max_error_xy_m;
        println!("{speed} m/s: {error_m:.2} m");
        assert!((low_m..high_m).contains(&error_m), "{speed} m/s: {error_m}");
    }
}

proptest::proptest! {
    #![proptest_config(proptest::prelude::ProptestConfig::with_cases(24))]
    #[test]
    fn any_show_in_any_bearable_wind_is_flown_and_landed(
        speed in 0.5..4.0_f64,
        height in 3.0..60.0_f64,
        side in -30.0..30.0_f64,
        wind in proptest::array::uniform3(-3.0..3.0_f64),
        ground in -20.0..20.0_f64,
        drone in 0_u16..=u16::MAX,
    ) {
        let home = Vector3::new(1.0, -2.0, ground);
        let at = |x: f64, z: f64| SegmentPath::Line(home + Vector3::new(x, 0.0, z));
        let piece = |metres: f64, path| {
            Segment { duration_ms: (metres / speed * 1000.0) as u32 + 1, path }
        };
        let trajectory = Trajectory {
            start_m: home,
            segments: vec![
                piece(height, at(0.0, height)),
                Segment { duration_ms: 8_000, path: SegmentPath::Hold },
                piece(side.abs(), at(side, height)),
                Segment { duration_ms: 3_000, path: SegmentPath::Hold },
                piece(height - 2.5, at(side, 2.5)),
            ],
        };
        let (vehicle, air) = (vehicle(), Uniform(Vector3::from(wind)));
        let summary = fly_without_log(&setup(&vehicle, &trajectory, &air, drone)).unwrap();
        let end_s = trajectory.duration_ms() as f64 / 1000.0;
        proptest::prop_assert!((summary.landing_s - end_s).abs() < 0.01);
        proptest::prop_assert!(summary.landed_s - end_s < 30.0, "{summary:?}");
        proptest::prop_assert!(summary.max_error_xy_m < 4.0, "{summary:?}");
        proptest::prop_assert!(summary.max_height_m < height + 6.0, "{summary:?}");
    }
}

#[test]
fn air_that_no_drone_can_fly_in_ends_the_flight() {
    let vehicle = vehicle();
    let trajectory = short_show(Vector3::zeros());
    let undefined = Uniform(Vector3::repeat(f64::NAN));
    let error = fly_without_log(&setup(&vehicle, &trajectory, &undefined, 1)).unwrap_err();
    assert!(matches!(error, SimError::Diverged { .. }), "{error}");
    let storm = Uniform(Vector3::new(0.0, 0.0, 15.0));
    let error = fly_without_log(&setup(&vehicle, &trajectory, &storm, 1)).unwrap_err();
    assert!(matches!(error, SimError::NotLanded { .. }), "{error}");
    let text = error.to_string();
    assert!(text.contains("more than the vehicle can hold") && text.contains("15.0 m/s"), "{text}");
    let sink = Uniform(Vector3::new(0.0, 0.0, -20.0));
    let error = fly_without_log(&setup(&vehicle, &trajectory, &sink, 1)).unwrap_err();
    assert!(error.to_string().contains("updraft -20.0 m/s"), "{error}");
}
