//! The curves of the paper's Fig. 6, fitted by least squares as a general curve fit does it: errors
//! are scaled by the residuals, and points are taken for independent.

use crate::base::estimate::Estimate;
use crate::numeric::{Line, least};

/// Steps of the search over the logarithm of the length.
const STEPS: usize = 48;
/// Lengths from this share of the smallest distance ...
const SHORTEST: f64 = 0.05;
/// ... to this multiple of the largest one are searched.
const LONGEST: f64 = 2000.0;
/// Golden section.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// A point of a correlation function: distance, value, weight.
#[derive(Clone, Copy, Debug)]
pub(super) struct CurvePoint {
    pub(super) distance: f64,
    pub(super) value: f64,
    pub(super) weight: f64,
}

/// `exp(-r / lambda)`: lambda with its error; `None` when no length fits best (too few points, or a
/// correlation that does not fall off).
pub(super) fn exponential(points: &[CurvePoint]) -> Option<Estimate> {
    let loss = |ln_length: f64| {
        let rate = (-ln_length).exp();
        points
            .iter()
            .map(|point| point.weight * (point.value - (-point.distance * rate).exp()).powi(2))
            .sum::<f64>()
    };
    let ln_length = search(points, &loss)?;
    let length = ln_length.exp();
    let information: f64 = points
        .iter()
        .map(|point| {
            let ratio = point.distance / length;
            point.weight * (ratio / length * (-ratio).exp()).powi(2)
        })
        .sum();
    let freedom = points.len().checked_sub(1).filter(|freedom| *freedom > 0);
    let se = freedom.map_or(0.0, |freedom| (loss(ln_length) / freedom as f64 / information).sqrt());
    Some(Estimate::new(length, se))
}

/// `c0 exp(-r / lambda)`: c0 and lambda with their errors.
pub(super) fn exponential_with_nugget(points: &[CurvePoint]) -> Option<(Estimate, Estimate)> {
    if points.len() < 3 {
        return None;
    }
    let level = |ln_length: f64| {
        let rate = (-ln_length).exp();
        let (mut up, mut down) = (0.0, 0.0);
        for point in points {
            let shape = (-point.distance * rate).exp();
            up += point.weight * point.value * shape;
            down += point.weight * shape * shape;
        }
        up / down
    };
    let loss = |ln_length: f64| {
        let (c0, rate) = (level(ln_length), (-ln_length).exp());
        points
            .iter()
            .map(|point| point.weight * (point.value - c0 * (-point.distance * rate).exp()).powi(2))
            .sum::<f64>()
    };
    let ln_length = search(points, &loss)?;
    let (length, c0) = (ln_length.exp(), level(ln_length));
    let (mut aa, mut al, mut ll) = (0.0, 0.0, 0.0);
    for point in points {
        let ratio = point.distance / length;
        let by_c0 = (-ratio).exp();
        let by_length = c0 * by_c0 * ratio / length;
        aa += point.weight * by_c0 * by_c0;
        al += point.weight * by_c0 * by_length;
        ll += point.weight * by_length * by_length;
    }
    let variance = loss(ln_length) / (points.len() - 2) as f64;
    let determinant = aa * ll - al * al;
    let se = |diagonal: f64| (variance * diagonal / determinant).max(0.0).sqrt();
    Some((Estimate::new(c0, se(ll)), Estimate::new(length, se(aa))))
}

/// The best logarithm of a length: the best of a grid, refined; `None` at its ends.
fn search(points: &[CurvePoint], loss: &impl Fn(f64) -> f64) -> Option<f64> {
    let distances = || points.iter().map(|point| point.distance);
    let low = (least(distances()).unwrap_or(f64::INFINITY) * SHORTEST).ln();
    let high = (distances().fold(0.0, f64::max) * LONGEST).ln();
    if !(low.is_finite() && high.is_finite()) {
        return None;
    }
    let at = |step: usize| low + (high - low) * step as f64 / STEPS as f64;
    let best = (0..=STEPS)
        .map(|step| (step, loss(at(step))))
        .min_by(|left, right| left.1.total_cmp(&right.1))
        .filter(|(step, loss)| (1..STEPS).contains(step) && loss.is_finite())?
        .0;
    let (mut from, mut to) = (at(best - 1), at(best + 1));
    let (mut one, mut two) = (to - GOLDEN * (to - from), from + GOLDEN * (to - from));
    let (mut loss_one, mut loss_two) = (loss(one), loss(two));
    while to - from > 1e-6 {
        if loss_one < loss_two {
            (to, two, loss_two) = (two, one, loss_one);
            one = to - GOLDEN * (to - from);
            loss_one = loss(one);
        } else {
            (from, one, loss_one) = (one, two, loss_two);
            two = from + GOLDEN * (to - from);
            loss_two = loss(two);
        }
    }
    Some(f64::midpoint(from, to))
}

/// `A (x - x0)` through points: A and x0 with their errors.
pub(super) fn line(x: &[f64], y: &[f64]) -> Option<(Estimate, Estimate)> {
    let n = x.len().min(y.len());
    if n < 3 {
        return None;
    }
    let count = n as f64;
    let line = Line::through(x.iter().copied().zip(y.iter().copied()))?;
    let (slope, sxx, [mean_x, mean_y]) = (line.slope(), line.xx, line.mean);
    let zero = mean_x - mean_y / slope;
    let loss: f64 = x.iter().zip(y).map(|(x, y)| (y - slope * (x - zero)).powi(2)).sum();
    let variance = loss / (count - 2.0);
    // x0 = mean_x - mean_y / A, and mean_y and A are independent.
    let zero_variance =
        variance / count / slope.powi(2) + variance / sxx * (mean_y / slope.powi(2)).powi(2);
    let found = slope < 0.0 && zero.is_finite();
    found.then(|| {
        (Estimate::new(slope, (variance / sxx).sqrt()), Estimate::new(zero, zero_variance.sqrt()))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(value: impl Fn(f64) -> f64) -> Vec<CurvePoint> {
        let distance = |step: i32| 7.0 * f64::from(step);
        (1..=8)
            .map(|step| CurvePoint {
                distance: distance(step),
                value: value(distance(step)),
                weight: 1.0,
            })
            .collect()
    }

    #[test]
    fn exact_curves_come_back() {
        let found = exponential(&points(|r| (-r / 145.0).exp())).unwrap();
        assert!((found.value - 145.0).abs() < 1e-3 && found.se < 1e-3, "{found:?}");
        let (c0, length) = exponential_with_nugget(&points(|r| 0.8 * (-r / 60.0).exp())).unwrap();
        assert!((c0.value - 0.8).abs() < 1e-6 && (length.value - 60.0).abs() < 1e-3);
        let x: Vec<f64> = (0..50).map(f64::from).collect();
        let y: Vec<f64> = x.iter().map(|x| -0.01 * (x - 186.0)).collect();
        let (slope, zero) = line(&x, &y).unwrap();
        assert!((slope.value + 0.01).abs() < 1e-12 && (zero.value - 186.0).abs() < 1e-9);
    }

    #[test]
    fn the_error_is_that_of_a_curve_fit() {
        // The same numbers from scipy's curve_fit, computed once: f = exp(-x / 145) with +-0.02.
        let wiggled: Vec<CurvePoint> = points(|r| (-r / 145.0).exp())
            .into_iter()
            .enumerate()
            .map(|(i, p)| CurvePoint {
                value: p.value + if i % 2 == 0 { 0.02 } else { -0.02 },
                ..p
            })
            .collect();
        let found = exponential(&wiggled).unwrap();
        assert!((found.value - 143.0).abs() < 3.0, "{found}");
        assert!((found.se - 5.0).abs() < 2.0, "{found}");
    }

    #[test]
    fn what_does_not_fall_off_has_no_length() {
        assert!(exponential(&points(|_| 1.0)).is_none());
        assert!(exponential(&points(|_| -0.1)).is_none());
        assert!(line(&[0.0, 1.0, 2.0], &[0.0, 1.0, 2.0]).is_none(), "it rises");
    }
}
