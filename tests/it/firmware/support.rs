//! The flights that were flown with the real firmware in its own simulator, flown by ours, and what
//! is compared of them.

#![allow(dead_code, clippy::allow_attributes, reason = "each test binary uses a part of it")]

use std::path::Path as FilePath;

use nalgebra::Vector3;
use updraft::analysis::result::WindowStats;
use updraft::analysis::windows::{Target, Tilt, WindowOptions, correct_tilt, measure};
use updraft::base::frame::{Geodetic, ShowFrame};
use updraft::base::time::GpsTime;
use updraft::flight::{Flight, FlightOptions};
use updraft::log::{Log, Select};
use updraft::mission::plan::SegmentKind;
use updraft::show::{Segment, SegmentPath, Trajectory};
use updraft::sim::{FlightSetup, Hooks, Uniform, fly};
use updraft::vehicle::Vehicle;
use updraft::vehicle::library::builtin;

/// A log of the firmware in `tests/data`.
pub(crate) fn fixture(name: &str) -> Log {
    let folder = FilePath::new(env!("CARGO_MANIFEST_DIR")).join("crates/dataflash/tests/data");
    Log::open(&folder.join(name)).expect("a fixture")
}

/// The vehicle that the firmware's simulator flew.
pub(crate) fn sitl() -> Vehicle {
    builtin("arducopter-sitl").expect("a built-in vehicle")
}

/// Show made of straight lines, from the ground: (duration ms, end x, y, z m).
pub(crate) fn show(points: &[(u32, f64, f64, f64)]) -> Trajectory {
    let segments = points.iter().map(|&(duration_ms, x, y, z)| Segment {
        duration_ms,
        path: SegmentPath::Line(Vector3::new(x, y, z)),
    });
    Trajectory { start_m: Vector3::zeros(), segments: segments.collect() }
}

/// The ladder that was uploaded to the firmware: up to 20 m at 2 m/s, the legs, down to 3 m at
/// 2 m/s, 2 s there.
pub(crate) fn ladder() -> Trajectory {
    let mut points = vec![(10_000, 0.0, 0.0, 20.0), (10_000, 0.0, 0.0, 20.0)];
    for step in 1..=7 {
        let top_m = 20.0 + 10.0 * f64::from(step);
        for (duration_ms, height_m) in
            [(20_000, top_m), (10_000, top_m), (20_000, 20.0), (10_000, 20.0)]
        {
            points.push((duration_ms, 0.0, 0.0, height_m));
        }
    }
    points.extend([(8_500, 0.0, 0.0, 3.0), (2_000, 0.0, 0.0, 3.0)]);
    show(&points)
}

/// The ladder's steps of velocity: show time (s) and the speed after it (m/s).
pub(crate) fn steps() -> Vec<(f64, f64)> {
    let mut steps = vec![(10.0, 0.0)];
    for step in 1..=7 {
        let (speed, start_s) = (f64::from(step) * 0.5, 20.0 + 60.0 * f64::from(step - 1));
        steps.extend([
            (start_s, speed),
            (start_s + 20.0, 0.0),
            (start_s + 30.0, -speed),
            (start_s + 50.0, 0.0),
        ]);
    }
    steps
}

/// The windows of the ladder's legs and hovers.
pub(crate) fn windows(flight: &Flight) -> Vec<WindowStats> {
    let target = |(start_s, commanded_mps): (f64, f64)| {
        let (kind, after_s, until_s) = if commanded_mps == 0.0 {
            (SegmentKind::Hover, 3.0, 9.0)
        } else {
            (SegmentKind::LegUp, 10.0, 19.0)
        };
        Target {
            kind,
            label: format!("{commanded_mps:+.1} m/s from {start_s} s"),
            start_s: start_s + after_s,
            end_s: start_s + until_s,
            commanded_mps,
        }
    };
    let targets: Vec<_> = steps().into_iter().map(target).collect();
    let options = WindowOptions { tilt: Tilt::Paper, ..WindowOptions::default() };
    measure(flight, &correct_tilt(flight, &options), &targets, &options)
}

/// The log of a flight of ours at the firmware's place, heading north, in a uniform wind (m/s,
/// towards north, west and up).
pub(crate) fn flown(
    vehicle: &Vehicle,
    show: &Trajectory,
    wind_mps: Vector3<f64>,
    seed: u64,
) -> Log {
    let origin = Geodetic { lat_deg: -35.363_261, lon_deg: 149.165_230, amsl_m: 584.0 };
    let setup = FlightSetup {
        vehicle,
        trajectory: show,
        home_m: Vector3::zeros(),
        frame: ShowFrame { origin, orientation_deg: 0.0 },
        atmosphere: &Uniform(wind_mps),
        seed,
        drone: 1,
        start: GpsTime { week: 2445, tow_ms: 442_755_000 },
        lights: &[],
        full_logs: false,
        hooks: Hooks::default(),
    };
    let mut log = Vec::new();
    fly(&setup, &mut log).expect("a flight");
    Log::from_bytes(log)
}

/// A log as the analysis reads it.
pub(crate) fn read(log: &Log) -> Flight {
    Flight::from_log(log, FilePath::new("flight"), FlightOptions::default()).expect("a flight")
}

/// Show time at which a stage began, s.
pub(crate) fn stage_s(flight: &Flight, stage: u8) -> f64 {
    flight.stages.iter().find(|(_, other)| *other == stage).expect("a stage").0
}

/// Distances from the show's target: show time (s), horizontal (m) and vertical (m, up).
pub(crate) fn distances(log: &Log) -> Vec<[f64; 3]> {
    let fields = ["ClockMS", "HDist", "VDist"];
    let (tables, _) = log.select(&[Select { message: "SHOW", fields: &fields }]);
    let column = |field: &str| tables[0].number(field).expect("a column");
    let [clock, flat, up] = fields.map(column);
    clock.iter().zip(flat).zip(up).map(|((ms, flat), up)| [ms / 1000.0, *flat, *up]).collect()
}

/// Of a component of [`distances`] the sample of greatest size within `seconds` after a time.
pub(crate) fn greatest(
    rows: &[[f64; 3]],
    component: usize,
    after_s: f64,
    seconds: f64,
) -> [f64; 2] {
    rows.iter()
        .filter(|row| (after_s..after_s + seconds).contains(&row[0]))
        .map(|row| [row[0], row[component]])
        .max_by(|a, b| a[1].abs().total_cmp(&b[1].abs()))
        .expect("rows")
}
