//! Running means of a series.

use crate::flight::Series;

/// Length of the running window, s: the paper's.
pub(crate) const RUNNING_S: f64 = 10.0;
/// A silence longer than this breaks a running window, s: a tenth of it. Chosen.
pub(super) const GAP_S: f64 = 1.0;

/// Time-weighted running means by prefix sums, so that the logging rate does not matter.
pub(super) struct Running<'a> {
    times: &'a [f64],
    /// Integral of the piecewise linear signal up to each sample.
    integral: Vec<f64>,
    /// Index of the last gap's end at or before each sample.
    gap_before: Vec<usize>,
}

impl<'a> Running<'a> {
    pub(super) fn new(series: &'a Series, start_s: f64, end_s: f64) -> Self {
        let range = series.range(start_s - GAP_S, end_s + GAP_S);
        let times = series.time_s.get(range.clone()).unwrap_or_default();
        let values = series.value.get(range).unwrap_or_default();
        let mut integral = Vec::with_capacity(times.len());
        let mut gap_before = Vec::with_capacity(times.len());
        let (mut sum, mut gap) = (0.0, 0);
        let mut before: Option<(f64, f64)> = None;
        for (index, (time, value)) in times.iter().zip(values).enumerate() {
            if let Some((last, last_value)) = before {
                let step = time - last;
                sum += step * f64::midpoint(*value, last_value);
                if step > GAP_S {
                    gap = index;
                }
            }
            before = Some((*time, *value));
            integral.push(sum);
            gap_before.push(gap);
        }
        Self { times, integral, gap_before }
    }

    /// Mean over the full window centred on a time; `None` across gaps and beyond the ends.
    pub(super) fn mean(&self, centre_s: f64) -> Option<f64> {
        let half = RUNNING_S / 2.0;
        let first = self.times.partition_point(|time| *time < centre_s - half);
        let last = self.times.partition_point(|time| *time <= centre_s + half).checked_sub(1)?;
        if last <= first || *self.gap_before.get(last)? > first {
            return None;
        }
        let (start, end) = (*self.times.get(first)?, *self.times.get(last)?);
        if start - (centre_s - half) > GAP_S || (centre_s + half) - end > GAP_S {
            return None;
        }
        Some((self.integral.get(last)? - self.integral.get(first)?) / (end - start))
    }
}
