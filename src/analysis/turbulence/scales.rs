//! Integral time of the air at the drones.

use turbulence_statistics::Record;
use turbulence_statistics::autocovariance::Exponential;

use super::pairs::coarse;
use super::result::Interval;
use crate::numeric::mean;

/// Parts of the record that are left out in turn.
const PARTS: usize = 8;
/// Lags reach to this share of the record.
const LAGS_SHARE: f64 = 0.25;
/// Half the width of a normal 95 % interval, standard errors.
const NORMAL: f64 = 1.96;

/// Sums of products of anomalies by lag, of all drones, over one part of the record.
#[derive(Clone, Default)]
struct Sums {
    sum: Vec<f64>,
    count: Vec<f64>,
}

/// Integral time of the exponential that fits the mean autocovariance of all records, with the error that leaving out an
/// eighth of the record in turn shows; `None` where nothing decays.
pub(super) fn integral_time(records: &[&Record]) -> Option<Interval> {
    let coarse: Vec<Record> = records.iter().map(|record| coarse(record)).collect();
    let count = coarse.iter().map(Record::len).max()?;
    let step_s = coarse.first()?.step_s();
    let lags = (LAGS_SHARE * count as f64) as usize;
    let mut parts = vec![Sums { sum: vec![0.0; lags + 1], count: vec![0.0; lags + 1] }; PARTS];
    for record in &coarse {
        let anomalies = record.anomalies();
        let values = anomalies.values();
        for (index, one) in values.iter().enumerate().filter(|(_, one)| !one.is_nan()) {
            let Some(part) = parts.get_mut(index * PARTS / count) else { continue };
            let later = values.iter().skip(index).take(lags + 1).enumerate();
            for (lag, other) in later.filter(|(_, other)| !other.is_nan()) {
                part.sum[lag] += one * other;
                part.count[lag] += 1.0;
            }
        }
    }
    let known = mean(coarse.iter().map(|record| record.count() as f64))? * step_s;
    let fit = |without: Option<usize>| {
        let over = |lag: usize, of: fn(&Sums) -> &[f64]| {
            let used = parts.iter().enumerate().filter(|(part, _)| Some(*part) != without);
            used.map(|(_, part)| of(part)[lag]).sum::<f64>()
        };
        let at = |lag: usize| over(lag, |part| &part.sum) / over(lag, |part| &part.count);
        let covariances: Vec<f64> = (0..=lags).map(at).collect();
        // Lag 0 has the noise.
        Some(Exponential::fit(&covariances, step_s, known, 1)?.time_s)
    };
    let value = fit(None)?;
    let without: Option<Vec<f64>> = (0..PARTS).map(|part| fit(Some(part))).collect();
    let logs: Vec<f64> = without?.iter().map(|time| time.ln()).collect();
    let centre = mean(logs.iter())?;
    let squares: f64 = logs.iter().map(|log| (log - centre).powi(2)).sum();
    let width = NORMAL * ((PARTS - 1) as f64 / PARTS as f64 * squares).sqrt();
    Some(Interval { value, low: value * (-width).exp(), high: value * width.exp() })
}
