//! White noise of a record.

use crate::Record;
use crate::autocovariance::auto;

/// Lags that the autocovariance at lag 0 is told from.
const LAGS: usize = 5;

/// Variance of the white noise of a record: what its autocovariance has at lag 0 above that which the next lags lead to
/// along `R(0) - c lag^(2/3)`, the law of the inertial range (Lenschow, Wulfmeyer and Senff 2000); 0 where there is less.
/// `None` of a record with too few values.
///
/// Noise that is not white, as that of a position that is filtered, is not seen.
pub fn white(record: &Record) -> Option<f64> {
    let lags = auto(record, LAGS);
    if record.count() < 4 * LAGS || lags.iter().any(|value| value.is_nan()) {
        return None;
    }
    let points = (1..=LAGS).map(|lag| ((lag as f64).powf(2.0 / 3.0), lags[lag]));
    let count = LAGS as f64;
    let (x, y) =
        points.clone().fold((0.0, 0.0), |sum, (x, y)| (sum.0 + x / count, sum.1 + y / count));
    let square: f64 = points.clone().map(|(of, _)| (of - x).powi(2)).sum();
    let slope = points.map(|(of, at)| (of - x) * (at - y)).sum::<f64>() / square;
    let at_zero = y - slope.min(0.0) * x;
    Some((lags[0] - at_zero).clamp(0.0, lags[0].max(0.0)))
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
    }
}
