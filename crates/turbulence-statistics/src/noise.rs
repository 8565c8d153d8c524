//! White noise of a record, and what its steps have lost of the air.

use crate::Record;
use crate::autocovariance::auto;

/// Lags that the autocovariance at lag 0 is told from.
const LAGS: usize = 5;
/// Half the mean square difference of two moments in one step, of differences that grow as the power of two thirds, those
/// over a whole step being 1: `1/((2/3 + 1)(2/3 + 2)/2)`, less than the differences of means of neighbouring steps.
const WITHIN_STEP: f64 = 0.45;

/// The fastest part of a record of means over its steps.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Fastest {
    /// Variance of the white noise of one value.
    pub noise: f64,
    /// Variance of the air that the means over the steps have lost.
    pub lost: f64,
}

impl Fastest {
    /// Variance that the record has too much: noise less what was lost; negative where more was lost.
    pub fn too_much(&self) -> f64 {
        self.noise - self.lost
    }
}

/// The fastest part of a record whose values are means over its steps. `None` of a record with too few values.
///
/// Air alone has the variance which the autocovariance of the next lags leads to along `R(0) - c lag^(2/3)`, the law of the
/// inertial range (Lenschow, Wulfmeyer and Senff 2000). Means over steps of length `h` have `0.45 c h^(2/3)` less of it, and
/// white noise besides. A step must be short against the eddies.
///
/// Noise that is not white, as that of a position that is filtered, is not seen.
pub fn of_means(record: &Record) -> Option<Fastest> {
    let (at_zero, falls, measured) = towards_zero(record, of_means_at)?;
    let lost = WITHIN_STEP * falls;
    Some(Fastest { noise: (measured - (at_zero - lost)).clamp(0.0, measured.max(0.0)), lost })
}

/// Variance of the white noise of a record whose values are those of instants: what its autocovariance has at lag 0 above
/// that which the next lags lead to along `R(0) - c lag^(2/3)`; 0 where there is less. `None` of a record with too few
/// values.
pub fn white(record: &Record) -> Option<f64> {
    let (at_zero, _, measured) = towards_zero(record, |lag| lag.powf(2.0 / 3.0))?;
    Some((measured - at_zero).clamp(0.0, measured.max(0.0)))
}

/// Half the mean square difference of means over steps that are so many steps apart, as [`WITHIN_STEP`] is for 0.
fn of_means_at(lag: f64) -> f64 {
    const POWER: f64 = 2.0 / 3.0 + 2.0;
    let of = |apart: f64| apart.abs().powf(POWER);
    (of(lag + 1.0) - 2.0 * of(lag) + of(lag - 1.0)) / (POWER * (POWER - 1.0))
}

/// The autocovariance that the lags next to 0 lead to, how much it falls by with `shape` of a step, and what it is.
fn towards_zero(record: &Record, shape: impl Fn(f64) -> f64) -> Option<(f64, f64, f64)> {
    let lags = auto(record, LAGS);
    if record.count() < 4 * LAGS || lags.iter().any(|value| value.is_nan()) {
        return None;
    }
    let points = (1..=LAGS).map(|lag| (shape(lag as f64), lags[lag]));
    let count = LAGS as f64;
    let (x, y) =
        points.clone().fold((0.0, 0.0), |sum, (x, y)| (sum.0 + x / count, sum.1 + y / count));
    let square: f64 = points.clone().map(|(of, _)| (of - x).powi(2)).sum();
    let slope = points.map(|(of, at)| (of - x) * (at - y)).sum::<f64>() / square;
    let falls = (-slope).max(0.0);
    Some((y + falls * x, falls, lags[0]))
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng as _;
    use rand_distr::{Distribution as _, StandardNormal};

    use super::*;

    #[test]
    fn noise_is_found_and_air_is_none() {
        let mut random = rand_pcg::Pcg64::seed_from_u64(1);
        let mut draw = || -> f64 { StandardNormal.sample(&mut random) };
        let mut air = 0.0;
        let mut clean = Vec::new();
        for _ in 0..40_000 {
            air = 0.998 * air + 0.063 * draw();
            clean.push(Some(air));
        }
        let noisy: Vec<_> =
            clean.iter().map(|value| value.map(|value| value + 0.3 * draw())).collect();
        let of = |values: &[Option<f64>]| white(&Record::new(0.25, values.to_vec())).unwrap();
        // A Markov process, which falls along a straight line, is rougher than turbulence: a hundredth of its variance.
        assert!(of(&clean) < 0.01, "{}", of(&clean));
        assert!((of(&noisy) - of(&clean) - 0.09).abs() < 0.01, "{}", of(&noisy));
        assert_eq!(white(&Record::new(1.0, [Some(1.0); 5])), None);
        assert_eq!(of_means(&Record::new(1.0, [Some(1.0); 5])), None);
    }

    #[test]
    fn means_that_are_far_apart_differ_as_moments_do() {
        assert!((of_means_at(0.0) - WITHIN_STEP).abs() < 1e-12);
        assert!((of_means_at(4.0) / 4f64.powf(2.0 / 3.0) - 1.0).abs() < 0.002);
        // ((2^(8/3) - 2)/(40/9)
        assert!((of_means_at(1.0) - 0.978_66).abs() < 1e-4, "{}", of_means_at(1.0));
    }
}
