//! Speed, acceleration, velocity steps and altitude of every drone.

use nalgebra::Vector3;

use super::curve::Curve;
use super::report::Severity;
use super::track::{Track, curve_of};
use super::watch::{Quantity, Watch};
use super::{CheckInput, TOLERANCE_M, TOLERANCE_MPS, TOLERANCE_MPS2};

/// The quantities of [`watch`], in its order.
pub(super) fn quantities(input: &CheckInput<'_>) -> [Quantity; 7] {
    let limits = input.limits;
    let base = Quantity {
        check: "",
        label: "",
        object: None,
        verb: "",
        unit: "m/s",
        severity: Severity::Error,
        remedy: "fly the piece slower, or choose a vehicle that is faster",
        limit: 0.0,
        tolerance: TOLERANCE_MPS,
        squared: false,
        least: false,
    };
    [
        Quantity {
            check: "speed-horizontal",
            label: "fastest horizontally",
            verb: "flies horizontally at",
            limit: limits.max_speed_xy_mps,
            squared: true,
            ..base
        },
        Quantity {
            check: "speed-up",
            label: "fastest climb",
            verb: "climbs at",
            limit: limits.max_speed_up_mps,
            ..base
        },
        Quantity {
            check: "speed-down",
            label: "fastest descent",
            verb: "descends at",
            limit: limits.max_speed_down_mps,
            ..base
        },
        Quantity {
            check: "acceleration",
            label: "hardest acceleration",
            verb: "accelerates at",
            unit: "m/s²",
            limit: limits.max_acceleration_mps2,
            tolerance: TOLERANCE_MPS2,
            squared: true,
            remedy: "stretch the piece, or make its curve gentler",
            ..base
        },
        Quantity {
            check: "velocity-step",
            label: "largest velocity step",
            verb: "changes its velocity at once by",
            limit: limits.max_velocity_step_mps,
            remedy: "put a ramp of finite acceleration between the two pieces",
            ..base
        },
        Quantity {
            check: "altitude-max",
            label: "highest point",
            verb: "reaches an altitude of",
            unit: "m",
            limit: limits.max_altitude_m,
            tolerance: TOLERANCE_M,
            remedy: "lower the show, or get permission to fly higher",
            ..base
        },
        Quantity {
            check: "altitude-min",
            label: "lowest point above ground",
            verb: "is, above its own ground, at",
            unit: "m",
            limit: -input.options.ground_tolerance_m,
            tolerance: TOLERANCE_M,
            least: true,
            remedy: "raise the trajectory: it leads into the ground",
            ..base
        },
    ]
}

/// Watches all quantities over the trajectory of one drone.
pub(super) fn watch(track: &Track<'_>, quantities: &[Quantity; 7]) -> [Watch; 7] {
    let mut watches = quantities.map(Watch::new);
    let [horizontal, up, down, acceleration, step, highest, lowest] = &mut watches;
    let mut before_mps = Vector3::zeros();
    highest.feed_instant(track.start_m.z, 0.0);
    lowest.feed_instant(track.start_m.z - track.ground_m, 0.0);
    for piece in &track.pieces {
        let (start_s, duration_s) = (piece.start_ms as f64 / 1000.0, piece.duration_s());
        let curve = curve_of(piece);
        let velocity = curve.rate(duration_s);
        let second = velocity.rate(duration_s);
        let climb = velocity.bounds();
        let height = curve.bounds();
        // Most pieces cannot break a record or a limit: their control points already say so.
        let greatest = |curve: &Curve, size: fn(&Vector3<f64>) -> f64| {
            curve.points().iter().map(size).fold(0.0, f64::max)
        };
        if !horizontal.is_dull(greatest(&velocity, |v| v.x.hypot(v.y))) {
            horizontal.feed(&velocity.horizontal_squared(), start_s, duration_s);
        }
        if !up.is_dull(climb.high.z) {
            up.feed(&velocity.axis(2), start_s, duration_s);
        }
        if !down.is_dull(-climb.low.z) {
            down.feed(&velocity.axis(2).times(-1.0), start_s, duration_s);
        }
        if !acceleration.is_dull(greatest(&second, Vector3::norm)) {
            acceleration.feed(&second.norm_squared(), start_s, duration_s);
        }
        if !highest.is_dull(height.high.z) {
            highest.feed(&curve.axis(2), start_s, duration_s);
        }
        if !lowest.is_dull(height.low.z - track.ground_m) {
            lowest.feed(&curve.axis(2).plus(-track.ground_m), start_s, duration_s);
        }
        step.feed_instant((velocity.first() - before_mps).norm(), start_s);
        before_mps = velocity.last();
    }
    step.feed_instant(before_mps.norm(), track.end_ms as f64 / 1000.0);
    watches
}
