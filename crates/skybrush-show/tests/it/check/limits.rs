//! Every check has a show that must fail it, with its message, and one that just passes.

use crate::check::support::*;
use skybrush_show::check::Fence;
use skybrush_show::check::{CheckInput, CheckReport, Severity, check};
use skybrush_show::trajectory::{Segment, SegmentPath};

fn one(middle: Vec<Segment>, to: (f64, f64)) -> CheckReport {
    run(vec![flight(1, (0.0, 0.0), middle, to)])
}

fn fenced(middle: Vec<Segment>, to: (f64, f64), fence: &Fence) -> CheckReport {
    let show = show(vec![flight(1, (0.0, 0.0), middle, to)]);
    check(&CheckInput { fence: Some(fence), ..CheckInput::new(&show, &limits()) })
}

#[test]
fn a_calm_show_passes_and_says_by_how_much() {
    let report = run(vec![calm(1, 0.0, 0.0), calm(2, 7.0, 0.0)]);
    clean(&report);
    insta::assert_snapshot!(report);
}

#[test]
fn a_bad_show_says_who_when_and_how_much() {
    let show = show(vec![
        flight(1, (0.0, 0.0), vec![line(5_000, 30.0, 0.0, 10.0)], (30.0, 0.0)),
        flight(2, (7.0, 1.0), vec![hold(5_000)], (7.0, 1.0)),
    ]);
    let (fence, limits) = (fence(33.0), limits());
    let input = CheckInput { fence: Some(&fence), ..CheckInput::new(&show, &limits) };
    let report = check(&input);
    assert!(!report.passed());
    insta::assert_snapshot!(report);
    insta::assert_json_snapshot!(report.findings[0]);
}

#[test]
fn horizontal_speed() {
    // The limit on steps is 3.5 m/s: ease in and out with cubics, whose speed is 1.5 times the mean.
    let eased = |distance: f64| {
        let (d, z) = (distance, 10.0);
        cubic(20_000, [[0.0, 0.0, z], [d, 0.0, z], [d, 0.0, z]])
    };
    let report = one(vec![eased(67.0)], (67.0, 0.0));
    let finding = only(&report, "speed-horizontal");
    assert!((finding.value.unwrap() - 67.0 * 1.5 / 20.0).abs() < 1e-5);
    // 6 u (1 - u) 67 / 20 > 5 within sqrt(1 - 10 / (1.5 * 6.7)) / 2 of the middle.
    let half = (1.0_f64 - 5.0 / (1.5 * 3.35)).sqrt() / 2.0;
    assert!((finding.time_s.unwrap() - (10.0 + 20.0 * (0.5 - half))).abs() < 1e-4, "{finding}");
    assert!((finding.end_s.unwrap() - (10.0 + 20.0 * (0.5 + half))).abs() < 1e-4, "{finding}");
    assert_eq!(finding.message, "flies horizontally at 5.025 m/s at 20.000 s, limit 5.000 m/s");
    clean(&one(vec![eased(66.66)], (66.66, 0.0)));
}

#[test]
fn vertical_speed_up_and_down() {
    let cycle = |up_mps: f64, down_mps: f64| {
        let top = 10.0 + 10.0 * up_mps;
        let down_ms = (10_000.0 * up_mps / down_mps).round() as u32;
        one(
            vec![
                hold(1000),
                line(10_000, 0.0, 0.0, top),
                hold(1000),
                line(down_ms, 0.0, 0.0, 10.0),
            ],
            (0.0, 0.0),
        )
    };
    clean(&cycle(3.5, 2.8));
    let report = run(vec![flight(
        1,
        (0.0, 0.0),
        vec![
            cubic(10_000, [[0.0, 0.0, 10.0], [0.0, 0.0, 34.0], [0.0, 0.0, 34.0]]),
            line(12_000, 0.0, 0.0, 10.0),
        ],
        (0.0, 0.0),
    )]);
    let finding = only(&report, "speed-up");
    assert_eq!(finding.message, "climbs at 3.600 m/s at 15.000 s, limit 3.500 m/s");
    let finding = only(&cycle(3.5, 3.1), "speed-down");
    assert_eq!(finding.limit, Some(3.0));
    assert!(finding.message.starts_with("descends at 3.10"), "{finding}");
    assert_eq!((finding.time_s, finding.end_s), (Some(22.0), Some(33.29)));
}

#[test]
fn acceleration_within_a_piece() {
    // Ease over d in t: acceleration 6 d / t² at the ends.
    let eased = |ms: u32| {
        one(vec![cubic(ms, [[0.0, 0.0, 10.0], [12.0, 0.0, 10.0], [12.0, 0.0, 10.0]])], (12.0, 0.0))
    };
    let report = eased(5_900);
    assert_eq!(report.errors(), 2, "at both ends: {report}");
    let finding = report.findings[0].clone();
    assert_eq!(finding.check, "acceleration");
    assert_eq!(finding.drones, ["Drone 1"]);
    assert!((finding.value.unwrap() - 72.0 / 5.9 / 5.9).abs() < 1e-4);
    assert!(finding.message.contains("accelerates at 2.068 m/s² at 10.000 s"), "{finding}");
    clean(&eased(6_001));
}

#[test]
fn velocity_steps_between_pieces_and_at_the_ends() {
    let turn = |speed: f64| {
        let far = 10.0 * speed;
        one(
            vec![
                hold(1000),
                line(10_000, far, 0.0, 10.0),
                line(10_000, 0.0, 0.0, 10.0),
                hold(1000),
            ],
            (0.0, 0.0),
        )
    };
    clean(&turn(1.75));
    let finding = only(&turn(1.76), "velocity-step");
    assert_eq!((finding.time_s, finding.end_s), (Some(21.0), None));
    assert!((finding.value.unwrap() - 3.52).abs() < 1e-9);
    let rocket = run(vec![drone(1, 0.0, 0.0, vec![line(2_000, 0.0, 0.0, 8.0)])]);
    let steps: Vec<_> =
        rocket.findings.iter().filter(|f| f.check == "velocity-step").map(|f| f.time_s).collect();
    assert_eq!(steps, [Some(0.0), Some(2.0)], "{rocket}");
}

#[test]
fn altitude() {
    let up = |height: f64| {
        let ms = (400.0 * height) as u32;
        one(vec![line(ms, 0.0, 0.0, height), hold(1000), line(ms, 0.0, 0.0, 10.0)], (0.0, 0.0))
    };
    clean(&up(120.0));
    let finding = only(&up(120.5), "altitude-max");
    assert!(finding.message.contains("120.500 m at 58.200 s, limit 120.000 m"), "{finding}");
    let mut deep = calm(1, 0.0, 0.0);
    deep.trajectory.segments.insert(0, line(1000, 0.0, 0.0, -0.04));
    deep.trajectory.segments[1].duration_ms = 21_000;
    clean(&run(vec![deep.clone()]));
    deep.trajectory.segments[0] = line(1000, 0.0, 0.0, -0.2);
    let finding = only(&run(vec![deep]), "altitude-min");
    assert_eq!(finding.value, Some(-0.2));
    assert!(finding.message.contains("-0.200 m at 1.000 s, limit -0.050 m"), "{finding}");
}

#[test]
fn sideways_motion_near_the_ground() {
    let leaving = |shift: f64, height: f64| {
        run(vec![drone(
            1,
            0.0,
            0.0,
            vec![
                line((1000.0 * height) as u32, 0.0, 0.0, height),
                line(1000, shift, 0.0, height),
                line(10_000, shift, 0.0, height + 5.0),
                line(10_000, shift, 0.0, 2.5),
            ],
        )])
    };
    clean(&leaving(1.0, 2.5));
    clean(&leaving(0.05, 2.0));
    let finding = only(&leaving(1.0, 2.0), "low-lateral");
    assert!((finding.value.unwrap() - 1.0).abs() < 1e-6);
    assert!((finding.time_s.unwrap() - 2.05).abs() < 1e-6, "from where it is 50 mm away");
    assert!(finding.message.contains("limit 0.050 m"), "{finding}");
    // A slanted landing counts from the place where it came below the take-off altitude.
    let segments = vec![line(10_000, 0.0, 0.0, 10.0), line(8_000, 8.0, 0.0, 2.0)];
    let mut slanted = drone(1, 0.0, 0.0, segments);
    slanted.land_at_m = Some(v(8.0, 0.0, 0.0));
    let slanted = run(vec![slanted]);
    let finding = only(&slanted, "low-lateral");
    assert!((finding.value.unwrap() - 0.49).abs() < 1e-6, "{finding}");
}

#[test]
fn flight_below_the_take_off_altitude() {
    let at = |height: f64| {
        one(
            vec![line(8_000, 0.0, 0.0, height), hold(5_000), line(8_000, 0.0, 0.0, 10.0)],
            (0.0, 0.0),
        )
    };
    clean(&at(2.5));
    let report = at(2.0);
    let finding = only(&report, "low-flight");
    assert_eq!(finding.severity, Severity::Warning);
    // From 10 m at 1 m/s: below 2.49 m after 7.51 s, and the same on the way up.
    assert!((finding.time_s.unwrap() - 17.51).abs() < 1e-6, "{finding}");
    assert!((finding.end_s.unwrap() - 23.49).abs() < 1e-6, "{finding}");
    assert!(finding.message.contains("at a height of 2.000 m at "), "{finding}");
    assert!(report.passed());
    // A landing is no low flight, a hover within it is.
    let landing = |last: Vec<Segment>| {
        let mut segments = vec![line(10_000, 0.0, 0.0, 10.0), line(10_000, 0.0, 0.0, 1.5)];
        segments.extend(last);
        run(vec![drone(1, 0.0, 0.0, segments)])
    };
    let low = |report: &CheckReport| {
        report.findings.iter().find(|found| found.check == "low-flight").map(|f| f.time_s.unwrap())
    };
    assert_eq!(low(&landing(vec![line(2_000, 0.0, 0.0, 0.0), hold(3_000)])), None);
    assert_eq!(low(&landing(vec![hold(4_000), line(2_000, 0.0, 0.0, 0.0)])), Some(20.0));
}

#[test]
fn the_fence_with_its_margin() {
    let out_and_back =
        |x: f64| vec![line(20_000, x, 0.0, 10.0), hold(1000), line(20_000, 0.0, 0.0, 10.0)];
    let square = fence(45.0);
    let report = fenced(out_and_back(40.0), (0.0, 0.0), &square);
    clean(&report);
    assert!((report.margin("fence").unwrap().value - 5.0).abs() < 1e-9);
    let near = only(&fenced(out_and_back(41.0), (0.0, 0.0), &square), "fence");
    assert!((near.value.unwrap() - 4.0).abs() < 1e-6);
    // 40 of 41 m after 20 s, and the same on the way back.
    assert!((near.time_s.unwrap() - (10.0 + 20.0 * 40.0 / 41.0)).abs() < 1e-6, "{near}");
    assert!((near.end_s.unwrap() - (31.0 + 20.0 / 41.0)).abs() < 1e-6, "{near}");
    let outside = only(&fenced(out_and_back(47.0), (0.0, 0.0), &square), "fence");
    assert!((outside.value.unwrap() + 2.0).abs() < 0.01, "{outside}");
    assert!((outside.time_s.unwrap() - (10.0 + 20.0 * 40.0 / 47.0)).abs() < 1e-6);
}

#[test]
fn a_concave_fence_and_a_curve() {
    // A notch reaches down to y = 20 at x = 20.
    let polygon_m = vec![
        [-50.0, -50.0],
        [50.0, -50.0],
        [50.0, 50.0],
        [30.0, 50.0],
        [20.0, 20.0],
        [10.0, 50.0],
        [-50.0, 50.0],
    ];
    let fence = Fence { polygon_m, max_altitude_m: 60.0, margin_m: 5.0 };
    // This arc's top is at 3/4 of the height of its control points.
    let arc = |y: f64| {
        let there = cubic(20_000, [[0.0, y, 10.0], [40.0, y, 10.0], [40.0, 0.0, 10.0]]);
        vec![there, hold(1000), line(20_000, 0.0, 0.0, 10.0)]
    };
    clean(&fenced(arc(19.9), (0.0, 0.0), &fence));
    let report = fenced(arc(20.8), (0.0, 0.0), &fence);
    let finding = only(&report, "fence");
    assert!((finding.value.unwrap() - (20.0 - 0.75 * 20.8)).abs() < 1e-5, "{finding}");
    assert!(finding.message.contains("at 20.000 s"), "{finding}");
    let report = fenced(arc(30.0), (0.0, 0.0), &fence);
    let finding = report.findings.iter().find(|f| f.check == "fence").unwrap();
    assert!(finding.value.unwrap() < 0.0, "through the notch: {report}");
    let low = Fence { max_altitude_m: 14.9, ..fence };
    let finding = only(&fenced(arc(19.9), (0.0, 0.0), &low), "fence-altitude");
    assert!(finding.message.contains("10.000 m at 10.000 s, limit 9.900 m"), "{finding}");
}

#[test]
fn a_show_that_starts_outside_its_fence_fails() {
    let show = show(vec![calm(1, 60.0, 0.0)]);
    let fence = fence(50.0);
    let report = check(&CheckInput { fence: Some(&fence), ..CheckInput::new(&show, &limits()) });
    let finding = only(&report, "fence");
    assert_eq!((finding.value, finding.time_s), (Some(-10.0), Some(0.0)));
    assert_eq!(finding.end_s, Some(47.5));
}

#[test]
fn endurance_with_reserve_and_landing() {
    // 900 s with a fifth in reserve: 720 s. Climb, hover, descent, and 5 s to land from 2.5 m.
    let hover =
        |ms: u32| one(vec![hold(65_000); 10].into_iter().chain([hold(ms)]).collect(), (0.0, 0.0));
    clean(&hover(45_000));
    let finding = only(&hover(45_100), "endurance");
    assert!((finding.value.unwrap() - 720.1).abs() < 1e-6);
    assert!(finding.message.contains("720.100 s at 720.100 s, limit 720.000 s"), "{finding}");
    let mut late = flight(1, (0.0, 0.0), vec![hold(45_000)], (0.0, 0.0));
    late.trajectory.segments.insert(0, hold(780_000));
    clean(&run(vec![late]));
}

#[test]
fn skyb_range_unit_and_size() {
    let far = |x: f64| {
        let mut show = show(vec![calm(1, x, 0.0)]);
        show.drones[0].home_m = None;
        check(&CheckInput::new(&show, &limits()))
    };
    let report = far(4161.0);
    clean(&report);
    assert_eq!(report.margin("skyb-unit").unwrap().value, 127.0);
    let finding = only(&far(4162.0), "skyb-range");
    assert!(finding.message.contains("4162.000 m; .skyb files hold up to 4161.409 m"), "{finding}");
    let finding = far(50.001).findings[0].clone();
    assert_eq!(finding.check, "skyb-unit");
    assert_eq!(finding.severity, Severity::Warning);
    assert!(
        finding.message.contains("units of 2 mm, which moves a point by up to 1.0 mm"),
        "{finding}"
    );
    assert!(far(50.001).passed(), "a warning does not fail a show");

    let zigzag = |pieces: usize| {
        let middle = (0..pieces).map(|i| {
            let side = if i % 2 == 0 { 0.01 } else { 0.0 };
            line(100, side, side, 10.0 + side)
        });
        one(middle.collect(), (0.0, 0.0))
    };
    // 9 B header, 5 B each for climb and descent, 9 B for every piece in between.
    assert_eq!(zigzag(7278).margin("skyb-size").unwrap().value, 9.0 + 10.0 + 9.0 * 7278.0);
    assert!(zigzag(7278).counts.keys().all(|check| *check != "skyb-size"));
    let report = zigzag(7282);
    let finding = report.findings.iter().find(|f| f.check == "skyb-size").unwrap();
    assert!(finding.message.contains("needs 65557 B for its trajectory"), "{finding}");
}

#[test]
fn long_pieces_that_lose_time() {
    clean(&one(vec![hold(130_002)], (0.0, 0.0)));
    let finding = only(&one(vec![hold(130_001)], (0.0, 0.0)), "skyb-duration");
    assert!(finding.message.contains("parts 2 ms short"), "{finding}");
}

#[test]
fn what_the_firmware_derives() {
    let hop = |height: f64| {
        run(vec![drone(1, 0.0, 0.0, vec![line(5_000, 0.0, 0.0, height), hold(10_000)])])
    };
    let finding = only(&hop(2.5), "firmware-early-landing");
    assert_eq!((finding.severity, finding.value), (Severity::Warning, Some(10.0)));
    assert!(finding.message.contains("at 5.000 s from 2.500 m"), "{finding}");
    let finding = only(&hop(2.4), "firmware-takeoff");
    assert_eq!(finding.severity, Severity::Error);
    assert!(finding.message.contains("climbs only 2.400 m above its start, limit 2.500 m"));

    let climb = |ms: u32| run(vec![drone(1, 0.0, 0.0, vec![line(ms, 0.0, 0.0, 2.5), hold(1000)])]);
    clean(&climb(2_500));
    let finding = only(&climb(2_000), "firmware-climb");
    assert_eq!((finding.severity, finding.value), (Severity::Warning, Some(1.25)));

    let end = |z: f64| {
        run(vec![drone(1, 0.0, 0.0, vec![line(10_000, 0.0, 0.0, 10.0), line(10_000, 0.0, 0.0, z)])])
    };
    clean(&end(3.0));
    let finding = only(&end(0.0), "firmware-end");
    assert!(finding.message.contains("ends 0.000 m above ground"), "{finding}");

    let away = |x: f64| {
        let mut drone = calm(1, 0.0, 0.0);
        drone.home_m = Some(v(x, 0.0, 0.0));
        run(vec![drone])
    };
    clean(&away(3.0));
    let finding = only(&away(3.1), "firmware-start");
    assert!(finding.message.contains("3.100 m from its home, limit 3.000 m"), "{finding}");
}

/// A hop in a single curve: firmware 4.6 takes it for the descent at the end and lands at once.
#[test]
fn a_landing_before_the_take_off() {
    let hop = |ms: u32| {
        let top = [[0.0, 0.0, 26.0], [0.0, 0.0, 26.0], [0.0, 0.0, 2.5]];
        let mut drone = drone(1, 0.0, 0.0, vec![cubic(ms, top)]);
        drone.trajectory.start_m.z = 2.5;
        run(vec![drone])
    };
    // Three times 23.5 m over the duration is the climb; 2.5 m are reached at 3.67 % of it, and the
    // drone needs 2 sqrt(2.5) + 0.5 s for them.
    clean(&hop(90_000));
    let finding = only(&hop(110_000), "firmware-landing");
    assert_eq!(finding.severity, Severity::Error);
    assert!(finding.message.contains("firmware 4.6 would land at 0.000 s"), "{finding}");
}

#[test]
fn a_low_hover_at_the_end_that_4_6_leaves_out() {
    let end = |hover_m: f64| {
        let down = vec![line(10_000, 0.0, 0.0, hover_m), hold(5_000)];
        run(vec![flight(1, (0.0, 0.0), down, (0.0, 0.0))])
    };
    clean(&end(5.1));
    let finding = only(&end(4.0), "firmware-early-landing");
    assert_eq!(finding.severity, Severity::Warning);
    assert!(finding.message.contains("leaves out 5.000 s of hovering"), "{finding}");
}

#[test]
fn the_climb_speed_of_the_vehicle_decides_when_it_takes_off() {
    let show = show(vec![calm(1, 0.0, 0.0)]);
    let takeoff = |mps: f64| {
        let limits = limits();
        let report = check(&CheckInput::new(&show, &limits).with_speed_up(mps));
        report.margin("firmware-takeoff").unwrap().value
    };
    assert_eq!((takeoff(2.5), takeoff(5.0)), (1.5, 2.0));
}

#[test]
fn the_unit_is_the_one_that_the_writer_takes() {
    // 90 m are too far for 1 mm; 5 mm hold the half metres, and the 5 mm of a half of 7.01 m, exactly.
    let tall = |x: f64| {
        let mut drone =
            drone(1, x, 0.0, vec![line(40_000, x, 0.0, 90.0), line(40_000, x, 0.0, 2.5)]);
        drone.home_m = None;
        let show = show(vec![drone]);
        let report = check(&CheckInput::new(&show, &limits()));
        let file = skybrush_show::skyb::write(
            &show.drones[0],
            &skybrush_show::skyb::SkybOptions::default(),
        )
        .unwrap();
        let unit = report.margin("skyb-unit").unwrap().value;
        assert_eq!(unit, f64::from(file.scale_mm));
        assert_eq!(report.margin("skyb-size").unwrap().value, file.trajectory_bytes as f64);
        (unit, report.counts.contains_key("skyb-unit"))
    };
    assert_eq!(tall(3.505), (5.0, false));
    assert_eq!(tall(3.504), (4.0, false));
    assert_eq!(tall(3.501), (3.0, true));
}

#[test]
fn doubled_places() {
    let mut doubled = calm(2, 7.0, 0.0);
    doubled.home_m = Some(v(0.0, 0.0, 0.0));
    doubled.trajectory.start_m = v(0.0, 0.0, 0.0);
    let report = run(vec![calm(1, 0.0, 0.0), doubled]);
    for check in ["same-start", "same-home", "ground-distance"] {
        let finding = report.findings.iter().find(|f| f.check == check).unwrap();
        assert_eq!(finding.drones, ["Drone 1", "Drone 2"], "{finding}");
    }
    let mut swapped = calm(2, 7.0, 0.0);
    swapped.home_m = Some(v(6.0, 0.0, 0.0));
    clean(&run(vec![calm(1, 0.0, 0.0), swapped]));
}

#[test]
fn starts_that_are_almost_together() {
    let later = |ms: u32| {
        let mut late = calm(2, 7.0, 0.0);
        late.trajectory.segments.insert(0, hold(ms));
        run(vec![calm(1, 0.0, 0.0), late])
    };
    clean(&later(1_000));
    let report = later(40);
    let finding = only(&report, "mixed-starts");
    assert!(finding.message.contains("0.040 s after each other"), "{finding}");
    assert!(report.passed());
}

#[test]
fn numbers_that_make_no_sense() {
    assert_eq!(only(&run(vec![]), "validity").message, "the show has no drones");
    let mut broken = calm(2, 7.0, 0.0);
    broken.trajectory.segments[1] = Segment {
        duration_ms: 500,
        path: SegmentPath::Septic(Box::new([v(f64::NAN, 0.0, 0.0); 7])),
    };
    let finding = only(&run(vec![calm(1, 0.0, 0.0), broken]), "validity");
    assert_eq!((finding.drones, finding.time_s), (vec!["Drone 2".to_owned()], Some(20.0)));

    let mut standing = calm(1, 0.0, 0.0);
    standing.trajectory.segments.insert(1, hold(0));
    let finding = only(&run(vec![standing]), "validity");
    assert_eq!(finding.message, "a piece of the trajectory takes no time");

    let finding = only(&run(vec![drone(1, 0.0, 0.0, vec![])]), "validity");
    assert_eq!(finding.message, "the trajectory is empty");

    let drones: Vec<_> =
        (0..5001).map(|i| calm(i, 7.0 * (i % 71) as f64, 7.0 * (i / 71) as f64)).collect();
    let finding = only(&run(drones), "validity");
    assert_eq!(finding.message, "the show has 5001 drones, the loader takes 5000");

    let show = show(vec![calm(1, 0.0, 0.0)]);
    let limits = limits();
    let mut wrong = limits;
    wrong.min_distance_m = f64::NAN;
    let finding = only(&check(&CheckInput::new(&show, &wrong)), "validity");
    assert!(finding.message.contains("min_distance_m is NaN"), "{finding}");
    let line =
        Fence { polygon_m: vec![[0.0, 0.0], [1.0, 1.0]], max_altitude_m: 9.0, margin_m: 1.0 };
    let input = CheckInput { fence: Some(&line), ..CheckInput::new(&show, &limits) };
    assert!(only(&check(&input), "validity").message.starts_with("the fence needs three corners"));
}
