//! Location, spread and standard error of samples in a window.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::numeric::{Moments, Sorted, mean};

/// Share cut off at each end for the trimmed mean (docs/physics.md, 5.1).
const TRIM: f64 = 0.1;

/// Location and spread of the samples in a window.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SampleStats {
    /// Median.
    pub median: f64,
    /// Mean.
    pub mean: f64,
    /// Standard deviation of the samples.
    pub sd: f64,
    /// Number of samples.
    pub n: usize,
    /// Mean without the lowest and the highest tenth of the samples.
    #[serde(default)]
    pub trimmed: f64,
    /// Standard error of the mean from the means of blocks longer than the signal's memory.
    #[serde(default)]
    pub se: f64,
}

/// Statistics of samples with their times. The standard error comes from the means of blocks of
/// `block_s` (longer than the signal's memory), so that it does not shrink with the logging rate.
pub(crate) fn sample_stats(times_s: &[f64], values: &[f64], block_s: f64) -> SampleStats {
    let n = times_s.len().min(values.len());
    let (times_s, values) = (times_s.get(..n).unwrap_or(&[]), values.get(..n).unwrap_or(&[]));
    if n == 0 {
        return SampleStats::default();
    }
    let mut sorted = values.to_vec();
    let sorted = Sorted::of(&mut sorted);
    let (average, sd) = mean_sd(values);
    let cut = (n as f64 * TRIM).floor() as usize;
    let inner = sorted.values().get(cut..n - cut).filter(|inner| !inner.is_empty());
    SampleStats {
        median: sorted.median().unwrap_or_default(),
        mean: average,
        sd,
        n,
        trimmed: mean(inner.unwrap_or(sorted.values())).unwrap_or_default(),
        se: block_error(times_s, values, block_s).unwrap_or(sd / (n as f64).sqrt()),
    }
}

/// Mean and sample standard deviation (0 for fewer than two values).
pub(crate) fn mean_sd(values: &[f64]) -> (f64, f64) {
    Moments::of(values)
        .map_or((0.0, 0.0), |moments| (moments.mean, moments.deviation().unwrap_or_default()))
}

/// Standard error of the mean from block means; `None` with fewer than three blocks.
pub(crate) fn block_error(times_s: &[f64], values: &[f64], block_s: f64) -> Option<f64> {
    let start = *times_s.first()?;
    let mut means: Vec<f64> = Vec::new();
    let mut block = (-1_i64, 0.0, 0_u32);
    for (time, value) in times_s.iter().zip(values) {
        let index = ((time - start) / block_s).floor() as i64;
        if index != block.0 {
            if block.2 > 0 {
                means.push(block.1 / f64::from(block.2));
            }
            block = (index, 0.0, 0);
        }
        block.1 += value;
        block.2 += 1;
    }
    if block.2 > 0 {
        means.push(block.1 / f64::from(block.2));
    }
    (means.len() >= 3).then(|| mean_sd(&means).1 / (means.len() as f64).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn textbook_numbers() {
        let values = [2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0, 9.0, 90.0, -90.0];
        let times: Vec<f64> = (0..10).map(f64::from).collect();
        let stats = sample_stats(&times, &values, 2.0);
        assert_eq!((stats.median, stats.mean, stats.n), (4.5, 4.0, 10));
        assert_eq!(stats.trimmed, 5.0, "the two outliers are cut");
        assert_eq!(sample_stats(&[], &[], 1.0), SampleStats::default());
    }

    #[test]
    fn the_block_error_does_not_shrink_with_the_logging_rate() {
        // A square wave of 4 s: samples repeat, information does not.
        let wave = |rate: usize| {
            let times: Vec<f64> = (0..40 * rate).map(|i| i as f64 / rate as f64).collect();
            let values: Vec<f64> =
                times.iter().map(|t| if (t / 2.0) as i64 % 2 == 0 { 1.0 } else { -1.0 }).collect();
            sample_stats(&times, &values, 2.0).se
        };
        assert!((wave(10) - wave(100)).abs() < 1e-12);
        assert!((wave(10) - 1.0 / 19.0_f64.sqrt()).abs() < 1e-9, "{}", wave(10));
    }
}
