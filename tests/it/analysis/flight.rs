//! Logs of the real show firmware as flights: channels, alignment, and what happens when messages
//! are missing.

#![expect(clippy::unwrap_used, reason = "this is test code")]

use std::fs;
use std::path::Path;

use crate::analysis::support::{LADDER_START_S, Synthetic, fixture, ladder, renamed};
use updraft::base::time::GpsTime;
use updraft::flight::{Alignment, Flight, FlightError, FlightOptions, identify};
use updraft::log::Log;

fn bytes() -> Vec<u8> {
    fs::read(fixture("ladder-still.trimmed.BIN")).unwrap()
}

fn load(bytes: Vec<u8>, options: FlightOptions<'_>) -> Result<Flight, FlightError> {
    Flight::from_log(&Log::from_bytes(bytes), Path::new("07.BIN"), options)
}

/// Board time of the show's start, from the SHOW rows.
const OFFSET_S: f64 = 86.1585;

#[test]
fn a_show_log_is_read_with_its_own_clock() {
    let flight = load(bytes(), FlightOptions::default()).unwrap();
    assert_eq!(flight.clock.method, Alignment::ShowRows);
    assert!((flight.clock.offset_s - OFFSET_S).abs() < 0.001, "{:?}", flight.clock);
    assert!(flight.clock.residual_s < 0.002, "{:?}", flight.clock);
    let start = flight.clock.start.unwrap();
    assert_eq!(start.week, 2445);
    let seconds = f64::from(start.tow_ms) / 1000.0;
    assert!((seconds - f64::from(LADDER_START_S)).abs() < 0.05, "{start}");
    assert_eq!(flight.system_id, Some(1));
    assert!(flight.stages.iter().any(|(time, stage)| *stage == 4 && (time - 2.2).abs() < 0.2));
    assert_eq!(flight.armed_s.len(), 1);
    assert!((flight.armed_s[0].1 - 458.77).abs() < 0.05, "{:?}", flight.armed_s);
    assert!((flight.pulse_limits_us.1 - 1950.0).abs() < 0.01);
    // Up is positive: at 395 s the drone climbs with 3.5 m/s, 70 m above its home.
    assert!((flight.velocity_up_mps.at(395.0, 1.0).unwrap() - 3.5).abs() < 0.02);
    assert!((flight.height_m.at(395.0, 1.0).unwrap() - 72.5).abs() < 1.0);
    assert!((flight.height_m.at(-5.0, 1.0).unwrap()).abs() < 0.1);
    assert!((flight.voltage_v.unwrap().at(100.0, 2.0).unwrap() - 12.588).abs() < 0.01);
    assert_eq!(flight.warnings, []);
}

#[test]
fn motors_that_lift_nothing_are_no_flight() {
    let log = Synthetic {
        system_id: 1,
        duration_s: 60.0,
        velocity_up_mps: |_| 0.0,
        pulse_us: Box::new(|time| if time < 3.0 { 1000.0 } else { 1600.0 }),
    };
    let error = load(log.write(), FlightOptions::default()).unwrap_err().to_string();
    assert_eq!(
        error,
        "07.BIN: no flight in this log: the motors ran, but the vehicle never rose 0.5 m above the \
         ground"
    );
}

#[test]
fn a_log_that_ends_in_the_air_says_so() {
    assert_eq!(load(bytes(), FlightOptions::default()).unwrap().cut_off_at_m, None);
    let log = Synthetic {
        system_id: 1,
        duration_s: 60.0,
        velocity_up_mps: |time| if time > 3.0 { 0.5 } else { 0.0 },
        pulse_us: Box::new(|time| if time < 3.0 { 1000.0 } else { 1600.0 }),
    };
    let flight = load(log.write(), FlightOptions::default()).unwrap();
    assert!((flight.cut_off_at_m.unwrap() - 28.5).abs() < 0.2, "{:?}", flight.cut_off_at_m);
    assert!(flight.warnings.iter().any(|warning| warning.to_string().contains("ends in the air")));
}

#[test]
fn home_is_where_the_flight_was_armed() {
    let identity = identify(&Log::from_bytes(bytes()));
    let (lat, lon) = identity.home_deg.unwrap();
    assert!((lat + 35.363_261).abs() < 1e-5 && (lon - 149.165_23).abs() < 1e-5);
    assert!(identity.flew);
}

#[test]
fn without_show_rows_the_start_comes_from_gps_time() {
    let start = GpsTime { week: 2445, tow_ms: LADDER_START_S * 1000 };
    let options = FlightOptions { start: Some(start), ..FlightOptions::default() };
    let flight = load(renamed(&bytes(), *b"SHOW", *b"SHOX"), options).unwrap();
    assert_eq!(flight.clock.method, Alignment::GpsTime);
    assert!((flight.clock.offset_s - OFFSET_S).abs() < 0.05, "{:?}", flight.clock);
    assert_eq!(flight.clock.start, Some(start));
}

#[test]
fn a_start_time_of_another_day_is_refused() {
    let start = GpsTime { week: 2400, tow_ms: 0 };
    let options = FlightOptions { start: Some(start), ..FlightOptions::default() };
    let flight = load(renamed(&bytes(), *b"SHOW", *b"SHOX"), options).unwrap();
    assert_eq!(flight.clock.method, Alignment::Takeoff);
    assert!(flight.warnings.iter().any(|w| w.to_string().contains("away from this flight")));
}

#[test]
fn without_any_clock_the_plan_is_matched() {
    let segments = ladder(1.0);
    let options = FlightOptions { segments: Some(&segments), ..FlightOptions::default() };
    let hidden = renamed(&renamed(&bytes(), *b"SHOW", *b"SHOX"), *b"GPS\0", *b"GPX\0");
    let flight = load(hidden.clone(), options).unwrap();
    assert_eq!(flight.clock.method, Alignment::Plan);
    let error = flight.clock.offset_s - OFFSET_S;
    println!("by the desired velocity: {error:+.3} s, residual {}", flight.clock.residual_s);
    assert!(error.abs() < 0.1, "{error}");
    assert!(flight.clock.residual_s < 0.1, "{:?}", flight.clock);

    let measured = renamed(&renamed(&hidden, *b"PSCD", *b"PSCX"), *b"CTUN", *b"CTUX");
    let flight = load(measured, options).unwrap();
    assert_eq!(flight.clock.method, Alignment::Plan);
    assert!(flight.desired_up_mps.is_none());
    let error = flight.clock.offset_s - OFFSET_S;
    println!("by the measured velocity: {error:+.3} s, residual {}", flight.clock.residual_s);
    assert!(error.abs() < 0.1, "{error}");
}

#[test]
fn a_plan_that_was_not_flown_is_not_matched() {
    let segments = ladder(-1.0);
    let options = FlightOptions { segments: Some(&segments), ..FlightOptions::default() };
    let hidden = renamed(&renamed(&bytes(), *b"SHOW", *b"SHOX"), *b"GPS\0", *b"GPX\0");
    let flight = load(hidden, options).unwrap();
    assert_eq!(flight.clock.method, Alignment::Takeoff);
    assert!(
        flight.warnings.iter().any(|w| w.to_string().contains("does not match the plan")),
        "{flight:?}"
    );
    // Seconds since the drone left the ground, which it did 1.3 s after the show's start.
    assert!((flight.clock.offset_s - OFFSET_S - 1.2).abs() < 0.5, "{:?}", flight.clock);
}

#[test]
fn older_message_names_are_read() {
    let old = renamed(&renamed(&bytes(), *b"XKF1", *b"NKF1"), *b"BAT\0", *b"CURR");
    let flight = load(old, FlightOptions::default()).unwrap();
    assert!((flight.velocity_up_mps.at(395.0, 1.0).unwrap() - 3.5).abs() < 0.02);
    assert!((flight.voltage_v.unwrap().at(100.0, 2.0).unwrap() - 12.588).abs() < 0.01);
}

#[test]
fn a_missing_message_is_named_with_its_remedy() {
    for (hidden, named, remedy) in [
        (b"RCOU", "motor outputs (RCOU)", "LOG_BITMASK"),
        (b"XKF1", "vertical velocity of the position filter (XKF1, NKF1 or EKF1)", "LOG_BITMASK"),
        (b"ATT\0", "attitude (ATT)", "LOG_BITMASK"),
    ] {
        let error =
            load(renamed(&bytes(), *hidden, *b"XXXX"), FlightOptions::default()).unwrap_err();
        let text = error.to_string();
        assert!(text.contains("07.BIN") && text.contains(named), "{text}");
        assert!(text.contains(remedy), "{text}");
    }
    let empty = load(Vec::new(), FlightOptions::default()).unwrap_err().to_string();
    assert!(empty.contains("the log is empty"), "{empty}");
}

#[test]
fn a_log_that_ends_on_the_ground_is_no_flight() {
    // The vehicle arms 7 s before the start and idles until take-off; 20 kB of definitions go ahead.
    let all = bytes();
    let mut shortest = None;
    for length in (20_000..all.len()).step_by(4000) {
        match load(all[..length].to_vec(), FlightOptions::default()) {
            Ok(flight) => {
                shortest = Some((length, flight));
                break;
            }
            Err(FlightError::NoFlight { reason, .. }) => assert!(!reason.is_empty()),
            Err(FlightError::Missing { .. } | FlightError::Empty { .. }) => {}
            Err(other) => panic!("{other}"),
        }
    }
    let (length, flight) = shortest.unwrap();
    let (_, last) = flight.effort.values.span().unwrap();
    assert!((0.0..12.0).contains(&last), "{length} bytes reach to {last} s");
}

#[test]
fn two_boots_in_one_file_are_told_apart() {
    let once = load(bytes(), FlightOptions::default()).unwrap();
    let mut twice = bytes();
    twice.extend(bytes());
    let flight = load(twice, FlightOptions::default()).unwrap();
    assert!(
        flight.warnings.iter().any(|w| w.to_string().contains("2 boots")),
        "{:?}",
        flight.warnings
    );
    assert_eq!(flight.effort.values, once.effort.values);
    assert_eq!(flight.velocity_up_mps, once.velocity_up_mps);
    assert_eq!(flight.clock, once.clock);
}

#[test]
fn damage_never_panics() {
    let all = bytes();
    for seed in 0..40_usize {
        let mut damaged = all.clone();
        for step in 0..200_usize {
            let at = (seed * 7919 + step * 104_729 + step * step * 31) % damaged.len();
            damaged[at] ^= 1 << (step % 8);
        }
        damaged.truncate(all.len() - seed * 17_321);
        if let Ok(flight) = load(damaged, FlightOptions::default()) {
            for series in [&flight.effort.values, &flight.velocity_up_mps, &flight.roll_rad] {
                assert!(series.time_s.is_sorted(), "times increase");
                assert!(series.value.iter().all(|value| value.is_finite()));
            }
        }
    }
}

/// Real logs of other firmware, where a checkout has them beside it.
#[test]
fn other_peoples_logs_load() {
    let Ok(folder) = std::env::var("UPDRAFT_SHARED_DATA") else { return };
    let real = |name: &str| {
        let path = Path::new(&folder).join("real").join(name);
        Flight::open(&path, FlightOptions::default()).unwrap()
    };
    let copter3 = real("copter3-rtl.BIN");
    assert_eq!(copter3.clock.method, Alignment::Takeoff);
    assert!((copter3.pulse_limits_us.0 - 1222.1).abs() < 0.1, "limits from RC3_MIN and RC3_MAX");
    assert!((copter3.voltage_v.unwrap().value[0] - 13.06).abs() < 0.01);
    let fastest = copter3.velocity_up_mps.value.iter().copied().fold(f64::MIN, f64::max);
    assert!((fastest - 2.417).abs() < 0.01, "{fastest}");
    let copter44 = real("copter4.4-sitl-baseline.BIN");
    let highest = copter44.height_m.value.iter().copied().fold(f64::MIN, f64::max);
    assert!((highest - 3.02).abs() < 0.02, "{highest}");
}
