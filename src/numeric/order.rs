//! Least and most, medians and quantiles: what follows from the order of values.

use std::borrow::Borrow;

/// Least value; NaN is passed over, `None` without any other.
pub fn least<V: Borrow<f64>>(values: impl IntoIterator<Item = V>) -> Option<f64> {
    extreme(values, f64::min)
}

/// Greatest value; NaN is passed over, `None` without any other.
pub fn most<V: Borrow<f64>>(values: impl IntoIterator<Item = V>) -> Option<f64> {
    extreme(values, f64::max)
}

fn extreme<V: Borrow<f64>>(
    values: impl IntoIterator<Item = V>,
    of: fn(f64, f64) -> f64,
) -> Option<f64> {
    let values = values.into_iter().map(|value| *value.borrow());
    values.filter(|value| !value.is_nan()).reduce(of)
}

/// Least and greatest value; NaN is passed over, `None` without any other.
pub fn extent<V: Borrow<f64>>(values: impl IntoIterator<Item = V>) -> Option<(f64, f64)> {
    let values = values.into_iter().map(|value| *value.borrow());
    let one = values.filter(|value| !value.is_nan()).map(|value| (value, value));
    one.reduce(|(low, high), (value, _)| (low.min(value), high.max(value)))
}

/// Median, the mean of the two in the middle of an even number; `None` of nothing.
pub fn median(mut values: Vec<f64>) -> Option<f64> {
    let even = values.len().is_multiple_of(2);
    let middle = values.len() / 2;
    if values.is_empty() {
        return None;
    }
    let (below, upper, _) = values.select_nth_unstable_by(middle, f64::total_cmp);
    let lower = below.iter().max_by(|a, b| a.total_cmp(b)).filter(|_| even);
    Some(lower.map_or(*upper, |lower| f64::midpoint(*lower, *upper)))
}

/// Median that is one of the values: the upper one of the two in the middle; `None` of nothing.
pub fn upper_median(mut values: Vec<f64>) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// Ascending values, for more than one look at their order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sorted<'a>(&'a [f64]);

impl<'a> Sorted<'a> {
    /// Sorts values in place.
    pub fn of(values: &'a mut [f64]) -> Self {
        values.sort_unstable_by(f64::total_cmp);
        Self(values)
    }

    /// Takes values for sorted. If they are not, quantiles are no quantiles.
    pub fn taken(ascending: &'a [f64]) -> Self {
        Self(ascending)
    }

    /// The values, ascending.
    pub fn values(self) -> &'a [f64] {
        self.0
    }

    /// Median, the mean of the two in the middle of an even number; `None` of nothing.
    pub fn median(self) -> Option<f64> {
        let middle = self.0.len() / 2;
        let upper = *self.0.get(middle)?;
        let lower = middle.checked_sub(1).and_then(|below| self.0.get(below));
        let lower = lower.filter(|_| self.0.len().is_multiple_of(2));
        Some(lower.map_or(upper, |lower| f64::midpoint(*lower, upper)))
    }

    /// Quantile, interpolated between its neighbours (R's type 7, the default of R and NumPy); a share
    /// outside 0 to 1 gives the least or greatest value, nothing gives `None`.
    pub fn quantile(self, share: f64) -> Option<f64> {
        let last = self.0.len().checked_sub(1)?;
        let place = share.clamp(0.0, 1.0) * last as f64;
        let low = place.floor() as usize;
        let (below, above) = (self.0.get(low)?, self.0.get((low + 1).min(last))?);
        Some(below + (above - below) * (place - low as f64))
    }

    /// The last value at or below the place of a share of 0 to 1, not interpolated; `None` of nothing.
    pub fn lower_quantile(self, share: f64) -> Option<f64> {
        self.0.get((self.0.len().checked_sub(1)? as f64 * share) as usize).copied()
    }

    /// The value nearest to the place of a share of 0 to 1, not interpolated; `None` of nothing.
    pub fn nearest_quantile(self, share: f64) -> Option<f64> {
        self.0.get((self.0.len().checked_sub(1)? as f64 * share).round() as usize).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn nothing_has_no_order() {
        assert_eq!((least::<f64>([]), most::<f64>([]), extent::<f64>([])), (None, None, None));
        assert_eq!((median(Vec::new()), upper_median(Vec::new())), (None, None));
        let nothing = Sorted::taken(&[]);
        assert_eq!((nothing.median(), nothing.quantile(0.5)), (None, None));
        assert_eq!((nothing.lower_quantile(0.5), nothing.nearest_quantile(0.5)), (None, None));
    }

    #[test]
    fn what_is_missing_is_neither_least_nor_most() {
        let values = [f64::NAN, 2.0, -3.0, f64::NAN];
        assert_eq!(
            (least(values), most(values), extent(values)),
            (Some(-3.0), Some(2.0), Some((-3.0, 2.0)))
        );
        assert_eq!((least([f64::NAN]), most([f64::NAN]), extent([f64::NAN])), (None, None, None));
    }

    #[test]
    fn medians() {
        assert_eq!(median(vec![3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(vec![4.0, 1.0, 2.0, 3.0]), Some(2.5));
        assert_eq!(upper_median(vec![4.0, 1.0, 2.0, 3.0]), Some(3.0));
        assert_eq!(upper_median(vec![3.0, 1.0, 2.0]), Some(2.0));
    }

    #[test]
    fn quantiles_are_those_of_r() {
        // quantile(c(1, 2, 4, 8), c(0.25, 0.5, 0.9), type = 7): 1.75, 3, 6.8.
        let sorted = Sorted::taken(&[1.0, 2.0, 4.0, 8.0]);
        assert_eq!((sorted.quantile(0.25), sorted.quantile(0.5)), (Some(1.75), Some(3.0)));
        assert!((sorted.quantile(0.9).unwrap() - 6.8).abs() < 1e-12);
        assert_eq!((sorted.quantile(-1.0), sorted.quantile(2.0)), (Some(1.0), Some(8.0)));
        assert_eq!(
            (sorted.lower_quantile(0.65), sorted.lower_quantile(0.99)),
            (Some(2.0), Some(4.0))
        );
        assert_eq!(
            (sorted.nearest_quantile(0.5), sorted.nearest_quantile(0.9)),
            (Some(4.0), Some(8.0))
        );
    }

    proptest! {
        #[test]
        fn all_medians_are_one(mut values in prop::collection::vec(-1e9..1e9_f64, 1..60)) {
            let (whole, upper) = (median(values.clone()), upper_median(values.clone()));
            let sorted = Sorted::of(&mut values);
            prop_assert_eq!(whole, sorted.median());
            prop_assert_eq!(upper, sorted.values().get(sorted.values().len() / 2).copied());
            prop_assert_eq!(sorted.quantile(0.0), least(sorted.values()));
            prop_assert_eq!(sorted.quantile(1.0), most(sorted.values()));
            prop_assert!((sorted.quantile(0.5).unwrap() - whole.unwrap()).abs() < 1e-6);
        }
    }
}
