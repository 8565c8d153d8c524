//! Checks of the firmware's reading of a trajectory: the schedule it derives on board, and whether
//! it accepts the show.
//!
//! Both generations are asked, through [`derive()`]: 4.4 finds the take-off on a grid of 1/16 s and
//! lands at the end of the trajectory; 4.6 finds it exactly, reckons with acceleration and spool-up,
//! and lands in the descent at the end.

use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::CheckInput;
use super::report::{Collector, Finding, Margin, Severity};
use super::track::{Track, curve_of};
use crate::derive::{self, DeriveParams, Derived, derive};

/// Climb below the take-off altitude from which the catch-up becomes large, m/s.
const GENTLE_CLIMB_MPS: f64 = 1.0;
/// LAND_ALT_LOW, m: below it the firmware lands at LAND_SPEED, above it at a speed that no show knows.
const LAND_ALT_LOW_M: f64 = 10.0;
/// How far the end may be from the take-off altitude above ground, m.
const END_TOLERANCE_M: f64 = 0.5;
/// Hover at the end that firmware 4.6 may leave out, s.
const SHORT_HOVER_S: f64 = 1.0;
/// Speed below which a piece hovers, m/s.
const HOVER_MPS: f64 = 0.05;

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
    /// WPNAV_ACCEL_Z, m/s² (4.6).
    pub wpnav_accel_z_mps2: f64,
    /// MOT_SPOOL_TIME, s (4.6).
    pub mot_spool_s: f64,
    /// LAND_SPEED, m/s.
    pub land_speed_mps: f64,
}

impl Default for Firmware {
    /// Defaults of the show firmware, with those of [`DeriveParams`].
    fn default() -> Self {
        let derive = DeriveParams::default();
        Self {
            takeoff_alt_m: derive.takeoff_alt_m,
            takeoff_err_m: 3.0,
            wpnav_speed_up_mps: derive.speed_up_mps,
            wpnav_accel_z_mps2: derive.accel_z_mps2,
            mot_spool_s: derive.spool_s,
            land_speed_mps: 0.5,
        }
    }
}

impl Firmware {
    /// The parameters that the derivation takes.
    pub fn derive_params(&self) -> DeriveParams {
        DeriveParams {
            takeoff_alt_m: self.takeoff_alt_m,
            speed_up_mps: self.wpnav_speed_up_mps,
            accel_z_mps2: self.wpnav_accel_z_mps2,
            spool_s: self.mot_spool_s,
            ..DeriveParams::default()
        }
    }
}

/// What each generation derives.
struct Both {
    v44: Derived,
    v46: Derived,
}

impl Both {
    fn of(track: &Track<'_>, params: &DeriveParams) -> Self {
        let of = |firmware| derive(&track.drone.trajectory, firmware, params);
        Self { v44: of(derive::Firmware::V44), v46: of(derive::Firmware::V46) }
    }

    fn named(&self) -> [(&'static str, &Derived); 2] {
        [("4.4", &self.v44), ("4.6", &self.v46)]
    }
}

pub(super) fn check(input: &CheckInput<'_>, tracks: &[Track<'_>], collector: &mut Collector) {
    let firmware = &input.firmware;
    let params = firmware.derive_params();
    let flown: Vec<_> =
        tracks.iter().filter(|track| !track.drone.trajectory.segments.is_empty()).collect();
    let derived: Vec<Both> = flown.par_iter().map(|track| Both::of(track, &params)).collect();
    for (track, derived) in flown.iter().zip(&derived) {
        check_start(track, firmware, collector);
        if check_validity(track, derived, firmware, collector) {
            check_climb(track, derived, collector);
            check_end(track, derived, firmware, collector);
            check_away(track, derived, firmware, collector);
        }
    }
    check_early_landing(&flown, &derived, collector);
    margins(&flown, &derived, collector);
}

/// A finding about one drone.
fn finding(
    track: &Track<'_>,
    (severity, check): (Severity, &'static str),
    time_s: f64,
    (value, limit, unit): (f64, f64, &'static str),
    message: String,
    remedy: &'static str,
) -> Finding {
    Finding {
        drones: vec![track.name()],
        time_s: Some(time_s),
        value: Some(value),
        limit: Some(limit),
        unit,
        ..Finding::new(severity, check, message, remedy)
    }
}

fn check_start(track: &Track<'_>, firmware: &Firmware, collector: &mut Collector) {
    let Some(home) = track.drone.home_m else { return };
    let away_m = (track.start_m - home).xy().norm();
    let limit_m = firmware.takeoff_err_m;
    if away_m > limit_m {
        let message = format!(
            "its first point is {away_m:.3} m from its home, limit {limit_m:.3} m: the firmware will not arm"
        );
        let (kind, remedy) =
            ((Severity::Error, "firmware-start"), "start the trajectory at the drone's home");
        let values = (away_m, limit_m, "m");
        collector.add(track.index, finding(track, kind, 0.0, values, message, remedy));
    }
}

/// Whether both generations accept the trajectory; reports why not.
fn check_validity(
    track: &Track<'_>,
    derived: &Both,
    firmware: &Firmware,
    collector: &mut Collector,
) -> bool {
    let alt_m = firmware.takeoff_alt_m;
    if derived.named().iter().any(|(_, derived)| derived.takeoff_s.is_none()) {
        let highest_m = track
            .pieces
            .iter()
            .map(|piece| curve_of(piece).axis(2).maximum(|_| 1e-6).value - track.start_m.z)
            .fold(0.0, f64::max);
        let message = if highest_m >= alt_m {
            format!(
                "is above the take-off altitude too briefly, or has no climb speed: it climbs {highest_m:.3} m above its start, needed {alt_m:.3} m"
            )
        } else {
            format!(
                "climbs only {highest_m:.3} m above its start, limit {alt_m:.3} m: the firmware takes the show for invalid"
            )
        };
        let (kind, remedy) =
            ((Severity::Error, "firmware-takeoff"), "climb above the take-off altitude");
        let values = (highest_m, alt_m, "m");
        collector.add(track.index, finding(track, kind, 0.0, values, message, remedy));
        return false;
    }
    let mut valid = true;
    for (version, derived) in derived.named() {
        let Some(takeoff_s) = derived.takeoff_s.filter(|_| !derived.valid) else { continue };
        valid = false;
        let landing_s = derived.landing_s;
        let message = format!(
            "firmware {version} would land at {landing_s:.3} s, before it takes off at {takeoff_s:.3} s: it takes the show for invalid"
        );
        let kind = (Severity::Error, "firmware-landing");
        let remedy =
            "climb in one piece and come down in another, and reach the take-off altitude earlier";
        let values = (landing_s, takeoff_s, "s");
        collector.add(track.index, finding(track, kind, landing_s, values, message, remedy));
    }
    valid
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

fn check_climb(track: &Track<'_>, derived: &Both, collector: &mut Collector) {
    let Some(reaches_s) = derived.v46.reaches_takeoff_alt_s else { return };
    let (climb_mps, time_s) = takeoff_climb(track, reaches_s);
    if climb_mps > GENTLE_CLIMB_MPS + super::TOLERANCE_MPS {
        let message = format!(
            "takes off at {climb_mps:.3} m/s, recommended up to {GENTLE_CLIMB_MPS:.3} m/s: it will have to catch up"
        );
        let kind = (Severity::Warning, "firmware-climb");
        let remedy = "climb to the take-off altitude at 1 m/s or slower";
        let values = (climb_mps, GENTLE_CLIMB_MPS, "m/s");
        collector.add(track.index, finding(track, kind, time_s, values, message, remedy));
    }
}

fn check_end(track: &Track<'_>, derived: &Both, firmware: &Firmware, collector: &mut Collector) {
    let alt_m = firmware.takeoff_alt_m;
    let ground_m = track.drone.land_at_m.map_or(track.ground_m, |place| place.z);
    let end_m = track.end_m.z - ground_m;
    if (end_m - alt_m).abs() > END_TOLERANCE_M {
        // Shows are flown from ground to ground: a high end is left to LAND mode, out of formation.
        let high = end_m > LAND_ALT_LOW_M;
        let severity = if high { Severity::Error } else { Severity::Warning };
        let message = if high {
            format!(
                "ends {end_m:.3} m above ground, recommended {alt_m:.3} m, at most {LAND_ALT_LOW_M:.3} m: both firmwares leave the show there and land (4.6: or return home, by SHOW_POST_ACTION) at speeds that the show does not set"
            )
        } else {
            format!(
                "ends {end_m:.3} m above ground, recommended {alt_m:.3} m: firmware 4.4 starts to land where the trajectory ends"
            )
        };
        let kind = (severity, "firmware-end");
        let remedy = "end with a vertical descent to the take-off altitude";
        let values = (end_m, alt_m, "m");
        let time_s = derived.v44.landing_s;
        collector.add(track.index, finding(track, kind, time_s, values, message, remedy));
    }
}

/// A drone lands below the end of its trajectory: elsewhere than it is meant to is told.
fn check_away(track: &Track<'_>, derived: &Both, firmware: &Firmware, collector: &mut Collector) {
    let (place, whose) = match (track.drone.land_at_m, track.drone.home_m) {
        (Some(place), _) => (place, "its landing place"),
        // A start away from home is told as such.
        (None, Some(home)) if (track.start_m - home).xy().norm() <= firmware.takeoff_err_m => {
            (home, "its home")
        }
        (None, _) => (track.start_m, "its start"),
    };
    let away_m = (track.end_m - place).xy().norm();
    let limit_m = firmware.takeoff_err_m;
    if away_m > limit_m {
        let message = format!(
            "ends {away_m:.3} m from {whose}, more than {limit_m:.3} m: the firmware lands it below that end, and it will not arm there for the next flight"
        );
        let kind = (Severity::Warning, "firmware-away");
        let remedy = "end the trajectory above the home, or give the landing place (landAt)";
        let values = (away_m, limit_m, "m");
        let time_s = derived.v44.landing_s;
        collector.add(track.index, finding(track, kind, time_s, values, message, remedy));
    }
}

/// One warning for the whole show: the drones of a show usually end in the same way.
fn check_early_landing(tracks: &[&Track<'_>], derived: &[Both], collector: &mut Collector) {
    let mut names = Vec::new();
    let mut worst: Option<(f64, &Track<'_>, &Derived)> = None;
    for (track, both) in tracks.iter().zip(derived).filter(|(_, both)| both.v46.valid) {
        let skipped_s = skipped_s(track, both.v46.landing_s);
        if skipped_s > SHORT_HOVER_S {
            names.push(track.name());
            if worst.is_none_or(|(most, ..)| skipped_s > most) {
                worst = Some((skipped_s, track, &both.v46));
            }
        }
    }
    let Some((skipped_s, track, derived)) = worst else { return };
    let ground_m = track.drone.land_at_m.map_or(track.ground_m, |place| place.z);
    let from_m = derived.lands_from_m + track.start_m.z - ground_m;
    let landing_s = derived.landing_s;
    let message = format!(
        "firmware 4.6 starts to land at {landing_s:.3} s from {from_m:.3} m and leaves out {skipped_s:.3} s of hovering, limit {SHORT_HOVER_S:.3} s"
    );
    let kind = (Severity::Warning, "firmware-early-landing");
    let remedy = "hover at more than the take-off altitude above the trajectory's end";
    let values = (skipped_s, SHORT_HOVER_S, "s");
    let finding = finding(track, kind, landing_s, values, message, remedy);
    collector.add(track.index, Finding { drones: names, ..finding });
}

/// How long a drone should still hover after a landing has begun, s.
fn skipped_s(track: &Track<'_>, landing_s: f64) -> f64 {
    let late = track.pieces.iter().rev();
    late.take_while(|piece| piece.end_ms as f64 / 1000.0 > landing_s)
        .filter(|piece| curve_of(piece).bounds().size_m().norm() < HOVER_MPS * piece.duration_s())
        .map(|piece| (piece.end_ms as f64 / 1000.0 - landing_s).min(piece.duration_s()))
        .sum()
}

/// First take-off and last landing by each generation, and how late 4.6 is at the start.
fn margins(tracks: &[&Track<'_>], derived: &[Both], collector: &mut Collector) {
    type Measure = fn(&Both) -> Option<f64>;
    let measures: [(&'static str, &'static str, bool, Measure); 5] = [
        ("firmware-takeoff", "first take-off by firmware 4.4", false, |both| both.v44.takeoff_s),
        ("firmware-takeoff", "first take-off by firmware 4.6", false, |both| both.v46.takeoff_s),
        ("firmware-takeoff", "latest behind the show at take-off, firmware 4.6", true, |both| {
            both.v46.takeoff_s.map(|_| both.v46.late_s)
        }),
        ("firmware-landing", "last start of landing by firmware 4.4", true, |both| {
            Some(both.v44.landing_s)
        }),
        ("firmware-landing", "last start of landing by firmware 4.6", true, |both| {
            Some(both.v46.landing_s)
        }),
    ];
    for (check, quantity, most, measure) in measures {
        let mut found: Option<(f64, &Track<'_>)> = None;
        for (track, both) in tracks.iter().zip(derived) {
            let Some(value) = measure(both) else { continue };
            if found.is_none_or(|(known, _)| if most { value > known } else { value < known }) {
                found = Some((value, track));
            }
        }
        if let Some((value, track)) = found {
            collector.margin(Margin {
                check,
                quantity,
                value,
                limit: None,
                unit: "s",
                drones: vec![track.name()],
                time_s: None,
            });
        }
    }
}
