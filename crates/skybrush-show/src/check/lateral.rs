//! Sideways motion near the ground.
//!
//! The firmware climbs to its take-off altitude by itself and follows the trajectory only from there;
//! what a trajectory does to the side below that altitude is flown late, or along the ground.

use super::report::Severity;
use super::track::{Track, curve_of};
use super::watch::{Quantity, Watch};
use super::{CheckInput, TOLERANCE_M};

/// How far the height may stay below the take-off altitude and still count as reaching it, m: the
/// unit of coarse files.
const HEIGHT_TOLERANCE_M: f64 = 0.01;
/// A break of this length does not end a stretch, s.
const JOINT_S: f64 = 1e-6;

pub(super) fn quantity(input: &CheckInput<'_>) -> Quantity {
    Quantity {
        check: "low-lateral",
        label: "largest sideways motion below the take-off altitude",
        object: None,
        verb: "moves sideways below the take-off altitude, by",
        unit: "m",
        severity: Severity::Error,
        remedy: "climb vertically to the take-off altitude first, and land vertically from it",
        limit: input.options.low_lateral_m,
        tolerance: TOLERANCE_M,
        squared: true,
        least: false,
    }
}

/// Watches how far a drone gets from the place where it was when it last came below the take-off
/// altitude.
pub(super) fn watch(track: &Track<'_>, what: Quantity, takeoff_alt_m: f64) -> Watch {
    let mut watch = Watch::new(what);
    let low_z_m = track.start_m.z + takeoff_alt_m - HEIGHT_TOLERANCE_M;
    let mut anchor = (track.start_m, 0.0);
    watch.feed_instant(0.0, 0.0);
    for piece in &track.pieces {
        let (start_s, duration_s) = (piece.start_ms as f64 / 1000.0, piece.duration_s());
        let curve = curve_of(piece);
        if curve.bounds().low.z >= low_z_m {
            continue;
        }
        for (from, to) in curve.axis(2).below(low_z_m) {
            let part = curve.restrict(from, to);
            let from_s = start_s + from * duration_s;
            if from_s > anchor.1 + JOINT_S {
                anchor.0 = part.first();
            }
            let moved = part.shifted(-anchor.0).horizontal_squared();
            watch.feed(&moved, from_s, (to - from) * duration_s);
            anchor.1 = start_s + to * duration_s;
        }
    }
    watch
}
