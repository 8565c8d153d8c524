//! Limits that a show states itself, besides those that every vehicle has: accelerations by
//! direction, the yaw rate, and the altitude below which no drone moves sideways.
//!
//! Studio for Blender writes `maxAccelerationXY`, `maxAccelerationZ`, `maxYawRate` and
//! `minNavAltitude`, Viewer draws the first three as thresholds. The vehicle's own limit of
//! acceleration counts for all directions together; what a show states counts where it is stricter.

use super::report::Severity;
use super::track::{Track, curve_of};
use super::watch::{Quantity, Watch};
use super::{CheckInput, TOLERANCE_MPS2, lateral};

/// What yaw rates may exceed their limit by, degrees/s: files have tenths of a degree.
const TOLERANCE_DPS: f64 = 0.5;

/// The quantities that a show states; those that are `None` have no limit of their own.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stated {
    horizontal: Option<Quantity>,
    vertical: Option<Quantity>,
    yaw_rate: Option<Quantity>,
    nav_altitude: Option<(Quantity, f64)>,
}

impl Stated {
    pub(super) fn of(input: &CheckInput<'_>) -> Self {
        let stated = input.show.validation.unwrap_or_default();
        let usable = |value: &f64| value.is_finite() && *value > 0.0;
        let own = input.limits.max_acceleration_mps2;
        let acceleration = |limit: Option<f64>, check, label, verb| {
            limit.filter(usable).filter(|limit| *limit < own).map(|limit| Quantity {
                check,
                label,
                object: None,
                verb,
                unit: "m/s²",
                severity: Severity::Error,
                remedy: "stretch the piece, or make its curve gentler",
                limit,
                tolerance: TOLERANCE_MPS2,
                squared: true,
                least: false,
            })
        };
        let turns = input.show.drones.iter().any(|drone| drone.yaw.is_some());
        let yaw_rate = stated.max_yaw_rate_dps.filter(usable).filter(|_| turns);
        let altitude = stated.min_nav_altitude_m.filter(usable);
        // Below the take-off altitude of the firmware it is an error anyway.
        let altitude = altitude.filter(|altitude_m| *altitude_m > input.firmware.takeoff_alt_m);
        Self {
            horizontal: acceleration(
                stated.max_acceleration_xy_mps2,
                "acceleration-horizontal",
                "hardest horizontal acceleration",
                "accelerates horizontally at",
            ),
            vertical: acceleration(
                stated.max_acceleration_z_mps2,
                "acceleration-vertical",
                "hardest vertical acceleration",
                "accelerates vertically at",
            ),
            yaw_rate: yaw_rate.map(|limit| Quantity {
                check: "yaw-rate",
                label: "fastest turn",
                object: None,
                verb: "turns at",
                unit: "deg/s",
                severity: Severity::Warning,
                remedy: "turn more slowly, or state the intended rate",
                limit,
                tolerance: TOLERANCE_DPS,
                squared: false,
                least: false,
            }),
            nav_altitude: altitude.map(|altitude_m| {
                let quantity = Quantity {
                    check: "nav-altitude",
                    label: "largest sideways motion below the stated navigation altitude",
                    verb: "moves sideways below the show's minNavAltitude, by",
                    severity: Severity::Warning,
                    remedy: "climb vertically to that altitude first, and land vertically from it",
                    ..lateral::quantity(input)
                };
                (quantity, altitude_m)
            }),
        }
    }

    /// Watches the stated limits over the trajectory of one drone.
    pub(super) fn watch(&self, track: &Track<'_>) -> Vec<Watch> {
        let mut watches = Vec::new();
        for (quantity, vertical) in [(self.horizontal, false), (self.vertical, true)] {
            let Some(quantity) = quantity else { continue };
            let mut watch = Watch::new(quantity);
            for piece in &track.pieces {
                let (start_s, duration_s) = (piece.start_ms as f64 / 1000.0, piece.duration_s());
                let second = curve_of(piece).rate(duration_s).rate(duration_s);
                let squared =
                    if vertical { second.vertical_squared() } else { second.horizontal_squared() };
                watch.feed(&squared, start_s, duration_s);
            }
            watches.push(watch);
        }
        if let Some(quantity) = self.yaw_rate {
            let mut watch = Watch::new(quantity);
            let setpoints = track.drone.yaw.iter().flat_map(|yaw| yaw.setpoints.windows(2));
            watch.feed_instant(0.0, 0.0);
            for pair in setpoints {
                let [(from_s, from_deg), (to_s, to_deg)] = pair else { continue };
                let rate_dps = (to_deg - from_deg).abs() / (to_s - from_s);
                if rate_dps.is_finite() {
                    watch.feed_instant(rate_dps, *from_s);
                }
            }
            watches.push(watch);
        }
        if let Some((quantity, altitude_m)) = self.nav_altitude {
            watches.push(lateral::watch(track, quantity, altitude_m));
        }
        watches
    }
}
