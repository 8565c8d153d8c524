//! Means and spreads of values.

use std::borrow::Borrow;

/// Arithmetic mean; `None` of nothing, NaN if a value is.
pub fn mean<V: Borrow<f64>>(values: impl IntoIterator<Item = V>) -> Option<f64> {
    let mut count = 0_usize;
    let counted = values.into_iter().map(|value| {
        count += 1;
        *value.borrow()
    });
    let sum: f64 = counted.sum();
    (count > 0).then(|| sum / count as f64)
}

/// Root of the mean square; `None` of nothing, NaN if a value is.
pub fn rms<V: Borrow<f64>>(values: impl IntoIterator<Item = V>) -> Option<f64> {
    mean(values.into_iter().map(|value| value.borrow() * value.borrow())).map(f64::sqrt)
}

/// Logarithm of the sum of numbers that are given by their logarithms; negative infinity of nothing.
pub(crate) fn log_sum(logs: impl IntoIterator<Item = f64, IntoIter: Clone>) -> f64 {
    let logs = logs.into_iter();
    let most = logs.clone().fold(f64::NEG_INFINITY, f64::max);
    if most == f64::NEG_INFINITY {
        return most;
    }
    most + logs.map(|log| (log - most).exp()).sum::<f64>().ln()
}

/// Number, mean and scatter of values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moments {
    /// Number of values.
    pub count: usize,
    /// Arithmetic mean of the values.
    pub mean: f64,
    /// Sum of squared deviations from the mean.
    pub squares: f64,
}

impl Moments {
    /// Moments of values, in two passes; `None` of nothing.
    pub fn of<V: Borrow<f64>>(
        values: impl IntoIterator<Item = V, IntoIter: Clone>,
    ) -> Option<Self> {
        let values = values.into_iter();
        let mean = mean(values.clone())?;
        let mut count = 0;
        let squares = values.map(|value| {
            count += 1;
            (value.borrow() - mean).powi(2)
        });
        let squares = squares.sum();
        Some(Self { count, mean, squares })
    }

    /// Unbiased estimate of the variance (divided by one less than the number); `None` below two values.
    pub fn variance(&self) -> Option<f64> {
        (self.count > 1).then(|| self.squares / (self.count - 1) as f64)
    }

    /// Root of [`Self::variance`]; `None` below two values.
    pub fn deviation(&self) -> Option<f64> {
        self.variance().map(f64::sqrt)
    }

    /// Standard error of the mean of independent values; `None` below two.
    pub fn standard_error(&self) -> Option<f64> {
        self.variance().map(|variance| (variance / self.count as f64).sqrt())
    }

    /// Variance of the values themselves, divided by their number.
    pub fn population_variance(&self) -> f64 {
        self.squares / self.count as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_logarithm_of_a_sum_is_that_of_numbers_too_small_to_add() {
        assert!((log_sum([2.0_f64.ln(), 3.0_f64.ln()]) - 5.0_f64.ln()).abs() < 1e-12);
        assert!((log_sum([-9000.0, -9000.0]) - (2.0_f64.ln() - 9000.0)).abs() < 1e-9);
        assert_eq!(log_sum([]), f64::NEG_INFINITY);
        assert_eq!(log_sum([f64::NEG_INFINITY; 2]), f64::NEG_INFINITY);
    }

    #[test]
    fn nothing_has_no_mean() {
        assert_eq!(mean::<f64>([]), None);
        assert_eq!(rms::<f64>([]), None);
        assert_eq!(Moments::of::<f64>([]), None);
        assert!(mean([1.0, f64::NAN]).is_some_and(f64::is_nan));
    }

    #[test]
    fn the_scatter_is_the_textbooks() {
        let moments = Moments::of([2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0, 9.0]).unwrap();
        assert_eq!((moments.count, moments.mean, moments.population_variance()), (8, 5.0, 4.0));
        assert_eq!(moments.variance(), Some(32.0 / 7.0));
        assert_eq!(moments.deviation(), Some((32.0_f64 / 7.0).sqrt()));
        assert_eq!(moments.standard_error(), Some((32.0_f64 / 7.0 / 8.0).sqrt()));
        assert_eq!(rms([3.0, -4.0]), Some(12.5_f64.sqrt()));
    }

    #[test]
    fn one_value_has_no_scatter() {
        let moments = Moments::of([3.0]).unwrap();
        assert_eq!((moments.mean, moments.variance(), moments.standard_error()), (3.0, None, None));
    }

    #[test]
    fn sums_run_from_first_to_last() {
        // Grouped otherwise, the ones would survive.
        let values = [1e16, 1.0, 1.0, -1e16];
        assert_eq!(mean(values), Some(0.0));
        assert_eq!(mean(values.iter().rev()), Some(0.0));
        assert_eq!(mean([1.0, 1.0, 1e16, -1e16]), Some(0.5));
    }

    #[test]
    fn statrs_agrees() {
        use statrs::statistics::Statistics as _;
        let values: Vec<f64> =
            (0..200).map(|i| (f64::from(i) * 0.7).sin() * 3.0 + 1500.0).collect();
        let moments = Moments::of(&values).unwrap();
        assert!((moments.mean - (&values).mean()).abs() < 1e-9);
        assert!((moments.deviation().unwrap() / (&values).std_dev() - 1.0).abs() < 1e-9);
    }
}
