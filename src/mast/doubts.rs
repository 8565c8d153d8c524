//! Sentences about a mast's record that is not what it seems: gaps, a wrong sign, another place.

use super::result::{MastFlight, Matched};
use crate::flight::Series;

/// Missing share of a record that is told.
const GAPS: f64 = 0.05;
/// Means that come further apart than this many of their lengths leave air out.
const APART: f64 = 1.2;
/// Further away a mast stands in other air, m.
const FAR_M: f64 = 500.0;
/// A correlation below zero by this many of its standard errors is told.
const SURE: f64 = 3.0;
/// Fewer independent values say nothing of a sign,
const FEWEST_INDEPENDENT: f64 = 6.0;
/// but for a correlation like this of one eddy, second by second.
const MIRRORED: f64 = -0.8;
/// Fewer values do not follow an eddy.
const FEWEST_OF_EDDY: usize = 30;

/// Doubts about the times of a record: `step_s` between its values, `mean_s` the duration of each.
pub(super) fn of_times(w: &Series, step_s: f64, mean_s: f64) -> Vec<String> {
    let mut doubts = Vec::new();
    let (from_s, to_s) = w.span().unwrap_or_default();
    let expected = (to_s - from_s) / step_s + 1.0;
    let missing = 1.0 - w.value.len() as f64 / expected;
    if missing > GAPS {
        doubts.push(format!(
            "{:.0} % of the mast's values of w between its first and its last are missing (longest stretch {:.0} s)",
            100.0 * missing,
            w.longest_gap_s(from_s, to_s)
        ));
    }
    if mean_s.is_finite() && step_s > APART * mean_s {
        doubts.push(format!(
            "means of the mast are over {mean_s:.0} s and come every {step_s:.0} s: the air between is in none of them"
        ));
    }
    doubts
}

/// Takes out variances below zero; a sentence if there are any.
pub(super) fn negative(variance: &mut Series) -> Option<String> {
    let keep: Vec<bool> = variance.value.iter().map(|value| *value >= 0.0).collect();
    let left_out = keep.iter().filter(|keep| !**keep).count();
    if left_out == 0 {
        return None;
    }
    for values in [&mut variance.time_s, &mut variance.value] {
        let mut keep = keep.iter();
        values.retain(|_| *keep.next().unwrap_or(&true));
    }
    Some(format!(
        "{left_out} variances of w at the mast are below zero, which none is, and are left out"
    ))
}

/// Doubts about a flight beside the mast.
pub(super) fn of_flight(flight: &MastFlight) -> Vec<String> {
    let distances = flight.drones.iter().filter_map(|drone| drone.distance_m);
    let nearest_m = distances.fold(f64::INFINITY, f64::min);
    let far = (nearest_m.is_finite() && nearest_m > FAR_M).then(|| {
        let distance = if nearest_m < 9_950.0 {
            format!("{:.1} km", nearest_m / 1000.0)
        } else {
            format!("{:.0} km", nearest_m / 1000.0)
        };
        format!(
            "{}: the nearest drone is {distance} from the mast: they met other eddies, and what differs is not the drones' \
             error",
            flight.flight
        )
    });
    let sign = is_mirrored(&flight.fleet).then(|| {
        format!(
            "{}: the mast's w falls where the drones' rises (correlation {:.2}): is it positive downwards? A mapping has \
             scale = -1.0 for that",
            flight.flight,
            flight.fleet.correlation.unwrap_or_default()
        )
    });
    far.into_iter().chain(sign).collect()
}

/// Whether a correlation is below zero, for sure or almost -1; independent values by the error of the mean difference.
fn is_mirrored(matched: &Matched) -> bool {
    let Some((correlation, bias_se)) = matched.correlation.zip(matched.bias_se_mps) else {
        return false;
    };
    if matched.count >= FEWEST_OF_EDDY && correlation < MIRRORED {
        return true;
    }
    let independent = (matched.sd_mps / bias_se).powi(2);
    let bounded = correlation.clamp(-0.999, 0.999);
    independent >= FEWEST_INDEPENDENT && bounded.atanh() * (independent - 3.0).sqrt() < -SURE
}

#[cfg(test)]
mod tests {
    use super::*;

    fn series(times: impl Iterator<Item = f64>, value: f64) -> Series {
        let time_s: Vec<f64> = times.collect();
        Series { value: vec![value; time_s.len()], time_s }
    }

    #[test]
    fn gaps_and_means_apart_are_told() {
        let all = || (0..100).map(f64::from);
        assert!(of_times(&series(all(), 0.1), 1.0, 1.0).is_empty());
        let holes = series(all().filter(|at| !(30.0..50.0).contains(at)), 0.1);
        let told = of_times(&holes, 1.0, 1.0);
        assert!(told[0].starts_with("20 % of") && told[0].contains("stretch 21 s"), "{told:?}");
        let slow = series((0..10).map(|k| 600.0 * f64::from(k)), 0.1);
        let told = of_times(&slow, 600.0, 300.0);
        assert!(told.len() == 1 && told[0].contains("over 300 s and come every 600 s"), "{told:?}");
    }

    #[test]
    fn variances_below_zero_are_counted() {
        let mut variance = series((0..4).map(f64::from), 0.2);
        assert!(negative(&mut variance).is_none());
        variance.value[1] = -0.1;
        variance.value[2] = 0.0;
        assert!(negative(&mut variance).unwrap().starts_with("1 variances of w"));
        assert_eq!((variance.value, variance.time_s), (vec![0.2, 0.0, 0.2], vec![0.0, 2.0, 3.0]));
    }

    #[test]
    fn a_mirror_is_told_where_it_is_sure() {
        let matched = |correlation: f64, bias_se: f64| Matched {
            count: 300,
            mast_mean_mps: 0.0,
            bias_mps: 0.0,
            bias_se_mps: Some(bias_se),
            stated_se_mps: None,
            rms_mps: 0.5,
            sd_mps: 0.5,
            correlation: Some(correlation),
            slope: None,
            intercept_mps: None,
        };
        assert!(is_mirrored(&matched(-0.9, 0.1)));
        assert!(is_mirrored(&matched(-1.0, 0.1)));
        assert!(!is_mirrored(&matched(-0.4, 0.1)), "25 values");
        assert!(is_mirrored(&matched(-0.9, 0.4)), "one eddy, mirrored");
        assert!(!is_mirrored(&matched(-0.7, 0.4)), "two values");
        let few = Matched { count: 5, ..matched(-0.9, 0.4) };
        assert!(!is_mirrored(&few), "five means");
        assert!(!is_mirrored(&matched(0.9, 0.1)));
    }
}
