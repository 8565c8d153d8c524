//! Quantities that a drone's firmware derives from its trajectory: the instants of take-off and
//! landing, and whether it accepts the show at all.
//!
//! Two generations of the show fork differ. 4.4 samples the altitude at 1/16 s and lands at the end
//! of the trajectory; 4.6 finds the exact instant, reckons with a finite acceleration and the spool-up
//! of the motors, and lands early when the show ends in a vertical descent.

use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::Serialize;

use super::bezier::Scalar;
use super::trajectory::{Piece, Trajectory};

/// Generation of the show firmware, which decides how a trajectory is read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, JsonSchema)]
pub enum Firmware {
    /// CMCopter-4.4, with libskybrush 1.9.
    #[default]
    #[serde(rename = "4.4")]
    V44,
    /// CMCopter-4.6, with libskybrush 4.
    #[serde(rename = "4.6")]
    V46,
}

/// Parameters of the drone that matter. Defaults: the fork's own, with the take-off speed of the swarm
/// launcher's parameter file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeriveParams {
    /// Height above its start to which a drone climbs by itself (`SHOW_TAKEOFF_ALT`), m.
    pub takeoff_alt_m: f64,
    /// Climb rate of the take-off (`WPNAV_SPEED_UP`), m/s.
    pub speed_up_mps: f64,
    /// Vertical acceleration of the take-off (`WPNAV_ACCEL_Z`), m/s²; used by 4.6 only.
    pub accel_z_mps2: f64,
    /// Time that the motors need to spool up (`MOT_SPOOL_TIME`), s; used by 4.6 only.
    pub spool_s: f64,
    /// Largest sideways displacement along x or y in a piece that still counts as a vertical
    /// descent, m; used by 4.6 only.
    pub vertical_within_m: f64,
}

impl Default for DeriveParams {
    fn default() -> Self {
        Self {
            takeoff_alt_m: 2.5,
            speed_up_mps: 5.5,
            accel_z_mps2: 1.0,
            spool_s: 0.5,
            vertical_within_m: 0.05,
        }
    }
}

/// Schedule and acceptance of one drone's show, as its firmware derives them.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Derived {
    /// Instant at which the trajectory is `takeoff_alt_m` above its start, show time, s; `None` if
    /// it never is.
    pub reaches_takeoff_alt_s: Option<f64>,
    /// Instant of take-off, show time, s; `None` if the firmware refuses the show.
    pub takeoff_s: Option<f64>,
    /// Delay of the take-off because the show starts too late for it, s.
    pub late_s: f64,
    /// Instant at which the drone changes over to landing, show time, s.
    pub landing_s: f64,
    /// Altitude at which the landing begins, m above the start point.
    pub lands_from_m: f64,
    /// Whether the firmware accepts the show.
    pub valid: bool,
    /// Reasons for a refusal, and remarks on a show that is accepted, one sentence each.
    pub reasons: Vec<String>,
}

/// Derives what the firmware would.
///
/// ```
/// use nalgebra::Vector3;
/// use skybrush_show::derive::{DeriveParams, Firmware, derive};
/// use skybrush_show::{SegmentPath, Segment, Trajectory};
///
/// // A climb at 1 m/s: 2.5 m are reached at 2.5 s, and take 2.5 / 5.5 s.
/// let climb = Segment { duration_ms: 10_000, path: SegmentPath::Line(Vector3::new(0.0, 0.0, 10.0)) };
/// let trajectory = Trajectory { start_m: Vector3::zeros(), segments: vec![climb] };
/// let derived = derive(&trajectory, Firmware::V44, &DeriveParams::default());
/// assert!((derived.takeoff_s.unwrap() - 2.045).abs() < 1e-3);
/// ```
pub fn derive(trajectory: &Trajectory, firmware: Firmware, params: &DeriveParams) -> Derived {
    let start_z_m = trajectory.start_m.z;
    let altitude_m = start_z_m + params.takeoff_alt_m;
    let (reaches, travel_s) = match firmware {
        Firmware::V44 => {
            (reached_on_grid(trajectory, altitude_m), params.takeoff_alt_m / params.speed_up_mps)
        }
        Firmware::V46 => (
            reached(trajectory, altitude_m),
            travel_time_s(params.takeoff_alt_m, params.speed_up_mps, params.accel_z_mps2)
                + params.spool_s,
        ),
    };
    let end_s = trajectory.duration_ms() as f64 / 1000.0;
    let landing_s = match firmware {
        Firmware::V44 => end_s,
        Firmware::V46 => landing_s(trajectory, params),
    };
    let mut reasons = Vec::new();
    let takeoff_s = reaches.filter(|_| travel_s.is_finite()).map(|s| s - travel_s);
    match takeoff_s {
        None if reaches.is_some() => {
            reasons.push("the climb speed or acceleration is not positive".to_owned());
        }
        None => reasons.push(format!(
            "the trajectory never rises {} m above its start: the drone refuses the show",
            params.takeoff_alt_m
        )),
        Some(takeoff_s) if takeoff_s < 0.0 => reasons.push(format!(
            "the trajectory rises so fast that the drone should take off {:.2} s before the start; \
             it takes off at 0 and lags behind",
            -takeoff_s
        )),
        Some(_) => {}
    }
    let late_s = takeoff_s.map_or(0.0, |s| (-s).max(0.0));
    let takeoff_s = takeoff_s.map(|s| s.max(0.0));
    if takeoff_s.is_some_and(|takeoff_s| landing_s < takeoff_s) {
        reasons.push("it would land before it takes off".to_owned());
    }
    let valid = takeoff_s.is_some_and(|takeoff_s| landing_s >= takeoff_s);
    let lands_from_m = trajectory.state_at(landing_s).position_m.z - start_z_m;
    Derived {
        reaches_takeoff_alt_s: reaches,
        takeoff_s,
        late_s,
        landing_s,
        lands_from_m,
        valid,
        reasons,
    }
}

/// First time on the 1/16 s grid at which the altitude is reached. The firmware starts each piece's
/// grid at show time 0, and looks at the end of the trajectory last.
fn reached_on_grid(trajectory: &Trajectory, altitude_m: f64) -> Option<f64> {
    let mut tick = 0_u64;
    for piece in trajectory.pieces() {
        if piece.end_ms <= piece.start_ms {
            continue;
        }
        let lasts_ms = (piece.end_ms - piece.start_ms) as f64;
        // Ticks before the curve first touches the altitude need not be looked at one by one.
        let touch = if piece.from_m.z >= altitude_m {
            Some(0.0)
        } else {
            first_touch(z_points(&piece), altitude_m)
        };
        let Some(touch) = touch else {
            tick = piece.end_ms * 2 / 125 + 1;
            continue;
        };
        let touch_ms = piece.start_ms as f64 + touch * lasts_ms;
        tick = tick.max(((touch_ms / 62.5).floor() as u64).saturating_sub(1));
        // 1/16 s is 62.5 ms; the earlier piece holds at a boundary.
        while tick * 125 <= piece.end_ms * 2 {
            let u = (tick as f64 * 62.5 - piece.start_ms as f64) / lasts_ms;
            if piece.state(u).position_m.z >= altitude_m {
                return Some(tick as f64 / 16.0);
            }
            tick += 1;
        }
    }
    (trajectory.end_m().z >= altitude_m).then(|| tick as f64 / 16.0)
}

/// First instant at which the altitude is reached.
fn reached(trajectory: &Trajectory, altitude_m: f64) -> Option<f64> {
    if trajectory.start_m.z >= altitude_m {
        return Some(0.0);
    }
    trajectory.pieces().find_map(|piece| {
        let u = first_touch(z_points(&piece), altitude_m)?;
        Some(piece.start_ms as f64 / 1000.0 + u * piece.duration_s())
    })
}

fn z_points(piece: &Piece<'_>) -> Scalar {
    let mut buffer = [Vector3::zeros(); 8];
    Scalar::new(piece.path.control_points(piece.from_m, &mut buffer).iter().map(|point| point.z))
}

/// Smallest u in [0, 1] at which a curve has a value, by halving: the control points bound each half.
fn first_touch(curve: Scalar, value: f64) -> Option<f64> {
    let mut open = vec![(curve, 0.0, 1.0)];
    while let Some((curve, from, width)) = open.pop() {
        let points = curve.points();
        let (low, high) = points
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), z| (low.min(*z), high.max(*z)));
        if value < low || value > high {
            continue;
        }
        if width < 1e-12 || (curve.degree() <= 1 && high == low) {
            return Some(from);
        }
        if let [first, last] = points {
            return Some(from + width * (value - first) / (last - first));
        }
        let (left, right) = curve.halves();
        open.push((right, from + width / 2.0, width / 2.0));
        open.push((left, from, width / 2.0));
    }
    None
}

/// Time to travel a distance from rest to rest with limited speed and acceleration, s.
pub fn travel_time_s(distance_m: f64, speed_mps: f64, accel_mps2: f64) -> f64 {
    if !(distance_m >= 0.0 && speed_mps > 0.0 && accel_mps2 > 0.0) {
        return f64::INFINITY;
    }
    let full_m = speed_mps * speed_mps / accel_mps2;
    if distance_m >= full_m {
        distance_m / speed_mps + speed_mps / accel_mps2
    } else {
        2.0 * (distance_m / accel_mps2).sqrt()
    }
}

/// When 4.6 starts to land: in the vertical descent at the end, `takeoff_alt_m` above the last point;
/// at the start of that descent if it is shorter; at the end if there is none.
fn landing_s(trajectory: &Trajectory, params: &DeriveParams) -> f64 {
    let pieces: Vec<Piece<'_>> = trajectory.pieces().collect();
    let vertical = |piece: &&Piece<'_>| {
        let way = piece.end_m() - piece.from_m;
        let within = |side: f64| side.abs() <= params.vertical_within_m && -way.z >= side.abs();
        within(way.x) && within(way.y)
    };
    let descent = pieces.iter().rev().take_while(vertical).count();
    let end_s = trajectory.duration_ms() as f64 / 1000.0;
    let descent = &pieces[pieces.len() - descent..];
    let (Some(first), Some(last)) = (descent.first(), descent.last()) else {
        return end_s;
    };
    let land_z_m = last.end_m().z + params.takeoff_alt_m;
    let first_s = first.start_ms as f64 / 1000.0;
    if land_z_m >= first.from_m.z {
        return first_s;
    }
    // The firmware takes the piece at whose end the altitude has been passed.
    let crossing = descent.iter().find(|piece| piece.end_m().z < land_z_m);
    crossing.map_or(end_s, |piece| {
        let u = first_touch(z_points(piece), land_z_m).unwrap_or(0.0);
        piece.start_ms as f64 / 1000.0 + u * piece.duration_s()
    })
}

/// A position as it reaches the navigation code of 4.4: altitude truncated to whole centimetres
/// (towards zero), m. Latitude and longitude are truncated to 1e-7 degrees, about 1 cm.
pub fn on_board_altitude_m(z_m: f64) -> f64 {
    ((z_m * 1000.0) as f32 / 10.0).trunc() as f64 / 100.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Segment, SegmentPath};
    use proptest::prelude::*;

    fn vertical(start_z: f64, legs: &[(u32, f64)]) -> Trajectory {
        let leg = |(duration_ms, z): &(u32, f64)| Segment {
            duration_ms: *duration_ms,
            path: SegmentPath::Line(Vector3::new(0.0, 0.0, *z)),
        };
        Trajectory {
            start_m: Vector3::new(0.0, 0.0, start_z),
            segments: legs.iter().map(leg).collect(),
        }
    }

    fn both(trajectory: &Trajectory) -> [Derived; 2] {
        [Firmware::V44, Firmware::V46]
            .map(|firmware| derive(trajectory, firmware, &DeriveParams::default()))
    }

    #[test]
    fn take_off_agrees_with_flights_of_4_4() {
        // Predicted 2.045 s and 0.795 s, flown at 2.06 s and 0.82 s (the loop runs at 10 Hz).
        let slow = &both(&vertical(0.0, &[(10_000, 10.0)]))[0];
        assert!((slow.takeoff_s.unwrap() - 2.0455).abs() < 1e-4);
        let fast = &both(&vertical(5.0, &[(5_000, 15.0)]))[0];
        // 2 m/s reaches 2.5 m at 1.25 s, which is on the grid.
        assert!((fast.takeoff_s.unwrap() - 0.7955).abs() < 1e-4);
        // 1.3 m/s reaches it at 1.923 s; the next tick is 31/16 s.
        let odd = &both(&vertical(0.0, &[(10_000, 13.0)]))[0];
        assert_eq!(odd.reaches_takeoff_alt_s, Some(31.0 / 16.0));
    }

    #[test]
    fn landing_agrees_with_what_4_6_derived() {
        // 10 m to 2.5 m in the last 8 s of 618 s: 615.33 s on the real firmware.
        let trajectory = vertical(0.0, &[(10_000, 10.0), (600_000, 10.0), (8_000, 2.5)]);
        let [old, new] = both(&trajectory);
        assert_eq!(old.landing_s, 618.0);
        assert!((new.landing_s - 615.333).abs() < 1e-3, "{}", new.landing_s);
        assert!((new.lands_from_m - 5.0).abs() < 1e-9);
        assert!(old.valid && new.valid);
    }

    #[test]
    fn shows_that_are_not_flown_say_why() {
        let low = &both(&vertical(0.0, &[(10_000, 2.4)]))[0];
        assert!(!low.valid && low.takeoff_s.is_none());
        assert_eq!(
            low.reasons,
            ["the trajectory never rises 2.5 m above its start: the drone refuses the show"]
        );
        let quick = &both(&vertical(0.0, &[(200, 5.0), (10_000, 5.0)]))[0];
        assert_eq!(quick.takeoff_s, Some(0.0));
        assert!(quick.reasons[0].contains("0.33 s before the start"), "{:?}", quick.reasons);
        let empty = both(&Trajectory::default());
        assert!(empty.iter().all(|derived| !derived.valid));
    }

    #[test]
    fn travel_time_is_that_of_a_trapezoid() {
        assert_eq!(travel_time_s(10.0, 2.0, 2.0), 6.0);
        assert_eq!(travel_time_s(1.0, 2.0, 1.0), 2.0);
        assert_eq!(travel_time_s(2.5, 5.0, f64::INFINITY), 0.5);
        assert_eq!(travel_time_s(1.0, 0.0, 1.0), f64::INFINITY);
    }

    #[test]
    fn altitude_is_cut_to_centimetres() {
        assert_eq!(on_board_altitude_m(12.349), 12.34);
        assert_eq!(on_board_altitude_m(-0.019), -0.01);
    }

    proptest! {
        #[test]
        fn the_first_touch_is_the_first(points in prop::array::uniform4(-10.0..10.0_f64), value in -10.0..10.0_f64) {
            let curve = Scalar::new(points.into_iter());
            let eval = |u: f64| {
                let v = 1.0 - u;
                points[0] * v * v * v + 3.0 * points[1] * v * v * u + 3.0 * points[2] * v * u * u + points[3] * u * u * u
            };
            let below = points[0] < value;
            let crossed = (0..=1000).map(|i| f64::from(i) / 1000.0).find(|u| (eval(*u) < value) != below);
            match (first_touch(curve, value), crossed) {
                (Some(touch), Some(crossed)) => {
                    prop_assert!((eval(touch) - value).abs() < 1e-9);
                    prop_assert!(touch <= crossed + 1e-9);
                    for i in 0..100 {
                        prop_assert_eq!(eval(touch * f64::from(i) / 101.0) < value, below);
                    }
                }
                // Two crossings may hide between samples, the other way round is an error.
                (None, crossed) => prop_assert_eq!(crossed, None),
                (Some(touch), None) => prop_assert!((eval(touch) - value).abs() < 1e-9),
            }
        }
    }
}
