//! Exact safety checks of a show against its limits.
//!
//! Nothing is sampled: lines are solved in closed form, curves by bounds on their polynomials that
//! are proven and refined until they agree with an attained value ([`bernstein`]). Every check
//! reports what breaks a limit (drone, time, value, limit) and, passing or not, the worst value it
//! met ([`Margin`]).
//!
//! # What counts
//!
//! * A drone is in the air while it is more than [`AIRBORNE_ABOVE_M`] above its own ground: the
//!   height of its home, or of its first point.
//! * The distance limit holds while at least one of two drones is in the air; two drones on the
//!   ground keep [`Options::min_ground_distance_m`].
//! * After its last point a drone may be anywhere from there down to the ground, until the end of the
//!   show: whether it hovers, is landing or has landed depends on the firmware.
//! * Files round to a millimetre. A limit is broken when it is exceeded by more than [`TOLERANCE_M`],
//!   [`TOLERANCE_MPS`] or [`TOLERANCE_MPS2`]; the values in the report are exact.

pub mod bernstein;
mod cause;
mod curve;
mod distance;
mod endurance;
mod extras;
mod fence;
mod firmware;
mod format;
mod ground;
mod lateral;
mod limits;
mod low_flight;
mod motion;
mod pair;
mod report;
mod stated;
mod track;
mod tree;
mod validity;
mod watch;

use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use cause::{Cause, causes};
pub use firmware::Firmware;
pub use report::{CheckReport, Collector, Count, Finding, Margin, Severity};

pub use crate::MAX_DRONES;

use crate::Show;
use stated::Stated;
use track::Track;
use watch::Watch;

/// Height above its ground from which a drone is in the air, m.
pub const AIRBORNE_ABOVE_M: f64 = 0.5;
/// Excess over its limit that a length is allowed, m: the resolution of show files.
pub const TOLERANCE_M: f64 = 1e-3;
/// Excess over its limit that a speed is allowed, m/s: the effect of rounding in show files.
pub const TOLERANCE_MPS: f64 = 1e-3;
/// Excess over its limit that an acceleration is allowed, m/s².
pub const TOLERANCE_MPS2: f64 = 1e-3;
/// Time after the last trajectory that is still checked, ms: all drones are then landing.
const AFTER_SHOW_MS: u64 = 1000;

/// Choices that are neither the vehicle's nor the firmware's.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Options {
    /// Smallest distance of two drones that both stand on the ground, m.
    pub min_ground_distance_m: f64,
    /// How far a trajectory may lead below the drone's own ground, m.
    pub ground_tolerance_m: f64,
    /// How far a drone may move sideways below the take-off altitude, m.
    pub low_lateral_m: f64,
    /// Findings of each check that are listed; the rest is counted.
    pub findings_per_check: usize,
}

impl Default for Options {
    /// Half a metre on the ground; 50 mm sideways, as the firmware allows in a vertical stretch.
    fn default() -> Self {
        Self {
            min_ground_distance_m: 0.5,
            ground_tolerance_m: 0.05,
            low_lateral_m: 0.05,
            findings_per_check: 20,
        }
    }
}

/// A show and what it is checked against.
#[derive(Clone, Copy, Debug)]
pub struct CheckInput<'a> {
    /// The show to check.
    pub show: &'a Show,
    /// Limits of the vehicle that is to fly the show.
    pub limits: &'a Limits,
    /// The fence, if there is one; the show's own zones ([`Show::fence`]) are checked besides it.
    pub fence: Option<&'a Fence>,
    /// Whether the fence has a top; a polygon that a show file brings has none.
    pub fence_has_top: bool,
    /// The vehicle's own limits, against which [`CheckInput::limits`] may have been loosened.
    pub stock: Option<&'a Limits>,
    /// A rule of the caller's own, checked besides those of this crate.
    pub rule: Option<&'a dyn Rule>,
    /// Firmware parameters that decide how a trajectory is read.
    pub firmware: Firmware,
    /// Settings that belong neither to the vehicle nor to the firmware.
    pub options: Options,
}

/// What a vehicle may be asked to do; plans are checked against it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Limits {
    /// Largest horizontal speed, m/s.
    pub max_speed_xy_mps: f64,
    /// Largest upward speed, m/s.
    pub max_speed_up_mps: f64,
    /// Largest downward speed, m/s.
    pub max_speed_down_mps: f64,
    /// Largest acceleration within a piece, m/s².
    pub max_acceleration_mps2: f64,
    /// Largest jump of velocity between two pieces, m/s.
    pub max_velocity_step_mps: f64,
    /// Highest altitude above ground, m.
    pub max_altitude_m: f64,
    /// Smallest distance between any two drones in the air, m.
    pub min_distance_m: f64,
    /// Time a full battery carries the vehicle in hover, s.
    pub endurance_s: f64,
    /// Share of the endurance that must be left after landing, 0..1.
    pub endurance_reserve: f64,
}

/// The fence around the show: a box of the show frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Fence {
    /// Corners of the inclusion polygon, show x and y, m, counter-clockwise, not repeated.
    pub polygon_m: Vec<[f64; 2]>,
    /// Highest altitude above ground, m.
    pub max_altitude_m: f64,
    /// Distance that trajectories must keep from the fence, m.
    pub margin_m: f64,
}

/// A rule of the caller's own, whose findings stand in the report with the rest.
pub trait Rule: std::fmt::Debug + Sync {
    /// Adds the rule's findings to the report.
    fn check(&self, collector: &mut Collector);
}

/// Names of all checks of this crate, as findings carry them.
pub const NAMES: &[&str] = &[
    "acceleration",
    "acceleration-horizontal",
    "acceleration-vertical",
    "altitude-max",
    "altitude-min",
    "distance",
    "endurance",
    "fence",
    "fence-altitude",
    "fence-exclusion",
    "file",
    "firmware-away",
    "firmware-climb",
    "firmware-early-landing",
    "firmware-end",
    "firmware-landing",
    "firmware-start",
    "firmware-takeoff",
    "ground-distance",
    "home",
    "limits",
    "low-flight",
    "low-lateral",
    "mixed-starts",
    "nav-altitude",
    "same-home",
    "same-start",
    "skyb-duration",
    "skyb-range",
    "skyb-size",
    "skyb-unit",
    "speed-down",
    "speed-horizontal",
    "speed-up",
    "validity",
    "velocity-step",
    "yaw-rate",
];

impl<'a> CheckInput<'a> {
    /// A show and limits, without a fence, with default firmware and options.
    pub fn new(show: &'a Show, limits: &'a Limits) -> Self {
        let (firmware, options) = (Firmware::default(), Options::default());
        Self {
            show,
            limits,
            fence: None,
            fence_has_top: true,
            stock: None,
            rule: None,
            firmware,
            options,
        }
    }

    /// This input with another climb rate of the autopilot (`WPNAV_SPEED_UP`), m/s.
    #[must_use]
    pub fn with_speed_up(mut self, wpnav_speed_up_mps: f64) -> Self {
        self.firmware.wpnav_speed_up_mps = wpnav_speed_up_mps;
        self
    }

    /// This input with another fence, or with none.
    #[must_use]
    pub fn with_fence(self, fence: Option<&'a Fence>) -> Self {
        Self { fence, ..self }
    }

    /// This input with the polygon of a fence whose top is unknown, or with no fence.
    #[must_use]
    pub fn with_polygon(self, fence: Option<&'a Fence>) -> Self {
        Self { fence, fence_has_top: false, ..self }
    }

    /// This input with one rule of the caller's own besides the crate's checks.
    #[must_use]
    pub fn with_rule(self, rule: &'a dyn Rule) -> Self {
        Self { rule: Some(rule), ..self }
    }

    /// This input with the vehicle's stock limits: where [`CheckInput::limits`] are looser, the
    /// report says so.
    #[must_use]
    pub fn with_stock(self, stock: &'a Limits) -> Self {
        Self { stock: Some(stock), ..self }
    }
}

/// Runs all checks.
///
/// The report depends on the input alone, not on the number of threads. Drones whose numbers make no
/// sense (not finite, thousands of kilometres away) are reported and left out of the other checks.
///
/// ```
/// use skybrush_show::check::{CheckInput, check};
/// # use skybrush_show::{Show, check::Limits};
/// # let limits = Limits { max_speed_xy_mps: 4.0, max_speed_up_mps: 3.5, max_speed_down_mps: 3.5,
/// #     max_acceleration_mps2: 2.0, max_velocity_step_mps: 3.5, max_altitude_m: 120.0,
/// #     min_distance_m: 3.0, endurance_s: 900.0, endurance_reserve: 0.2 };
/// let report = check(&CheckInput::new(&Show::default(), &limits));
/// assert!(!report.passed());
/// assert_eq!(report.findings[0].message, "the show has no drones");
/// ```
pub fn check(input: &CheckInput<'_>) -> CheckReport {
    let show = input.show;
    let mut collector = Collector::new(input.options.findings_per_check);
    let usable = validity::check(input, &mut collector);
    let duration_ms =
        show.drones.iter().map(|drone| drone.trajectory.duration_ms()).max().unwrap_or(0);
    let horizon_ms = duration_ms.saturating_add(AFTER_SHOW_MS);
    let tracks: Vec<Track<'_>> = show
        .drones
        .par_iter()
        .enumerate()
        .zip(&usable)
        .filter(|(_, usable)| **usable)
        .map(|((index, drone), _)| Track::new(index, drone, AIRBORNE_ABOVE_M, horizon_ms))
        .collect();

    limits::check(input, &mut collector);
    extras::check(input, &mut collector);
    if let Some(rule) = input.rule {
        rule.check(&mut collector);
    }
    ground::check(&tracks, &mut collector);
    distance::check(input, &tracks, horizon_ms, &mut collector);
    watch_drones(input, &tracks, &mut collector);
    format::check(&tracks, &mut collector);
    firmware::check(input, &tracks, &mut collector);
    if input.fence.is_none() && !show.fence.iter().any(|zone| zone.is_inclusion) {
        collector.note(if show.fence.is_empty() {
            "no fence in this show: nothing says how far a drone may stray"
        } else {
            "the fence of this show only excludes: nothing says how far a drone may stray"
        });
    }
    collector.finish(show.drones.len(), duration_ms as f64 / 1000.0)
}

/// The checks that look at one drone at a time.
fn watch_drones(input: &CheckInput<'_>, tracks: &[Track<'_>], collector: &mut Collector) {
    let firmware = &input.firmware;
    let zones = fence::zones(input);
    let top = input.fence.filter(|fence| input.fence_has_top && fence::usable(fence));
    let top = top.map(fence::altitude);
    let motion = motion::quantities(input);
    let lateral = lateral::quantity(input);
    let stated = Stated::of(input);
    let low_flight = low_flight::quantity(input);
    let endurance = endurance::quantity(input);
    let watched: Vec<Vec<Watch>> = tracks
        .par_iter()
        .map(|track| {
            let mut watches = motion::watch(track, &motion).to_vec();
            watches.push(lateral::watch(track, lateral, firmware.takeoff_alt_m));
            watches.push(low_flight::watch(track, low_flight, AIRBORNE_ABOVE_M));
            watches.push(endurance::watch(track, endurance, firmware.land_speed_mps));
            let clearances = zones.iter().map(|(zone, what)| fence::watch(track, zone, *what));
            watches.extend(clearances);
            watches.extend(stated.watch(track));
            watches.extend(top.map(|what| fence::watch_altitude(track, what)));
            watches
        })
        .collect();
    let kinds = watched.first().map_or(0, Vec::len);
    let mut columns: Vec<_> = watched.into_iter().map(Vec::into_iter).collect();
    for _ in 0..kinds {
        let column = columns.iter_mut().filter_map(Iterator::next);
        watch::report(tracks.iter().zip(column), collector);
    }
}
