//! What `plan` says of templates that are not right: the line, what is wrong with it, what to do.

use crate::cli::support::Bench;

#[test]
fn speeds_that_cannot_be_flown_are_shown_where_they_stand() {
    let bench = Bench::new();
    let cases = [
        ("word", "\"fast\"", 2),
        ("none", "[]", 2),
        ("one", "[40]", 4),
        ("some", "[0.5, 40, 1]", 4),
    ];
    for (name, value, code) in cases {
        let set = format!("speeds_mps={value}");
        let ended = bench.expect(code, &["plan", "calibration", "--grid", "1x3", "--set", &set]);
        assert_eq!(ended.out.is_empty(), code == 2, "{ended}");
        insta::assert_snapshot!(format!("speeds_{name}"), ended.err);
    }
}

#[test]
fn a_ladder_that_can_give_no_law_is_refused_unless_asked_for() {
    let bench = Bench::new();
    let plan = ["plan", "calibration", "--grid", "1x2", "--leg", "2", "-o", "short"];
    let refused = bench.expect(4, &plan);
    assert!(refused.err.contains("error[ladder-speeds]: "), "{refused}");
    assert!(!bench.path("short").exists());
    let written = bench.expect(0, &[&plan[..], &["--allow", "ladder-speeds"]].concat());
    assert!(written.err.contains("allowed: error[ladder-speeds]"), "{written}");
    bench.expect(4, &["check", "short"]);
    bench.expect(0, &["check", "short", "--allow", "ladder-speeds"]);
}

#[test]
fn numbers_are_written_without_their_unit_and_the_unit_is_named() {
    let bench = Bench::new();
    for (option, value, unit) in [
        ("--height", "100ft", "metres"),
        ("--duration", "10min", "seconds"),
        ("--orientation", "north", "degrees"),
        ("--ramp", "1m/s", "m/s²"),
        ("--speeds", "1,2kn", "m/s"),
    ] {
        let ended = bench.expect(2, &["plan", "hover", option, value]);
        let (value, _) = value.split_once(",2").map_or((value, ""), |_| ("2kn", ""));
        assert!(ended.err.contains(&format!("'{value}' for '{option}")), "{ended}");
        assert!(ended.err.contains(unit), "{ended}");
    }
}

#[test]
fn a_flight_may_be_named_before_a_key_where_it_is_alone() {
    let bench = Bench::new();
    let set = |key: &str| {
        let set = format!("{key}=60");
        bench.expect(0, &["plan", "hover", "--grid", "1x1", "--dry-run", "--set", &set]).out
    };
    assert_eq!(set("hover.duration_s"), set("duration_s"));
    let other = ["plan", "hover", "--grid", "1x1", "--set", "calibration.duration_s=60"];
    assert!(bench.expect(2, &other).err.contains("calibration.duration_s"));
}

#[test]
fn one_cause_is_one_line_with_all_of_its_drones() {
    let bench = Bench::new();
    let fast = ["plan", "calibration", "--grid", "2x6", "--speeds", "1,9"];
    let refused = bench.expect(4, &fast);
    let lines: Vec<&str> = refused.err.lines().filter(|line| line.starts_with("error[")).collect();
    assert!(lines.iter().all(|line| line.contains(" drones 1-12")), "{refused}");
    assert!(lines.len() <= 6, "{refused}");
    assert!(!refused.err.contains(" more\n"), "{refused}");
    // Each of them, where that is asked for.
    let each = bench.expect(4, &[&fast[..], &["--verbose"]].concat());
    assert!(each.err.contains("error[speed-up] Drone 12 at "), "{each}");
}
