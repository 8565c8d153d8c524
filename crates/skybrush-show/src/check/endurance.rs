//! Flight time against the battery.

use super::CheckInput;
use super::ground::first_motion_ms;
use super::report::Severity;
use super::track::Track;
use super::watch::{Quantity, Stretch, Watch};

pub(super) fn quantity(input: &CheckInput<'_>) -> Quantity {
    let limits = input.limits;
    Quantity {
        check: "endurance",
        label: "longest flight, landing included",
        object: None,
        verb: "flies, landing included, for",
        unit: "s",
        severity: Severity::Error,
        remedy: "shorten the flight, or fly it in two",
        limit: limits.endurance_s * (1.0 - limits.endurance_reserve),
        tolerance: 1e-3,
        squared: false,
        least: false,
    }
}

/// Watches one drone: from its first motion to the ground, which it reaches from the last point at
/// the landing speed.
pub(super) fn watch(track: &Track<'_>, what: Quantity, land_speed_mps: f64) -> Watch {
    let mut watch = Watch::new(what);
    if let Some(start_ms) = first_motion_ms(track) {
        let from_s = start_ms as f64 / 1000.0;
        let descent_s = (track.end_m.z - track.landed_z_m) / land_speed_mps;
        let to_s = track.end_ms as f64 / 1000.0 + descent_s;
        watch.feed_stretch(Stretch { from_s, to_s, worst: to_s - from_s, worst_s: to_s });
    }
    watch
}
