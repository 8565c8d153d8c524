//! Autocorrelation of the drones over time (eq. 9).

use nalgebra::DMatrix;

use super::curve::line;
use super::result::{Scale, TimeCorrelation, TimeLine};
use super::space::scored;
use crate::base::estimate::Estimate;

/// Autocorrelation needs this many pairs of values at a lag.
const FEWEST_PAIRS: f64 = 10.0;

/// How many pairs of values each drone has at each lag; `None`: there are no gaps.
pub(super) struct Counts(Option<Vec<Vec<f64>>>);

impl Counts {
    /// Of columns with NaN in gaps, for lags up to half their length.
    pub(super) fn of(columns: &DMatrix<f64>) -> Self {
        let gaps = columns.iter().any(|value| !value.is_finite());
        Self(gaps.then(|| {
            columns
                .column_iter()
                .map(|column| {
                    let known: Vec<f64> =
                        column.iter().map(|value| f64::from(u8::from(value.is_finite()))).collect();
                    (0..=known.len() / 2).map(|lag| lagged(&known, lag)).collect()
                })
                .collect()
        }))
    }

    fn pairs(&self, seconds: usize, drone: usize, lag: usize) -> f64 {
        match &self.0 {
            None => (seconds - lag) as f64,
            Some(counts) => {
                counts.get(drone).and_then(|counts| counts.get(lag)).copied().unwrap_or(0.0)
            }
        }
    }
}

/// Autocorrelation of each drone at a lag: the mean of the products of all overlapping pairs.
fn at_lag<'a>(
    scored: &'a DMatrix<f64>,
    counts: &'a Counts,
    lag: usize,
) -> impl Iterator<Item = f64> + 'a {
    let seconds = scored.nrows();
    scored.as_slice().chunks_exact(seconds.max(1)).enumerate().filter_map(move |(drone, values)| {
        let pairs = counts.pairs(seconds, drone, lag);
        (pairs >= FEWEST_PAIRS).then(|| lagged(values, lag) / pairs)
    })
}

fn lagged(values: &[f64], lag: usize) -> f64 {
    let early = values.get(..values.len() - lag.min(values.len())).unwrap_or_default();
    dot(early, values.get(lag..).unwrap_or_default())
}

/// Sum of products, in several sums at once: one alone waits for itself.
fn dot(left: &[f64], right: &[f64]) -> f64 {
    let (left_parts, right_parts) = (left.chunks_exact(8), right.chunks_exact(8));
    let (left_rest, right_rest) = (left_parts.remainder(), right_parts.remainder());
    let mut sums = [0.0; 8];
    for (left, right) in left_parts.zip(right_parts) {
        for (sum, (left, right)) in sums.iter_mut().zip(left.iter().zip(right)) {
            *sum += left * right;
        }
    }
    let rest: f64 = left_rest.iter().zip(right_rest).map(|(left, right)| left * right).sum();
    sums.iter().sum::<f64>() + rest
}

/// The paper's t0: a line through the mean autocorrelation up to its first zero crossing.
pub(super) fn zero_time(scored: &DMatrix<f64>, counts: &Counts) -> Option<Fitted> {
    let (mut lags, mut means) = (Vec::new(), Vec::new());
    for lag in 0..=scored.nrows() / 2 {
        let mean = super::field::mean(at_lag(scored, counts, lag));
        if mean <= 0.0 || !mean.is_finite() {
            let (slope, t0) = line(&lags, &means)?;
            return Some(Fitted { slope, t0, points: lags.len() });
        }
        lags.push(lag as f64);
        means.push(mean);
    }
    None
}

/// A fitted line.
pub(super) struct Fitted {
    pub(super) slope: Estimate,
    pub(super) t0: Estimate,
    points: usize,
}

/// The autocorrelation as a result, with lags up to half of the record.
pub(super) fn autocorrelation(columns: &DMatrix<f64>) -> TimeCorrelation {
    let (scored, counts) = (scored(columns), Counts::of(columns));
    let mut found = TimeCorrelation::default();
    for lag in 0..=columns.nrows() / 2 {
        let values: Vec<f64> = at_lag(&scored, &counts, lag).collect();
        if values.is_empty() {
            break;
        }
        found.lag_s.push(lag as f64);
        found.mean.push(super::field::mean(values.iter().copied()));
        let (n, sd) = (values.len() as f64, super::field::sd(&values));
        found.sd_between_drones.push(if n > 1.0 { sd * (n / (n - 1.0)).sqrt() } else { 0.0 });
        found.drones.push(values.len());
    }
    let crossing = found.mean.iter().position(|mean| *mean <= 0.0);
    found.first_zero_s = crossing.and_then(|index| {
        let (after, before) = (found.mean.get(index)?, found.mean.get(index.checked_sub(1)?)?);
        Some(index as f64 - 1.0 + before / (before - after))
    });
    found.line = zero_time(&scored, &counts).map(|fitted| TimeLine {
        slope_per_s: fitted.slope,
        t0_s: Scale { value: fitted.t0.value, fit_se: Some(fitted.t0.se), ..Scale::default() },
        points: fitted.points,
    });
    found
}
