//! Flight between take-off and landing below the take-off altitude of the show firmware (2.5 m by
//! default): within some two rotor diameters of the ground its cushion carries part of the weight, and
//! whoever stands there is in reach.

use super::CheckInput;
use super::report::Severity;
use super::track::{Track, curve_of};
use super::watch::{Quantity, Stretch, Watch};

/// How far the height may stay below the altitude and still count as reaching it, m: the unit of
/// coarse files.
const HEIGHT_TOLERANCE_M: f64 = 0.01;
/// A last descent sinks by this at least over each of its parts, m.
const SINKS_M: f64 = 1e-3;
/// A break of this length does not end a stretch, s.
const JOINT_S: f64 = 1e-6;

pub(super) fn quantity(input: &CheckInput<'_>) -> Quantity {
    Quantity {
        check: "low-flight",
        label: "lowest between take-off and landing",
        object: None,
        verb: "flies, between take-off and landing, at a height of",
        unit: "m",
        severity: Severity::Warning,
        remedy: "stay above the take-off altitude until the last descent",
        limit: input.firmware.takeoff_alt_m,
        tolerance: HEIGHT_TOLERANCE_M,
        squared: false,
        least: true,
    }
}

/// One part of a piece below the altitude.
struct Part {
    stretch: Stretch,
    /// Whether it leads down, as a landing does.
    sinks: bool,
}

/// Watches what a drone does below the altitude after it was first above it. The last time that it
/// comes below is its landing: of that only what does not sink counts.
pub(super) fn watch(track: &Track<'_>, what: Quantity, airborne_above_m: f64) -> Watch {
    let mut watch = Watch::new(what);
    let low_m = what.limit - HEIGHT_TOLERANCE_M;
    let mut taken_off = false;
    let mut low: Vec<Part> = Vec::new();
    for piece in &track.pieces {
        let height = curve_of(piece).axis(2).plus(-track.ground_m);
        let (start_s, duration_s) = (piece.start_ms as f64 / 1000.0, piece.duration_s());
        let below = if height.lower_bound() < low_m { height.below(low_m) } else { Vec::new() };
        let mut at = 0.0;
        for (from, to) in below.iter().copied().chain([(1.0, 1.0)]) {
            // What lies between is flown above: all before was no landing.
            if (from - at) * duration_s > JOINT_S {
                taken_off = true;
                for part in low.drain(..) {
                    watch.feed_stretch(part.stretch);
                }
            }
            at = to;
            if to > from && taken_off {
                let part = height.restrict(from, to);
                let least = part.minimum(|_| HEIGHT_TOLERANCE_M);
                let at_s = |u: f64| start_s + (from + u * (to - from)) * duration_s;
                let stretch = Stretch {
                    from_s: at_s(0.0),
                    to_s: at_s(1.0),
                    worst: least.value,
                    worst_s: at_s(least.u),
                };
                low.push(Part { stretch, sinks: part.value(0.0) - part.value(1.0) > SINKS_M });
            }
        }
    }
    low.retain(|part| !part.sinks && part.stretch.worst > airborne_above_m);
    for part in low {
        watch.feed_stretch(part.stretch);
    }
    watch
}
