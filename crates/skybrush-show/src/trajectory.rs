//! Trajectories as exact polynomial pieces (Bézier curves) on a grid of whole milliseconds.

use nalgebra::Vector3;

/// Shape of one piece of a trajectory, in show-frame metres. The start point is the end of the
/// piece before it. The curve parameter is `t / duration`, so a line is flown at constant speed.
#[derive(Clone, Debug, PartialEq)]
pub enum SegmentPath {
    /// Stands still at the start point of the piece.
    Hold,
    /// A straight line to this point at constant speed.
    Line(Vector3<f64>),
    /// Cubic Bézier: two control points and the end point.
    Cubic([Vector3<f64>; 3]),
    /// 7th-degree Bézier: six control points and the end point.
    Septic(Box<[Vector3<f64>; 7]>),
}

/// One piece: a path flown in a whole number of milliseconds.
#[derive(Clone, Debug, PartialEq)]
pub struct Segment {
    /// Duration of the piece, ms; never 0 in a valid trajectory.
    pub duration_ms: u32,
    /// Shape of the piece.
    pub path: SegmentPath,
}

/// Flight of one drone from show time 0, in the show frame (x forward, y left, z up), metres.
///
/// Before time 0 the drone stands at the start; after the end it stays at the last point with zero
/// velocity. At a boundary between pieces the earlier piece is in force, as in the firmware.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Trajectory {
    /// First point, show frame, m.
    pub start_m: Vector3<f64>,
    /// The pieces, in order.
    pub segments: Vec<Segment>,
}

/// One piece with its place in time and its start point, from [`Trajectory::pieces`].
#[derive(Clone, Copy, Debug)]
pub struct Piece<'a> {
    /// Start, show time in ms.
    pub start_ms: u64,
    /// End, show time in ms.
    pub end_ms: u64,
    /// Start point of the piece, show frame, m.
    pub from_m: Vector3<f64>,
    /// Shape of the piece.
    pub path: &'a SegmentPath,
}

/// Position, velocity and acceleration at one instant, show frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct State {
    /// Position, show frame, m.
    pub position_m: Vector3<f64>,
    /// Velocity, show frame, m/s.
    pub velocity_mps: Vector3<f64>,
    /// Acceleration, show frame, m/s².
    pub acceleration_mps2: Vector3<f64>,
}

impl SegmentPath {
    /// End point, given the start point.
    pub fn end_m(&self, from_m: Vector3<f64>) -> Vector3<f64> {
        match self {
            Self::Hold => from_m,
            Self::Line(to) => *to,
            Self::Cubic(points) => points[2],
            Self::Septic(points) => points[6],
        }
    }

    /// All Bézier control points, including both ends, in `buffer`; returns how many (degree + 1).
    pub fn control_points<'b>(
        &self,
        from_m: Vector3<f64>,
        buffer: &'b mut [Vector3<f64>; 8],
    ) -> &'b [Vector3<f64>] {
        buffer[0] = from_m;
        let rest: &[Vector3<f64>] = match self {
            Self::Hold => &[],
            Self::Line(to) => std::slice::from_ref(to),
            Self::Cubic(points) => points,
            Self::Septic(points) => points.as_slice(),
        };
        buffer[1..=rest.len()].copy_from_slice(rest);
        &buffer[..=rest.len()]
    }
}

impl Piece<'_> {
    /// Duration of the piece, s.
    pub fn duration_s(&self) -> f64 {
        (self.end_ms - self.start_ms) as f64 / 1000.0
    }

    /// End point of the piece, show frame, m.
    pub fn end_m(&self) -> Vector3<f64> {
        self.path.end_m(self.from_m)
    }

    /// State at `u` = (time - start) / duration in [0, 1].
    pub fn state(&self, u: f64) -> State {
        let mut buffer = [Vector3::zeros(); 8];
        let points = self.path.control_points(self.from_m, &mut buffer);
        let duration_s = self.duration_s();
        let degree = (points.len() - 1) as f64;
        let position_m = de_casteljau(points, u);
        if points.len() < 2 || duration_s <= 0.0 {
            return State { position_m, ..State::default() };
        }
        let mut first = [Vector3::zeros(); 7];
        for (derivative, pair) in first.iter_mut().zip(points.windows(2)) {
            *derivative = (pair[1] - pair[0]) * (degree / duration_s);
        }
        let first = &first[..points.len() - 1];
        let velocity_mps = de_casteljau(first, u);
        if first.len() < 2 {
            return State { position_m, velocity_mps, acceleration_mps2: Vector3::zeros() };
        }
        let mut second = [Vector3::zeros(); 6];
        for (derivative, pair) in second.iter_mut().zip(first.windows(2)) {
            *derivative = (pair[1] - pair[0]) * ((degree - 1.0) / duration_s);
        }
        let acceleration_mps2 = de_casteljau(&second[..first.len() - 1], u);
        State { position_m, velocity_mps, acceleration_mps2 }
    }
}

/// Value of a Bézier curve at `u`, by de Casteljau's construction (numerically stable).
fn de_casteljau(points: &[Vector3<f64>], u: f64) -> Vector3<f64> {
    let mut work = [Vector3::zeros(); 8];
    let n = points.len().min(8);
    work[..n].copy_from_slice(&points[..n]);
    for last in (1..n).rev() {
        for i in 0..last {
            work[i] = work[i] * (1.0 - u) + work[i + 1] * u;
        }
    }
    work[0]
}

impl Trajectory {
    /// A trajectory that stands at a point.
    pub fn starting_at(start_m: Vector3<f64>) -> Self {
        Self { start_m, segments: Vec::new() }
    }

    /// Duration of the whole trajectory, ms.
    pub fn duration_ms(&self) -> u64 {
        self.segments.iter().map(|segment| u64::from(segment.duration_ms)).sum()
    }

    /// Last point of the trajectory, show frame, m; the start if it has no pieces.
    pub fn end_m(&self) -> Vector3<f64> {
        self.pieces().last().map_or(self.start_m, |piece| piece.end_m())
    }

    /// The pieces with their times and start points.
    pub fn pieces(&self) -> impl Iterator<Item = Piece<'_>> {
        let mut at_ms = 0;
        let mut from_m = self.start_m;
        self.segments.iter().map(move |segment| {
            let piece = Piece {
                start_ms: at_ms,
                end_ms: at_ms + u64::from(segment.duration_ms),
                from_m,
                path: &segment.path,
            };
            at_ms = piece.end_ms;
            from_m = piece.end_m();
            piece
        })
    }

    /// First difference from another trajectory that exceeds `tolerance_m`, in words; `None` if
    /// there is none.
    ///
    /// Both are compared at every boundary of either and in between (a file may cut long pieces,
    /// so pieces need not match one to one).
    pub fn difference(&self, other: &Self, tolerance_m: f64) -> Option<String> {
        let (here_ms, there_ms) = (self.duration_ms(), other.duration_ms());
        if here_ms != there_ms {
            return Some(format!("it lasts {here_ms} ms, not {there_ms} ms"));
        }
        let mut times_ms: Vec<u64> = [self, other]
            .into_iter()
            .flat_map(|trajectory| trajectory.pieces().map(|piece| piece.end_ms))
            .chain([0])
            .collect();
        times_ms.sort_unstable();
        times_ms.dedup();
        let (mut here, mut there) = (Cursor::new(self), Cursor::new(other));
        let mut before_ms = 0;
        for end_ms in times_ms {
            let span_ms = (end_ms - before_ms) as f64;
            // Eight points fix a polynomial of degree 7, the highest there is.
            for step in 1..=8 {
                let time_s = (before_ms as f64 + span_ms * f64::from(step) / 8.0) / 1000.0;
                let apart = here.state_at(time_s).position_m - there.state_at(time_s).position_m;
                if apart.amax() > tolerance_m * 1.001 {
                    return Some(format!("{:.3} m apart at {time_s:.3} s", apart.norm()));
                }
            }
            before_ms = end_ms;
        }
        None
    }

    /// State at a show time in seconds. Linear in the number of pieces: use a [`Cursor`] for
    /// stepping through time.
    pub fn state_at(&self, time_s: f64) -> State {
        Cursor::new(self).state_at(time_s)
    }
}

/// Steps through a trajectory in time without searching from the start for each query.
#[derive(Clone, Debug)]
pub struct Cursor<'a> {
    trajectory: &'a Trajectory,
    next: usize,
    start_ms: u64,
    from_m: Vector3<f64>,
}

impl<'a> Cursor<'a> {
    /// A cursor at the start of a trajectory.
    pub fn new(trajectory: &'a Trajectory) -> Self {
        Self { trajectory, next: 0, start_ms: 0, from_m: trajectory.start_m }
    }

    /// State at a show time in seconds. Going back in time starts over from the beginning.
    pub fn state_at(&mut self, time_s: f64) -> State {
        let time_ms = time_s * 1000.0;
        if time_ms < self.start_ms as f64 {
            *self = Self::new(self.trajectory);
        }
        if time_s < 0.0 {
            return State { position_m: self.trajectory.start_m, ..State::default() };
        }
        while let Some(segment) = self.trajectory.segments.get(self.next) {
            let piece = Piece {
                start_ms: self.start_ms,
                end_ms: self.start_ms + u64::from(segment.duration_ms),
                from_m: self.from_m,
                path: &segment.path,
            };
            if time_ms <= piece.end_ms as f64 && segment.duration_ms > 0 {
                return piece
                    .state((time_ms - piece.start_ms as f64) / f64::from(segment.duration_ms));
            }
            self.start_ms = piece.end_ms;
            self.from_m = piece.end_m();
            self.next += 1;
        }
        State { position_m: self.from_m, ..State::default() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The two-drone example of the Skybrush formats note, drone 1.
    fn example() -> Trajectory {
        let line = |duration_ms, x, z| Segment {
            duration_ms,
            path: SegmentPath::Line(Vector3::new(x, 0.0, z)),
        };
        let hold = |duration_ms| Segment { duration_ms, path: SegmentPath::Hold };
        Trajectory {
            start_m: Vector3::zeros(),
            segments: vec![
                line(10_000, 0.0, 10.0),
                hold(5_000),
                line(20_000, 20.0, 10.0),
                hold(5_000),
                line(20_000, 0.0, 10.0),
                hold(5_000),
                line(8_000, 0.0, 2.5),
            ],
        }
    }

    #[test]
    fn evaluates_like_the_reference_library() {
        // t = 0: z 0, vz 1; t = 25: x 10, vx 1, z 10; t = 73: z 2.5, vz -0.9375.
        let trajectory = example();
        let first = trajectory.state_at(0.0);
        assert_eq!((first.position_m.z, first.velocity_mps.z), (0.0, 1.0));
        let middle = trajectory.state_at(25.0);
        assert_eq!((middle.position_m.x, middle.velocity_mps.x), (10.0, 1.0));
        let last = trajectory.state_at(73.0);
        assert_eq!((last.position_m.z, last.velocity_mps.z), (2.5, -0.9375));
        assert_eq!(trajectory.duration_ms(), 73_000);
        let after = trajectory.state_at(80.0);
        assert_eq!((after.position_m.z, after.velocity_mps.z), (2.5, 0.0));
    }

    #[test]
    fn a_cursor_agrees_with_single_queries_also_backwards() {
        let trajectory = example();
        let mut cursor = Cursor::new(&trajectory);
        for time_s in [0.0, 3.0, 9.99, 10.0, 10.01, 40.0, 72.0, 80.0, 12.0, -1.0, 30.0] {
            assert_eq!(cursor.state_at(time_s), trajectory.state_at(time_s), "at {time_s} s");
        }
    }

    #[test]
    fn derivatives_are_those_of_the_curve() {
        let points = [
            Vector3::new(1.0, 0.0, 4.0),
            Vector3::new(3.0, 1.0, 5.0),
            Vector3::new(4.0, -2.0, 6.0),
        ];
        let trajectory = Trajectory {
            start_m: Vector3::zeros(),
            segments: vec![Segment { duration_ms: 4_000, path: SegmentPath::Cubic(points) }],
        };
        let h = 1e-4;
        for time_s in [0.5, 1.7, 3.2] {
            let [before, here, after] = [-h, 0.0, h].map(|step| trajectory.state_at(time_s + step));
            let velocity = (after.position_m - before.position_m) / (2.0 * h);
            let acceleration = (after.velocity_mps - before.velocity_mps) / (2.0 * h);
            assert!((velocity - here.velocity_mps).norm() < 1e-6);
            assert!((acceleration - here.acceleration_mps2).norm() < 1e-6);
        }
    }
}
