//! The grammar: what templates mean, and what they are told when they are wrong.

use super::plan::{Plan, Segment, SegmentKind};
use super::resolve::{MissionError, Override, resolve, resolve_text};

fn set(text: &str) -> Override {
    Override::parse(text).unwrap()
}

fn plan_of(name: &str, overrides: &[&str]) -> Plan {
    let overrides: Vec<_> = overrides.iter().map(|text| set(text)).collect();
    resolve(name, &overrides).unwrap().flights.remove(0).plan
}

/// The calibration template with one piece of its text replaced.
fn with(from: &str, to: &str) -> Result<Plan, MissionError> {
    let text = include_str!("../../templates/calibration.toml");
    assert!(text.contains(from), "the template no longer has {from}");
    resolve_text("mine.toml", &text.replacen(from, to, 1), &[])
        .map(|mut mission| mission.flights.remove(0).plan)
}

fn refusal(from: &str, to: &str) -> String {
    with(from, to).expect_err(to).to_string()
}

#[test]
fn the_papers_ladder_has_15_hovers_and_14_legs_in_430_s() {
    let plan = plan_of("calibration", &[]);
    assert_eq!(plan.slots.len(), 49);
    let segments = &plan.groups[0].segments;
    let hovers: Vec<_> = segments.iter().filter(|s| s.kind == SegmentKind::Hover).collect();
    let legs: Vec<_> = segments.iter().filter(|s| s.kind.is_leg()).collect();
    assert_eq!((hovers.len(), legs.len()), (15, 14));
    assert_eq!(hovers[14].end_ms - hovers[0].start_ms, 430_000);
    assert_eq!(hovers[0].from_m[2], 20.0);
    let fastest = legs[12];
    assert_eq!((fastest.velocity_mps[2], fastest.to_m[2]), (3.5, 90.0));
    let window = fastest.window.unwrap();
    assert_eq!(window.start_ms - fastest.start_ms, 10_000);
    assert_eq!(fastest.end_ms - window.end_ms, 1_000);
    let window = hovers[0].window.unwrap();
    assert_eq!((window.start_ms - hovers[0].start_ms, window.duration_s()), (3_000, 6.0));
}

#[test]
fn every_segment_starts_where_the_last_one_ended() {
    for name in ["calibration", "hover", "calibration-counterphase"] {
        for ramp in ["motion.ramp_mps2=0", "motion.ramp_mps2=1.5"] {
            for group in plan_of(name, &[ramp]).groups {
                let mut at_ms = 0;
                let mut at_m = [0.0; 3];
                for segment in &group.segments {
                    assert_eq!(segment.start_ms, at_ms, "{name} {}", segment.label);
                    assert_eq!(segment.from_m, at_m, "{name} {}", segment.label);
                    (at_ms, at_m) = (segment.end_ms, segment.to_m);
                }
                assert_eq!(at_m, [0.0, 0.0, 2.5], "{name} ends above home");
            }
        }
    }
}

#[test]
fn ramps_change_velocity_without_jumps_and_keep_the_heights() {
    let plan = plan_of("calibration", &["motion.ramp_mps2=1.0"]);
    let slot = &plan.slots[0];
    let trajectory = plan.trajectory(slot);
    let mut before = nalgebra::Vector3::zeros();
    for piece in trajectory.pieces() {
        let jump = (piece.state(0.0).velocity_mps - before).norm();
        assert!(jump < 1e-3, "a jump of {jump} m/s at {} ms", piece.start_ms);
        before = piece.state(1.0).velocity_mps;
    }
    let top = plan.groups[0].segments.iter().map(|s| s.to_m[2]).fold(0.0, f64::max);
    assert!((top - 90.0).abs() < 1e-9, "the highest rung ends at {top} m");
}

#[test]
fn counterphase_halves_move_in_opposite_directions() {
    let plan = plan_of("calibration-counterphase", &[]);
    let [even, odd] = &plan.groups[..] else { panic!("two groups") };
    assert_eq!(plan.slots.iter().filter(|slot| slot.group == 0).count(), 25);
    let moving_at = |segments: &[Segment], ms: u64| {
        segments
            .iter()
            .find(|s| s.start_ms <= ms && ms < s.end_ms)
            .map_or(0.0, |s| s.velocity_mps[2])
    };
    let mut opposite = 0;
    for leg in even.segments.iter().filter(|s| s.kind.is_leg()) {
        let middle = u64::midpoint(leg.start_ms, leg.end_ms);
        let other = moving_at(&odd.segments, middle);
        assert!(other * leg.velocity_mps[2] <= 0.0, "both halves move alike at {middle} ms");
        opposite += usize::from(other * leg.velocity_mps[2] < 0.0);
    }
    assert!(opposite >= 13, "only {opposite} of 16 legs are in counter-phase");
    let horizontal = |segments: &[Segment]| {
        let legs = segments.iter().filter(|s| s.kind == SegmentKind::Horizontal);
        legs.map(|s| (s.start_ms, s.velocity_mps)).collect::<Vec<_>>()
    };
    assert_eq!(horizontal(&even.segments), horizontal(&odd.segments), "flown together");
    assert_eq!(even.segments.last().unwrap().end_ms, odd.segments.last().unwrap().end_ms);
}

#[test]
fn offsets_without_a_stagger_step_are_waited_on_the_ground() {
    let groups = r#"groups = [{ name = "a", select = "rows-even" }, { name = "b", select = "rows-odd", offset_s = 30 }]"#;
    let plan = with("[site]", &format!("{groups}\n[site]")).unwrap();
    let first = &plan.groups[1].segments[0];
    assert_eq!((first.kind, first.end_ms, first.to_m), (SegmentKind::Wait, 30_000, [0.0; 3]));
}

#[test]
fn grids_of_any_number_of_drones() {
    for (sets, rows, columns, count) in [
        (vec!["grid.rows=3", "grid.columns=4"], 3, 4, 12),
        (vec!["grid.drones=47"], 7, 7, 47),
        (vec!["grid.rows=1", "grid.columns=1"], 1, 1, 1),
        (vec!["grid.rows=50", "grid.columns=100"], 50, 100, 5000),
    ] {
        let plan = plan_of("calibration", &sets);
        let grid = plan.grid.unwrap();
        assert_eq!((grid.rows, grid.columns, plan.slots.len()), (rows, columns, count));
        let full = rows as usize * columns as usize == count;
        let mean = plan.slots.iter().map(|s| s.home_m[0] + s.home_m[1]).sum::<f64>();
        assert!(!full || mean.abs() < 1e-6, "centred on the origin");
    }
}

#[test]
fn a_resolved_template_gives_the_same_plan_again() {
    let sets = [set("leg_s=15"), set("speeds_mps=[1, 2]"), set("grid.spacing_m=5.5")];
    let flight = resolve("calibration", &sets).unwrap().flights.remove(0);
    let again = resolve_text("template.toml", &flight.template_text, &[]).unwrap();
    assert_eq!(again.flights[0].plan, flight.plan);
}

#[test]
fn a_campaign_passes_overrides_to_the_flights_that_have_them() {
    let sets = [set("leg_s=15"), set("grid.rows=2"), set("hover.duration_s=60")];
    let mission = resolve("campaign", &sets).unwrap();
    let [calibration, hover] = &mission.flights[..] else { panic!("two flights") };
    assert_eq!(calibration.plan.slots.len(), 14);
    assert_eq!(hover.plan.slots.len(), 14);
    let longest = |plan: &Plan, kind| {
        let of_kind = plan.groups[0].segments.iter().filter(|s| s.kind == kind);
        of_kind.map(|s| s.end_ms - s.start_ms).max().unwrap()
    };
    assert_eq!(longest(&calibration.plan, SegmentKind::LegUp), 15_000);
    assert_eq!(longest(&hover.plan, SegmentKind::Hover), 60_000);
    let error = resolve("campaign", &[set("leg=15")]).unwrap_err().to_string();
    assert!(error.starts_with("cannot set leg: none of the campaign's flights has such a key; did you mean leg_s? there are the parameters "), "{error}");
}

#[test]
fn wrong_templates_are_told_where_and_what_is_allowed() {
    let mistakes = [
        ("spacing_m = 7.0", "spacing_m = \"ten\""),
        ("spacing_m = 7.0", "spacing = 7.0"),
        ("spacing_m = 7.0", "spacing_m = -7.0"),
        ("spacing_m = 7.0", "spacing_m = nan"),
        ("rows = 7", "rows = 800"),
        ("rows = 7", "rows = 0"),
        ("leg_s = 20.0", "leg_s = -1"),
        ("leg_s = 20.0", "legs_s = 20"),
        ("speeds_mps = [0.5, 1.0", "speeds_mps = [0.5, -1.0"),
        ("direction = \"up\"", "direction = \"down\""),
        ("direction = \"up\"", "direction = \"sideways\""),
        ("direction = \"up\"", "heading_deg = 10"),
        ("kind = \"climb\"\nto_m", "kind = \"climb\"\nto"),
        ("to_m = \"$baseline_m\"", ""),
        ("vehicle = \"airsim", "vehicle = \"airbus"),
        ("origin = [47.4733, 19.0621]", "origin = [474733130, 19]"),
        ("updraft.template/1", "updraft.template/9"),
        ("name = \"calibration\"", "name = \"../x\""),
        ("ramp_mps2 = 0.0", "ramp_mps2 = 0.1"),
        ("[grid]", "[grid"),
        ("purpose = \"calibration\"", "purpose = \"fun\""),
    ];
    let told: Vec<_> = mistakes
        .iter()
        .map(|(from, to)| format!("{from}  ->  {to}\n{}\n", refusal(from, to)))
        .collect();
    insta::assert_snapshot!(told.join("\n"));
}

#[test]
fn wrong_overrides_are_told_what_is_wrong() {
    for (text, expected) in [
        ("leg_s", "write it as KEY=VALUE"),
        ("steps.99.speed_mps=1", "not one of the 3 entries"),
        ("grid.rows.x=1", "inside a plain value"),
        ("nonsense=1", "has no such key"),
        (
            "foo.bar=3",
            "the parameters baseline_m, hover_s, leg_s, speeds_mps, transfer_mps, and what",
        ),
        ("foo.bar=3", "is under name, title, purpose, vehicle, site, grid, takeoff,"),
        ("takeof.speed_mps=2", "did you mean takeoff?"),
        ("legs_s=2", "did you mean leg_s?"),
        ("grid.spacing_m=abc", "grid.spacing_m is a number; allowed: 0.5 to 1000 m"),
        ("takeoff.speed_mps=fast", "takeoff.speed_mps is a number; allowed: 0.1 to 50 m/s"),
        ("site.orientation_deg=1e300", "= 1e300\n"),
        ("speeds_mps=[1, -1e300]", ", -1e300]\n"),
    ] {
        let error = Override::parse(text)
            .and_then(|item| resolve("calibration", &[item]).map(|_| ()))
            .unwrap_err()
            .to_string();
        assert!(error.contains(expected), "{text}: {error}");
    }
}

#[test]
fn legs_behind_a_ladder_go_to_all_sides_and_back() {
    let overrides = [set("vehicle=pixel"), set("grid.rows=2"), set("legs.speeds_mps=[3, 6]")];
    let mission = resolve("calibration", &overrides).unwrap();
    let flight = &mission.flights[0];
    let segments = &flight.plan.groups[0].segments;
    let legs: Vec<_> = segments.iter().filter(|s| s.kind == SegmentKind::Horizontal).collect();
    assert_eq!(legs.len(), 8);
    assert!(legs.iter().all(|leg| leg.window.is_some_and(|window| window.duration_s() >= 8.0)));
    let fast = legs.iter().filter(|leg| leg.label.starts_with("6 m/s")).count();
    assert_eq!(fast, 4);
    let last = legs[7].end_ms;
    let after = segments.iter().find(|s| s.kind == SegmentKind::Hover && s.start_ms >= last);
    let after = after.unwrap();
    assert!(after.window.is_some(), "a hover to compare with");
    for (to, home) in after.to_m.into_iter().zip([0.0, 0.0, 20.0]) {
        assert!((to - home).abs() < 1e-6, "{:?}", after.to_m);
    }
    let plain = plan_of("calibration", &["vehicle=pixel", "grid.rows=2"]).groups.remove(0).segments;
    let before = plain.len() - 1;
    assert_eq!(segments[..before], plain[..before], "the ladder is as it was");
}

#[test]
fn legs_of_a_hover_are_flown_behind_it_at_its_height() {
    let plain = plan_of("hover", &["vehicle=pixel", "grid.rows=2"]).groups.remove(0).segments;
    let with = ["vehicle=pixel", "grid.rows=2", "legs.speeds_mps=[3, 6]"];
    let segments = plan_of("hover", &with).groups.remove(0).segments;
    let hover = plain.iter().position(|s| s.kind == SegmentKind::Hover).unwrap();
    assert_eq!(segments[..=hover], plain[..=hover], "the hover is as it was");
    let (legs, rest): (Vec<&Segment>, Vec<&Segment>) =
        segments.iter().partition(|segment| segment.calibrates_wind);
    assert_eq!(rest.len(), plain.len(), "and so is the way down");
    let flown = |kind| legs.iter().filter(move |segment| segment.kind == kind);
    assert_eq!(flown(SegmentKind::Horizontal).count(), 8);
    assert_eq!(flown(SegmentKind::Hover).count(), 9);
    // A hover's own window waits for 10 s, which is most of a leg.
    for kind in [SegmentKind::Horizontal, SegmentKind::Hover] {
        assert!(flown(kind).all(|s| s.window.is_some_and(|window| window.duration_s() >= 4.0)));
    }
    assert!(legs.iter().all(|segment| segment.from_m[2] == 100.0));
    let json = serde_json::to_string(&plain).unwrap();
    assert!(!json.contains("calibrates_wind"), "other plans keep their bytes");
}
