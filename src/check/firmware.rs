//! What the show firmware will derive from a trajectory on board, and whether it will accept it.
//!
//! Take-off is when the trajectory first reaches the take-off altitude above its start, less the time
//! of the climb to it. Firmware 4.4 finds that moment on a grid of 1/16 s, 4.6 exactly; 4.4 lands at
//! the end of the trajectory.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::CheckInput;
use super::report::{Collector, Finding, Severity};
use super::track::{Track, curve_of};

/// Grid on which firmware 4.4 looks for the take-off, per s.
const GRID_PER_S: f64 = 16.0;
/// Climb below the take-off altitude from which the catch-up becomes large, m/s.
const GENTLE_CLIMB_MPS: f64 = 1.0;
/// How far the end may be from the take-off altitude above ground, m.
const END_TOLERANCE_M: f64 = 0.5;

/// Firmware parameters that decide what is derived from a trajectory.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Firmware {
    /// SHOW_TAKEOFF_ALT, m.
    pub takeoff_alt_m: f64,
    /// SHOW_TAKEOFF_ERR: how far from the first point the drone may stand, m.
    pub takeoff_err_m: f64,
    /// WPNAV_SPEED_UP, m/s.
    pub wpnav_speed_up_mps: f64,
    /// LAND_SPEED, m/s.
    pub land_speed_mps: f64,
}

impl Default for Firmware {
    /// Defaults of the show firmware; the climb speed is the stock one of ArduCopter.
    fn default() -> Self {
        Self {
            takeoff_alt_m: 2.5,
            takeoff_err_m: 3.0,
            wpnav_speed_up_mps: 2.5,
            land_speed_mps: 0.5,
        }
    }
}

/// What the firmware derives from one trajectory, show time in s.
#[derive(Clone, Copy, Debug, PartialEq)]
#[expect(clippy::struct_field_names, reason = "the unit is part of a name")]
pub(super) struct Derived {
    /// The trajectory first reaches the take-off altitude.
    pub(super) reaches_s: f64,
    /// Take-off in firmware 4.4.
    pub(super) takeoff_44_s: f64,
    /// Start of the landing in firmware 4.4.
    pub(super) landing_s: f64,
}

/// Derives the take-off and landing; `None` when the trajectory never reaches the altitude.
pub(super) fn derive(track: &Track<'_>, firmware: &Firmware) -> Option<Derived> {
    let target_m = track.start_m.z + firmware.takeoff_alt_m;
    let reaches_s = track.pieces.iter().find_map(|piece| {
        let height = curve_of(piece).axis(2);
        if height.upper_bound() < target_m {
            return None;
        }
        let reached = height.times(-1.0).plus(target_m).below(1e-9).first().map(|part| part.0)?;
        Some(piece.start_ms as f64 / 1000.0 + reached * piece.duration_s())
    })?;
    let climb_s = firmware.takeoff_alt_m / firmware.wpnav_speed_up_mps;
    let on_grid_s = (reaches_s * GRID_PER_S - 1e-6).ceil() / GRID_PER_S;
    Some(Derived {
        reaches_s,
        takeoff_44_s: (on_grid_s - climb_s).max(0.0),
        landing_s: track.end_ms as f64 / 1000.0,
    })
}

/// Fastest climb before the take-off altitude is reached, m/s, and when.
fn takeoff_climb(track: &Track<'_>, reaches_s: f64) -> (f64, f64) {
    let mut most = (0.0, 0.0);
    for piece in &track.pieces {
        let (start_s, duration_s) = (piece.start_ms as f64 / 1000.0, piece.duration_s());
        if start_s >= reaches_s {
            break;
        }
        let climb = curve_of(piece).rate(duration_s).axis(2);
        let part = climb.restrict(0.0, ((reaches_s - start_s) / duration_s).min(1.0));
        let fastest = part.maximum(|_| 1e-6);
        if fastest.value > most.0 {
            most = (fastest.value, start_s + fastest.u * duration_s.min(reaches_s - start_s));
        }
    }
    most
}

pub(super) fn check(input: &CheckInput<'_>, tracks: &[Track<'_>], collector: &mut Collector) {
    let firmware = &input.firmware;
    for track in tracks {
        if track.drone.trajectory.segments.is_empty() {
            continue;
        }
        check_drone(track, firmware, collector);
    }
}

fn check_drone(track: &Track<'_>, firmware: &Firmware, collector: &mut Collector) {
    let mut add = |severity, check, time_s, value: f64, limit: f64, unit, message, remedy| {
        let finding = Finding {
            severity,
            check,
            drones: vec![track.name()],
            time_s: Some(time_s),
            end_s: None,
            value: Some(value),
            limit: Some(limit),
            unit,
            message,
            remedy,
        };
        collector.add(track.index, finding);
    };
    let alt_m = firmware.takeoff_alt_m;
    if let Some(home) = track.drone.home_m {
        let away_m = (track.start_m - home).xy().norm();
        let limit_m = firmware.takeoff_err_m;
        if away_m > limit_m {
            let message = format!(
                "its first point is {away_m:.3} m from its home, limit {limit_m:.3} m: the firmware will not arm"
            );
            let remedy = "start the trajectory at the drone's home";
            add(Severity::Error, "firmware-start", 0.0, away_m, limit_m, "m", message, remedy);
        }
    }
    let Some(derived) = derive(track, firmware) else {
        let highest_m = track
            .pieces
            .iter()
            .map(|piece| curve_of(piece).axis(2).maximum(|_| 1e-6).value - track.start_m.z)
            .fold(0.0, f64::max);
        let message = format!(
            "climbs only {highest_m:.3} m above its start, limit {alt_m:.3} m: the firmware takes the show for invalid"
        );
        let remedy = "climb above the take-off altitude";
        add(Severity::Error, "firmware-takeoff", 0.0, highest_m, alt_m, "m", message, remedy);
        return;
    };
    if derived.landing_s < derived.takeoff_44_s {
        let message = format!(
            "would land at {:.3} s, before it takes off at {:.3} s",
            derived.landing_s, derived.takeoff_44_s
        );
        let remedy = "reach the take-off altitude earlier, or end the trajectory later";
        let (value, limit) = (derived.landing_s, derived.takeoff_44_s);
        let time_s = derived.landing_s;
        add(Severity::Error, "firmware-landing", time_s, value, limit, "s", message, remedy);
    }
    let (climb_mps, time_s) = takeoff_climb(track, derived.reaches_s);
    if climb_mps > GENTLE_CLIMB_MPS + super::TOLERANCE_MPS {
        let message = format!(
            "takes off at {climb_mps:.3} m/s, recommended up to {GENTLE_CLIMB_MPS:.3} m/s: it will have to catch up"
        );
        let remedy = "climb to the take-off altitude at 1 m/s or slower";
        let (check, limit) = ("firmware-climb", GENTLE_CLIMB_MPS);
        add(Severity::Warning, check, time_s, climb_mps, limit, "m/s", message, remedy);
    }
    let end_m = track.end_m.z - track.drone.land_at_m.map_or(track.ground_m, |place| place.z);
    if (end_m - alt_m).abs() > END_TOLERANCE_M {
        let message = format!(
            "ends {end_m:.3} m above ground, recommended {alt_m:.3} m: firmware 4.4 starts to land where the trajectory ends"
        );
        let remedy = "end with a vertical descent to the take-off altitude";
        let time_s = derived.landing_s;
        add(Severity::Warning, "firmware-end", time_s, end_m, alt_m, "m", message, remedy);
    }
}
