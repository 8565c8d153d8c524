//! The paper's slow offset of a drone's pulse over time and height (its section II.C, eq. 5).
//!
//! In the field the air moves while the drones calibrate. Wherever no vertical velocity was
//! commanded (the "0-windows"), the pulse's deviation from its own mean over all of them is taken for
//! the work of the air, and interpolated to the times and heights between: the *offset*, which is
//! subtracted before a law is fitted. Its mean is zero by definition: "a long enough average of the
//! vertical velocity of the air vanishes".
//!
//! The interpolation is linear on the Delaunay triangulation of the scattered 0-windows. A
//! triangulation is not independent of units, so time counts in minutes and height in tens of metres;
//! heights are rounded to whole metres first, or centimetres of jitter between hovers at one nominal
//! height would decide the mesh. Outside the hull of the 0-windows the offset is that of the nearest
//! 0-window, and says so ([`Offset::inside`]): the first climb of the paper's ladder lies there.
//!
//! Subtracting a pulse is exact for the straight law only: an updraft of 1 m/s takes the same number
//! of microseconds at every speed there, and not where the law bends.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spade::{
    DelaunayTriangulation, FloatTriangulation as _, HasPosition, Point2, Triangulation as _,
};

use super::calibrate::{Location, location};
use super::stats::mean_sd;
use super::window::WindowStats;
use crate::base::estimate::Estimate;

/// Time that counts as much as [`HEIGHT_SCALE_M`] in the triangulation, s. A Delaunay mesh depends on the
/// ratio of the two (docs/physics.md, 5.3); the paper does not give it. Convention.
pub const TIME_SCALE_S: f64 = 60.0;
/// Height that counts as much as [`TIME_SCALE_S`] in the triangulation, m. Convention.
pub const HEIGHT_SCALE_M: f64 = 10.0;
/// 0-windows without which there is no offset: a single one is its own mean.
const FEWEST: usize = 2;

/// A drone's pulse in its 0-windows, against their mean.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct OffsetMap {
    /// Mean pulse over the 0-windows (eq. 5), us. Its error is their scatter over the root of their
    /// number: what remains of air that moves faster than the flight lasts. Slower air is not in it.
    pub baseline_us: Estimate,
    /// The 0-windows, in time order.
    pub points: Vec<OffsetPoint>,
}

/// One 0-window.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct OffsetPoint {
    /// Middle of the window, show time, s.
    pub time_s: f64,
    /// Mean height above home, m.
    pub height_m: f64,
    /// Pulse less the baseline, us.
    pub offset_us: f64,
}

/// Offset of the pulse at one time and height, interpolated between 0-windows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Offset {
    /// Offset of the pulse, us.
    pub us: f64,
    /// Whether it lies between 0-windows; otherwise it is that of the nearest one.
    pub inside: bool,
}

impl OffsetMap {
    /// The offset map of a calibration, from the hovers that were flown properly; `None` with fewer
    /// than two.
    pub fn of(windows: &[WindowStats], by: Location) -> Option<Self> {
        let hovers = || windows.iter().filter(|one| one.kind.is_hover() && one.rejected.is_empty());
        let pulses: Vec<f64> = hovers().map(|one| location(&one.effort_phi, by)).collect();
        if pulses.len() < FEWEST || pulses.iter().any(|pulse| !pulse.is_finite()) {
            return None;
        }
        let (mean, sd) = mean_sd(&pulses);
        let points = hovers()
            .zip(&pulses)
            .map(|(window, pulse)| OffsetPoint {
                time_s: middle_s(window),
                height_m: window.height_m,
                offset_us: pulse - mean,
            })
            .collect();
        let se = sd / (pulses.len() as f64).sqrt();
        Some(Self { baseline_us: Estimate::new(mean, se), points })
    }

    /// Prepares the interpolation; to be done once for many times and heights.
    pub fn surface(&self) -> OffsetSurface {
        let mut mesh = DelaunayTriangulation::new();
        let mut along: Vec<(f64, f64)> = Vec::new();
        for point in &self.points {
            let position = scaled(point.time_s, point.height_m.round());
            // Positions are finite: they come from windows that were flown.
            if mesh.insert(Knot { position, offset_us: point.offset_us }).is_ok() {
                along.push((point.time_s, point.offset_us));
            }
        }
        along.sort_by(|left, right| left.0.total_cmp(&right.0));
        OffsetSurface { mesh, along }
    }

    /// The offset at a show time and height above home; `None` without any 0-window.
    pub fn at(&self, time_s: f64, height_m: f64) -> Option<Offset> {
        self.surface().at(time_s, height_m)
    }

    /// The 0-windows' offset, subtracted from all windows of vertical motion of a calibration.
    pub(super) fn subtract(windows: &mut [WindowStats], by: Location) -> Option<Self> {
        let map = Self::of(windows, by).filter(|_| windows.iter().any(|one| one.kind.is_leg()))?;
        map.apply(windows);
        Some(map)
    }

    /// Writes the offset into each window of vertical motion, and whether it lay outside.
    pub fn apply(&self, windows: &mut [WindowStats]) {
        let surface = self.surface();
        for window in windows.iter_mut().filter(|window| window.kind.is_leg()) {
            let offset = surface.at(middle_s(window), window.height_m);
            window.offset_us = offset.map(|offset| offset.us);
            window.offset_outside = offset.is_some_and(|offset| !offset.inside);
        }
    }
}

/// [`OffsetMap`] made ready for interpolation.
#[derive(Debug)]
pub struct OffsetSurface {
    mesh: DelaunayTriangulation<Knot>,
    /// Time and offset of the 0-windows, in time order: for those that all lie on one line.
    along: Vec<(f64, f64)>,
}

#[derive(Clone, Copy, Debug)]
struct Knot {
    position: Point2<f64>,
    offset_us: f64,
}

impl HasPosition for Knot {
    type Scalar = f64;

    fn position(&self) -> Point2<f64> {
        self.position
    }
}

impl OffsetSurface {
    /// The offset at a show time and height above home; `None` without any 0-window.
    pub fn at(&self, time_s: f64, height_m: f64) -> Option<Offset> {
        if self.mesh.num_inner_faces() == 0 {
            return self.along_time(time_s);
        }
        let place = scaled(time_s, height_m);
        if !(place.x.is_finite() && place.y.is_finite()) {
            return None;
        }
        let linear = self.mesh.barycentric().interpolate(|knot| knot.data().offset_us, place);
        if let Some(us) = linear {
            return Some(Offset { us, inside: true });
        }
        let nearest = self.mesh.vertices().map(|knot| *knot.data()).min_by(|left, right| {
            let distance = |knot: &Knot| knot.position.distance_2(place);
            distance(left).total_cmp(&distance(right))
        })?;
        Some(Offset { us: nearest.offset_us, inside: false })
    }

    /// 0-windows all at one height (or otherwise on a line): linear in time alone.
    fn along_time(&self, time_s: f64) -> Option<Offset> {
        let after = self.along.partition_point(|(time, _)| *time < time_s);
        let before = after.checked_sub(1).and_then(|index| self.along.get(index));
        Some(match (before, self.along.get(after)) {
            (Some((t0, u0)), Some((t1, u1))) => {
                let share = if t1 > t0 { (time_s - t0) / (t1 - t0) } else { 0.0 };
                Offset { us: u0 + share * (u1 - u0), inside: true }
            }
            (Some((time, us)), None) | (None, Some((time, us))) => {
                Offset { us: *us, inside: *time == time_s }
            }
            (None, None) => return None,
        })
    }
}

fn middle_s(window: &WindowStats) -> f64 {
    f64::midpoint(window.start_s, window.end_s)
}

fn scaled(time_s: f64, height_m: f64) -> Point2<f64> {
    Point2::new(time_s / TIME_SCALE_S, height_m / HEIGHT_SCALE_M)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 0-windows of the paper's ladder: base hovers at 20 m, top hovers after 20 s at each rung.
    fn ladder(offset: impl Fn(f64, f64) -> f64, jitter_m: f64) -> OffsetMap {
        let mut points = Vec::new();
        for rung in 0..7 {
            let base_s = 5.0 + 60.0 * f64::from(rung);
            let top_m = 20.0 + 10.0 * f64::from(rung + 1);
            let wobble = jitter_m * f64::from(rung % 3 - 1);
            points.push((base_s, 20.0 + wobble));
            points.push((base_s + 30.0, top_m - wobble));
        }
        points.push((425.0, 20.0));
        let point = |(time_s, height_m): (f64, f64)| OffsetPoint {
            time_s,
            height_m,
            offset_us: offset(time_s, height_m.round()),
        };
        OffsetMap {
            baseline_us: Estimate::new(1546.5, 1.0),
            points: points.into_iter().map(point).collect(),
        }
    }

    #[test]
    fn a_plane_is_found_exactly_inside_and_told_outside() {
        let plane = |time_s: f64, height_m: f64| 0.02 * time_s - 0.3 * height_m;
        let map = ladder(plane, 0.0);
        let surface = map.surface();
        for (time_s, height_m) in [(50.0, 22.0), (200.0, 40.0), (300.0, 60.0), (390.0, 50.0)] {
            let found = surface.at(time_s, height_m).unwrap();
            assert!(found.inside, "{time_s} s, {height_m} m");
            assert!((found.us - plane(time_s, height_m)).abs() < 1e-9, "{found:?}");
        }
        // The paper's first climb: above the edge from the first base hover to the first top hover.
        let first_up = surface.at(24.5, 27.0).unwrap();
        assert!(!first_up.inside);
        let nearest = map.points[1].offset_us;
        assert_eq!(first_up.us, nearest, "the nearest 0-window's, nothing extrapolated");
    }

    #[test]
    fn centimetres_of_jitter_do_not_decide() {
        let bend = |time_s: f64, height_m: f64| (time_s / 90.0).sin() * 8.0 + 0.1 * height_m;
        let (still, jittered) = (ladder(bend, 0.0).surface(), ladder(bend, 0.04).surface());
        for step in 0..60 {
            let (time_s, height_m) = (7.0 * f64::from(step), 21.0 + 0.6 * f64::from(step % 20));
            assert_eq!(still.at(time_s, height_m), jittered.at(time_s, height_m), "{time_s}");
        }
    }

    #[test]
    fn hovers_at_one_height_are_joined_along_time() {
        let mut map = ladder(|time_s, _| time_s, 0.0);
        map.points.retain(|point| point.height_m < 21.0);
        let surface = map.surface();
        assert_eq!(surface.at(95.0, 30.0), Some(Offset { us: 95.0, inside: true }));
        assert_eq!(surface.at(900.0, 20.0), Some(Offset { us: 425.0, inside: false }));
        map.points.clear();
        assert_eq!(map.at(1.0, 1.0), None);
    }

    #[test]
    fn absurd_places_are_not_interpolated() {
        let surface = ladder(|_, _| 1.0, 0.0).surface();
        assert_eq!(surface.at(f64::NAN, 20.0), None);
        assert!(!surface.at(1e12, -1e9).unwrap().inside);
    }

    fn hover(pulse_us: f64, rejected: &[super::super::result::Rejection]) -> WindowStats {
        let stats =
            |mean: f64| serde_json::json!({"median": mean, "mean": mean, "sd": 0.0, "n": 1});
        let mut window: WindowStats = serde_json::from_value(serde_json::json!({
            "kind": "hover", "label": "", "start_s": 10.0, "end_s": 16.0, "commanded_mps": 0.0,
            "height_m": 20.0, "velocity_mps": stats(0.0), "pulse_us": stats(0.0),
            "pulse_phi_us": stats(0.0), "tilt_deg": stats(0.0), "offset_us": null, "rejected": []
        }))
        .unwrap();
        window.effort_phi.mean = pulse_us;
        window.rejected = rejected.to_vec();
        window
    }

    #[test]
    fn two_hovers_that_were_flown_properly_make_a_map_and_one_is_its_own_mean() {
        let gap = hover(1700.0, &[super::super::result::Rejection::Gap]);
        let of = |windows: &[WindowStats]| OffsetMap::of(windows, Location::Mean);
        let map = of(&[hover(1540.0, &[]), gap.clone(), hover(1550.0, &[])]).unwrap();
        assert_eq!(map.baseline_us.value, 1545.0);
        let offsets: Vec<f64> = map.points.iter().map(|point| point.offset_us).collect();
        assert_eq!(offsets, [-5.0, 5.0]);
        assert_eq!(of(&[hover(1540.0, &[]), gap]), None);
        assert_eq!(of(&[hover(1540.0, &[]), hover(f64::NAN, &[])]), None, "a pulse is not known");
    }
}
