//! What a check says beyond the show's own numbers: fences that are not there, limits that were
//! loosened, ladders that cannot be fitted, ends from which the firmware is left alone.

#![expect(clippy::unwrap_used, reason = "a test without its template fails")]

use crate::check::support::*;
use updraft::check::{CheckInput, CheckReport, Severity, check};
use updraft::mission::Plan;
use updraft::mission::resolve::{Override, ResolvedFlight, resolve};
use updraft::show::{Extras, FenceZone, Show, Validation, YawControl};
use updraft::vehicle::library;

fn planned(template: &str, overrides: &[&str]) -> ResolvedFlight {
    let overrides: Vec<_> = overrides.iter().map(|text| Override::parse(text).unwrap()).collect();
    resolve(template, &overrides).unwrap().flights.remove(0)
}

fn of_plan(flight: &ResolvedFlight) -> CheckReport {
    let show = flight.plan.to_show();
    check(
        &CheckInput::new(&show, &flight.plan.limits)
            .with_rule(&flight.plan)
            .with_stock(&flight.vehicle.limits),
    )
}

fn named<'a>(report: &'a CheckReport, check: &str) -> Vec<&'a str> {
    let of = report.findings.iter().filter(|finding| finding.check == check);
    of.map(|finding| finding.message.as_str()).collect()
}

#[test]
fn a_show_without_a_fence_gets_none() {
    let vehicle = library::builtin("airsim-generic-quad").unwrap();
    let mut show = show(vec![calm(1, 0.0, 0.0), calm(2, 7.0, 0.0)]);
    let plan = Plan::of_show(&show, &vehicle);
    assert!(plan.fence.polygon_m.is_empty(), "{:?}", plan.fence);
    let report = check(&CheckInput::new(&show, &plan.limits));
    assert!(report.to_string().contains("note: no fence in this show"), "{report}");
    assert!(report.margin("fence").is_none() && report.margin("fence-altitude").is_none());

    let corners_m = vec![[-12.0, -12.0], [20.0, -12.0], [20.0, 12.0], [-12.0, 12.0]];
    show.fence = vec![FenceZone::inclusion(corners_m)];
    let plan = Plan::of_show(&show, &vehicle);
    let report = check(&CheckInput::new(&show, &plan.limits).with_polygon(Some(&plan.fence)));
    assert!((report.margin("fence").unwrap().value - 12.0).abs() < 1e-9, "{report}");
    assert!(report.margin("fence-altitude").is_none(), "a polygon has no top: {report}");
    assert!(report.notes.is_empty(), "{report}");
}

#[test]
fn every_loosened_limit_is_named_with_both_values() {
    let strict = planned("calibration", &["grid.rows=1", "grid.columns=2"]);
    assert_eq!(named(&of_plan(&strict), "limits"), [""; 0]);
    let loose = planned(
        "calibration",
        &[
            "grid.rows=1",
            "grid.columns=2",
            "limits.max_speed_xy_mps=11",
            "limits.max_speed_up_mps=6",
            "limits.max_speed_down_mps=7",
            "limits.max_acceleration_mps2=8",
            "limits.max_velocity_step_mps=6.5",
            "limits.max_altitude_m=400",
            "limits.min_distance_m=1.5",
            "limits.endurance_s=2000",
            "limits.endurance_reserve=0.05",
        ],
    );
    let report = of_plan(&loose);
    let mut messages = named(&report, "limits");
    messages.sort_unstable();
    assert_eq!(
        messages,
        [
            "endurance_reserve is loosened to 0.05; the vehicle's own is 0.2",
            "endurance_s is loosened to 2000 s; the vehicle's own is 1200 s",
            "max_acceleration_mps2 is loosened to 8 m/s²; the vehicle's own is 5 m/s²",
            "max_altitude_m is loosened to 400 m; the vehicle's own is 150 m",
            "max_speed_down_mps is loosened to 7 m/s; the vehicle's own is 5 m/s",
            "max_speed_up_mps is loosened to 6 m/s; the vehicle's own is 5 m/s",
            "max_speed_xy_mps is loosened to 11 m/s; the vehicle's own is 10 m/s",
            "max_velocity_step_mps is loosened to 6.5 m/s; the vehicle's own is 4 m/s",
            "min_distance_m is loosened to 1.5 m; the vehicle's own is 3 m",
        ]
    );
    assert!(report.passed(), "loosening warns: {report}");
    let tight = planned("calibration", &["limits.max_altitude_m=120", "limits.min_distance_m=5"]);
    assert_eq!(named(&of_plan(&tight), "limits"), [""; 0]);
}

#[test]
fn legs_without_a_window_and_ladders_of_one_speed_are_told() {
    let few = |overrides: &[&str]| {
        let grid = ["grid.rows=1", "grid.columns=1"];
        of_plan(&planned("calibration", &[&grid[..], overrides].concat()))
    };
    let whole = few(&[]);
    assert_eq!(named(&whole, "ladder-window"), [""; 0]);
    assert_eq!(named(&whole, "ladder-speeds"), [""; 0]);

    let short = few(&["leg_s=5"]);
    assert_eq!(
        named(&short, "ladder-window"),
        [
            "14 of 14 segments to be analysed (group all) are too short for an analysis window, first \"up 0.5 m/s\" of 5.0 s: they will not count"
        ]
    );
    assert_eq!(
        named(&short, "ladder-speeds"),
        ["the ladder has no leg with an analysis window: no law can be fitted"]
    );
    assert!(!short.passed() && whole.passed());
    let one = few(&["speeds_mps=[1.5, 1.5]"]);
    assert_eq!(
        named(&one, "ladder-speeds"),
        [
            "all legs of the ladder have the same speed, 1.50 m/s: a straight line is all that can be fitted to fewer than 2 speeds"
        ]
    );
    assert_eq!(named(&few(&["speeds_mps=[1.5, 2]"]), "ladder-speeds"), [""; 0]);
    let hover = planned("hover", &["grid.rows=1", "grid.columns=1", "duration_s=5"]);
    assert_eq!(named(&of_plan(&hover), "ladder-window").len(), 1);
}

#[test]
fn a_high_end_is_told_and_a_very_high_one_refused() {
    let ends_at = |end_m: f64| {
        let segments = vec![line(20_000, 0.0, 0.0, 20.0), line(20_000, 0.0, 0.0, end_m)];
        let report = run(vec![drone(1, 0.0, 0.0, segments)]);
        let found = report.findings.iter().find(|finding| finding.check == "firmware-end").cloned();
        found.map(|finding| (finding.severity, finding.message))
    };
    assert_eq!(ends_at(2.5), None);
    let (severity, message) = ends_at(9.0).unwrap();
    assert_eq!(severity, Severity::Warning, "{message}");
    let (severity, message) = ends_at(15.0).unwrap();
    assert_eq!(severity, Severity::Error);
    assert!(message.starts_with("ends 15.000 m above ground, recommended 2.500 m"), "{message}");
    assert!(message.contains("land (4.6: or return home"), "{message}");
}

#[test]
fn an_end_away_from_home_is_told_unless_it_is_meant() {
    let away = |to: f64, land_at: Option<f64>| {
        let segments = vec![
            line(10_000, 0.0, 0.0, 10.0),
            line(10_000, to, 0.0, 10.0),
            line(10_000, to, 0.0, 2.5),
        ];
        let mut flown = drone(1, 0.0, 0.0, segments);
        flown.land_at_m = land_at.map(|x| v(x, 0.0, 0.0));
        let report = run(vec![flown]);
        named(&report, "firmware-away").join("; ")
    };
    assert_eq!(away(2.9, None), "");
    assert!(away(12.0, None).starts_with("ends 12.000 m from its home, more than 3.000 m: "));
    assert_eq!(away(12.0, Some(12.0)), "", "the show says that it lands there");
    assert!(away(12.0, Some(0.0)).starts_with("ends 12.000 m from its landing place"));
}

#[test]
fn limits_of_a_show_file_survive_it() {
    let flight = planned("calibration-counterphase", &["limits.endurance_reserve=0"]);
    let show = flight.plan.to_show();
    let bytes = updraft::show::skyc::write(&show).unwrap();
    let recovered = Plan::of_show(&updraft::show::skyc::read(&bytes).unwrap(), &flight.vehicle);
    assert_eq!(recovered.limits, flight.plan.limits);
}

#[test]
fn numbers_without_sense_stay_short() {
    let show = show(vec![calm(1, 0.0, 0.0)]);
    let mut limits = limits();
    limits.max_altitude_m = 1e300;
    limits.min_distance_m = 1e300;
    let report = check(&CheckInput::new(&show, &limits).with_stock(&limits)).to_string();
    assert!(report.lines().all(|line| line.chars().count() < 200), "{report}");
    assert!(report.contains(" 1e300 m "), "{report}");
}

/// A show cannot give itself more distance, altitude or speed than the vehicle has.
#[test]
fn of_the_shows_and_the_vehicles_limits_the_stricter_counts() {
    let vehicle = library::builtin("airsim-generic-quad").unwrap();
    let mut show = show(vec![calm(1, 0.0, 0.0), calm(2, 1.0, 0.0)]);
    show.validation = Some(Validation {
        min_distance_m: Some(0.1),
        max_altitude_m: Some(10_000.0),
        max_velocity_xy_mps: Some(2.0),
        max_velocity_z_mps: Some(100.0),
        max_velocity_step_mps: Some(6.5),
        ..Validation::default()
    });
    let limits = Plan::of_show(&show, &vehicle).limits;
    let own = vehicle.limits;
    assert_eq!(limits.min_distance_m, own.min_distance_m);
    assert_eq!(limits.max_altitude_m, own.max_altitude_m);
    assert_eq!(limits.max_speed_xy_mps, 2.0, "the show is stricter here");
    assert_eq!((limits.max_speed_up_mps, limits.max_speed_down_mps), (5.0, 5.0));
    assert_eq!(limits.max_velocity_step_mps, 6.5, "only shows of this program state it");
    let report = check(&CheckInput::new(&show, &limits).with_stock(&own));
    assert!(!report.passed() && report.counts.contains_key("distance"), "{report}");
    let mut messages = named(&report, "limits");
    messages.sort_unstable();
    assert_eq!(
        messages,
        [
            "max_velocity_step_mps is loosened to 6.5 m/s; the vehicle's own is 4 m/s",
            "the show states max_altitude_m = 10000 m; the vehicle's own 150 m are stricter and count",
            "the show states max_speed_down_mps = 100 m/s; the vehicle's own 5 m/s are stricter and count",
            "the show states max_speed_up_mps = 100 m/s; the vehicle's own 5 m/s are stricter and count",
            "the show states min_distance_m = 0.1 m; the vehicle's own 3 m are stricter and count",
        ]
    );
}

#[test]
fn hovers_that_ramps_eat_are_counted() {
    let ramped = |ramp: &str| {
        let grid = ["grid.rows=1", "grid.columns=1", "speeds_mps=[3.5, 0.5]", ramp];
        planned("calibration", &grid)
    };
    let flight = ramped("motion.ramp_mps2=0.5");
    let hovers: Vec<_> =
        flight.plan.groups[0].segments.iter().filter(|s| s.label.starts_with("hover")).collect();
    for hover in &hovers {
        let height = (hover.to_m[2] * 10.0).round() / 10.0;
        assert_eq!(hover.label, format!("hover at {height} m"));
    }
    assert_eq!(
        named(&of_plan(&flight), "ladder-window"),
        [
            "2 of 5 hovers (group all) are too short for an analysis window after the ramps they begin with, first \"hover at 90 m\": 3.0 s are left after a ramp of 7.0 s"
        ]
    );
    assert_eq!(named(&of_plan(&ramped("motion.ramp_mps2=5")), "ladder-window"), [""; 0]);
}

/// Studio for Blender states accelerations by direction, a yaw rate and an altitude below which nobody
/// moves sideways.
#[test]
fn what_other_programs_state_counts_where_it_is_stricter() {
    // Within 2 m/s² of the vehicle: 1.5 sideways, then 1.2 down to the side.
    let swing = |number, x| {
        let middle = vec![
            cubic(4000, [[x, 0.0, 10.0], [x + 4.0, 0.0, 10.0], [x + 8.0, 0.0, 10.0]]),
            hold(4000),
            line(4000, x + 8.0, 0.0, 3.0),
            line(4000, x + 10.0, 0.0, 3.0),
        ];
        flight(number, (x, 0.0), middle, (x + 10.0, 0.0))
    };
    let mut show = show(vec![swing(1, 0.0), swing(2, 20.0)]);
    show.drones[1].yaw = Some(YawControl {
        setpoints: vec![(0.0, 0.0), (10.0, 90.0), (12.0, 190.0)],
        ..YawControl::default()
    });
    let found = |show: &Show| {
        let report = check(&CheckInput::new(show, &limits()));
        let names =
            ["acceleration-horizontal", "acceleration-vertical", "yaw-rate", "nav-altitude"];
        names.map(|name| report.counts.get(name).map_or(0, |count| count.errors + count.warnings))
    };
    assert_eq!(found(&show), [0; 4], "nothing is stated");
    let stated = |xy, z, yaw, altitude| Validation {
        max_acceleration_xy_mps2: Some(xy),
        max_acceleration_z_mps2: Some(z),
        max_yaw_rate_dps: Some(yaw),
        min_nav_altitude_m: Some(altitude),
        ..Validation::default()
    };
    show.validation = Some(stated(4.0, 4.0, 60.0, 2.5));
    assert_eq!(found(&show), [0; 4], "looser than the vehicle, or kept");
    show.validation = Some(stated(0.5, 0.5, 30.0, 5.0));
    let [horizontal, vertical, yaw, altitude] = found(&show);
    assert_eq!((horizontal, vertical), (2, 0), "where each swing begins, to the side alone");
    assert_eq!(yaw, 1, "drone 2 turns at 50 deg/s");
    assert!(altitude > 0, "it moves sideways at 3 m");
    let report = check(&CheckInput::new(&show, &limits()));
    let text = report.to_string();
    assert!(
        text.contains("warning[yaw-rate] Drone 2 at 10.000 s: turns at 50.000 deg/s"),
        "{text}"
    );
    let report = check(&CheckInput::new(&show, &limits()).with_stock(&limits()));
    assert!(!report.counts.contains_key("limits"), "{report}");
    show.validation = Some(stated(4.0, 4.0, 60.0, 2.5));
    let report = check(&CheckInput::new(&show, &limits()).with_stock(&limits()));
    let text = report.to_string();
    assert!(text.contains("the show states max_acceleration_mps2 = 4 m/s²"), "{text}");
}

/// What is not checked is named.
#[test]
fn what_is_there_and_not_checked_is_named() {
    let mut show = show(vec![calm(1, 0.0, 0.0), calm(2, 10.0, 0.0), calm(3, 20.0, 0.0)]);
    show.doubts = vec!["cues.json: cue 2 has no time and is left out".to_owned()];
    show.drones[0].extras = Extras { pyro_events: 3, has_rth_plan: true, spare_coordinates: 0 };
    show.drones[1].extras = Extras { pyro_events: 1, has_rth_plan: false, spare_coordinates: 7 };
    let report = check(&CheckInput::new(&show, &limits()));
    assert!(report.passed(), "{report}");
    let text = report.to_string();
    for words in [
        "warning[file]: cues.json: cue 2 has no time and is left out",
        "warning[file] Drone 2: has points with more than three coordinates",
        "note: pyro: 4 events of 2 drones (first Drone 1); they are not checked",
        "note: return-to-home plan of Drone 1: ",
    ] {
        assert!(text.contains(words), "{words}\n{text}");
    }
}

/// A fleet that does the same by design is told so once; what one of them does is its own.
#[test]
fn equal_warnings_of_many_drones_are_one() {
    let low = |number: usize, height: f64| {
        let x = 10.0 * number as f64;
        let segments = vec![
            line(10_000, x, 0.0, 10.0),
            line(10_000, x, 0.0, height),
            hold(10_000),
            line(10_000, x, 0.0, 10.0),
            line(10_000, x, 0.0, 2.5),
        ];
        drone(number, x, 0.0, segments)
    };
    let mut drones: Vec<_> = (1..=9).map(|number| low(number, 1.5)).collect();
    drones.push(low(10, 1.2));
    let report = run(drones);
    let low: Vec<_> = report.findings.iter().filter(|found| found.check == "low-flight").collect();
    assert_eq!(low.iter().map(|found| found.drones.len()).collect::<Vec<_>>(), [1, 9], "{report}");
    let text = report.to_string();
    assert!(text.contains("warning[low-flight] drones 1-10, 2 findings; the worst: "), "{text}");
    let each = report.each_finding();
    assert!(each.contains("warning[low-flight] drones 1-9 at "), "{each}");
    assert_eq!(report.counts["low-flight"].warnings, 2);
}

/// Templates of what meteorologists fly, in the fleets that they have, by the vehicles that come with the program.
#[test]
fn profiles_columns_crosses_and_race_tracks_can_be_flown_as_they_are() {
    for template in ["profile", "column", "cross", "race-track"] {
        for (rows, columns) in [(4, 4), (7, 7), (1, 1)] {
            for vehicle in ["airsim-generic-quad", "pixel"] {
                let flight = planned(
                    template,
                    &[
                        &format!("grid.rows={rows}"),
                        &format!("grid.columns={columns}"),
                        &format!("vehicle={vehicle}"),
                    ],
                );
                let report = of_plan(&flight);
                let what = format!("{template}, {rows} x {columns}, {vehicle}");
                assert_eq!(flight.plan.slots.len(), rows * columns, "{what}");
                let bad: Vec<_> =
                    report.findings.iter().filter(|one| one.severity == Severity::Error).collect();
                assert!(bad.is_empty(), "{what}: {report}");
                assert_eq!(named(&report, "ladder-window"), [""; 0], "{what}");
            }
        }
    }
}

#[test]
fn a_cross_has_its_drones_on_two_lines() {
    let home = |drones: &str| {
        let plan = planned("cross", &[drones, "grid.rows=4", "grid.columns=4"]).plan;
        plan.slots.iter().map(|slot| slot.home_m).collect::<Vec<_>>()
    };
    let [middle, ahead, behind, left, right] = home("grid.drones=5")[..] else { panic!() };
    assert_eq!(middle, [0.0, 0.0, 0.0]);
    assert_eq!((ahead, behind), ([10.0, 0.0, 0.0], [-10.0, 0.0, 0.0]));
    assert_eq!((left, right), ([0.0, 10.0, 0.0], [0.0, -10.0, 0.0]));
    let all = home("grid.drones=16");
    assert!(all.iter().all(|place| place[0] == 0.0 || place[1] == 0.0), "{all:?}");
    let along = all.iter().filter(|place| place[1] == 0.0).count();
    assert_eq!((all.len(), along), (16, 9));
}

#[test]
fn a_repeat_over_heights_climbs_to_each() {
    let plan =
        planned("column", &["heights_m=[30.0, 10.0, 50.0]", "grid.rows=1", "grid.columns=1"]);
    let hovers = plan.plan.groups[0].segments.iter().filter(|segment| segment.kind.is_hover());
    let heights: Vec<f64> = hovers.map(|segment| segment.from_m[2]).collect();
    assert_eq!(heights, [30.0, 10.0, 50.0]);
    let both = resolve("column", &[Override::parse("steps.0.times=2").unwrap()]);
    let error = both.unwrap_err().to_string();
    assert!(error.contains("one of `speeds_mps`, `heights_m` and `times`"), "{error}");
}
