//! Distances between drones: known cases, and properties against dense sampling.

#![expect(clippy::unwrap_used, reason = "helpers of tests")]

use crate::check::support::*;
use nalgebra::Vector3;
use proptest::prelude::*;
use skybrush_show::ShowDrone;
use skybrush_show::check::Limits;
use skybrush_show::check::{CheckInput, CheckReport, Options, check};
use skybrush_show::trajectory::{Cursor, Segment, SegmentPath, Trajectory};

/// A drone that is in the air from the beginning, above a ground far below.
fn flying(number: usize, start: [f64; 3], segments: Vec<Segment>) -> ShowDrone {
    let start_m = Vector3::from(start);
    ShowDrone {
        name: format!("Drone {number}"),
        home_m: Some(v(start[0], start[1], -1000.0)),
        land_at_m: Some(v(0.0, 0.0, 1000.0)),
        trajectory: Trajectory { start_m, segments },
        ..ShowDrone::default()
    }
}

fn with_distance(drones: Vec<ShowDrone>, min_distance_m: f64) -> CheckReport {
    let limits = Limits { min_distance_m, ..limits() };
    let options = Options { findings_per_check: 1000, ..Options::default() };
    check(&CheckInput { options, ..CheckInput::new(&show(drones), &limits) })
}

fn approach(report: &CheckReport) -> f64 {
    report.margin("distance").unwrap().value
}

#[test]
fn crossing_lines_come_as_near_as_the_textbook_says() {
    // East at 2 m/s through the origin at 10 s, north at 2 m/s through it at 11 s, 2 m higher:
    // d² = (2 s)² + (2 (s - 1))² + 4, least 6 at s = 1/2, below 9 for |s - 1/2| < sqrt(3/8).
    let east = flying(1, [-20.0, 0.0, 10.0], vec![line(20_000, 20.0, 0.0, 10.0)]);
    let north = flying(2, [0.0, -22.0, 12.0], vec![line(20_000, 0.0, 18.0, 12.0)]);
    let report = with_distance(vec![east.clone(), north.clone()], 3.0);
    let finding = report.findings.iter().find(|f| f.check == "distance").unwrap();
    assert_eq!(finding.drones, ["Drone 1", "Drone 2"]);
    assert!((finding.value.unwrap() - 6f64.sqrt()).abs() < 1e-9);
    assert!((finding.time_s.unwrap() - (10.5 - 0.375_f64.sqrt())).abs() < 1e-6, "{finding}");
    assert!((finding.end_s.unwrap() - (10.5 + 0.375_f64.sqrt())).abs() < 1e-6, "{finding}");
    assert_eq!(finding.message, "come within 2.449 m of each other at 10.500 s, limit 3.000 m");
    let near_miss = with_distance(vec![east, north], 2.449);
    assert!(near_miss.findings.iter().all(|f| f.check != "distance"), "{near_miss}");
}

#[test]
fn a_near_miss_between_samples_is_seen() {
    // At 100 m/s each, 4 ms within 1 m: no sampling at 25 or 100 Hz would meet it.
    let there = flying(1, [-100.0, 0.0, 10.0], vec![line(1_987, 100.0, 0.0, 10.0)]);
    let back = flying(2, [100.0, 0.1, 10.0], vec![line(1_987, -100.0, 0.1, 10.0)]);
    let report = with_distance(vec![there, back], 3.0);
    assert!((approach(&report) - 0.1).abs() < 1e-9, "{report}");
}

#[test]
fn the_limit_holds_as_soon_as_one_is_in_the_air() {
    // 2 m apart on the ground; the first climbs, and is at 0.5 m after 0.5 s.
    let close = |y: f64| run(vec![calm(1, 0.0, 0.0), calm(2, 0.0, y)]);
    clean(&close(3.0));
    let finding = only(&close(2.0), "distance");
    assert!((finding.time_s.unwrap() - 0.5).abs() < 1e-9, "{finding}");
    assert_eq!((finding.value, finding.end_s), (Some(2.0), Some(48.5)));

    let mut waiting = calm(2, 0.0, 2.0);
    waiting.trajectory.segments.insert(0, hold(60_000));
    let report = run(vec![calm(1, 0.0, 0.0), waiting]);
    let (from_s, until_s) = (report.findings[0].time_s, report.findings[0].end_s);
    assert!((from_s.unwrap() - 0.5).abs() < 1e-9, "{report}");
    assert!((until_s.unwrap() - 5f64.sqrt()).abs() < 1e-9, "until 3 m = |(2, z)| apart: {report}");
}

#[test]
fn drones_on_the_ground_keep_the_smaller_distance() {
    let neighbours = |y: f64| {
        let parked = |number, y| drone(number, 0.0, y, vec![hold(10_000)]);
        run(vec![parked(1, 0.0), parked(2, y)])
    };
    let of = |report: &CheckReport| {
        report.findings.iter().filter(|f| f.check.ends_with("distance")).count()
    };
    assert_eq!(of(&neighbours(0.5)), 0);
    let report = neighbours(0.4);
    let finding = report.findings.iter().find(|f| f.check == "ground-distance").unwrap();
    assert!(finding.message.contains("within 0.400 m of each other on the ground"), "{finding}");
    assert_eq!(of(&report), 1);
}

#[test]
fn a_drone_that_has_ended_may_be_anywhere_on_its_way_down() {
    // The first ends at 10 m; the second flies 2 m beside it at 5 m, a minute later.
    let ended = drone(1, 0.0, 0.0, vec![line(10_000, 0.0, 0.0, 10.0)]);
    let passing = |y: f64| {
        let there = vec![
            line(5_000, -20.0, y, 5.0),
            hold(60_000),
            line(20_000, 20.0, y, 5.0),
            line(5_000, 20.0, y, 2.5),
        ];
        drone(2, -20.0, y, there)
    };
    let report = run(vec![ended.clone(), passing(2.0)]);
    let finding = only_distance(&report);
    assert!((finding.value.unwrap() - 2.0).abs() < 1e-9, "{finding}");
    assert!(finding.message.contains("at 75.000 s"), "{finding}");
    assert!(run(vec![ended, passing(3.0)]).findings.iter().all(|f| f.check != "distance"));
}

#[test]
fn drones_that_end_above_each_other_would_land_on_each_other() {
    let upper = drone(1, 0.0, 0.0, vec![line(20_000, 0.0, 0.0, 20.0)]);
    let mut lower = drone(2, 7.0, 0.0, vec![line(10_000, 7.0, 0.0, 10.0)]);
    lower.trajectory.segments.push(line(10_000, 1.0, 0.0, 10.0));
    let report = run(vec![upper, lower]);
    let finding = only_distance(&report);
    assert!((finding.value.unwrap() - 1.0).abs() < 1e-9, "{report}");
    assert!((finding.time_s.unwrap() - 20.0).abs() < 1e-9, "{report}");
}

fn only_distance(report: &CheckReport) -> skybrush_show::check::Finding {
    let mut found = report.findings.iter().filter(|f| f.check == "distance");
    let first = found.next().unwrap_or_else(|| panic!("{report}")).clone();
    assert!(found.next().is_none(), "{report}");
    first
}

#[test]
fn a_crowd_is_counted_and_cut_short() {
    let crowd: Vec<_> = (0..100).map(|i| calm(i, 0.01 * i as f64, 0.0)).collect();
    let report = run(crowd);
    let count = report.counts["distance"];
    assert_eq!(count.errors, 100 * 99 / 2, "{report}");
    assert_eq!(report.findings.iter().filter(|f| f.check == "distance").count(), 20);
    assert!(report.to_string().contains("distance: and 4930 more"), "{report}");
}

#[test]
fn thousands_at_one_point_end_with_a_verdict() {
    let pile: Vec<_> = (0..1000).map(|i| calm(i, 0.0, 0.0)).collect();
    let report = run(pile);
    assert!(report.counts["distance"].at_least);
    assert_eq!(approach(&report), 0.0);
    assert!(report.findings.iter().any(|f| f.message.contains("there may be more")), "{report}");
}

#[test]
fn counter_phase_groups_pass_each_other() {
    // A chessboard of 10 x 10 at 7 m; every other drone flies the same ladder half a cycle later.
    let drones: Vec<_> = (0..100)
        .map(|i| {
            let (row, column) = (i / 10, i % 10);
            let (x, y) = (7.0 * row as f64, 7.0 * column as f64);
            let mut segments = vec![line(20_000, x, y, 20.0)];
            if (row + column) % 2 == 1 {
                segments.insert(0, hold(25_000));
            }
            for speed in [1.0, 2.0, 3.0] {
                let up = line(20_000, x, y, 20.0 + 20.0 * speed);
                segments.extend([hold(5_000), up, hold(5_000), line(20_000, x, y, 20.0)]);
            }
            segments.push(line(17_500, x, y, 2.5));
            drone(i + 1, x, y, segments)
        })
        .collect();
    let report = run(drones);
    assert_eq!(report.errors(), 0, "{report}");
    // At a crossing two neighbours are level.
    assert!((approach(&report) - 7.0).abs() < 1e-6, "{report}");
}

fn path() -> impl Strategy<Value = SegmentPath> {
    let point = || (-20.0..20.0_f64, -20.0..20.0_f64, 5.0..30.0_f64);
    let points = |count| {
        proptest::collection::vec(point(), count)
            .prop_map(|points| points.into_iter().map(|(x, y, z)| v(x, y, z)).collect::<Vec<_>>())
    };
    prop_oneof![
        1 => Just(SegmentPath::Hold),
        3 => points(1).prop_map(|p| SegmentPath::Line(p[0])),
        3 => points(3).prop_map(|p| SegmentPath::Cubic([p[0], p[1], p[2]])),
        2 => points(7).prop_map(|p| SegmentPath::Septic(Box::new(p.try_into().unwrap()))),
    ]
}

fn trajectory() -> impl Strategy<Value = ([f64; 3], Vec<Segment>)> {
    let segment =
        (500u32..4_000, path()).prop_map(|(duration_ms, path)| Segment { duration_ms, path });
    ((-20.0..20.0_f64, -20.0..20.0_f64, 5.0..30.0_f64), proptest::collection::vec(segment, 1..5))
        .prop_map(|((x, y, z), segments)| ([x, y, z], segments))
}

fn fleet(parts: Vec<([f64; 3], Vec<Segment>)>) -> Vec<ShowDrone> {
    parts.into_iter().enumerate().map(|(i, (start, segments))| flying(i, start, segments)).collect()
}

/// Smallest distance on a fine grid of times, of drones that stay at their last points.
fn sampled(drones: &[ShowDrone], steps_per_s: u32) -> f64 {
    let duration_ms = drones.iter().map(|d| d.trajectory.duration_ms()).max().unwrap();
    let steps = duration_ms as u32 * steps_per_s / 1000;
    let mut cursors: Vec<_> = drones.iter().map(|d| Cursor::new(&d.trajectory)).collect();
    let mut least = f64::INFINITY;
    for step in 0..=steps {
        let time_s = f64::from(step) / f64::from(steps_per_s);
        let points: Vec<_> = cursors.iter_mut().map(|c| c.state_at(time_s).position_m).collect();
        for (i, a) in points.iter().enumerate() {
            for b in &points[..i] {
                least = least.min((a - b).norm());
            }
        }
    }
    least
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn no_sampling_finds_less_and_dense_sampling_as_much(
        parts in proptest::collection::vec(trajectory(), 2..=2), limit in 0.1..10.0_f64,
    ) {
        let drones = fleet(parts);
        let exact = approach(&with_distance(drones.clone(), limit));
        let sampled = sampled(&drones, 10_000);
        prop_assert!(sampled >= exact - 1e-6, "sampled {sampled}, exact {exact}");
        // Relative speeds reach some 500 m/s: 0.1 ms are up to 25 mm, but of a hyperbola's vertex.
        let shortfall = (sampled * sampled - exact * exact).max(0.0).sqrt();
        prop_assert!(sampled - exact < 1e-3 || shortfall < 0.05, "sampled {sampled}, exact {exact}");
    }

    #[test]
    fn a_fleet_is_as_near_as_its_nearest_pair_in_any_order(
        parts in proptest::collection::vec(trajectory(), 3..12), turn in 1usize..10,
    ) {
        let drones = fleet(parts);
        let report = with_distance(drones.clone(), 2.0);
        let mut nearest = f64::INFINITY;
        let mut conflicts = 0;
        for (i, a) in drones.iter().enumerate() {
            for b in &drones[..i] {
                // The pair alone must see the same end of the show.
                let mut longer = a.clone();
                let whole: u64 = drones.iter().map(|d| d.trajectory.duration_ms()).max().unwrap();
                let rest = whole - longer.trajectory.duration_ms();
                if rest > 0 {
                    longer.trajectory.segments.push(hold(rest as u32));
                }
                let pair = with_distance(vec![b.clone(), longer], 2.0);
                nearest = nearest.min(approach(&pair));
                conflicts += pair.counts.get("distance").map_or(0, |count| count.errors);
            }
        }
        prop_assert!((approach(&report) - nearest).abs() < 1e-6);
        let found = report.counts.get("distance").map_or(0, |count| count.errors);
        prop_assert_eq!(found, conflicts);

        let mut turned = drones.clone();
        let middle = turn % turned.len();
        turned.rotate_left(middle);
        turned.swap(0, 1);
        let other = with_distance(turned, 2.0);
        prop_assert!((approach(&other) - approach(&report)).abs() < 1e-6);
        prop_assert_eq!(other.counts.get("distance"), report.counts.get("distance"));
        let names = |report: &CheckReport| {
            let mut names = report.margin("distance").unwrap().drones.clone();
            names.sort();
            names
        };
        prop_assert_eq!(names(&other), names(&report));
    }

    #[test]
    fn the_times_of_a_conflict_are_those_of_the_samples(
        parts in proptest::collection::vec(trajectory(), 2..=2),
    ) {
        let drones = fleet(parts);
        let report = with_distance(drones.clone(), 6.0);
        let conflicts: Vec<_> = report
            .findings
            .iter()
            .filter(|f| f.check == "distance")
            .map(|f| (f.time_s.unwrap(), f.end_s.unwrap()))
            .collect();
        let (mut a, mut b) =
            (Cursor::new(&drones[0].trajectory), Cursor::new(&drones[1].trajectory));
        for step in 0..20_000 {
            let time_s = f64::from(step) / 1000.0;
            let gap = (a.state_at(time_s).position_m - b.state_at(time_s).position_m).norm();
            let inside = conflicts.iter().any(|(from, to)| (*from..=*to).contains(&time_s));
            let over = drones.iter().map(|d| d.trajectory.duration_ms()).max().unwrap();
            if time_s * 1000.0 <= over as f64 && (gap - 6.0).abs() > 2e-3 {
                prop_assert_eq!(inside, gap < 6.0, "{} s: {} m, {:?}", time_s, gap, conflicts);
            }
        }
    }
}
