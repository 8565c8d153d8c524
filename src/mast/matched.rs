//! Agreement of two records of means at the same times.

use turbulence_statistics::{Record, moments};

use super::result::Matched;

/// Share of an average's seconds that both records must have.
const COVERED: f64 = 0.8;
/// Fewer pairs have a mean difference alone.
const FEWEST: usize = 3;

/// Agreement of `drones` with `mast`, value by value at steps of `step_s`; NaN: not known. `None` without a pair.
pub fn matched(
    drones: &[f64],
    mast: &[f64],
    step_s: f64,
    stated_se_mps: Option<f64>,
) -> Option<Matched> {
    let pairs: Vec<(f64, f64)> = drones
        .iter()
        .zip(mast)
        .map(|(drone, mast)| (*mast, *drone))
        .filter(|(mast, drone)| mast.is_finite() && drone.is_finite())
        .collect();
    let count = pairs.len();
    if count == 0 {
        return None;
    }
    let is_enough = count >= FEWEST;
    let n = count as f64;
    let mean = |of: &dyn Fn(&(f64, f64)) -> f64| pairs.iter().map(of).sum::<f64>() / n;
    let (mast_mean, drone_mean) = (mean(&|pair| pair.0), mean(&|pair| pair.1));
    let bias = drone_mean - mast_mean;
    let rms = mean(&|pair| (pair.1 - pair.0).powi(2)).sqrt();
    let sd = mean(&|pair| (pair.1 - pair.0 - bias).powi(2)).sqrt();
    let xx = mean(&|pair| (pair.0 - mast_mean).powi(2));
    let yy = mean(&|pair| (pair.1 - drone_mean).powi(2));
    let xy = mean(&|pair| (pair.0 - mast_mean) * (pair.1 - drone_mean));
    let slope = (is_enough && xx > 0.0).then(|| xy / xx);
    Some(Matched {
        count,
        mast_mean_mps: mast_mean,
        bias_mps: bias,
        bias_se_mps: is_enough.then(|| {
            let time_s = integral_s(drones, mast, step_s);
            // Few values have their mean taken off, which they are the nearer to.
            let independent = (1.0 / (n - 1.0)).max(2.0 * time_s / (n * step_s));
            sd * independent.sqrt()
        }),
        stated_se_mps,
        rms_mps: rms,
        sd_mps: sd,
        correlation: (is_enough && xx > 0.0 && yy > 0.0).then(|| xy / (xx * yy).sqrt()),
        slope,
        intercept_mps: slope.map(|slope| drone_mean - slope * mast_mean),
    })
}

/// Integral time of the differences, s.
fn integral_s(drones: &[f64], mast: &[f64], step_s: f64) -> f64 {
    let known = |value: f64| value.is_finite().then_some(value);
    let differences = drones.iter().zip(mast).map(|(drone, mast)| known(drone - mast));
    moments::variance(&Record::new(step_s, differences), 0.0, 0.0).map_or(0.0, |of| of.time_s)
}

/// Averages over blocks of `count` values; NaN where a fifth of one is missing.
pub fn averages(values: &[f64], count: usize) -> Vec<f64> {
    let mean = |block: &[f64]| {
        let known: Vec<f64> = block.iter().copied().filter(|value| value.is_finite()).collect();
        let enough = known.len() as f64 >= COVERED * count as f64;
        if enough { known.iter().sum::<f64>() / known.len() as f64 } else { f64::NAN }
    };
    values.chunks_exact(count.max(1)).map(mean).collect()
}

/// Shift of the mast's record at which the drones follow it best, s (positive: the drones are later), and the correlation
/// there; `None` where nothing correlates.
pub fn best_shift(drones: &[f64], mast: &[f64], step_s: f64, most_s: f64) -> Option<[f64; 2]> {
    let most = (most_s / step_s) as isize;
    let at = |shift: isize| {
        let shifted: Vec<f64> = (0..drones.len() as isize)
            .map(|index| usize::try_from(index - shift).ok())
            .map(|index| index.and_then(|index| mast.get(index)).copied().unwrap_or(f64::NAN))
            .collect();
        matched(drones, &shifted, step_s, None)?.correlation
    };
    (-most..=most)
        .filter_map(|shift| Some([shift as f64 * step_s, at(shift)?]))
        .max_by(|a, b| a[1].total_cmp(&b[1]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shifted_and_scaled_record_is_found_out() {
        let mast: Vec<f64> = (0..400).map(|k| (f64::from(k) / 15.0).sin()).collect();
        let drones: Vec<f64> =
            (0..400).map(|k| 0.2 + 0.9 * (f64::from(k - 7) / 15.0).sin()).collect();
        let [shift, correlation] = best_shift(&drones, &mast, 1.0, 30.0).unwrap();
        assert!(shift == 7.0 && correlation > 0.999, "{shift} {correlation}");
        let same: Vec<f64> = mast.iter().map(|w| 0.2 + 0.9 * w).collect();
        let found = matched(&same, &mast, 1.0, None).unwrap();
        assert!((found.slope.unwrap() - 0.9).abs() < 1e-9, "{found:?}");
        assert!((found.intercept_mps.unwrap() - 0.2).abs() < 1e-9, "{found:?}");
        assert!(
            (found.rms_mps.powi(2) - found.bias_mps.powi(2) - found.sd_mps.powi(2)).abs() < 1e-9
        );
    }

    #[test]
    fn gaps_are_no_values() {
        let with = [1.0, f64::NAN, 3.0, 4.0, 5.0];
        assert_eq!(averages(&with, 5), [3.25]);
        assert!(averages(&[1.0, f64::NAN, f64::NAN, 4.0], 4)[0].is_nan());
        let mast = [1.0, 2.0, f64::NAN, 4.0, 5.0];
        let found = matched(&with, &mast, 1.0, None).unwrap();
        assert_eq!((found.count, found.bias_mps), (3, 0.0));
        let one = matched(&with[..1], &mast, 1.0, None).unwrap();
        assert_eq!((one.count, one.bias_se_mps, one.correlation), (1, None, None));
        assert!(matched(&with[1..2], &mast, 1.0, None).is_none());
    }
}
