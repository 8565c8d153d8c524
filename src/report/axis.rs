//! Axes: round ranges and ticks around data.

use kuva::render::layout::TickFormat;

use crate::numeric;

use super::text::{fixed, usable};

/// Heights that stand for the ground, which barometers know no better, m.
const GROUND_M: f64 = 3.0;
/// Distances of ticks on a time axis.
const TIME_STEPS_S: [f64; 12] =
    [1.0, 2.0, 5.0, 10.0, 20.0, 60.0, 120.0, 300.0, 600.0, 1200.0, 3600.0, 7200.0];

/// A linear axis: label with unit, range, distance of its ticks.
#[derive(Clone, Debug)]
pub(super) struct Axis {
    pub(super) label: String,
    pub(super) min: f64,
    pub(super) max: f64,
    pub(super) step: f64,
}

impl Axis {
    /// An axis around all usable values, at least `span` wide, ending on ticks.
    pub(super) fn around(label: &str, values: impl Iterator<Item = f64>, span: f64) -> Self {
        let (low, high) = extent(values, span);
        let step = nice_step((high - low) / 5.0);
        // Room between the data and the frame.
        let pad = 0.03 * (high - low);
        let min = ((low - pad) / step).floor() * step;
        let max = ((high + pad) / step).ceil() * step;
        Self { label: label.to_owned(), min, max, step }
    }

    /// An axis of heights above the ground: nothing below it is shown, unless something flew there.
    pub(super) fn heights(values: impl Iterator<Item = f64>) -> Self {
        let values: Vec<f64> = values.collect();
        let lowest = numeric::least(values.iter().copied().filter(|&value| usable(value)));
        let mut axis = Self::around("height (m)", values.into_iter(), 10.0);
        if axis.min < 0.0 && lowest.is_some_and(|lowest| lowest > -GROUND_M) {
            axis.min = 0.0;
        }
        axis
    }

    /// A time axis in seconds, not starting before the data.
    pub(super) fn time(values: impl Iterator<Item = f64>) -> Self {
        let (low, high) = extent(values, 10.0);
        let wanted = (high - low) / 7.0;
        let step = TIME_STEPS_S
            .into_iter()
            .find(|&step| step >= wanted)
            .unwrap_or_else(|| nice_step(wanted));
        let min = if low > 0.0 && low < step { 0.0 } else { low };
        Self { label: "show time (s)".to_owned(), min, max: high, step }
    }

    /// A logarithmic axis of frequencies from `low` to `high`, Hz.
    pub(super) fn frequencies(low: f64, high: f64) -> Self {
        Self { label: "frequency (Hz)".to_owned(), min: 0.9 * low, max: 1.1 * high, step: 0.001 }
    }

    /// A logarithmic axis that ends on powers of ten around values; `None` of none above 0.
    pub(super) fn decades(label: &str, values: impl Iterator<Item = f64>) -> Option<Self> {
        let known = values.filter(|value| usable(*value) && *value > 0.0);
        let (low, high) = numeric::extent(known)?;
        let power = |value: f64| 10_f64.powf(value);
        let [min, max] = [power(low.log10().floor()), power(high.log10().ceil())];
        Some(Self { label: label.to_owned(), min, max: max.max(10.0 * min), step: 0.001 })
    }

    /// Tick labels with just the decimals that the step needs.
    pub(super) fn format(&self) -> TickFormat {
        let decimals = decimals_of(self.step);
        TickFormat::Custom(std::sync::Arc::new(move |value| fixed(value, decimals)))
    }
}

/// Decimals that tell two multiples of `step` apart.
pub(super) fn decimals_of(step: f64) -> usize {
    (0..6)
        .find(|&decimals| {
            let scaled = step * 10_f64.powi(decimals);
            (scaled - scaled.round()).abs() < 1e-6 * scaled.abs().max(1.0)
        })
        .unwrap_or(6) as usize
}

/// The smallest of 1, 2, 2.5, 5 times a power of ten that is not below `raw`.
pub(super) fn nice_step(raw: f64) -> f64 {
    if !(raw.is_finite() && raw > 0.0) {
        return 1.0;
    }
    let power = 10_f64.powf(raw.log10().floor());
    [1.0, 2.0, 2.5, 5.0, 10.0]
        .into_iter()
        .map(|factor| factor * power)
        .find(|&step| step >= raw * (1.0 - 1e-9))
        .unwrap_or(10.0 * power)
}

/// Ends of symmetric scales, as multiples of a power of ten: so close that colours are not washed out.
const ENDS: [f64; 11] = [1.0, 1.25, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0];

/// The end of a symmetric scale around a size: round, and no more than a third above it.
pub(super) fn scale_end(largest: f64) -> f64 {
    if !(largest.is_finite() && largest > 0.0) {
        return 1.0;
    }
    let power = 10_f64.powf(largest.log10().floor());
    ENDS.into_iter()
        .map(|factor| factor * power)
        .find(|&end| end >= largest * (1.0 - 1e-9))
        .unwrap_or(10.0 * power)
}

fn extent(values: impl Iterator<Item = f64>, span: f64) -> (f64, f64) {
    let Some((low, high)) = numeric::extent(values.filter(|&value| usable(value))) else {
        return (0.0, span);
    };
    let lacking = (span - (high - low)).max(0.0) / 2.0;
    (low - lacking, high + lacking)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_end_on_round_numbers() {
        let axis = Axis::around("u (us)", [1498.7, 1702.3].into_iter(), 10.0);
        assert_eq!((axis.min, axis.max, axis.step), (1450.0, 1750.0, 50.0));
        assert_eq!(decimals_of(0.25), 2);
        assert_eq!(decimals_of(50.0), 0);
    }

    #[test]
    fn heights_begin_at_the_ground() {
        let of = |values: [f64; 2]| Axis::heights(values.into_iter()).min;
        assert_eq!(of([-0.4, 93.0]), 0.0);
        assert_eq!(of([-15.0, 93.0]), -25.0, "a valley");
        assert_eq!(of([20.0, 93.0]), 0.0);
    }

    #[test]
    fn scales_end_on_round_numbers_close_to_what_they_hold() {
        for (size, end) in
            [(0.52, 0.6), (1.02, 1.25), (2.48, 2.5), (0.0301, 0.04), (4.0, 4.0), (9.1, 10.0)]
        {
            assert!((scale_end(size) - end).abs() < 1e-9, "{size}");
        }
        assert_eq!(scale_end(f64::NAN), 1.0);
    }

    #[test]
    fn nothing_and_nonsense_still_make_an_axis() {
        for values in [vec![], vec![f64::NAN], vec![f64::INFINITY, 1e300], vec![3.0, 3.0]] {
            let axis = Axis::around("x", values.into_iter(), 1.0);
            assert!(axis.max > axis.min && axis.step > 0.0, "{axis:?}");
        }
    }
}
