//! Splitting Bézier curves and changing their degree.

use nalgebra::Vector3;

use super::trajectory::{Segment, SegmentPath};

/// Control points of one axis of a curve of at most 7th degree, ends included.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scalar {
    values: [f64; 8],
    degree: usize,
}

impl Scalar {
    /// From 1 to 8 control points; further ones are ignored.
    pub(crate) fn new(points: impl Iterator<Item = f64>) -> Self {
        let mut values = [0.0; 8];
        let mut count = 0;
        for (value, point) in values.iter_mut().zip(points) {
            *value = point;
            count += 1;
        }
        Self { values, degree: usize::max(count, 1) - 1 }
    }

    pub(crate) fn degree(&self) -> usize {
        self.degree
    }

    pub(crate) fn points(&self) -> &[f64] {
        &self.values[..=self.degree]
    }

    /// The curve over [0, 1/2] and over [1/2, 1].
    pub(crate) fn halves(self) -> (Self, Self) {
        let (mut left, mut right) = (self, self);
        let mut work = self.values;
        for i in 0..=self.degree {
            left.values[i] = work[0];
            right.values[self.degree - i] = work[self.degree - i];
            for j in 0..self.degree - i {
                work[j] = f64::midpoint(work[j], work[j + 1]);
            }
        }
        (left, right)
    }

    /// This curve written with more control points (`degree` at most 7).
    pub(crate) fn elevated(mut self, degree: usize) -> Self {
        while self.degree < degree.min(7) {
            let n = self.degree + 1;
            let old = self.values;
            self.values[n] = old[n - 1];
            for i in (1..n).rev() {
                let share = i as f64 / n as f64;
                self.values[i] = old[i - 1] * share + old[i] * (1.0 - share);
            }
            self.degree = n;
        }
        self
    }

    /// The curve with the lowest degree of 0, 1, 3 and 7 that is the same within `tolerance`.
    pub(crate) fn reduced(self, tolerance: f64) -> Self {
        let same = |candidate: Self| {
            let again = candidate.elevated(self.degree);
            let near = |(a, b): (&f64, &f64)| (a - b).abs() <= tolerance;
            again.points().iter().zip(self.points()).all(near)
        };
        let (first, last) = (self.values[0], self.values[self.degree]);
        let constant = Self::new(std::iter::once(first));
        if same(constant) {
            return constant;
        }
        let line = Self::new([first, last].into_iter());
        if same(line) {
            return line;
        }
        if self.degree > 3 {
            // The end derivatives fix a cubic.
            let n = self.degree as f64 / 3.0;
            let c1 = first + (self.values[1] - first) * n;
            let c2 = last + (self.values[self.degree - 1] - last) * n;
            let cubic = Self::new([first, c1, c2, last].into_iter());
            if same(cubic) {
                return cubic;
            }
        }
        self
    }
}

/// Splits at `u`; both halves have as many control points as the whole (at most 8).
fn split(points: &[Vector3<f64>], u: f64) -> (Vec<Vector3<f64>>, Vec<Vector3<f64>>) {
    let mut work = points.to_vec();
    let mut left = Vec::with_capacity(points.len());
    let mut right = Vec::with_capacity(points.len());
    while let (Some(first), Some(last)) = (work.first(), work.last()) {
        left.push(*first);
        right.push(*last);
        work = work.windows(2).map(|pair| pair[0] * (1.0 - u) + pair[1] * u).collect();
    }
    right.reverse();
    (left, right)
}

/// Path through control points (without the start point), if their number is one that exists.
pub(crate) fn path_through(points: &[Vector3<f64>]) -> Option<SegmentPath> {
    Some(match points {
        [] => SegmentPath::Hold,
        [to] => SegmentPath::Line(*to),
        [a, b, c] => SegmentPath::Cubic([*a, *b, *c]),
        _ => SegmentPath::Septic(Box::new(points.try_into().ok()?)),
    })
}

/// Cuts a piece into equal parts of at most `longest_ms` each, on whole milliseconds that add up.
pub(crate) fn cut(from_m: Vector3<f64>, segment: &Segment, longest_ms: u32) -> Vec<Segment> {
    let total_ms = segment.duration_ms;
    let count = total_ms.div_ceil(longest_ms.max(1)).max(1);
    if count == 1 {
        return vec![segment.clone()];
    }
    let boundary = |i: u32| (u64::from(total_ms) * u64::from(i) / u64::from(count)) as u32;
    let mut buffer = [Vector3::zeros(); 8];
    let mut rest = segment.path.control_points(from_m, &mut buffer).to_vec();
    let mut parts = Vec::with_capacity(count as usize);
    for i in 0..count {
        let (start_ms, end_ms) = (boundary(i), boundary(i + 1));
        let part = if i + 1 == count {
            std::mem::take(&mut rest)
        } else {
            let u = f64::from(end_ms - start_ms) / f64::from(total_ms - start_ms);
            let (left, right) = split(&rest, u);
            rest = right;
            left
        };
        let path = path_through(part.get(1..).unwrap_or_default()).unwrap_or(SegmentPath::Hold);
        parts.push(Segment { duration_ms: end_ms - start_ms, path });
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Trajectory;
    use proptest::prelude::*;

    fn point() -> impl Strategy<Value = Vector3<f64>> {
        prop::array::uniform3(-100.0..100.0).prop_map(Vector3::from)
    }

    proptest! {
        #[test]
        fn cutting_changes_neither_shape_nor_duration(
            points in prop::collection::vec(point(), 8),
            count in prop::sample::select(vec![1_usize, 2, 4, 8]),
            duration_ms in 1_u32..400_000,
        ) {
            let segment = Segment { duration_ms, path: path_through(&points[1..count]).unwrap() };
            let parts = cut(points[0], &segment, 60_000);
            prop_assert!(parts.iter().all(|part| (1..=60_000).contains(&part.duration_ms)));
            let whole = Trajectory { start_m: points[0], segments: vec![segment] };
            let pieces = Trajectory { start_m: points[0], segments: parts };
            prop_assert_eq!(whole.duration_ms(), pieces.duration_ms());
            for i in 0..=50 {
                let time_s = f64::from(duration_ms) / 1000.0 * f64::from(i) / 50.0;
                let gap = whole.state_at(time_s).position_m - pieces.state_at(time_s).position_m;
                prop_assert!(gap.norm() < 1e-9);
            }
        }

        #[test]
        fn reduction_undoes_elevation(points in prop::array::uniform4(-100.0..100.0)) {
            let cubic = Scalar::new(points.into_iter());
            let back = cubic.elevated(7).reduced(1e-9);
            prop_assert_eq!(back.degree(), 3);
            for (a, b) in back.points().iter().zip(points) {
                prop_assert!((a - b).abs() < 1e-9);
            }
            let line = Scalar::new(points.into_iter().take(2));
            prop_assert_eq!(line.elevated(3).reduced(1e-9).degree(), 1);
            prop_assert_eq!(line.elevated(7).reduced(1e-9).degree(), 1);
        }
    }
}
