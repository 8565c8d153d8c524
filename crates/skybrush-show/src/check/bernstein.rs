//! Polynomials in Bernstein form on [0, 1], with bounds that are proven and not sampled.
//!
//! A polynomial in Bernstein form lies within the range of its coefficients (convex hull property),
//! and subdividing it makes that range converge quadratically to the true one (Farouki, *The
//! Bernstein polynomial basis: a centennial retrospective*, CAGD 29, 2012). Every check of this
//! module that is not closed-form rests on these two facts.

/// Highest degree: the square of a 7th-degree curve.
pub const MAX_DEGREE: usize = 14;
const SIZE: usize = MAX_DEGREE + 1;
/// Pieces that one search may look at; when they are used up the proven bound is returned instead
/// of an attained value, so that the answer stays on the safe side.
const NODE_BUDGET: usize = 4096;
/// Bisections of [0, 1]: a millisecond of a day-long piece.
const MAX_DEPTH: u32 = 40;

const BINOMIAL: [[f64; SIZE]; SIZE] = binomials();

const fn binomials() -> [[f64; SIZE]; SIZE] {
    let mut table = [[0.0; SIZE]; SIZE];
    let mut n = 0;
    while n < SIZE {
        table[n][0] = 1.0;
        let mut k = 1;
        while k <= n {
            table[n][k] = table[n - 1][k - 1] + if k < n { table[n - 1][k] } else { 0.0 };
            k += 1;
        }
        n += 1;
    }
    table
}

/// A polynomial on [0, 1] by its Bernstein coefficients.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Poly {
    coefficients: [f64; SIZE],
    degree: usize,
}

/// A minimum or maximum on [0, 1].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extremum {
    /// Argument at which the polynomial has the extremum, in [0, 1].
    pub u: f64,
    /// Value of the polynomial there.
    pub value: f64,
}

impl Poly {
    /// The polynomial that has this value everywhere.
    pub fn constant(value: f64) -> Self {
        Self::from_iter([value])
    }

    /// From 1 to 15 coefficients; further ones are ignored, none gives the constant 0.
    fn from_values(values: impl IntoIterator<Item = f64>) -> Self {
        let mut coefficients = [0.0; SIZE];
        let mut count = 0;
        for (place, value) in coefficients.iter_mut().zip(values) {
            *place = value;
            count += 1;
        }
        Self { coefficients, degree: usize::max(count, 1) - 1 }
    }

    /// The Bernstein coefficients, degree + 1 of them.
    pub fn coefficients(&self) -> &[f64] {
        &self.coefficients[..=self.degree]
    }

    /// Degree in which the polynomial is written, which may be higher than it needs.
    pub fn degree(&self) -> usize {
        self.degree
    }

    /// Value of the polynomial at `u` in [0, 1], by de Casteljau's algorithm.
    pub fn value(&self, u: f64) -> f64 {
        let mut work = self.coefficients;
        for last in (1..=self.degree).rev() {
            for i in 0..last {
                work[i] = work[i] * (1.0 - u) + work[i + 1] * u;
            }
        }
        work[0]
    }

    /// Smallest coefficient: no value on [0, 1] is below it.
    pub fn lower_bound(&self) -> f64 {
        self.coefficients().iter().copied().fold(f64::INFINITY, f64::min)
    }

    /// Largest coefficient: no value on [0, 1] is above it.
    pub fn upper_bound(&self) -> f64 {
        self.coefficients().iter().copied().fold(f64::NEG_INFINITY, f64::max)
    }

    /// This polynomial plus a constant.
    #[must_use]
    pub fn plus(&self, constant: f64) -> Self {
        Self::from_values(self.coefficients().iter().map(|c| c + constant))
    }

    /// This polynomial times a constant.
    #[must_use]
    pub fn times(&self, factor: f64) -> Self {
        Self::from_values(self.coefficients().iter().map(|c| c * factor))
    }

    /// This polynomial in the basis of a higher degree, at most 14: its values stay, its control
    /// points come closer.
    #[must_use]
    pub fn elevate(&self, degree: usize) -> Self {
        let mut poly = *self;
        while poly.degree < degree.min(MAX_DEGREE) {
            let n = poly.degree + 1;
            let old = poly.coefficients;
            for k in 1..n {
                let share = k as f64 / n as f64;
                poly.coefficients[k] = share * old[k - 1] + (1.0 - share) * old[k];
            }
            poly.coefficients[n] = old[n - 1];
            poly.degree = n;
        }
        poly
    }

    /// Sum of two polynomials.
    #[must_use]
    pub fn add(&self, other: &Self) -> Self {
        let degree = self.degree.max(other.degree);
        let (mut sum, other) = (self.elevate(degree), other.elevate(degree));
        for (a, b) in sum.coefficients.iter_mut().zip(other.coefficients) {
            *a += b;
        }
        sum
    }

    /// Product of two polynomials.
    ///
    /// # Panics
    /// When the degrees add up to more than [`MAX_DEGREE`], which no trajectory's can.
    #[must_use]
    pub fn product(&self, other: &Self) -> Self {
        let (m, n) = (self.degree, other.degree);
        assert!(m + n <= MAX_DEGREE, "product of degrees {m} and {n}");
        let mut coefficients = [0.0; SIZE];
        for (i, a) in self.coefficients().iter().enumerate() {
            for (j, b) in other.coefficients().iter().enumerate() {
                coefficients[i + j] += BINOMIAL[m][i] * BINOMIAL[n][j] * a * b;
            }
        }
        for (value, count) in coefficients.iter_mut().zip(BINOMIAL[m + n]).take(m + n + 1) {
            *value /= count;
        }
        Self { coefficients, degree: m + n }
    }

    /// Square of the polynomial.
    #[must_use]
    pub fn square(&self) -> Self {
        self.product(self)
    }

    /// Parts on [0, u] and [u, 1], each on its own [0, 1] (de Casteljau).
    #[must_use]
    pub fn split(&self, u: f64) -> (Self, Self) {
        let (mut left, mut right) = (*self, *self);
        for step in 1..=self.degree {
            for i in 0..=self.degree - step {
                right.coefficients[i] =
                    right.coefficients[i] * (1.0 - u) + right.coefficients[i + 1] * u;
            }
            left.coefficients[step] = right.coefficients[0];
        }
        (left, right)
    }

    /// The part of the polynomial on [from, to], as a polynomial on [0, 1].
    #[must_use]
    pub fn restrict(&self, from: f64, to: f64) -> Self {
        let mut part = *self;
        if to < 1.0 {
            part = part.split(to).0;
        }
        if from > 0.0 && to > 0.0 {
            part = part.split((from / to.min(1.0)).min(1.0)).1;
        }
        part
    }

    /// Derivative with respect to u.
    #[must_use]
    pub fn derivative(&self) -> Self {
        let n = self.degree as f64;
        match self.degree {
            0 => Self::constant(0.0),
            _ => Self::from_values(self.coefficients().windows(2).map(|c| n * (c[1] - c[0]))),
        }
    }

    /// Minimum on [0, 1]: attained at `u`, and no value anywhere is smaller by more than `slack`
    /// of it (and the rounding of the arithmetic).
    pub fn minimum(&self, slack: impl Fn(f64) -> f64) -> Extremum {
        let c = self.coefficients();
        let (first, last) = (c[0], c[self.degree]);
        let mut best = if last < first {
            Extremum { u: 1.0, value: last }
        } else {
            Extremum { u: 0.0, value: first }
        };
        if self.degree < 2 {
            return best;
        }
        if self.degree == 2 {
            let bend = c[0] - 2.0 * c[1] + c[2];
            let u = (c[0] - c[1]) / bend;
            if bend > 0.0 && u > 0.0 && u < 1.0 {
                best = Extremum { u, value: self.value(u).min(best.value) };
            }
            return best;
        }
        let rounding = 1e-15 * c.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
        let mut stack = vec![(*self, 0.0, 1.0, 0)];
        let mut nodes = 0;
        while let Some((part, from, to, depth)) = stack.pop() {
            let lower = part.lower_bound();
            if lower >= best.value - slack(best.value).max(rounding) {
                continue;
            }
            nodes += 1;
            if depth >= MAX_DEPTH || nodes > NODE_BUDGET {
                best = Extremum { u: 0.5 * (from + to), value: lower };
                continue;
            }
            let (left, right) = part.split(0.5);
            let middle = 0.5 * (from + to);
            if right.coefficients[0] < best.value {
                best = Extremum { u: middle, value: right.coefficients[0] };
            }
            let mut halves = [(left, from, middle, depth + 1), (right, middle, to, depth + 1)];
            if halves[0].0.lower_bound() < halves[1].0.lower_bound() {
                halves.swap(0, 1);
            }
            stack.extend(halves);
        }
        best
    }

    /// Maximum on [0, 1], as [`Poly::minimum`].
    pub fn maximum(&self, slack: impl Fn(f64) -> f64) -> Extremum {
        let least = self.times(-1.0).minimum(|value| slack(-value));
        Extremum { u: least.u, value: -least.value }
    }

    /// The intervals of [0, 1] on which the polynomial is below `level`, in order, joined where they
    /// touch. Their ends are roots to better than 1e-9. A polynomial that equals the level but for
    /// rounding is not below it; where a search is cut short, the place counts as below.
    pub fn below(&self, level: f64) -> Vec<(f64, f64)> {
        let mut found: Vec<(f64, f64)> = Vec::new();
        let rounding = 1e-14
            * self.coefficients().iter().fold(level.abs(), |most, value| most.max(value.abs()));
        let level = level - rounding;
        let mut stack = vec![(*self, 0.0, 1.0, 0)];
        let mut nodes = 0;
        while let Some((part, from, to, depth)) = stack.pop() {
            nodes += 1;
            if part.lower_bound() >= level {
                continue;
            }
            let all = part.upper_bound() < level || depth >= MAX_DEPTH || nodes > NODE_BUDGET;
            let inside = if all {
                Some((from, to))
            } else if part.degree == 1 {
                let [first, last] = [part.coefficients[0], part.coefficients[1]];
                let root = from + (to - from) * ((level - first) / (last - first)).clamp(0.0, 1.0);
                Some(if first < level { (from, root) } else { (root, to) })
            } else {
                None
            };
            match (inside, found.last_mut()) {
                (Some((start, end)), Some(previous)) if previous.1 >= start => previous.1 = end,
                (Some(interval), _) => found.push(interval),
                (None, _) => {
                    let (left, right) = part.split(0.5);
                    let middle = 0.5 * (from + to);
                    stack.push((right, middle, to, depth + 1));
                    stack.push((left, from, middle, depth + 1));
                }
            }
        }
        found
    }
}

impl FromIterator<f64> for Poly {
    /// From 1 to 15 coefficients; further ones are ignored, none gives the constant 0.
    fn from_iter<I: IntoIterator<Item = f64>>(values: I) -> Self {
        Self::from_values(values)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn poly() -> impl Strategy<Value = Poly> {
        proptest::collection::vec(-50.0..50.0_f64, 1..=8).prop_map(Poly::from_iter)
    }

    const FINE: fn(f64) -> f64 = |_| 1e-9;

    #[test]
    fn a_known_cubic_has_its_textbook_extrema() {
        // Chebyshev T3(2u-1) in Bernstein form: extrema -1 at u = 3/4 and 1 at u = 1/4.
        let chebyshev = Poly::from_iter([-1.0, 5.0, -5.0, 1.0]);
        let least = chebyshev.minimum(FINE);
        assert!((least.value + 1.0).abs() < 1e-8);
        let most = chebyshev.maximum(FINE);
        assert!((most.value - 1.0).abs() < 1e-8);
        // Roots of T3: cos((2k+1) pi/6) mapped to [0, 1].
        let roots = [0.5 - 3f64.sqrt() / 4.0, 0.5, 0.5 + 3f64.sqrt() / 4.0];
        let below = chebyshev.below(0.0);
        assert_eq!(below.len(), 2);
        for (found, expected) in [below[0].1, below[1].0, below[1].1].into_iter().zip(roots) {
            assert!((found - expected).abs() < 1e-9, "{found} {expected}");
        }
    }

    #[test]
    fn flat_polynomials_end_at_once() {
        let flat = Poly::from_iter([4.0 + 1e-13; 15]).plus(-1e-13);
        assert!((flat.minimum(|_| 0.0).value - 4.0).abs() < 1e-12);
        assert!(flat.below(4.0).is_empty());
        assert_eq!(flat.below(4.1), [(0.0, 1.0)]);
    }

    proptest! {
        #[test]
        fn arithmetic_is_that_of_the_values(a in poly(), b in poly(), u in 0.0..1.0_f64, cut in 0.01..0.99_f64) {
            let tolerance = 1e-9;
            prop_assert!((a.product(&b).value(u) - a.value(u) * b.value(u)).abs() < tolerance);
            prop_assert!((a.add(&b).value(u) - (a.value(u) + b.value(u))).abs() < tolerance);
            prop_assert!((a.elevate(12).value(u) - a.value(u)).abs() < tolerance);
            let (left, right) = a.split(cut);
            prop_assert!((left.value(u) - a.value(u * cut)).abs() < tolerance);
            prop_assert!((right.value(u) - a.value(cut + u * (1.0 - cut))).abs() < tolerance);
            let part = a.restrict(0.3 * cut, cut);
            prop_assert!((part.value(u) - a.value(cut * (0.3 + 0.7 * u))).abs() < tolerance);
            let h = 1e-6;
            let slope = (a.value(u + h) - a.value(u - h)) / (2.0 * h);
            prop_assert!((a.derivative().value(u) - slope).abs() < 1e-3);
        }

        #[test]
        fn no_sample_escapes_the_extrema(a in poly(), b in poly()) {
            let p = a.product(&b);
            let (least, most) = (p.minimum(FINE), p.maximum(FINE));
            prop_assert!((p.value(least.u) - least.value).abs() < 1e-7);
            prop_assert!((p.value(most.u) - most.value).abs() < 1e-7);
            for i in 0..=1000 {
                let value = p.value(f64::from(i) / 1000.0);
                prop_assert!(least.value - 1e-7 <= value && value <= most.value + 1e-7);
            }
        }

        #[test]
        fn below_is_where_the_values_are_below(a in poly(), level in -40.0..40.0_f64) {
            let intervals = a.below(level);
            for pair in intervals.windows(2) {
                prop_assert!(pair[0].1 < pair[1].0);
            }
            for i in 0..=1000 {
                let u = f64::from(i) / 1000.0;
                let inside = intervals.iter().any(|(from, to)| (*from..=*to).contains(&u));
                let value = a.value(u);
                prop_assert!(inside == (value < level) || (value - level).abs() < 1e-5, "{u} {value}");
            }
        }
    }
}
