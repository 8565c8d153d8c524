//! The straight line of least squares, and Pearson's correlation.

/// Means of points and the sums of products about them, of which straight lines are made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// Sum of the weights: the number of points if they have none.
    pub weight: f64,
    /// Mean of x and of y.
    pub mean: [f64; 2],
    /// Sum of squared deviations of x.
    pub xx: f64,
    /// Sum of products of the deviations.
    pub xy: f64,
    /// Sum of squared deviations of y.
    pub yy: f64,
}

impl Line {
    /// Line through points (x, y); `None` without any. All at one x give a slope that is not finite.
    pub fn through(points: impl IntoIterator<Item = (f64, f64), IntoIter: Clone>) -> Option<Self> {
        Self::weighted(points.into_iter().map(|(x, y)| (x, y, 1.0)))
    }

    /// Line through points (x, y, weight), in which a weight is one over a variance; `None` without any weight.
    pub fn weighted(
        points: impl IntoIterator<Item = (f64, f64, f64), IntoIter: Clone>,
    ) -> Option<Self> {
        let points = points.into_iter();
        let (mut weight, mut mean) = (0.0, [0.0; 2]);
        for (x, y, w) in points.clone() {
            weight += w;
            mean[0] += w * x;
            mean[1] += w * y;
        }
        (weight != 0.0).then(|| Self::about(mean.map(|sum| sum / weight), points))
    }

    /// Line through points (x, y, weight) with a mean that the caller has.
    pub fn about(mean: [f64; 2], points: impl IntoIterator<Item = (f64, f64, f64)>) -> Self {
        let mut line = Self { weight: 0.0, mean, xx: 0.0, xy: 0.0, yy: 0.0 };
        for (x, y, w) in points {
            let (dx, dy) = (x - mean[0], y - mean[1]);
            line.weight += w;
            line.xx += w * dx * dx;
            line.xy += w * dx * dy;
            line.yy += w * dy * dy;
        }
        line
    }

    /// Slope of the line: rise of y per x.
    pub fn slope(&self) -> f64 {
        self.xy / self.xx
    }

    /// Intercept of the line: y at x = 0.
    pub fn intercept(&self) -> f64 {
        self.mean[1] - self.slope() * self.mean[0]
    }

    /// Residual of a point: how much higher than the line it lies.
    pub fn residual(&self, (x, y): (f64, f64)) -> f64 {
        y - self.mean[1] - self.slope() * (x - self.mean[0])
    }

    /// Pearson's correlation; `None` where x or y does not vary.
    pub fn correlation(&self) -> Option<f64> {
        let product = (self.xx * self.yy).sqrt();
        (product > 0.0).then(|| self.xy / product)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Anscombe 1973, first quartet: slope 0.50009, intercept 3.00009, rho 0.81642.
    const ANSCOMBE: [(f64, f64); 11] = [
        (10.0, 8.04),
        (8.0, 6.95),
        (13.0, 7.58),
        (9.0, 8.81),
        (11.0, 8.33),
        (14.0, 9.96),
        (6.0, 7.24),
        (4.0, 4.26),
        (12.0, 10.84),
        (7.0, 4.82),
        (5.0, 5.68),
    ];

    #[test]
    fn the_line_is_the_published_one() {
        let line = Line::through(ANSCOMBE).unwrap();
        assert!((line.slope() - 0.50009).abs() < 1e-5, "{line:?}");
        assert!((line.intercept() - 3.00009).abs() < 1e-5, "{line:?}");
        assert!((line.correlation().unwrap() - 0.81642).abs() < 1e-5, "{line:?}");
        let sum: f64 = ANSCOMBE.iter().map(|point| line.residual(*point)).sum();
        assert!(sum.abs() < 1e-9, "{sum}");
    }

    #[test]
    fn a_weight_of_two_is_the_point_twice() {
        let twice = ANSCOMBE.iter().chain(&ANSCOMBE[..4]).copied();
        let weighed = ANSCOMBE.iter().enumerate();
        let weighed = weighed.map(|(i, (x, y))| (*x, *y, if i < 4 { 2.0 } else { 1.0 }));
        let (twice, weighed) = (Line::through(twice).unwrap(), Line::weighted(weighed).unwrap());
        assert_eq!(twice.weight, weighed.weight);
        assert!((twice.slope() - weighed.slope()).abs() < 1e-12);
        assert!((twice.intercept() - weighed.intercept()).abs() < 1e-12);
    }

    #[test]
    fn without_points_or_spread_there_is_no_line() {
        assert_eq!(Line::through([]), None);
        assert_eq!(Line::weighted([(1.0, 2.0, 0.0)]), None);
        let upright = Line::through([(1.0, 2.0), (1.0, 3.0)]).unwrap();
        assert!(!upright.slope().is_finite());
        assert_eq!(upright.correlation(), None);
    }
}
