//! Variances, covariances and skewness of records, with random and systematic errors.

use crate::Record;
use crate::autocovariance::{
    Exponential, first_lost, products, products_until_lost, share_in_mean,
};
use crate::quantile::{WIDTH, of_variance, scaled};

/// Lags that enter errors reach to this share of a record.
const LAGS_SHARE: f64 = 0.25;
/// Fewer values have no moments.
const FEWEST: usize = 16;

/// A moment with its errors.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct Moment {
    /// Value, corrected for noise and for what the record's mean takes.
    pub value: f64,
    /// Ends of the 95 % interval: sampling, and the scale of the instrument.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// Random error of one record, a standard deviation.
    pub random: f64,
    /// What the record's mean took away and was added again.
    pub systematic: f64,
    /// Integral time of the fluctuations, s; 0 where none was found.
    pub time_s: f64,
}

/// A record with its autocovariance, which all of its moments and pairs ask for.
pub(crate) struct Known {
    step_s: f64,
    /// NaN in gaps.
    anomalies: Vec<f64>,
    count: usize,
    /// Autocovariance with noise, at the lags that enter errors, or at the first of them until nothing is left.
    lags: Vec<f64>,
}

impl Known {
    /// Of one record, whose moments need no lags beyond the first at which nothing is left. `None` with too few values.
    pub(crate) fn of(record: &Record) -> Option<Self> {
        Self::with_lags(record, products_until_lost)
    }

    /// Of one of several records, which have something in common beyond that, too.
    fn of_several(record: &Record) -> Option<Self> {
        Self::with_lags(record, |anomalies, most| products(anomalies, anomalies, most))
    }

    fn with_lags(record: &Record, lags: impl Fn(&[f64], usize) -> Vec<f64>) -> Option<Self> {
        let count = record.count();
        if count < FEWEST {
            return None;
        }
        let anomalies = record.anomalies().values().to_vec();
        let most = (LAGS_SHARE * record.len() as f64) as usize;
        let lags = lags(&anomalies, most);
        Some(Self { step_s: record.step_s(), anomalies, count, lags })
    }

    fn length_s(&self) -> f64 {
        self.count as f64 * self.step_s
    }

    /// Autocovariance of the air alone, until it is lost, and the exponential that it follows.
    fn of_air(&self, noise: f64) -> (Vec<f64>, Option<Exponential>) {
        let mut lags = self.lags.clone();
        lags[0] -= noise;
        let fitted = Exponential::fit(&lags, self.step_s, self.length_s(), 1);
        let taken = fitted.map_or(0.0, |fitted| fitted.in_mean * fitted.variance);
        let end = first_lost(&lags).unwrap_or(lags.len());
        lags.truncate(end.max(1));
        for value in &mut lags {
            *value += taken;
        }
        (lags, fitted)
    }

    fn variance(&self, noise: f64, scale_se: f64) -> Moment {
        let (lags, fitted) = self.of_air(noise);
        let value = lags[0].max(0.0);
        let taken = fitted.map_or(0.0, |fitted| fitted.in_mean * fitted.variance);
        // Noise is in the scatter of what was measured, too.
        let measured = |lag: usize| lags[lag] + if lag == 0 { noise } else { 0.0 };
        let mut random2 = 2.0 * of_mean(self.count as f64, lags.len(), |lag| measured(lag).powi(2));
        if let Some(fitted) = fitted {
            // Where one realisation happens to be lost early, its exponential goes on: a record that knows only few
            // eddies must not believe in many.
            let model = expected(fitted.time_s, self.length_s()).variance;
            random2 = random2.max((model * value).powi(2));
        }
        // What the mean takes away varies as a variance with one degree of freedom.
        random2 += 2.0 * taken.powi(2);
        let time_s = fitted.map_or(0.0, |fitted| fitted.time_s);
        Moment::of_variance(value, random2.sqrt(), scale_se, (taken, time_s))
    }

    /// Covariances with later parts of another and of another with later parts of this, up to so many lags.
    pub(crate) fn with(&self, other: &Self, lags: usize) -> [Vec<f64>; 2] {
        let (a, b) = (&self.anomalies, &other.anomalies);
        [products(a, b, lags), products(b, a, lags)]
    }

    /// Covariance with another at lag 0, and by lag as [`Known::with`] has them, up to `lags` or as many as errors need.
    pub(crate) fn covariance(
        &self,
        other: &Self,
        lags: usize,
        scale_se: f64,
    ) -> Option<(Moment, [Vec<f64>; 2])> {
        let pairs = self.anomalies.iter().zip(&other.anomalies);
        let both = pairs.filter(|(a, b)| !(*a * *b).is_nan()).count();
        if both < FEWEST || (self.step_s - other.step_s).abs() > 1e-9 * self.step_s {
            return None;
        }
        let end = |of: &Self| first_lost(&of.lags).unwrap_or(of.lags.len());
        let until = end(self).min(end(other)).max(1);
        let [later, earlier] = self.with(other, lags.max(until - 1));
        let value = later[0];
        let product = |lag: usize| self.lags[lag] * other.lags[lag] + later[lag] * earlier[lag];
        let random2 = of_mean(both as f64, until, product).max(0.0);
        let fitted = Exponential::fit(&self.lags, self.step_s, self.length_s(), 1);
        let time_s = fitted.map_or(0.0, |fitted| fitted.time_s);
        // The two means take of the covariance what each takes of its variance.
        let share = fitted.map_or(0.0, |fitted| fitted.in_mean).min(0.5);
        let systematic = value * share / (1.0 - share);
        let value = value + systematic;
        let random = random2.sqrt() / (1.0 - share);
        let width = WIDTH * random.hypot(value * scale_se);
        let (low, high) = (value - width, value + width);
        Some((Moment { value, low, high, random, systematic, time_s }, [later, earlier]))
    }

    /// Covariance of the variances of two records: `2/n` times the sum of their squared covariance over lags of either
    /// sign, less what the estimates of that scatter by.
    fn shared(&self, other: &Self, lags: usize) -> f64 {
        let count = self.count.min(other.count) as f64;
        let [later, earlier] = self.with(other, lags);
        let lags = lags.min(self.lags.len()).min(other.lags.len());
        let scatter = of_mean(count, lags, |lag| self.lags[lag] * other.lags[lag]);
        let both = later.iter().chain(earlier.iter().skip(1));
        let known = both.filter(|value| !value.is_nan());
        2.0 * known.map(|value| value.powi(2) - scatter).sum::<f64>() / count
    }
}

impl Moment {
    /// A variance with the interval that its random error gives, a relative error of the scale of values, and what the
    /// record's mean took of it with the integral time.
    pub fn of_variance(
        value: f64,
        random: f64,
        scale_se: f64,
        (systematic, time_s): (f64, f64),
    ) -> Self {
        let interval = if value > 0.0 && random > 0.0 {
            of_variance(value, 2.0 * (value / random).powi(2))
        } else {
            [0.0, value + WIDTH * random]
        };
        let [low, high] = scaled(value, interval, 2.0 * scale_se);
        Self { value, low, high, random, systematic, time_s }
    }
}

/// Variance of the mean of products whose covariances at a lag is `of(lag)`, over a record of so many values.
fn of_mean(count: f64, lags: usize, of: impl Fn(usize) -> f64) -> f64 {
    let later: f64 = (1..lags).map(|lag| (1.0 - lag as f64 / count).max(0.0) * of(lag)).sum();
    (of(0) + 2.0 * later) / count
}

/// Variance of a record, (m/s)²; `noise` is the variance of its white noise, less what means over its steps have lost
/// ([`Fastest::too_much`](crate::noise::Fastest::too_much)), `scale_se` the relative standard error of the instrument's
/// scale (0.03: all values are known to 3 %). `None` of a record with fewer than 16 values.
///
/// The random error is that of a Gaussian process with the record's autocovariance; the interval is that of a chi-squared
/// distribution with the degrees of freedom which give this error.
pub fn variance(record: &Record, noise: f64, scale_se: f64) -> Option<Moment> {
    Some(Known::of(record)?.variance(noise, scale_se))
}

/// Mean variance of several records of the same air and length, as of drones that fly side by side, (m/s)², with the error
/// of the mean: records that see the same eddies are not independent, which their covariances tell. `noise` is that of
/// each record. `None` where no record has a variance.
pub fn mean_variance(records: &[&Record], noise: &[f64], scale_se: f64) -> Option<Moment> {
    let own: Vec<(Known, Moment)> = records
        .iter()
        .zip(noise)
        .filter_map(|(record, noise)| {
            let known = Known::of_several(record)?;
            let moment = known.variance(*noise, 0.0);
            Some((known, moment))
        })
        .collect();
    let count = own.len() as f64;
    let mean =
        |of: &dyn Fn(&Moment) -> f64| own.iter().map(|(_, own)| of(own)).sum::<f64>() / count;
    let lags = own.iter().map(|(known, _)| known.of_air(0.0).0.len()).max()?;
    let independent: f64 = own.iter().map(|(_, own)| own.random.powi(2)).sum();
    let mut random2 = independent;
    for (i, (one, _)) in own.iter().enumerate() {
        for (other, _) in &own[i + 1..] {
            random2 += 2.0 * one.shared(other, lags);
        }
    }
    // Never better than records that know nothing of each other would be, nor worse than one.
    let worst = (count * mean(&|own| own.random)).powi(2);
    let random = random2.clamp(independent.min(worst), worst).sqrt() / count;
    let rest = (mean(&|own| own.systematic), mean(&|own| own.time_s));
    Some(Moment::of_variance(mean(&|own| own.value), random, scale_se, rest))
}

/// Covariance of two records of the same steps, (m/s)²; `None` where they have too little in common. `scale_se` is the
/// relative standard error of the product of their scales.
pub fn covariance(a: &Record, b: &Record, scale_se: f64) -> Option<Moment> {
    Known::of(a)?.covariance(&Known::of(b)?, 0, scale_se).map(|(moment, _)| moment)
}

/// Skewness of a record: its third central moment by the 3/2 power of its variance without noise (white noise has no
/// third moment of its own). The random error is that of a Gaussian process; `None` where there is no variance.
pub fn skewness(record: &Record, noise: f64) -> Option<Moment> {
    let (lags, fitted) = Known::of(record)?.of_air(noise);
    let value2 = lags[0];
    if value2 <= 0.0 {
        return None;
    }
    let anomalies = record.anomalies();
    let third = anomalies.known().map(|value| value.powi(3)).sum::<f64>() / record.count() as f64;
    let value = third / value2.powf(1.5);
    // Of a Gaussian process: cov(x³, x³) = 9 R0² R + 6 R³, less what the mean takes (9 R0² R).
    let of = |lag: usize| 6.0 * lags[lag].powi(3);
    let random = (of_mean(record.count() as f64, lags.len(), of) / value2.powi(3)).max(0.0).sqrt();
    let width = WIDTH * random;
    let time_s = fitted.map_or(0.0, |fitted| fitted.time_s);
    Some(Moment { value, low: value - width, high: value + width, random, systematic: 0.0, time_s })
}

/// Errors that a record of this length has before it is flown (Lenschow, Mann and Kristensen 1994), relative to the
/// standard deviation (of the mean) or to the variance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Expected {
    /// Random error of the mean, standard deviations of the air.
    pub mean: f64,
    /// Random error of the variance, relative.
    pub variance: f64,
    /// Systematic error of the variance before it is corrected, relative.
    pub lost: f64,
}

/// Expected errors of fluctuations with an exponential autocovariance.
pub fn expected(time_s: f64, length_s: f64) -> Expected {
    let lost = share_in_mean(time_s, length_s).min(1.0);
    // The square of an exponential has half its integral time.
    let variance = (2.0 * share_in_mean(0.5 * time_s, length_s)).sqrt();
    Expected { mean: lost.sqrt(), variance, lost }
}

/// Length of a record whose variance has this relative random error, s.
pub fn length_for_variance_s(time_s: f64, relative: f64) -> f64 {
    2.0 * time_s / relative.powi(2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn expected_errors_are_those_of_lenschow() {
        // T = 10 s, t = 2000 s: (2 T/t)^(1/2) of the variance, 2 T/t lost.
        let Expected { mean, variance, lost } = expected(10.0, 2000.0);
        assert!((variance - (2.0f64 * 10.0 / 2000.0).sqrt()).abs() < 2e-4, "{variance}");
        assert!((lost - 0.01).abs() < 1e-4 && (mean - 0.1).abs() < 1e-3);
        assert!((length_for_variance_s(10.0, 0.1) - 2000.0).abs() < 1e-9);
    }

    #[test]
    fn little_has_no_moments() {
        let short = Record::new(1.0, [Some(1.0); 15]);
        assert_eq!(variance(&short, 0.0, 0.0), None);
        assert_eq!(covariance(&short, &short, 0.0), None);
        let still = Record::new(1.0, [Some(1.0); 60]);
        assert_eq!(skewness(&still, 0.0), None);
        let none = variance(&still, 0.0, 0.0).unwrap();
        assert!(none.value == 0.0 && none.low == 0.0, "{none:?}");
    }
}
