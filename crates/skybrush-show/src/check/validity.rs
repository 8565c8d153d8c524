//! Check that the numbers of a show make sense at all; every other check relies on it.

use super::fence::{usable, usable_polygon};
use super::report::{Collector, Finding, Severity};
use super::track::name_of;
use super::{CheckInput, MAX_DRONES};
use crate::ShowDrone;
use crate::trajectory::SegmentPath;
use untrusted_io::number::plain;

const CHECK: &str = "validity";
/// Coordinates beyond this are taken for mistakes, m.
const MAX_COORDINATE_M: f64 = 1e6;

fn error(
    drones: Vec<String>,
    time_s: Option<f64>,
    message: String,
    remedy: &'static str,
) -> Finding {
    Finding { drones, time_s, ..Finding::new(Severity::Error, CHECK, message, remedy) }
}

/// Reports what is broken; returns for each drone whether the other checks can look at it.
pub(super) fn check(input: &CheckInput<'_>, collector: &mut Collector) -> Vec<bool> {
    let drones = &input.show.drones;
    if drones.is_empty() {
        collector.add(0, error(vec![], None, "the show has no drones".into(), ""));
    }
    if drones.len() > MAX_DRONES {
        let message =
            format!("the show has {} drones, the loader takes {MAX_DRONES}", drones.len());
        let finding = Finding {
            value: Some(drones.len() as f64),
            limit: Some(MAX_DRONES as f64),
            unit: "drones",
            ..error(vec![], None, message, "split the show")
        };
        collector.add(0, finding);
    }
    check_limits(input, collector);
    drones.iter().enumerate().map(|(index, drone)| check_drone(index, drone, collector)).collect()
}

fn check_limits(input: &CheckInput<'_>, collector: &mut Collector) {
    let limits = input.limits;
    let named = [
        ("max_speed_xy_mps", limits.max_speed_xy_mps),
        ("max_speed_up_mps", limits.max_speed_up_mps),
        ("max_speed_down_mps", limits.max_speed_down_mps),
        ("max_acceleration_mps2", limits.max_acceleration_mps2),
        ("max_velocity_step_mps", limits.max_velocity_step_mps),
        ("max_altitude_m", limits.max_altitude_m),
        ("min_distance_m", limits.min_distance_m),
        ("endurance_s", limits.endurance_s),
        ("endurance_reserve", limits.endurance_reserve),
    ];
    for (name, value) in named {
        // A limit that compares false with everything would let everything pass.
        if value.is_nan() || value < 0.0 {
            let message =
                format!("the limit {name} is {}: nothing can be checked against it", plain(value));
            collector.add(0, error(vec![], None, message, "correct the vehicle's limits"));
        }
    }
    if input.fence.is_some_and(|fence| !usable(fence)) {
        let message = "the fence needs three corners or more, and finite numbers".to_owned();
        collector.add(0, error(vec![], None, message, "correct the fence"));
    }
    for (index, zone) in input.show.fence.iter().enumerate() {
        if !usable_polygon(&zone.corners_m) {
            let message = format!(
                "zone {} of the fence needs three corners or more, and finite numbers",
                index + 1
            );
            collector.add(0, error(vec![], None, message, "correct the fence"));
        }
    }
}

fn check_drone(index: usize, drone: &ShowDrone, collector: &mut Collector) -> bool {
    let name = || vec![name_of(drone, index)];
    let sound = |point: &nalgebra::Vector3<f64>| {
        point.iter().all(|value| value.is_finite() && value.abs() <= MAX_COORDINATE_M)
    };
    let mut usable = true;
    let mut refuse = |time_s: Option<f64>, what: &str| {
        let message = format!(
            "{what} is not a finite place within {:.0} km; its other checks are left out",
            MAX_COORDINATE_M / 1000.0
        );
        collector.add(index, error(name(), time_s, message, "correct the trajectory"));
        usable = false;
    };
    let places = [("home", drone.home_m), ("the landing place", drone.land_at_m)];
    for (what, place) in places {
        if place.is_some_and(|place| !sound(&place)) {
            refuse(None, what);
        }
    }
    if !sound(&drone.trajectory.start_m) {
        refuse(Some(0.0), "the first point");
    }
    let mut standing_s = None;
    for piece in drone.trajectory.pieces() {
        let good = match piece.path {
            SegmentPath::Hold => true,
            SegmentPath::Line(to) => sound(to),
            SegmentPath::Cubic(points) => points.iter().all(sound),
            SegmentPath::Septic(points) => points.iter().all(sound),
        };
        let start_s = piece.start_ms as f64 / 1000.0;
        if !good {
            refuse(Some(start_s), "a point of the trajectory");
            break;
        }
        if piece.end_ms <= piece.start_ms && standing_s.is_none() {
            standing_s = Some(start_s);
        }
    }
    if let Some(time_s) = standing_s {
        let message = "a piece of the trajectory takes no time".to_owned();
        let remedy = "give every piece 1 ms or more";
        collector.add(index, error(name(), Some(time_s), message, remedy));
    }
    if drone.trajectory.segments.is_empty() {
        let message = "the trajectory is empty".to_owned();
        collector.add(index, error(name(), None, message, "give the drone something to fly"));
    }
    usable
}
