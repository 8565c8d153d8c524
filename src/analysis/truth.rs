//! Comparison of a map with the true air.

use super::budget::TruthCheck;
use super::kriging::Best;
use super::level::LevelledMap;
use super::posterior::half_mps;
use super::result::DroneUpdraft;
use crate::numeric::rms;

/// Compares the posterior with the truth; `None` where either is not known.
pub(super) fn check_posterior(drones: &[DroneUpdraft]) -> Option<TruthCheck> {
    let posterior = |drone: &DroneUpdraft| {
        let known = drone.posterior_mps.iter().zip(&drone.posterior_sd_mps);
        let interval = |(mean, sd): (&Option<f64>, &Option<f64>)| {
            let (mean, half) = ((*mean)?, half_mps((*sd)?));
            Some([mean - half, mean + half])
        };
        let mean = drone.posterior_mean;
        DroneUpdraft {
            updraft_mps: drone.posterior_mps.clone(),
            interval_mps: known.map(interval).collect(),
            mean_interval_mps: mean
                .map(|mean| [mean.value - half_mps(mean.se), mean.value + half_mps(mean.se)]),
            truth_mps: drone.truth_mps.clone(),
            ..drone.clone()
        }
    };
    check(&drones.iter().map(posterior).collect::<Vec<_>>())
}

/// Root mean square errors of the best linear estimate and of the posterior at the same places and seconds, m/s;
/// `drones` are places in the map by the index that the estimate gives them.
pub(super) fn at_limit(map: &[DroneUpdraft], drones: &[usize], best: &[Best]) -> Option<[f64; 2]> {
    let (mut limit, mut own) = (Vec::new(), Vec::new());
    for one in best {
        let Some(drone) = drones.get(one.drone).and_then(|index| map.get(*index)) else { continue };
        let truth = drone.truth_at(one.second);
        let found = drone.posterior_mps.get(one.second).copied().flatten();
        let Some((truth, found)) = truth.zip(found) else { continue };
        limit.push(one.updraft_mps - truth);
        own.push(found - truth);
    }
    Some([rms(limit)?, rms(own)?])
}

/// Share of a drone's values that have a truth, below which its mean is not compared with one of other seconds.
const COVERED: f64 = 0.8;

/// Compares the estimates of a map with a fitted level with the truth, where the truth did not set the level: the mean over
/// the zero stretch is zero by what was asked for. Means over the hover have that stretch in them, and are not compared.
pub(super) fn check_levelled(
    drones: &[DroneUpdraft],
    levelled: &LevelledMap,
    times_s: &[i64],
) -> Option<TruthCheck> {
    if levelled.zero_s.is_none() {
        return check(drones);
    }
    let outside = |drone: &DroneUpdraft| {
        let values = drone.updraft_mps.iter().zip(times_s);
        DroneUpdraft {
            updraft_mps: values
                .map(|(value, time_s)| value.filter(|_| levelled.is_outside(*time_s as f64)))
                .collect(),
            mean_interval_mps: None,
            ..drone.clone()
        }
    };
    check(&drones.iter().map(outside).collect::<Vec<_>>())
}

/// Compares estimates with the truth; `None` where the truth is not known.
pub(super) fn check(drones: &[DroneUpdraft]) -> Option<TruthCheck> {
    let mut check = TruthCheck::default();
    let (mut sum, mut squares, mut true_squares) = (0.0, 0.0, 0.0);
    let (mut inside, mut intervals) = (0_usize, 0_usize);
    let (mut means_inside, mut means) = (0_usize, 0_usize);
    for drone in drones {
        let Some(truth) = &drone.truth_mps else { continue };
        let (mut true_sum, mut values) = (0.0, 0_usize);
        for (index, (estimate, truth)) in drone.updraft_mps.iter().zip(truth).enumerate() {
            let (Some(estimate), Some(truth)) = (estimate, truth) else { continue };
            let error = estimate - truth;
            sum += error;
            squares += error * error;
            true_sum += truth;
            true_squares += truth * truth;
            values += 1;
            if let Some(Some([low, high])) = drone.interval_mps.get(index) {
                intervals += 1;
                inside += usize::from((*low..=*high).contains(truth));
            }
        }
        if values == 0 {
            continue;
        }
        check.drones += 1;
        check.values += values;
        let estimates = drone.updraft_mps.iter().flatten().count();
        let is_covered = values as f64 >= COVERED * estimates as f64;
        if let Some([low, high]) = drone.mean_interval_mps.filter(|_| is_covered) {
            means += 1;
            means_inside += usize::from((low..=high).contains(&(true_sum / values as f64)));
        }
    }
    if check.values == 0 {
        return None;
    }
    let n = check.values as f64;
    let share = |count: usize, of: usize| (of > 0).then(|| count as f64 / of as f64);
    check.bias_mps = sum / n;
    check.rms_mps = (squares / n).sqrt();
    check.zero_rms_mps = (true_squares / n).sqrt();
    check.rms_without_bias_mps = (squares / n - check.bias_mps.powi(2)).max(0.0).sqrt();
    check.inside_share = share(inside, intervals);
    check.means_inside_share = share(means_inside, means);
    Some(check)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::law::LawOf;

    fn drone(updraft_mps: Vec<Option<f64>>, truth_mps: Option<Vec<f64>>) -> DroneUpdraft {
        let interval = |value: &Option<f64>| value.map(|value| [value - 0.15, value + 0.15]);
        let truth_mps = truth_mps.map(|truth| {
            truth.into_iter().map(|value| value.is_finite().then_some(value)).collect()
        });
        DroneUpdraft {
            slot: Some(1),
            name: String::new(),
            position_m: None,
            track_m: Vec::new(),
            height_m: 100.0,
            mapping: LawOf::Own,
            mean: crate::base::estimate::Estimate::new(0.0, 0.1),
            mean_interval_mps: Some([0.0, 0.3]),
            errors: super::super::budget::ErrorBudget::default(),
            systematic_mps: 0.0,
            tilt_deg: 0.0,
            interval_mps: updraft_mps.iter().map(interval).collect(),
            updraft_mps,
            sd_mps: Vec::new(),
            posterior_mps: Vec::new(),
            posterior_sd_mps: Vec::new(),
            posterior_mean: None,
            quality: Vec::new(),
            truth_mps,
            place: None,
            wind: None,
        }
    }

    #[test]
    fn counts_what_is_there_and_known() {
        let values = vec![Some(0.2), Some(0.4), None, Some(0.3)];
        let found = check(&[
            drone(values.clone(), Some(vec![0.1, 0.2, 9.0, 0.3])),
            drone(values, None),
            drone(vec![None; 4], Some(vec![0.0; 4])),
        ])
        .unwrap();
        assert_eq!((found.drones, found.values), (1, 3));
        assert!((found.bias_mps - 0.1).abs() < 1e-12);
        assert!((found.rms_mps - (0.05_f64 / 3.0).sqrt()).abs() < 1e-12);
        assert!((found.zero_rms_mps - (0.14_f64 / 3.0).sqrt()).abs() < 1e-12);
        assert!((found.inside_share.unwrap() - 2.0 / 3.0).abs() < 1e-12);
        assert_eq!(found.means_inside_share, Some(1.0), "0.2 is in 0.0 to 0.3");
        assert_eq!(check(&[drone(vec![Some(1.0)], None)]), None);
    }

    #[test]
    fn seconds_without_truth_are_not_compared_and_the_others_are() {
        let truth = vec![0.1, f64::NAN, f64::NAN, 0.3];
        let found = check(&[drone(vec![Some(0.2); 4], Some(truth))]).unwrap();
        assert_eq!((found.drones, found.values), (1, 2));
        assert!((found.rms_mps - 0.1).abs() < 1e-12, "{found:?}");
        assert_eq!(found.means_inside_share, None, "the mean is one of other seconds");
    }

    #[test]
    fn what_set_the_zero_is_not_held_against_it() {
        let levelled = LevelledMap { zero_s: Some([0.0, 20.0]), ..LevelledMap::default() };
        let times_s: Vec<i64> = vec![10, 24, 25, 26];
        let own = [drone(vec![Some(0.2); 4], Some(vec![9.0, 9.0, 0.3, 0.4]))];
        let found = check_levelled(&own, &levelled, &times_s).unwrap();
        assert_eq!((found.values, found.inside_share), (2, Some(0.5)));
        assert!((found.bias_mps + 0.15).abs() < 1e-12, "{found:?}");
        assert_eq!(found.means_inside_share, None);
        let whole = check_levelled(&own, &LevelledMap::default(), &times_s).unwrap();
        assert_eq!(whole.values, 4);
    }
}
