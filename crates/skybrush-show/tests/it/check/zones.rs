//! Every zone of a show's fence counts: inside all inclusion zones, outside all exclusion zones, on
//! the curve itself and on the ground.

use crate::check::support::*;
use skybrush_show::check::{CheckInput, CheckReport, Finding, check};
use skybrush_show::trajectory::Segment;
use skybrush_show::{FenceZone, ShowDrone};

fn square(x0: f64, y0: f64, x1: f64, y1: f64) -> Vec<[f64; 2]> {
    vec![[x0, y0], [x1, y0], [x1, y1], [x0, y1]]
}

fn wide() -> FenceZone {
    FenceZone::inclusion(square(-50.0, -50.0, 50.0, 50.0))
}

fn flown(drone: ShowDrone, zones: Vec<FenceZone>) -> CheckReport {
    let mut show = show(vec![drone]);
    show.fence = zones;
    check(&CheckInput::new(&show, &limits()))
}

fn out(middle: Vec<Segment>, to: (f64, f64), zones: Vec<FenceZone>) -> CheckReport {
    flown(flight(1, (0.0, 0.0), middle, to), zones)
}

fn excluded(report: &CheckReport) -> Finding {
    only(report, "fence-exclusion")
}

#[test]
fn straight_through_an_exclusion_zone() {
    let way = || vec![line(20_000, 30.0, 0.0, 10.0)];
    let zone = FenceZone::exclusion(square(10.0, -5.0, 12.0, 5.0));
    let found = excluded(&out(way(), (30.0, 0.0), vec![wide(), zone.clone()]));
    assert_eq!(found.drones, ["Drone 1"]);
    assert!((found.time_s.unwrap() - (10.0 + 20.0 / 3.0)).abs() < 1e-6, "{found}");
    assert!((found.end_s.unwrap() - 18.0).abs() < 1e-6, "{found}");
    assert!((found.value.unwrap() + 1.0).abs() < 0.01, "{found}");
    assert!(found.message.contains(" m from exclusion zone 2 at 17.3"), "{found}");
    // Listed first, and alone.
    let found = excluded(&out(way(), (30.0, 0.0), vec![zone.clone(), wide()]));
    assert!(found.message.contains("from exclusion zone 1 at"), "{found}");
    let alone = out(way(), (30.0, 0.0), vec![zone]);
    excluded(&alone);
    assert!(alone.notes.iter().any(|note| note.contains("only excludes")), "{alone}");
    // Beside the way it is no matter.
    let beside = FenceZone::exclusion(square(10.0, 1.0, 12.0, 5.0));
    let report = out(way(), (30.0, 0.0), vec![wide(), beside.clone()]);
    clean(&report);
    assert!((report.margin("fence-exclusion").unwrap().value - 1.0).abs() < 1e-6, "{report}");
    assert!(report.notes.is_empty(), "{report}");
    // ... unless the fence asks for a margin.
    let mut show = show(vec![flight(1, (0.0, 0.0), way(), (30.0, 0.0))]);
    show.fence = vec![beside];
    let (fence, limits) = (fence(45.0), limits());
    let report = check(&CheckInput { fence: Some(&fence), ..CheckInput::new(&show, &limits) });
    let found = excluded(&report);
    assert_eq!(found.limit, Some(5.0));
    assert!((found.value.unwrap() - 1.0).abs() < 1e-6, "{found}");
}

#[test]
fn on_the_ground_too() {
    let zone = FenceZone::exclusion(square(25.0, -5.0, 35.0, 5.0));
    let landing = out(vec![line(20_000, 30.0, 0.0, 10.0)], (30.0, 0.0), vec![wide(), zone.clone()]);
    assert_eq!(excluded(&landing).end_s, Some(40.0), "{landing}");
    // The stated landing place alone, and the home alone.
    let mut lands = calm(1, 0.0, 0.0);
    lands.land_at_m = Some(v(30.0, 0.0, 0.0));
    let report = flown(lands, vec![zone]);
    let found = report.findings.iter().find(|found| found.check == "fence-exclusion");
    assert_eq!(found.and_then(|found| found.value), Some(-5.0), "{report}");
    let mut stands = calm(1, 0.0, 0.0);
    stands.home_m = Some(v(-2.0, 0.0, 0.0));
    let report = flown(stands, vec![FenceZone::exclusion(square(-3.0, -1.0, -1.0, 1.0))]);
    let found = report.findings.iter().find(|found| found.check == "fence-exclusion");
    assert_eq!(found.and_then(|found| found.time_s), Some(0.0), "{report}");
}

#[test]
fn a_curve_that_bulges_into_a_zone() {
    // The arc's top is at 3/4 of the height of its control points; both its ends are far away.
    let arc = cubic(20_000, [[0.0, 20.0, 10.0], [40.0, 20.0, 10.0], [40.0, 0.0, 10.0]]);
    let report = |from_m: f64| {
        let zone = FenceZone::exclusion(square(15.0, from_m, 25.0, 30.0));
        out(vec![arc.clone()], (40.0, 0.0), vec![wide(), zone])
    };
    clean(&report(15.01));
    let found = excluded(&report(14.9));
    assert!((found.value.unwrap() + 0.1).abs() < 0.011, "{found}");
    assert!((found.time_s.unwrap() - 20.0).abs() < 1.5, "{found}");
}

#[test]
fn inside_every_inclusion_zone() {
    let way = || vec![line(20_000, 30.0, 0.0, 10.0)];
    let east = FenceZone::inclusion(square(-10.0, -10.0, 20.0, 10.0));
    let found = only(&out(way(), (30.0, 0.0), vec![wide(), east]), "fence");
    assert!(found.message.contains("-10.000 m from inclusion zone 2 at 30.000 s"), "{found}");
}

#[test]
fn a_zone_that_is_none_is_refused() {
    let zone = FenceZone::exclusion(vec![[0.0, 0.0], [1.0, 1.0]]);
    let found = only(&flown(calm(1, 0.0, 0.0), vec![wide(), zone]), "validity");
    assert!(found.message.starts_with("zone 2 of the fence needs three corners"), "{found}");
}
