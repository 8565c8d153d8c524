//! Windows: tilt, the rules for finding them, and why they are rejected.

use updraft::analysis::result::Rejection;
use updraft::analysis::windows::{
    Target, Tilt, WindowOptions, contradiction, correct_tilt, inferred, measure,
};
use updraft::flight::{Effort, Flight, Indicator, Series};
use updraft::mission::plan::SegmentKind;

fn series(duration_s: f64, value: impl Fn(f64) -> f64) -> Series {
    let time_s: Vec<f64> = (0..(duration_s * 10.0) as i32).map(|i| f64::from(i) / 10.0).collect();
    Series { value: time_s.iter().map(|time| value(*time)).collect(), time_s }
}

/// A level flight of 100 s at 1550 us with a command.
fn flight(command: impl Fn(f64) -> f64 + Copy) -> Flight {
    Flight {
        velocity_up_mps: series(100.0, command),
        effort: Effort { values: series(100.0, |_| 1550.0), ..Effort::default() },
        pulse_max_us: series(100.0, |_| 1560.0),
        pulse_min_us: series(100.0, |_| 1540.0),
        roll_rad: series(100.0, |_| 0.0),
        pitch_rad: series(100.0, |_| 0.0),
        desired_up_mps: Some(series(100.0, command)),
        armed_s: vec![(0.0, 100.0)],
        pulse_limits_us: (1150.0, 1950.0),
        ..Flight::default()
    }
}

fn leg(start_s: f64, end_s: f64, commanded_mps: f64) -> Target {
    Target { kind: SegmentKind::LegUp, label: "up".to_owned(), start_s, end_s, commanded_mps }
}

fn rejections(flight: &Flight, target: &Target) -> Vec<Rejection> {
    let options = WindowOptions::default();
    let corrected = correct_tilt(flight, &options);
    measure(flight, &corrected, std::slice::from_ref(target), &options).remove(0).rejected
}

#[test]
fn tilt_is_that_of_the_rotor_axis_and_both_forms_use_it() {
    let mut tilted = flight(|_| 0.0);
    tilted.roll_rad = series(100.0, |_| 10_f64.to_radians());
    tilted.pitch_rad = series(100.0, |_| -6_f64.to_radians());
    // tan² phi = tan² 10° + tan² 6° (0.031091 + 0.011047): phi = 11.6005°, cos phi = 0.979574.
    // 550 us: linear in thrust 538.77 us; to its power 0.55, 550 cos^0.55 = 543.79 us.
    let forms = [
        (Tilt::Paper, None, 1518.34),
        (Tilt::Thrust, Some(1.0), 1538.77),
        (Tilt::Thrust, None, 1543.79),
    ];
    for (tilt, thrust_exponent, expected) in forms {
        let options = WindowOptions { tilt, thrust_exponent, ..WindowOptions::default() };
        let corrected = correct_tilt(&tilted, &options);
        assert_eq!(corrected.effort.len(), 1000);
        let pulse = corrected.effort.at(50.0, 1.0).unwrap();
        assert!((pulse - expected).abs() < 0.01, "{tilt:?}: {pulse}");
        assert!((corrected.tilt_deg.at(50.0, 1.0).unwrap() - 11.6005).abs() < 0.001);
    }
}

#[test]
fn attitude_is_interpolated_to_the_pulses_and_not_across_gaps() {
    let mut sparse = flight(|_| 0.0);
    // Pitch grows 1 degree per second, logged once a second, with a hole from 50 s to 60 s.
    let times: Vec<f64> =
        (0..100).map(f64::from).filter(|time| !(50.5..59.5).contains(time)).collect();
    let pitch = times.iter().map(|time| (time * 0.1).to_radians()).collect();
    sparse.pitch_rad = Series { time_s: times, value: pitch };
    let tilt = correct_tilt(&sparse, &WindowOptions::default()).tilt_deg;
    assert!((tilt.at(20.5, 0.2).unwrap() - 2.05).abs() < 1e-9);
    assert!(tilt.between(51.2, 59.9).is_empty(), "no attitude, no corrected pulse");
}

#[test]
fn windows_are_found_in_the_commands_of_the_log() {
    // Standing, a climb of 10 s, hover, a leg of 20 s, hover, a descent of 20 s, level to the end.
    let command = |time: f64| match time {
        t if t < 10.0 => 2.0,
        t if t < 20.0 => 0.0,
        t if t < 40.0 => 1.5,
        t if t < 50.0 => 0.0,
        t if t < 70.0 => -1.5,
        _ => 0.0,
    };
    let mut flown = flight(command);
    flown.desired_horizontal_mps = Some(series(100.0, |time| if time < 70.0 { 0.0 } else { 3.0 }));
    let found: Vec<(SegmentKind, f64, f64, f64)> = inferred(&flown)
        .into_iter()
        .map(|target| (target.kind, target.start_s, target.end_s, target.commanded_mps))
        .collect();
    assert_eq!(
        found,
        [
            (SegmentKind::Hover, 13.0, 19.0, 0.0),
            (SegmentKind::LegUp, 30.0, 39.0, 1.5),
            (SegmentKind::Hover, 43.0, 49.0, 0.0),
            (SegmentKind::LegDown, 60.0, 69.0, -1.5),
            (SegmentKind::Horizontal, 73.0, 98.9, 0.0),
        ]
    );
}

#[test]
fn a_vehicle_that_stands_has_no_windows() {
    let mut standing = flight(|_| 0.0);
    standing.effort.values = series(100.0, |_| 1100.0);
    assert!(inferred(&standing).is_empty());
    // Also where power is the effort: it flies by its pulses, and stands by them.
    let power = |pulse_us: f64| Flight {
        effort: Effort { indicator: Indicator::Power, values: series(100.0, |_| 90.0) },
        pulse_max_us: series(100.0, |_| pulse_us),
        ..flight(|_| 0.0)
    };
    assert_eq!((inferred(&power(1560.0)).len(), inferred(&power(1110.0)).len()), (1, 0));
    let mut disarmed = flight(|_| 0.0);
    disarmed.armed_s = vec![(0.0, 1.0)];
    assert!(inferred(&disarmed).is_empty());
}

#[test]
fn each_reason_to_reject_a_window_is_found() {
    let good = flight(|_| 1.0);
    assert_eq!(rejections(&good, &leg(30.0, 39.0, 1.0)), []);
    assert_eq!(rejections(&good, &leg(30.0, 39.0, 1.31)), [Rejection::NotFollowing]);
    assert_eq!(rejections(&good, &leg(95.0, 104.0, 1.0)), [Rejection::Incomplete]);

    let mut high = flight(|_| 1.0);
    high.pulse_max_us =
        series(100.0, |time| if (35.0..35.15).contains(&time) { 1949.0 } else { 1900.0 });
    assert_eq!(rejections(&high, &leg(30.0, 39.0, 1.0)), [Rejection::Saturated]);
    assert_eq!(rejections(&high, &leg(40.0, 49.0, 1.0)), []);
    let mut low = flight(|_| 1.0);
    low.pulse_min_us = series(100.0, |_| 1150.0);
    assert_eq!(rejections(&low, &leg(30.0, 39.0, 1.0)), [Rejection::Saturated]);

    let mut holed = flight(|_| 1.0);
    let keep = |time: f64| !(33.0..34.5).contains(&time);
    holed.effort.values.value.truncate(0);
    holed.effort.values.time_s.retain(|time| keep(*time));
    holed.effort.values.value.resize(holed.effort.values.time_s.len(), 1550.0);
    assert_eq!(rejections(&holed, &leg(30.0, 39.0, 1.0)), [Rejection::Gap]);
    assert_eq!(rejections(&holed, &leg(36.0, 45.0, 1.0)), []);
}

#[test]
fn a_plan_is_contradicted_by_most_of_its_legs_only() {
    let climbing = flight(|_| 1.0);
    let (right, wrong) = (leg(10.0, 19.0, 1.0), leg(30.0, 39.0, -1.0));
    assert_eq!(contradiction(&climbing, &[right.clone(), wrong.clone()]), None);
    let text = contradiction(&climbing, &[right, wrong.clone(), wrong]).unwrap().to_string();
    assert!(text.contains("2 of 3 legs") && text.contains("flown 1.00 m/s"), "{text}");
    assert_eq!(contradiction(&climbing, &[]), None);
}
