//! A drone's trajectory prepared for the checks: pieces in time, airborne or not, to the end of the
//! show.

use nalgebra::Vector3;

use super::curve::Curve;
use crate::trajectory::Piece;
use crate::{SegmentPath, ShowDrone};

/// Part of a drone's time that lies in one piece (or after the last one) and is either wholly in the
/// air or wholly on the ground.
#[derive(Clone, Copy, Debug)]
pub(super) struct Span {
    /// End, show time in ms; the start is the end of the span before it, or 0.
    pub(super) end_ms: f64,
    /// Index of the piece; none after the end of the trajectory.
    pub(super) piece: Option<u32>,
    /// Whether the drone is in the air, see [`super::AIRBORNE_ABOVE_M`].
    pub(super) airborne: bool,
}

/// One drone for the checks.
#[derive(Debug)]
pub(super) struct Track<'a> {
    /// Place in the show.
    pub(super) index: usize,
    pub(super) drone: &'a ShowDrone,
    /// Pieces that take time.
    pub(super) pieces: Vec<Piece<'a>>,
    pub(super) spans: Vec<Span>,
    /// Height of the ground where it takes off, show frame, m.
    pub(super) ground_m: f64,
    /// First point of the trajectory, show frame, m.
    pub(super) start_m: Vector3<f64>,
    /// Last point of the trajectory, show frame, m.
    pub(super) end_m: Vector3<f64>,
    /// Lowest point of the landing that follows the trajectory, m.
    pub(super) landed_z_m: f64,
    /// End of the trajectory, ms.
    pub(super) end_ms: u64,
}

/// Where a drone may be in an interval: on a curve, and after its end anywhere on the vertical line
/// down to the ground.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub(super) curve: Curve,
    /// How far below the curve it may be, m; 0 while it flies the trajectory.
    pub(super) depth_m: f64,
}

/// Name of a drone, or its number when it has none.
pub(super) fn name_of(drone: &ShowDrone, index: usize) -> String {
    if drone.name.trim().is_empty() { format!("#{}", index + 1) } else { drone.name.clone() }
}

/// The control points of a piece as a curve.
pub(super) fn curve_of(piece: &Piece<'_>) -> Curve {
    let mut buffer = [Vector3::zeros(); 8];
    Curve::new(piece.path.control_points(piece.from_m, &mut buffer))
}

impl<'a> Track<'a> {
    /// Prepares a drone whose trajectory has finite coordinates.
    pub(super) fn new(
        index: usize,
        drone: &'a ShowDrone,
        airborne_above_m: f64,
        horizon_ms: u64,
    ) -> Self {
        let start_m = drone.trajectory.start_m;
        let pieces: Vec<_> =
            drone.trajectory.pieces().filter(|piece| piece.end_ms > piece.start_ms).collect();
        let end_m = drone.trajectory.end_m();
        let ground_m = drone.home_m.map_or(start_m.z, |home| home.z);
        let landing_m = drone.land_at_m.map_or(ground_m, |place| place.z);
        let end_ms = drone.trajectory.duration_ms();
        let mut track = Self {
            index,
            drone,
            pieces,
            spans: Vec::new(),
            ground_m,
            start_m,
            end_m,
            landed_z_m: landing_m.min(end_m.z),
            end_ms,
        };
        track.spans = track.find_spans(ground_m + airborne_above_m, horizon_ms as f64);
        track
    }

    pub(super) fn name(&self) -> String {
        name_of(self.drone, self.index)
    }

    fn find_spans(&self, airborne_z_m: f64, horizon_ms: f64) -> Vec<Span> {
        let mut spans: Vec<Span> = Vec::with_capacity(self.pieces.len() + 4);
        for (number, piece) in self.pieces.iter().enumerate() {
            let (start_ms, end_ms) = (piece.start_ms as f64, piece.end_ms as f64);
            let height = curve_of(piece).axis(2);
            let piece = Some(number as u32);
            let mut at_ms = start_ms;
            let mut add = |to_ms: f64, airborne| {
                if to_ms > at_ms {
                    spans.push(Span { end_ms: to_ms, piece, airborne });
                    at_ms = to_ms;
                }
            };
            if height.lower_bound() < airborne_z_m {
                for (from, to) in height.below(airborne_z_m) {
                    add(start_ms + from * (end_ms - start_ms), true);
                    add(start_ms + to * (end_ms - start_ms), false);
                }
            }
            add(end_ms, height.upper_bound() > airborne_z_m);
        }
        spans.push(Span {
            end_ms: horizon_ms.max(self.end_ms as f64),
            piece: None,
            airborne: self.end_m.z > airborne_z_m,
        });
        spans
    }

    /// Index of the span in force at a time; the later one at a boundary.
    pub(super) fn span_at(&self, time_ms: f64) -> usize {
        self.spans.partition_point(|span| span.end_ms <= time_ms).min(self.spans.len() - 1)
    }

    /// Where the drone is during a part of a span.
    pub(super) fn place(&self, span: &Span, from_ms: f64, to_ms: f64) -> Place {
        match span.piece.and_then(|number| self.pieces.get(number as usize)) {
            Some(piece) => {
                let (start_ms, whole_ms) =
                    (piece.start_ms as f64, (piece.end_ms - piece.start_ms) as f64);
                let from = ((from_ms - start_ms) / whole_ms).clamp(0.0, 1.0);
                let to = ((to_ms - start_ms) / whole_ms).clamp(0.0, 1.0);
                Place { curve: curve_of(piece).restrict(from, to), depth_m: 0.0 }
            }
            None => {
                Place { curve: Curve::new(&[self.end_m]), depth_m: self.end_m.z - self.landed_z_m }
            }
        }
    }

    /// First and last position in a part of a span, if it is flown in a straight line.
    pub(super) fn straight(
        &self,
        span: &Span,
        from_ms: f64,
        to_ms: f64,
    ) -> Option<[Vector3<f64>; 2]> {
        let Some(piece) = span.piece.and_then(|number| self.pieces.get(number as usize)) else {
            return Some([self.end_m; 2]);
        };
        match piece.path {
            SegmentPath::Hold => Some([piece.from_m; 2]),
            SegmentPath::Line(to_m) => {
                let way = to_m - piece.from_m;
                let (start_ms, whole_ms) =
                    (piece.start_ms as f64, (piece.end_ms - piece.start_ms) as f64);
                Some(
                    [from_ms, to_ms].map(|ms| {
                        piece.from_m + way * ((ms - start_ms) / whole_ms).clamp(0.0, 1.0)
                    }),
                )
            }
            SegmentPath::Cubic(_) | SegmentPath::Septic(_) => None,
        }
    }

    /// How far below its place the drone may be during a span, m.
    pub(super) fn depth_m(&self, span: &Span) -> f64 {
        if span.piece.is_none() { self.end_m.z - self.landed_z_m } else { 0.0 }
    }

    /// Position at a show time in ms.
    pub(super) fn position(&self, time_ms: f64) -> Vector3<f64> {
        let span = self.spans[self.span_at(time_ms)];
        match self.straight(&span, time_ms, time_ms) {
            Some([position_m, _]) => position_m,
            None => self.place(&span, time_ms, time_ms).curve.first(),
        }
    }
}

/// Calls `visit` for every part of [from, to] in which both drones stay in one span.
pub(super) fn overlap(
    a: &Track<'_>,
    b: &Track<'_>,
    from_ms: f64,
    to_ms: f64,
    mut visit: impl FnMut(&Span, &Span, f64, f64),
) {
    let (mut i, mut j) = (a.span_at(from_ms), b.span_at(from_ms));
    let mut at_ms = from_ms;
    while let (Some(first), Some(second)) = (a.spans.get(i), b.spans.get(j)) {
        let until_ms = first.end_ms.min(second.end_ms).min(to_ms);
        visit(first, second, at_ms, until_ms.max(at_ms));
        if until_ms >= to_ms {
            break;
        }
        at_ms = until_ms.max(at_ms);
        i += usize::from(first.end_ms <= until_ms);
        j += usize::from(second.end_ms <= until_ms);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trajectory::{Segment, SegmentPath, Trajectory};

    #[test]
    fn spans_change_where_the_drone_leaves_the_ground() {
        let drone = ShowDrone {
            trajectory: Trajectory {
                start_m: Vector3::zeros(),
                segments: vec![
                    Segment { duration_ms: 2_000, path: SegmentPath::Hold },
                    Segment {
                        duration_ms: 10_000,
                        path: SegmentPath::Line(Vector3::new(0.0, 0.0, 10.0)),
                    },
                    Segment {
                        duration_ms: 10_000,
                        path: SegmentPath::Line(Vector3::new(0.0, 0.0, 0.1)),
                    },
                ],
            },
            ..ShowDrone::default()
        };
        let track = Track::new(0, &drone, 0.5, 30_000);
        let spans: Vec<_> = track.spans.iter().map(|s| (s.end_ms.round(), s.airborne)).collect();
        let expected = [
            (2_000.0, false),
            (2_500.0, false),
            (12_000.0, true),
            (21_596.0, true),
            (22_000.0, false),
            (30_000.0, false),
        ];
        assert_eq!(spans, expected);
        let last = track.place(&track.spans[5], 25_000.0, 26_000.0);
        assert!((last.depth_m - 0.1).abs() < 1e-12);
    }
}
