//! Bézier curves of position over a part of a piece.

use nalgebra::Vector3;

use super::bernstein::Poly;

/// A curve of up to 7th degree by its control points, m, on [0, 1].
#[derive(Clone, Copy, Debug)]
pub(super) struct Curve {
    points: [Vector3<f64>; 8],
    count: usize,
}

/// An axis-aligned box, m.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    pub(super) low: Vector3<f64>,
    pub(super) high: Vector3<f64>,
}

impl Bounds {
    pub(super) const EMPTY: Self = Self {
        low: Vector3::new(f64::INFINITY, f64::INFINITY, f64::INFINITY),
        high: Vector3::new(f64::NEG_INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY),
    };

    pub(super) fn size_m(&self) -> Vector3<f64> {
        self.high - self.low
    }

    pub(super) fn include(&mut self, point: &Vector3<f64>) {
        self.low = self.low.inf(point);
        self.high = self.high.sup(point);
    }

    pub(super) fn join(&mut self, other: &Self) {
        self.low = self.low.inf(&other.low);
        self.high = self.high.sup(&other.high);
    }

    /// Square of the distance between two boxes, 0 when they overlap.
    pub(super) fn distance_squared(&self, other: &Self) -> f64 {
        let mut sum = 0.0;
        for axis in 0..3 {
            let gap = (self.low[axis] - other.high[axis]).max(other.low[axis] - self.high[axis]);
            let gap = gap.max(0.0);
            sum += gap * gap;
        }
        sum
    }
}

impl Curve {
    /// From 1 to 8 control points.
    pub(super) fn new(control: &[Vector3<f64>]) -> Self {
        let mut points = [Vector3::zeros(); 8];
        let count = control.len().clamp(1, 8);
        for (place, point) in points.iter_mut().zip(control) {
            *place = *point;
        }
        Self { points, count }
    }

    pub(super) fn points(&self) -> &[Vector3<f64>] {
        &self.points[..self.count]
    }

    pub(super) fn first(&self) -> Vector3<f64> {
        self.points[0]
    }

    pub(super) fn last(&self) -> Vector3<f64> {
        self.points[self.count - 1]
    }

    pub(super) fn value(&self, u: f64) -> Vector3<f64> {
        let mut work = self.points;
        for last in (1..self.count).rev() {
            for i in 0..last {
                work[i] = work[i] * (1.0 - u) + work[i + 1] * u;
            }
        }
        work[0]
    }

    /// The part on [from, to], on its own [0, 1].
    pub(super) fn restrict(&self, from: f64, to: f64) -> Self {
        if self.count == 1 || (from <= 0.0 && to >= 1.0) {
            return *self;
        }
        if self.count == 2 || to <= from {
            return Self::new(&[self.value(from), self.value(to)]);
        }
        let mut part = *self;
        let last = self.count - 1;
        if to < 1.0 {
            for step in 1..=last {
                for i in (step..=last).rev() {
                    part.points[i] = part.points[i - 1] * (1.0 - to) + part.points[i] * to;
                }
            }
        }
        if from > 0.0 {
            let u = (from / to.min(1.0)).min(1.0);
            for step in 1..=last {
                for i in 0..=last - step {
                    part.points[i] = part.points[i] * (1.0 - u) + part.points[i + 1] * u;
                }
            }
        }
        part
    }

    fn elevate(&self, count: usize) -> Self {
        let mut curve = *self;
        while curve.count < count.min(8) {
            let n = curve.count;
            let old = curve.points;
            for k in 1..n {
                let share = k as f64 / n as f64;
                curve.points[k] = old[k - 1] * share + old[k] * (1.0 - share);
            }
            curve.points[n] = old[n - 1];
            curve.count += 1;
        }
        curve
    }

    /// This curve seen from a point that moves along another one.
    pub(super) fn minus(&self, other: &Self) -> Self {
        let count = self.count.max(other.count);
        let (mut difference, other) = (self.elevate(count), other.elevate(count));
        for (a, b) in difference.points.iter_mut().zip(other.points) {
            *a -= b;
        }
        difference
    }

    /// This curve moved by a constant, m.
    pub(super) fn shifted(&self, by: Vector3<f64>) -> Self {
        let mut curve = *self;
        for point in &mut curve.points[..curve.count] {
            *point += by;
        }
        curve
    }

    /// This curve projected onto the horizontal plane: z becomes 0.
    pub(super) fn flat(&self) -> Self {
        let mut curve = *self;
        for point in &mut curve.points[..curve.count] {
            point.z = 0.0;
        }
        curve
    }

    /// Derivative with respect to time when [0, 1] takes `duration_s`.
    pub(super) fn rate(&self, duration_s: f64) -> Self {
        if self.count == 1 {
            return Self::new(&[Vector3::zeros()]);
        }
        let mut rate = Self { points: [Vector3::zeros(); 8], count: self.count - 1 };
        let factor = rate.count as f64 / duration_s;
        for (place, pair) in rate.points.iter_mut().zip(self.points().windows(2)) {
            *place = (pair[1] - pair[0]) * factor;
        }
        rate
    }

    /// One coordinate (0 x, 1 y, 2 z).
    pub(super) fn axis(&self, axis: usize) -> Poly {
        self.points().iter().map(|point| point[axis]).collect()
    }

    /// Coordinate along a horizontal direction.
    pub(super) fn along(&self, x: f64, y: f64) -> Poly {
        self.points().iter().map(|point| point.x * x + point.y * y).collect()
    }

    /// Square of the distance from the origin.
    pub(super) fn norm_squared(&self) -> Poly {
        let [x, y, z] = [0, 1, 2].map(|axis| self.axis(axis).square());
        x.add(&y).add(&z)
    }

    /// Square of the horizontal distance from the origin.
    pub(super) fn horizontal_squared(&self) -> Poly {
        self.axis(0).square().add(&self.axis(1).square())
    }

    /// Square of the height.
    pub(super) fn vertical_squared(&self) -> Poly {
        self.axis(2).square()
    }

    /// A box that contains the curve: that of its control points.
    pub(super) fn bounds(&self) -> Bounds {
        let mut bounds = Bounds::EMPTY;
        for point in self.points() {
            bounds.include(point);
        }
        bounds
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn curve() -> impl Strategy<Value = Curve> {
        proptest::collection::vec((-9.0..9.0_f64, -9.0..9.0_f64, -9.0..9.0_f64), 1..=8).prop_map(
            |points| {
                let points: Vec<_> =
                    points.into_iter().map(|(x, y, z)| Vector3::new(x, y, z)).collect();
                Curve::new(&points)
            },
        )
    }

    proptest! {
        #[test]
        fn parts_and_differences_are_those_of_the_points(
            a in curve(), b in curve(), u in 0.0..1.0_f64, from in 0.0..0.5_f64, to in 0.5..1.0_f64,
        ) {
            let part = a.restrict(from, to);
            prop_assert!((part.value(u) - a.value(from + (to - from) * u)).norm() < 1e-9);
            let difference = a.minus(&b);
            prop_assert!((difference.value(u) - (a.value(u) - b.value(u))).norm() < 1e-9);
            prop_assert!((difference.norm_squared().value(u) - difference.value(u).norm_squared()).abs() < 1e-7);
            prop_assert!((a.axis(1).value(u) - a.value(u).y).abs() < 1e-9);
            let bounds = a.bounds();
            for axis in 0..3 {
                let value = a.value(u)[axis];
                prop_assert!(bounds.low[axis] - 1e-9 <= value && value <= bounds.high[axis] + 1e-9);
            }
        }
    }
}
