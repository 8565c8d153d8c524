//! Zipped CSV: there and back, and what is refused. Also what `inspect` says about a show.

use std::io::{Cursor, Read as _};

use super::common::{archive, trajectory, worked_example};
use nalgebra::Vector3;
use proptest::prelude::*;
use skybrush_show::csv::{self, CsvOptions};
use skybrush_show::derive::DeriveParams;
use skybrush_show::skyb::{self, SkybOptions};
use skybrush_show::summary::{summarise, summarise_skyb};
use skybrush_show::{Show, ShowDrone, lights, quantise};

fn show_of(drone: ShowDrone) -> Show {
    Show { drones: vec![drone], ..Show::default() }
}

#[test]
fn straight_flights_need_a_row_per_point() {
    let show = show_of(ShowDrone { lights: Vec::new(), ..worked_example() });
    let bytes = csv::write(&show, &CsvOptions::default()).unwrap();
    let mut text = String::new();
    zip::ZipArchive::new(Cursor::new(&bytes))
        .unwrap()
        .by_name("drone_01.csv")
        .unwrap()
        .read_to_string(&mut text)
        .unwrap();
    insta::assert_snapshot!(text, @"
    Time [msec],x [m],y [m],z [m],Red,Green,Blue
    0,0,0,0,0,0,0
    10000,0,0,10,0,0,0
    15000,0,0,10,0,0,0
    35000,20,0,10,0,0,0
    40000,20,0,10,0,0,0
    60000,0,0,10,0,0,0
    65000,0,0,10,0,0,0
    73000,0,0,2.5,0,0,0
    ");
    assert_eq!(csv::read(&bytes).unwrap().drones[0].trajectory, show.drones[0].trajectory);
}

#[test]
fn lights_survive_to_a_tenth_of_a_second() {
    let show = show_of(worked_example());
    let read = csv::read(&csv::write(&show, &CsvOptions::default()).unwrap()).unwrap();
    let color = |time_ms| lights::color_at(&read.drones[0].lights, time_ms);
    assert_eq!(color(0), [0, 255, 0]);
    assert_eq!(color(71_800), [0, 255, 0]);
    assert!(color(72_500)[1].abs_diff(128) <= 3, "{:?}", color(72_500));
    assert_eq!(color(73_100), [0, 0, 0]);
    for i in 0..=730 {
        let time_s = f64::from(i) / 10.0;
        let gap = read.drones[0].trajectory.state_at(time_s).position_m
            - show.drones[0].trajectory.state_at(time_s).position_m;
        assert!(gap.norm() < 1e-6);
    }
}

#[test]
fn drones_come_in_the_order_of_their_numbers() {
    let rows = |x: i32| format!("Time [msec],x [m],y [m],z [m]\n0,{x},0,0\n100,{x},0,1\n");
    let files = [("Drone 10.csv", rows(10)), ("Drone 9.csv", rows(9)), ("notes.txt", rows(0))];
    let files: Vec<(&str, &str)> =
        files.iter().map(|(name, text)| (*name, text.as_str())).collect();
    let show = csv::read(&archive(&files)).unwrap();
    let names: Vec<_> = show.drones.iter().map(|drone| drone.name.as_str()).collect();
    assert_eq!(names, ["Drone 9", "Drone 10"]);
    assert_eq!(show.drones[1].home_m, Some(Vector3::new(10.0, 0.0, 0.0)));
    assert!(show.drones[0].lights.is_empty());
}

#[test]
fn refuses_broken_rows_and_says_where() {
    let refusal = |rows: &str| {
        let text = format!("Time [msec],x [m],y [m],z [m],Red,Green,Blue\n{rows}");
        csv::read(&archive(&[("a.csv", &text)])).unwrap_err().to_string()
    };
    insta::assert_snapshot!(refusal(""), @"a.csv, line 2: there are no rows");
    insta::assert_snapshot!(refusal("0,0,0,0,0,0,0\n\n0,0,0,0,0,0,0\n"), @"a.csv, line 4: time stands still or goes back: 0 ms");
    insta::assert_snapshot!(refusal("40,0,0,0,0,0,0\n"), @"a.csv, line 2: the first time is 40 ms, not 0");
    insta::assert_snapshot!(refusal("0,0,zero,0,0,0,0\n"), @r#"a.csv, line 2: y is "zero", not a number"#);
    insta::assert_snapshot!(refusal("0,0,NaN,0,0,0,0\n"), @"a.csv, line 2: y is NaN: absurd");
    insta::assert_snapshot!(refusal("0,0\n"), @r#"a.csv, line 2: y is "", not a number"#);
    insta::assert_snapshot!(refusal("0.5,0,0,0,0,0,0\n"), @"a.csv, line 2: the time is 0.5 ms, not a whole number of milliseconds from 0");
    insta::assert_snapshot!(refusal("0,0,0,0,0,0,999\n"), @"a.csv, line 2: blue is 999: absurd");
    let text = |files| csv::read(&archive(files)).unwrap_err().to_string();
    insta::assert_snapshot!(text(&[("a.csv", "t;x;y;z\n")]), @r#"a.csv, line 1: the header must be "Time [msec],x [m],y [m],z [m],Red,Green,Blue""#);
    insta::assert_snapshot!(text(&[("a.txt", "")]), @"not a usable show archive (ZIP): it has 0 .csv entries, not 1 to 5000");
}

#[test]
fn a_summary_says_what_is_in_a_show() {
    let show = show_of(worked_example());
    let summary = summarise(&show, &DeriveParams::default());
    assert_eq!(summary.duration_s, 73.0);
    assert_eq!(summary.bounds_m, [[0.0, 0.0, 0.0], [20.0, 0.0, 10.0]]);
    assert_eq!((summary.speeds.horizontal_mps, summary.speeds.up_mps), (1.0, 1.0));
    assert_eq!(summary.drones[0].pieces, [3, 4, 0, 0]);
    let file = summary.drones[0].skyb.clone().unwrap();
    assert_eq!((file.file_bytes, file.scale_mm, file.deviation.max_position_m), (65, 1, 0.0));
    let bytes = skyb::write(&show.drones[0], &SkybOptions::default()).unwrap().bytes;
    let summary = summarise_skyb(&skyb::read(&bytes).unwrap(), &DeriveParams::default());
    insta::assert_json_snapshot!(summary);
}

#[test]
fn quantisation_is_reported_for_each_drone() {
    let mut crooked = worked_example();
    crooked.trajectory.start_m.x = 0.0004;
    let mut far = worked_example();
    far.trajectory.start_m.y = 9000.0;
    let show = Show { drones: vec![worked_example(), crooked, far], ..Show::default() };
    let report = quantise::report(&show, &SkybOptions::default());
    assert_eq!(report[0].as_ref().unwrap().deviation.max_position_m, 0.0);
    assert!((report[1].as_ref().unwrap().deviation.max_position_m - 0.0004).abs() < 1e-12);
    assert!(report[2].is_err());
    assert!((quantise::worst(&report).max_position_m - 0.0004).abs() < 1e-12);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn any_trajectory_comes_back_within_the_tolerance(mut trajectory in trajectory(true)) {
        trajectory.segments.truncate(4);
        for segment in &mut trajectory.segments {
            segment.duration_ms = segment.duration_ms % 20_000 + 3000;
        }
        let reach = trajectory.start_m.amax();
        let show = show_of(ShowDrone { trajectory, ..ShowDrone::default() });
        let read = csv::read(&csv::write(&show, &CsvOptions::default()).unwrap()).unwrap();
        let (a, b) = (&show.drones[0].trajectory, &read.drones[0].trajectory);
        prop_assert_eq!(a.duration_ms(), b.duration_ms());
        // Steps are not shorter than 1 ms: that bounds what kilometre-sized curves can keep.
        let limit = if reach < 200.0 { 0.0021 } else { 0.05 };
        for i in 0..=500 {
            let time_s = a.duration_ms() as f64 / 1000.0 * f64::from(i) / 500.0;
            let gap = a.state_at(time_s).position_m - b.state_at(time_s).position_m;
            prop_assert!(gap.norm() <= limit, "{} at {time_s} s", gap);
        }
    }

    #[test]
    fn any_text_is_survived(text in "[0-9,. \\-a-z\\n]{0,200}") {
        let text = format!("Time [msec],x [m],y [m],z [m],Red,Green,Blue\n0,0,0,0,0,0,0\n{text}");
        let _ = csv::read(&archive(&[("a.csv", &text)]));
    }
}
