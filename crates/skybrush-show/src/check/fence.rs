//! Containment in the fence with its margin: inside its inclusion polygons, also concave ones, outside
//! its exclusion zones, and below its top.

use nalgebra::Vector3;

use super::bernstein::Poly;
use super::curve::{Bounds, Curve};
use super::report::Severity;
use super::track::{Track, curve_of};
use super::watch::{Object, Quantity, Stretch, Watch};
use super::{CheckInput, TOLERANCE_M};
use crate::FenceZone;
use crate::check::Fence;

/// Precision of distances to the fence, m.
const PRECISION_M: f64 = 1e-6;
/// How exactly the distance on the wrong side of a polygon is bounded, m, and how long that is pursued.
const OUTSIDE_PRECISION_M: f64 = 0.01;
const OUTSIDE_STEPS: usize = 4096;

/// Clearance from the plan's polygon.
fn clearance(margin_m: f64) -> Quantity {
    Quantity {
        check: "fence",
        label: "closest to the fence (negative: outside)",
        object: None,
        verb: "has a clearance (negative: outside) from the fence of",
        unit: "m",
        severity: Severity::Error,
        remedy: "move or shrink the show, or draw the fence wider",
        limit: margin_m,
        tolerance: TOLERANCE_M,
        squared: false,
        least: true,
    }
}

/// Altitude below the top of the fence.
pub(super) fn altitude(fence: &Fence) -> Quantity {
    Quantity {
        check: "fence-altitude",
        label: "highest below the fence's top less its margin",
        verb: "is at an altitude of",
        remedy: "lower the show, or raise the top of the fence",
        limit: fence.max_altitude_m - fence.margin_m,
        least: false,
        ..clearance(0.0)
    }
}

/// Whether a fence can be checked against: three corners or more, all finite.
pub(super) fn usable(fence: &Fence) -> bool {
    usable_polygon(&fence.polygon_m)
        && fence.margin_m.is_finite()
        && fence.max_altitude_m.is_finite()
}

/// Whether a polygon can be checked against: three corners or more, all finite.
pub(super) fn usable_polygon(corners_m: &[[f64; 2]]) -> bool {
    corners_m.len() >= 3 && corners_m.iter().flatten().all(|value| value.is_finite())
}

/// Every polygon that counts, with what is watched: that of the fence, and the show's own, each with
/// the fence's margin.
///
/// A drone must be inside all inclusion polygons. That is what the autopilot asks for unless its
/// parameter `FENCE_OPTIONS` has the bit for their union, and the stricter of the two.
pub(super) fn zones<'a>(input: &CheckInput<'a>) -> Vec<(Polygon<'a>, Quantity)> {
    let fence = input.fence.filter(|fence| usable(fence));
    let margin_m = fence.map_or(0.0, |fence| fence.margin_m);
    let planned =
        fence.map(|fence| (Polygon::new(&fence.polygon_m, true, margin_m), clearance(margin_m)));
    let is_planned = |zone: &FenceZone| {
        zone.is_inclusion && fence.is_some_and(|fence| fence.polygon_m == zone.corners_m)
    };
    let own = input
        .show
        .fence
        .iter()
        .enumerate()
        .filter(|(_, zone)| usable_polygon(&zone.corners_m) && !is_planned(zone))
        .map(|(index, zone)| {
            let polygon = Polygon::new(&zone.corners_m, zone.is_inclusion, margin_m);
            (polygon, zone_clearance(zone, index + 1, margin_m))
        });
    planned.into_iter().chain(own).collect()
}

fn zone_clearance(zone: &FenceZone, number: usize, margin_m: f64) -> Quantity {
    let fence = clearance(margin_m);
    if zone.is_inclusion {
        let object = Some(Object { kind: "inclusion zone", number });
        Quantity {
            label: "closest to a further inclusion zone (negative: outside)",
            object,
            verb: "has a clearance (negative: outside) of",
            ..fence
        }
    } else {
        let object = Some(Object { kind: "exclusion zone", number });
        Quantity {
            check: "fence-exclusion",
            label: "closest to an exclusion zone (negative: inside)",
            object,
            verb: "has a clearance (negative: inside) of",
            remedy: "lead the show around the zone, or remove the zone from the fence",
            ..fence
        }
    }
}

/// One side of the polygon: from a corner, `length_m` along the unit vector.
struct Side {
    from: [f64; 2],
    along: [f64; 2],
    length_m: f64,
}

/// The polygon prepared for distances.
pub(super) struct Polygon<'a> {
    corners: &'a [[f64; 2]],
    is_inclusion: bool,
    sides: Vec<Side>,
    margin_m: f64,
}

impl<'a> Polygon<'a> {
    fn new(corners: &'a [[f64; 2]], is_inclusion: bool, margin_m: f64) -> Self {
        let next = corners.iter().cycle().skip(1);
        let sides = corners
            .iter()
            .zip(next)
            .map(|(from, to)| {
                let way = [to[0] - from[0], to[1] - from[1]];
                let length_m = way[0].hypot(way[1]);
                let along = if length_m > 0.0 { way.map(|v| v / length_m) } else { [1.0, 0.0] };
                Side { from: *from, along, length_m }
            })
            .collect();
        Self { corners, is_inclusion, sides, margin_m }
    }

    /// Whether a drone may be there, margin apart.
    fn allows(&self, x: f64, y: f64) -> bool {
        self.contains(x, y) == self.is_inclusion
    }

    /// Whether a point is inside, by the even-odd rule.
    fn contains(&self, x: f64, y: f64) -> bool {
        let next = self.corners.iter().cycle().skip(1);
        self.corners.iter().zip(next).fold(false, |inside, (a, b)| {
            let crosses =
                (a[1] > y) != (b[1] > y) && x < (b[0] - a[0]) * (y - a[1]) / (b[1] - a[1]) + a[0];
            inside ^ crosses
        })
    }

    /// Distance of a point from the boundary.
    fn distance_m(&self, x: f64, y: f64) -> f64 {
        let distance = |side: &Side| {
            let (dx, dy) = (x - side.from[0], y - side.from[1]);
            let t = (dx * side.along[0] + dy * side.along[1]).clamp(0.0, side.length_m);
            (dx - t * side.along[0]).hypot(dy - t * side.along[1])
        };
        self.sides.iter().map(distance).fold(f64::INFINITY, f64::min)
    }
}

impl Side {
    /// Lower bound of the distance of anything in a box.
    fn bound_m(&self, bounds: &Bounds) -> f64 {
        let mut sum = 0.0;
        for axis in 0..2 {
            let (a, b) = (self.from[axis], self.from[axis] + self.along[axis] * self.length_m);
            let gap = (bounds.low[axis] - a.max(b)).max(a.min(b) - bounds.high[axis]).max(0.0);
            sum += gap * gap;
        }
        sum.sqrt()
    }

    /// Coordinates of a curve along the side and across it.
    fn coordinates(&self, curve: &Curve) -> (Poly, Poly) {
        let [x, y] = self.along;
        let [x0, y0] = self.from;
        (curve.along(x, y).plus(-(x0 * x + y0 * y)), curve.along(-y, x).plus(x0 * y - y0 * x))
    }

    /// Calls `visit` with the squared distance of the curve over parts of [0, 1]: nearest to one of
    /// the corners, or to the side between them.
    fn squared_distances(&self, curve: &Curve, mut visit: impl FnMut(f64, f64, &Poly)) {
        let (along, across) = self.coordinates(curve);
        let mut cuts = vec![0.0, 1.0];
        for level in [0.0, self.length_m] {
            cuts.extend(along.below(level).iter().flat_map(|(from, to)| [*from, *to]));
        }
        cuts.sort_by(f64::total_cmp);
        cuts.dedup();
        for pair in cuts.windows(2) {
            let (along, across) =
                (along.restrict(pair[0], pair[1]), across.restrict(pair[0], pair[1]));
            let middle = along.value(0.5);
            let beyond = if middle < 0.0 {
                along.square()
            } else if middle > self.length_m {
                along.plus(-self.length_m).square()
            } else {
                Poly::constant(0.0)
            };
            visit(pair[0], pair[1], &across.square().add(&beyond));
        }
    }
}

/// Watches the altitude of one drone.
pub(super) fn watch_altitude(track: &Track<'_>, what: Quantity) -> Watch {
    let mut altitude = Watch::new(what);
    altitude.feed_instant(track.start_m.z, 0.0);
    for piece in &track.pieces {
        let curve = curve_of(piece);
        if !altitude.is_dull(curve.bounds().high.z) {
            altitude.feed(&curve.axis(2), piece.start_ms as f64 / 1000.0, piece.duration_s());
        }
    }
    altitude
}

/// Watches one drone against one polygon: from its home over the trajectory to its landing place.
pub(super) fn watch(track: &Track<'_>, polygon: &Polygon<'_>, what: Quantity) -> Watch {
    let mut clearance = Watch::new(what);
    let signed = |point: Vector3<f64>| {
        let distance_m = polygon.distance_m(point.x, point.y);
        if polygon.allows(point.x, point.y) { distance_m } else { -distance_m }
    };
    for place in track.drone.home_m.into_iter().chain([track.start_m]) {
        clearance.feed_instant(signed(place), 0.0);
    }
    for piece in &track.pieces {
        let (start_s, duration_s) = (piece.start_ms as f64 / 1000.0, piece.duration_s());
        let curve = curve_of(piece);
        let bounds = curve.bounds();
        let first = curve.first();
        let known_m = clearance.worst().unwrap_or(f64::INFINITY).max(polygon.margin_m);
        let far = polygon.sides.iter().all(|side| side.bound_m(&bounds) > known_m);
        if far && polygon.allows(first.x, first.y) {
            continue;
        }
        for (from, to, worst_m, at) in stretches(&curve, polygon) {
            clearance.feed_stretch(Stretch {
                from_s: start_s + from * duration_s,
                to_s: start_s + to * duration_s,
                worst: worst_m,
                worst_s: start_s + at * duration_s,
            });
        }
    }
    if let Some(place) = track.drone.land_at_m {
        clearance.feed_instant(signed(place), track.end_ms as f64 / 1000.0);
    }
    clearance
}

/// Parts of a curve with their least clearance (negative on the wrong side) and where it is: the parts that
/// break the margin, or the nearest point if none does.
fn stretches(curve: &Curve, polygon: &Polygon<'_>) -> Vec<(f64, f64, f64, f64)> {
    // The boundary is crossed only where the line of a side is.
    let mut cuts = vec![0.0, 1.0];
    for side in &polygon.sides {
        let across = side.coordinates(curve).1;
        cuts.extend(across.below(0.0).iter().flat_map(|(from, to)| [*from, *to]));
    }
    cuts.sort_by(f64::total_cmp);
    cuts.dedup();
    let mut found = Vec::new();
    for pair in cuts.windows(2) {
        let (low, high) = (pair[0], pair[1]);
        let at = |u: f64| low + u * (high - low);
        let part = curve.restrict(low, high);
        let middle = part.value(0.5);
        if !polygon.allows(middle.x, middle.y) {
            let (worst_m, u) = farthest(&part, polygon);
            found.push((low, high, -worst_m, at(u)));
            continue;
        }
        let mut nearest = (f64::INFINITY, 0.0);
        for side in &polygon.sides {
            side.squared_distances(&part, |from, to, squared| {
                let least =
                    squared.minimum(|value| PRECISION_M * (value.max(0.0).sqrt() + PRECISION_M));
                let distance_m = least.value.max(0.0).sqrt();
                let place = |u: f64| at(from + u * (to - from));
                if distance_m < nearest.0 {
                    nearest = (distance_m, place(least.u));
                }
                if distance_m < polygon.margin_m - TOLERANCE_M {
                    for (a, b) in squared.below(polygon.margin_m * polygon.margin_m) {
                        let worst = squared.restrict(a, b).minimum(|_| PRECISION_M * PRECISION_M);
                        let worst_u = place(a + worst.u * (b - a));
                        found.push((place(a), place(b), worst.value.max(0.0).sqrt(), worst_u));
                    }
                }
            });
        }
        found.push((nearest.1, nearest.1, nearest.0, nearest.1));
    }
    found.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    found
}

/// Largest distance from the sides of a curve on the wrong side of them: proven to within a centimetre unless
/// the search is cut short, since the distance cannot change faster than the curve moves.
fn farthest(curve: &Curve, polygon: &Polygon<'_>) -> (f64, f64) {
    let distance = |u: f64| {
        let point = curve.value(u);
        polygon.distance_m(point.x, point.y)
    };
    let mut best = (distance(0.0), 0.0);
    for u in [0.5, 1.0] {
        if distance(u) > best.0 {
            best = (distance(u), u);
        }
    }
    let mut stack = vec![(*curve, 0.0, 1.0)];
    let mut steps = 0;
    while let Some((part, from, to)) = stack.pop() {
        let middle = 0.5 * (from + to);
        let here = distance(middle);
        if here > best.0 {
            best = (here, middle);
        }
        let centre = part.value(0.5);
        let reach =
            part.points().iter().map(|point| (point - centre).xy().norm()).fold(0.0, f64::max);
        steps += 1;
        if here + reach > best.0 + OUTSIDE_PRECISION_M && steps < OUTSIDE_STEPS {
            stack.push((part.restrict(0.5, 1.0), middle, to));
            stack.push((part.restrict(0.0, 0.5), from, middle));
        }
    }
    best
}
