//! The flights that were flown with the real firmware in its own simulator, flown by ours.

use nalgebra::Vector3;
use updraft::base::frame::{Geodetic, ShowFrame};
use updraft::base::time::GpsTime;
use updraft::flight::{Flight, FlightOptions};
use updraft::log::Log;
use updraft::show::{Path, Segment, Trajectory};
use updraft::sim::{FlightSetup, Hooks, Uniform, fly};
use updraft::vehicle::Vehicle;

/// Legs of the speed ladder: start (s) and vertical speed (m/s), hovers with 0.
pub fn legs() -> Vec<(f64, f64)> {
    let mut legs = vec![(10.0, 0.0)];
    for step in 1..=7 {
        let (speed, start_s) = (f64::from(step) * 0.5, 20.0 + 60.0 * f64::from(step - 1));
        legs.extend(
            [(0.0, speed), (20.0, 0.0), (30.0, -speed), (50.0, 0.0)]
                .map(|(after_s, speed)| (start_s + after_s, speed)),
        );
    }
    legs
}

/// The ladder that was uploaded to the firmware: up to 20 m at 2 m/s, the legs, down to 3 m at
/// 2 m/s, 2 s there.
pub fn ladder() -> Trajectory {
    let to = |height_m: f64| Path::Line(Vector3::new(0.0, 0.0, height_m));
    let mut segments = vec![(10_000, to(20.0)), (10_000, Path::Hold)];
    for step in 1..=7 {
        let top_m = 20.0 + 20.0 * f64::from(step) * 0.5;
        segments.extend([
            (20_000, to(top_m)),
            (10_000, Path::Hold),
            (20_000, to(20.0)),
            (10_000, Path::Hold),
        ]);
    }
    segments.extend([(8_500, to(3.0)), (2_000, Path::Hold)]);
    let segments =
        segments.into_iter().map(|(duration_ms, path)| Segment { duration_ms, path }).collect();
    Trajectory { start_m: Vector3::zeros(), segments }
}

/// The log of a flight of ours at the firmware's place, heading north, in a uniform wind (m/s,
/// towards north and up).
pub fn flown(vehicle: &Vehicle, trajectory: &Trajectory, wind_mps: Vector3<f64>) -> Vec<u8> {
    let origin = Geodetic { lat_deg: -35.363_261, lon_deg: 149.165_230, amsl_m: 584.0 };
    let setup = FlightSetup {
        vehicle,
        trajectory,
        home_m: Vector3::zeros(),
        frame: ShowFrame { origin, orientation_deg: 0.0 },
        atmosphere: &Uniform(wind_mps),
        seed: 1,
        drone: 1,
        start: GpsTime { week: 2445, tow_ms: 442_755_000 },
        full_logs: false,
        hooks: Hooks::default(),
    };
    let mut log = Vec::new();
    fly(&setup, &mut log).expect("a flight");
    log
}

/// A log as the analysis reads it.
pub fn read(log: &Log) -> Flight {
    Flight::from_log(log, std::path::Path::new("flight"), FlightOptions::default())
        .expect("a flight")
}
