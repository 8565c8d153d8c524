//! Shows for the tests of the checks.
#![allow(dead_code, missing_docs, clippy::allow_attributes, unreachable_pub)]

use nalgebra::Vector3;
use skybrush_show::check::Fence;
use skybrush_show::check::Limits;
use skybrush_show::check::{CheckInput, CheckReport, Finding, check};
use skybrush_show::trajectory::{Segment, SegmentPath, Trajectory};
use skybrush_show::{Show, ShowDrone};

pub fn limits() -> Limits {
    Limits {
        max_speed_xy_mps: 5.0,
        max_speed_up_mps: 3.5,
        max_speed_down_mps: 3.0,
        max_acceleration_mps2: 2.0,
        max_velocity_step_mps: 3.5,
        max_altitude_m: 120.0,
        min_distance_m: 3.0,
        endurance_s: 900.0,
        endurance_reserve: 0.2,
    }
}

pub fn fence(half_m: f64) -> Fence {
    Fence {
        polygon_m: vec![[-half_m, -half_m], [half_m, -half_m], [half_m, half_m], [-half_m, half_m]],
        max_altitude_m: 150.0,
        margin_m: 5.0,
    }
}

pub fn v(x: f64, y: f64, z: f64) -> Vector3<f64> {
    Vector3::new(x, y, z)
}

pub fn line(duration_ms: u32, x: f64, y: f64, z: f64) -> Segment {
    Segment { duration_ms, path: SegmentPath::Line(v(x, y, z)) }
}

pub fn hold(duration_ms: u32) -> Segment {
    Segment { duration_ms, path: SegmentPath::Hold }
}

pub fn cubic(duration_ms: u32, points: [[f64; 3]; 3]) -> Segment {
    Segment { duration_ms, path: SegmentPath::Cubic(points.map(Vector3::from)) }
}

/// A drone that stands at (x, y, 0) and flies these segments.
pub fn drone(number: usize, x: f64, y: f64, segments: Vec<Segment>) -> ShowDrone {
    ShowDrone {
        name: format!("Drone {number}"),
        home_m: Some(v(x, y, 0.0)),
        land_at_m: None,
        trajectory: Trajectory { start_m: v(x, y, 0.0), segments },
        ..ShowDrone::default()
    }
}

/// Climbs at 1 m/s to 20 m, holds, and comes back to 2.5 m: nothing to complain about.
pub fn calm(number: usize, x: f64, y: f64) -> ShowDrone {
    let segments = vec![line(20_000, x, y, 20.0), hold(10_000), line(17_500, x, y, 2.5)];
    drone(number, x, y, segments)
}

/// Climbs at 1 m/s to 10 m, does `middle` from (x, y, 10), and lands from (to_x, to_y), as it is meant to.
pub fn flight(
    number: usize,
    (x, y): (f64, f64),
    middle: Vec<Segment>,
    (to_x, to_y): (f64, f64),
) -> ShowDrone {
    let mut segments = vec![line(10_000, x, y, 10.0)];
    segments.extend(middle);
    segments.push(line(10_000, to_x, to_y, 2.5));
    ShowDrone { land_at_m: Some(v(to_x, to_y, 0.0)), ..drone(number, x, y, segments) }
}

pub fn show(drones: Vec<ShowDrone>) -> Show {
    Show { drones, ..Show::default() }
}

pub fn run(drones: Vec<ShowDrone>) -> CheckReport {
    check(&CheckInput::new(&show(drones), &limits()))
}

/// All findings but the note on coarse units, which any show of more than 33 m has.
fn findings(report: &CheckReport) -> Vec<&Finding> {
    report.findings.iter().filter(|finding| finding.check != "skyb-unit").collect()
}

/// The only finding of a report, which must be of this check.
pub fn only(report: &CheckReport, name: &str) -> Finding {
    let findings = findings(report);
    assert_eq!(findings.len(), 1, "{report}");
    assert_eq!(findings[0].check, name, "{report}");
    findings[0].clone()
}

pub fn clean(report: &CheckReport) {
    assert!(findings(report).is_empty(), "{report}");
    assert!(report.passed());
}
