//! Confidence intervals of rates, and the power that no search can exceed.

use statrs::distribution::{Beta, ContinuousCDF as _};
use statrs::function::erf::erf;

/// Chance outside of the intervals, both sides together.
const ALPHA: f64 = 0.05;
/// Halvings of the interval in which a bound is looked for.
const HALVINGS: usize = 60;

/// Clopper-Pearson 95 % interval of the rate `count` of `total`; 0 to 1 if `total` is 0.
pub fn clopper_pearson(count: usize, total: usize) -> (f64, f64) {
    if total == 0 || count > total {
        return (0.0, 1.0);
    }
    let (k, n) = (count as f64, total as f64);
    let low = if count == 0 { 0.0 } else { beta_quantile(k, n - k + 1.0, ALPHA / 2.0) };
    let high = if count == total { 1.0 } else { beta_quantile(k + 1.0, n - k, 1.0 - ALPHA / 2.0) };
    (low, high)
}

fn beta_quantile(a: f64, b: f64, chance: f64) -> f64 {
    let Ok(beta) = Beta::new(a, b) else { return f64::NAN };
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..HALVINGS {
        let middle = f64::midpoint(low, high);
        if beta.cdf(middle) < chance { low = middle } else { high = middle }
    }
    f64::midpoint(low, high)
}

/// Probability of finding an effect of a Fisher z with a threshold of 8 nats: Phi(z - 4).
pub fn power(z: f64) -> f64 {
    0.5 * (1.0 + erf((z - 4.0) / std::f64::consts::SQRT_2))
}

/// Median of what is not NaN; `None` of an empty slice.
pub fn median(values: &[f64]) -> Option<f64> {
    crate::numeric::median(values.iter().copied().filter(|value| !value.is_nan()).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intervals_are_the_published_ones() {
        // Clopper and Pearson 1934 and the usual tables: 0 of 10, 5 of 10, 1 of 20, 81 of 263 (Newcombe
        // 1998), 15 of 148, 0 of 20, 1 of 29.
        for (count, total, low, high) in [
            (0, 10, 0.0, 0.3085),
            (5, 10, 0.1871, 0.8129),
            (1, 20, 0.0013, 0.2487),
            (81, 263, 0.2527, 0.3676),
            (15, 148, 0.0578, 0.1617),
            (0, 20, 0.0, 0.1684),
            (1, 29, 0.0009, 0.1776),
            (10, 10, 0.6915, 1.0),
        ] {
            let (found_low, found_high) = clopper_pearson(count, total);
            let same = (found_low - low).abs() < 6e-5 && (found_high - high).abs() < 6e-5;
            assert!(same, "{count} of {total}: {found_low} to {found_high}");
        }
        assert_eq!(clopper_pearson(0, 0), (0.0, 1.0));
    }

    #[test]
    fn power_is_a_half_at_four() {
        assert!((power(4.0) - 0.5).abs() < 1e-9);
        assert!((power(5.0) - 0.8413).abs() < 1e-4 && (power(6.0) - 0.9772).abs() < 1e-4);
    }

    #[test]
    fn medians() {
        assert_eq!(median(&[]), None);
        assert_eq!(median(&[3.0, f64::NAN, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(&[4.0, 1.0, 2.0, 3.0]), Some(2.5));
    }
}
