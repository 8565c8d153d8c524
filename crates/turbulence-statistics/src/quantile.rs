//! Quantiles that intervals are made of.

use statrs::distribution::{ChiSquared, ContinuousCDF as _};

/// Half the width of a normal 95 % interval, standard deviations.
pub const WIDTH: f64 = 1.959_964;

/// Interval (95 %) of a variance of which `value` was found with so many degrees of freedom: what a chi-squared
/// distribution gives.
pub fn of_variance(value: f64, freedom: f64) -> [f64; 2] {
    let Ok(distribution) = ChiSquared::new(freedom.max(0.1)) else { return [value, value] };
    let [low, high] = [0.025, 0.975].map(|share| distribution.inverse_cdf(share));
    [value * freedom / high, if low > 0.0 { value * freedom / low } else { f64::INFINITY }]
}

/// The interval with an independent relative error of the value's scale: both widths add in quadrature on a logarithmic
/// axis.
pub fn scaled(value: f64, [low, high]: [f64; 2], scale_se: f64) -> [f64; 2] {
    if value <= 0.0 || scale_se <= 0.0 {
        return [low, high];
    }
    let wider = |bound: f64, sign: f64| {
        let width = (bound / value).ln().abs().hypot(WIDTH * scale_se);
        value * (sign * width).exp()
    };
    let low = if low > 0.0 { wider(low, -1.0) } else { low };
    [low, if high.is_finite() { wider(high, 1.0) } else { high }]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_interval_of_a_variance_is_that_of_tables() {
        // Chi-squared with 10 degrees of freedom: 3.247 and 20.483.
        let [low, high] = of_variance(1.0, 10.0);
        assert!((low - 10.0 / 20.483).abs() < 1e-4 && (high - 10.0 / 3.247).abs() < 1e-3);
    }

    #[test]
    fn errors_of_scale_widen() {
        let [low, high] = scaled(2.0, [1.0, 4.0], 0.1);
        assert!(low < 1.0 && high > 4.0 && (low * high - 4.0).abs() < 1e-9);
        assert_eq!(scaled(2.0, [1.0, 4.0], 0.0), [1.0, 4.0]);
    }
}
