//! The closest approach of two drones while each stays in one piece of its trajectory.

use nalgebra::Vector3;

use super::curve::Curve;
use super::track::Place;

/// Agreement of the proven bound with the attained distance, m.
const PRECISION_M: f64 = 1e-7;
/// Largest difference between the two that is left when a search is cut short, m.
const DOUBT_M: f64 = 1e-3;

/// A distance and the curve parameter at which it is attained.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Closest {
    pub(super) u: f64,
    pub(super) distance_m: f64,
}

/// Calls `visit` with curves (and the part of [0, 1] that each covers) whose distance from the
/// origin is the distance of the two drones.
///
/// A drone that has ended may be anywhere on its way down: the vertical gap between two such
/// columns is 0 where they overlap, and from top to bottom where they do not.
pub(super) fn gaps(a: &Place, b: &Place, mut visit: impl FnMut(f64, f64, &Curve)) {
    let difference = a.curve.minus(&b.curve);
    if a.depth_m == 0.0 && b.depth_m == 0.0 {
        visit(0.0, 1.0, &difference);
        return;
    }
    let height = difference.axis(2);
    let mut cuts = vec![0.0, 1.0];
    for level in [a.depth_m, -b.depth_m] {
        cuts.extend(height.below(level).iter().flat_map(|(from, to)| [*from, *to]));
    }
    cuts.sort_by(f64::total_cmp);
    cuts.dedup();
    for pair in cuts.windows(2) {
        let part = difference.restrict(pair[0], pair[1]);
        let above_m = part.value(0.5).z;
        let gap = if above_m > a.depth_m {
            part.shifted(Vector3::new(0.0, 0.0, -a.depth_m))
        } else if above_m < -b.depth_m {
            part.shifted(Vector3::new(0.0, 0.0, b.depth_m))
        } else {
            part.flat()
        };
        visit(pair[0], pair[1], &gap);
    }
}

/// Smallest distance of a curve from the origin, if it is below `bound_m`.
///
/// Closed form for points and lines. Otherwise the squared distance, a polynomial of twice the
/// degree, is bounded from below by its Bernstein coefficients and subdivided until the bound and an
/// attained value agree.
pub(super) fn closest(gap: &Curve, bound_m: f64) -> Option<Closest> {
    let found = match *gap.points() {
        [point] => Closest { u: 0.0, distance_m: point.norm() },
        [from, to] => {
            let way = to - from;
            let length_squared = way.norm_squared();
            let u = if length_squared > 0.0 {
                (-from.dot(&way) / length_squared).clamp(0.0, 1.0)
            } else {
                0.0
            };
            Closest { u, distance_m: (from + way * u).norm() }
        }
        _ => {
            let origin = Curve::new(&[Vector3::zeros()]).bounds();
            if gap.bounds().distance_squared(&origin) >= bound_m * bound_m {
                return None;
            }
            let least = gap
                .norm_squared()
                .minimum(|squared| PRECISION_M * (2.0 * squared.max(0.0).sqrt() + PRECISION_M));
            let attained_m = gap.value(least.u).norm();
            let proven_m = least.value.max(0.0).sqrt();
            let distance_m = if attained_m - proven_m > DOUBT_M { proven_m } else { attained_m };
            Closest { u: least.u, distance_m }
        }
    };
    (found.distance_m < bound_m).then_some(found)
}

/// The parts of a curve that are nearer to the origin than a limit.
pub(super) fn nearer_than(gap: &Curve, limit_m: f64) -> Vec<(f64, f64)> {
    gap.norm_squared().below(limit_m * limit_m)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place(points: &[[f64; 3]], depth_m: f64) -> Place {
        let points: Vec<_> = points.iter().map(|p| Vector3::from(*p)).collect();
        Place { curve: Curve::new(&points), depth_m }
    }

    fn distance(a: &Place, b: &Place) -> f64 {
        let mut least = f64::INFINITY;
        gaps(a, b, |_, _, gap| {
            if let Some(found) = closest(gap, least) {
                least = found.distance_m;
            }
        });
        least
    }

    #[test]
    fn crossing_lines_have_their_textbook_distance() {
        // Along x and along y, 2 m apart in height, 1 m late: d(u)² = 2 (10 u - 5)² with a shift.
        let a = place(&[[-5.0, 0.0, 10.0], [5.0, 0.0, 10.0]], 0.0);
        let b = place(&[[0.0, -6.0, 12.0], [0.0, 4.0, 12.0]], 0.0);
        // |(s, 0, 0) - (0, s - 1, 2)|² = s² + (s - 1)² + 4, least 4.5 at s = 1/2.
        assert!((distance(&a, &b) - 4.5_f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn a_landing_drone_is_anywhere_below_its_last_point() {
        let landing = place(&[[0.0, 0.0, 10.0]], 10.0);
        let passing = place(&[[-5.0, 2.0, 4.0], [5.0, 2.0, 4.0]], 0.0);
        assert!((distance(&landing, &passing) - 2.0).abs() < 1e-12);
        assert!((distance(&passing, &landing) - 2.0).abs() < 1e-12);
        let above = place(&[[-5.0, 0.0, 13.0], [5.0, 0.0, 13.0]], 0.0);
        assert!((distance(&landing, &above) - 3.0).abs() < 1e-12);
        let climbing = place(&[[1.0, 0.0, -4.0], [1.0, 0.0, 16.0]], 0.0);
        assert!((distance(&landing, &climbing) - 1.0).abs() < 1e-12);
        let below = place(&[[0.0, 0.0, -4.0]], 1.0);
        assert!((distance(&landing, &below) - 4.0).abs() < 1e-12);
        let beside = place(&[[3.0, 0.0, 2.0]], 2.0);
        assert!((distance(&landing, &beside) - 3.0).abs() < 1e-12);
    }

    #[test]
    fn equal_curves_side_by_side_stay_apart_by_their_offset() {
        let points = [[0.0, 0.0, 5.0], [9.0, 4.0, 8.0], [-3.0, 7.0, 2.0], [1.0, 1.0, 9.0]];
        let moved = points.map(|[x, y, z]| [x + 3.0, y - 4.0, z]);
        assert!((distance(&place(&points, 0.0), &place(&moved, 0.0)) - 5.0).abs() < 1e-9);
    }
}
