//! Covariances of records with themselves and others, by lag.

use crate::Record;

/// Covariance of a record with a later part of another, at lags of 0, 1, ... steps up to `lags`: the mean product of
/// anomalies over all pairs that are known; NaN where there is none. Records with other steps have none in common.
pub fn cross(a: &Record, b: &Record, lags: usize) -> Vec<f64> {
    if (a.step_s() - b.step_s()).abs() > 1e-9 * a.step_s() {
        return vec![f64::NAN; lags + 1];
    }
    products(a.anomalies().values(), b.anomalies().values(), lags)
}

/// Lags that are summed side by side.
const LANES: usize = 8;

/// Lags after which it is looked whether anything is left.
const AT_ONCE: usize = 4 * LANES;

/// Mean products of values with later ones, by lag; NaN where no pair is known.
pub(crate) fn products(a: &[f64], b: &[f64], lags: usize) -> Vec<f64> {
    products_from(a, b, 0, lags)
}

/// Mean products of values with later ones of the same record, by lag, until nothing is left and for some lags more, up to `lags` at
/// most.
pub(crate) fn products_until_lost(values: &[f64], lags: usize) -> Vec<f64> {
    let mut found = Vec::new();
    while found.len() <= lags && first_lost(&found).is_none() {
        let first = found.len();
        found.extend(products_from(values, values, first, lags.min(first + AT_ONCE - 1)));
    }
    found
}

/// [`products`] from one of the lags on.
fn products_from(a: &[f64], b: &[f64], first: usize, lags: usize) -> Vec<f64> {
    if a.len() == b.len() && a.iter().chain(b).all(|value| value.is_finite()) {
        return (first..=lags).step_by(LANES).flat_map(|first| whole(a, b, first, lags)).collect();
    }
    (first..=lags)
        .map(|lag| {
            let later = b.get(lag..).unwrap_or_default();
            let (mut sum, mut count) = (0.0, 0usize);
            for (one, other) in a.iter().zip(later) {
                let product = one * other;
                if !product.is_nan() {
                    sum += product;
                    count += 1;
                }
            }
            if count == 0 { f64::NAN } else { sum / count as f64 }
        })
        .collect()
}

/// Mean products of records without gaps at some lags: each sum in the order of the record, several at a time.
fn whole(a: &[f64], b: &[f64], first: usize, lags: usize) -> impl Iterator<Item = f64> {
    let mut sums = [0.0; LANES];
    let later = b.get(first..).unwrap_or_default();
    let full = later.windows(LANES);
    let done = full.len();
    for (one, others) in a.iter().zip(full) {
        for (sum, other) in sums.iter_mut().zip(others) {
            *sum += one * other;
        }
    }
    // Near the end the later lags have no partner any more.
    for (place, one) in a.iter().enumerate().skip(done) {
        let others = later.get(place..).unwrap_or_default();
        for (sum, other) in sums.iter_mut().zip(others) {
            *sum += one * other;
        }
    }
    let pairs = later.len();
    (0..LANES.min(lags + 1 - first)).map(move |lane| {
        let count = pairs.saturating_sub(lane);
        if count == 0 { f64::NAN } else { sums[lane] / count as f64 }
    })
}

/// Covariance of a record with itself, at lags of 0, 1, ... steps up to `lags`.
pub fn auto(record: &Record, lags: usize) -> Vec<f64> {
    cross(record, record, lags)
}

/// The first lag at which nothing is left of an autocovariance.
pub fn first_lost(autocovariance: &[f64]) -> Option<usize> {
    autocovariance.iter().position(|value| value.is_nan() || *value <= 0.0)
}

/// An exponential of the lag that fits an autocovariance: variance and integral time, corrected for the mean that was
/// taken from the same record.
///
/// The mean of a finite record follows the air, and takes part of the variance away: `var(mean) = 2 T/t (1 - T/t (1 -
/// exp(-t/T)))` of it for a record of length `t` and an exponential of integral time `T` (Lenschow, Mann and Kristensen
/// 1994, eq. 14). That is not small where a record has ten integral times, and it lowers the autocovariance at every
/// lag alike.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exponential {
    /// Variance, without noise.
    pub variance: f64,
    /// Integral time, s.
    pub time_s: f64,
    /// Share of the variance that is in the mean of the record.
    pub in_mean: f64,
}

/// Share of the variance that the mean of a record of `length_s` has, of an exponential with this integral time.
pub fn share_in_mean(time_s: f64, length_s: f64) -> f64 {
    let ratio = time_s / length_s;
    2.0 * ratio * (1.0 - ratio * -(-1.0 / ratio).exp_m1())
}

/// The fastest exponential that is tried, steps of the record.
const FASTEST_STEPS: f64 = 0.3;
/// How much slower the next one is.
const SLOWER: f64 = 1.03;
/// At first only each so many-th is tried: what is left has one bottom. Numerical.
const COARSE: usize = 8;

impl Exponential {
    /// Fits lags from `from` on to the first at which nothing is left; `None` of what does not decay.
    pub fn fit(autocovariance: &[f64], step_s: f64, length_s: f64, from: usize) -> Option<Self> {
        let end = first_lost(autocovariance)?;
        // Beyond the first zero it is what one realisation happens to be.
        let used = autocovariance.get(from..end.max(from + 3)).filter(|used| used.len() >= 3)?;
        let fastest_s = FASTEST_STEPS * step_s;
        let mut shape = Vec::with_capacity(used.len());
        // What an exponential leaves unexplained, so many times slower than the fastest.
        let mut at = |slower: usize| {
            let time_s = fastest_s * SLOWER.powf(slower as f64);
            let share = share_in_mean(time_s, length_s);
            let each_lag = (-step_s / time_s).exp();
            let mut decayed = (-(from as f64) * step_s / time_s).exp();
            shape.clear();
            let (mut cross, mut square) = (0.0, 0.0);
            for value in used {
                let at_lag = decayed - share;
                shape.push(at_lag);
                cross += at_lag * value;
                square += at_lag.powi(2);
                decayed *= each_lag;
            }
            let variance = cross / square;
            let each = shape.iter().zip(used);
            let left: f64 = each.map(|(shape, value)| (value - variance * shape).powi(2)).sum();
            (variance > 0.0).then_some((left, slower, Self { variance, time_s, in_mean: share }))
        };
        let count = ((length_s / fastest_s).ln() / SLOWER.ln()).ceil().max(0.0) as usize;
        let mut least_of = |steps: &mut dyn Iterator<Item = usize>| {
            steps.filter_map(&mut at).min_by(|a, b| a.0.total_cmp(&b.0))
        };
        let (_, near, _) = least_of(&mut (0..count).step_by(COARSE))?;
        let around = near.saturating_sub(COARSE - 1)..count.min(near + COARSE);
        least_of(&mut around.into_iter()).map(|(_, _, found)| found)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn covariances_are_mean_products() {
        let a = Record::new(1.0, [1.0, 2.0, 3.0, 4.0].map(Some));
        // Anomalies -1.5, -0.5, 0.5, 1.5.
        assert_eq!(auto(&a, 2), [1.25, (0.75 - 0.25 + 0.75) / 3.0, (-0.75 - 0.75) / 2.0]);
        let b = Record::new(1.0, [Some(0.0), None, Some(2.0), Some(4.0)]);
        // Anomalies -2, -, 0, 2 with -1.5, -, 0.5, 1.5.
        assert_eq!(cross(&a, &b, 0), [(3.0 + 0.0 + 3.0) / 3.0]);
        assert!(cross(&a, &Record::new(0.5, [Some(1.0)]), 0)[0].is_nan());
        assert!(auto(&a, 7)[6].is_nan());
    }

    #[test]
    fn lags_side_by_side_are_those_one_by_one() {
        let value = |place: usize| (place as f64 * 1.7).sin() + 0.3 * (place as f64 * 0.31).cos();
        let a: Vec<f64> = (0..37).map(value).collect();
        let b: Vec<f64> = (50..87).map(value).collect();
        let by_hand = |lag: usize| {
            let sum = a.iter().zip(&b[lag.min(37)..]).fold(0.0, |sum, (a, b)| sum + a * b);
            sum / (37 - lag) as f64
        };
        let found = products(&a, &b, 40);
        assert_eq!(found.len(), 41);
        for (lag, found) in found.iter().enumerate() {
            if lag < 37 {
                assert_eq!(found.to_bits(), by_hand(lag).to_bits(), "{lag}");
            } else {
                assert!(found.is_nan(), "{lag}");
            }
        }
    }

    #[test]
    fn lags_until_nothing_is_left_are_the_first_of_all() {
        let all = |values: &[f64]| products(values, values, values.len() / 4);
        let is_first = |values: &[f64], most: usize| {
            let (found, all) = (products_until_lost(values, values.len() / 4), all(values));
            assert_eq!(found.len(), most);
            let equal = |(one, other): (&f64, &f64)| one.to_bits() == other.to_bits();
            assert!(found.iter().zip(&all).all(equal));
            assert_eq!(first_lost(&found), first_lost(&all));
        };
        // Waves that are lost after a quarter of 28 and of 200 steps; a gap; a slope that lasts.
        let wave =
            |steps: f64| move |place: usize| (place as f64 * std::f64::consts::TAU / steps).sin();
        is_first(&(0..400).map(wave(28.0)).collect::<Vec<f64>>(), AT_ONCE);
        is_first(&(0..400).map(wave(200.0)).collect::<Vec<f64>>(), 2 * AT_ONCE);
        let mut gap: Vec<f64> = (0..400).map(wave(28.0)).collect();
        gap[17] = f64::NAN;
        is_first(&gap, AT_ONCE);
        let slope: Vec<f64> = (0..400).map(|place| f64::from(place) - 200.0).collect();
        is_first(&slope, 101);
    }

    #[test]
    fn what_is_tried_roughly_first_is_the_best_of_all() {
        let (step_s, length_s) = (0.5, 300.0);
        for seed in 0..40_u32 {
            let time_s = 0.4 * 1.17_f64.powi(seed as i32 % 30);
            // An exponential with a wave of its own on it.
            let value = |lag: usize| {
                let by = lag as f64 * step_s;
                (-by / time_s).exp() - share_in_mean(time_s, length_s)
                    + 0.05 * (f64::from(seed) + by * (0.3 + 0.1 * f64::from(seed % 5))).sin()
            };
            let lags: Vec<f64> = (0..150).map(value).collect();
            let Some(found) = Exponential::fit(&lags, step_s, length_s, 1) else { continue };
            let used = &lags[1..first_lost(&lags).unwrap_or(lags.len()).max(4)];
            let left = |time_s: f64| {
                let share = share_in_mean(time_s, length_s);
                let shape = |lag: usize| (-(lag as f64 + 1.0) * step_s / time_s).exp() - share;
                let of = |of: &dyn Fn(usize, f64) -> f64| -> f64 {
                    used.iter().enumerate().map(|(lag, value)| of(lag, *value)).sum()
                };
                let square = of(&|lag, _| shape(lag).powi(2));
                let variance = of(&|lag, value| shape(lag) * value) / square;
                let left = of(&|lag, value| (value - variance * shape(lag)).powi(2));
                if variance > 0.0 { left } else { f64::INFINITY }
            };
            let count = ((length_s / (FASTEST_STEPS * step_s)).ln() / SLOWER.ln()).ceil() as i32;
            let all = (0..count).map(|slower| left(FASTEST_STEPS * step_s * SLOWER.powi(slower)));
            let least = all.fold(f64::INFINITY, f64::min);
            assert!(left(found.time_s) < least * (1.0 + 1e-9) + 1e-15, "{seed}: {found:?}");
        }
    }

    #[test]
    fn an_exponential_is_found_again() {
        let (time_s, length_s, variance) = (8.0, 120.0, 0.36);
        let share = share_in_mean(time_s, length_s);
        assert!((share - 2.0 * 8.0 / 120.0 * (1.0 - 8.0 / 120.0)).abs() < 1e-6);
        let all: Vec<f64> =
            (0..200).map(|k| variance * ((-f64::from(k) * 0.5 / time_s).exp() - share)).collect();
        let found = Exponential::fit(&all, 0.5, length_s, 1).unwrap();
        assert!((found.time_s / time_s - 1.0).abs() < 0.03, "{found:?}");
        assert!((found.variance / variance - 1.0).abs() < 0.02, "{found:?}");
        assert_eq!(Exponential::fit(&[1.0, -1.0], 1.0, 10.0, 0), None);
    }
}
