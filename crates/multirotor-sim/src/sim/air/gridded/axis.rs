//! Axes of a grid: where a place lies between its points.

/// Share of the spacing by which points of an equidistant axis may be off: coordinates come as 32-bit floats.
const UNEVEN: f64 = 2e-3;

/// Axis whose points are equidistant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Regular {
    /// First point, m.
    pub first_m: f64,
    /// Distance between points, m.
    pub spacing_m: f64,
    /// Number of points.
    pub count: usize,
}

impl Regular {
    /// Points that are equidistant; `None` where they are not, do not rise, or are fewer than two.
    pub fn of(points_m: &[f64]) -> Option<Self> {
        let (first_m, last_m) = (*points_m.first()?, *points_m.last()?);
        let count = points_m.len();
        let spacing_m = (last_m - first_m) / (count.checked_sub(1)?) as f64;
        (spacing_m.is_finite() && spacing_m > 0.0).then_some(())?;
        let is_even = points_m.iter().enumerate().all(|(index, point_m)| {
            (point_m - first_m - index as f64 * spacing_m).abs() <= UNEVEN * spacing_m
        });
        is_even.then_some(Self { first_m, spacing_m, count })
    }

    /// Length after which the points repeat, m.
    pub fn period_m(&self) -> f64 {
        self.spacing_m * self.count as f64
    }

    /// Last point, m.
    pub fn last_m(&self) -> f64 {
        self.first_m + self.spacing_m * self.count.saturating_sub(1) as f64
    }

    /// Point before a place, and the share of the way to the next one. Beyond the last point of an axis that
    /// repeats, the next one is the first; values beyond the ends of another are those of the ends.
    pub(super) fn at(&self, m: f64, repeats: bool) -> (usize, f64) {
        let along = (m - self.first_m) / self.spacing_m;
        if !along.is_finite() {
            return (0, 0.0);
        }
        if repeats {
            let along = along.rem_euclid(self.count as f64);
            // Rounding may give the count itself.
            let before = (along as usize).min(self.count.saturating_sub(1));
            return (before, (along - before as f64).clamp(0.0, 1.0));
        }
        let along = along.clamp(0.0, self.count.saturating_sub(1) as f64);
        let before = (along as usize).min(self.count.saturating_sub(2));
        (before, along - before as f64)
    }
}

/// Heights that rise, at any distances.
#[derive(Clone, Debug, PartialEq)]
pub struct Heights(Vec<f64>);

impl Heights {
    /// Heights that rise; `None` where they do not, or are fewer than two.
    pub fn of(heights_m: Vec<f64>) -> Option<Self> {
        let rises = heights_m.windows(2).all(|pair| pair[0] < pair[1]);
        let finite = heights_m.iter().all(|m| m.is_finite());
        (rises && finite && heights_m.len() >= 2).then_some(Self(heights_m))
    }

    /// The heights, m.
    pub fn all_m(&self) -> &[f64] {
        &self.0
    }

    /// Lowest and highest, m.
    pub fn ends_m(&self) -> (f64, f64) {
        (self.0.first().copied().unwrap_or(0.0), self.0.last().copied().unwrap_or(0.0))
    }

    /// Point below a height, the share of the way to the next one, and a factor on what is there. Below the
    /// lowest point above the ground the wind is that of the point, and the vertical velocity (`dies_out`) falls
    /// to none at the ground.
    pub(super) fn at(&self, m: f64, dies_out: bool) -> (usize, f64, f64) {
        let (lowest_m, _) = self.ends_m();
        let (index, share) = bracket(&self.0, m);
        let scale = if dies_out && lowest_m > 0.0 { (m / lowest_m).clamp(0.0, 1.0) } else { 1.0 };
        (index, share, scale)
    }
}

/// Index of the last of some rising values that is not above one, and the share of the way to the next. Held at
/// the ends; the last index is returned with a share of 0 alone.
pub(super) fn bracket(values: &[f64], at: f64) -> (usize, f64) {
    let above = values.partition_point(|value| *value <= at);
    let Some(index) = above.checked_sub(1) else { return (0, 0.0) };
    match (values.get(index), values.get(above)) {
        (Some(from), Some(to)) => (index, ((at - from) / (to - from)).clamp(0.0, 1.0)),
        _ => (index, 0.0),
    }
}
