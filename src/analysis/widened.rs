//! Errors of the values that each drone gives alone, widened by what the whole flight says about their zero.

use super::budget::{CommonError, ErrorBudget};
use super::posterior::half_mps;
use super::result::{DroneUpdraft, UpdraftMap};
use super::truth;
use crate::numeric::mean;

/// Widens the errors of the drones' own values to what the posterior of the same map makes of them.
///
/// A calibration hardly shows the slow air that is in its zero, so that it states too small an error for it. The posterior
/// knows the mean of the air over the flight with an error of its own, se, and is off the mean of the drones' values by d: these are
/// then off the true mean by the root of `se² + d²`. Where that is more than their common error, the rest is one of
/// the zero. Nothing is narrowed.
pub(super) fn widen(map: &mut UpdraftMap) {
    let Some(missing_mps) = missing_mps(map) else { return };
    if let Some(common) = &mut map.common {
        *common = CommonError {
            se_mps: common.se_mps.hypot(missing_mps),
            half_width_mps: common.half_width_mps.hypot(half_mps(missing_mps)),
            zero_mps: common.zero_mps.hypot(missing_mps),
            ..*common
        };
    }
    for drone in &mut map.drones {
        widen_drone(drone, missing_mps);
    }
    map.truth = truth::check(&map.drones);
}

/// Standard error that is missing in the common error of the drones' own values, m/s; `None` if there is none.
fn missing_mps(map: &UpdraftMap) -> Option<f64> {
    let fleet = map.posterior.as_ref()?.fleet?;
    let stated = map.common?.half_width_mps / half_mps(1.0);
    let apart = map.drones.iter().flat_map(|drone| {
        let both = drone.updraft_mps.iter().zip(&drone.posterior_mps);
        both.filter_map(|(own, posterior)| Some((*own)? - (*posterior)?))
    });
    let missing2 = fleet.se.powi(2) + mean(apart)?.powi(2) - stated.powi(2);
    (missing2 > 0.0).then(|| missing2.sqrt())
}

fn widen_drone(drone: &mut DroneUpdraft, missing_mps: f64) {
    let wider = |value: f64, [low, high]: [f64; 2]| {
        [
            value - (value - low).hypot(half_mps(missing_mps)),
            value + (high - value).hypot(half_mps(missing_mps)),
        ]
    };
    drone.errors = ErrorBudget {
        zero_mps: drone.errors.zero_mps.hypot(missing_mps),
        total_mps: drone.errors.total_mps.hypot(missing_mps),
        ..drone.errors
    };
    drone.mean.se = drone.mean.se.hypot(missing_mps);
    let mean_mps = drone.mean.value;
    drone.mean_interval_mps = drone.mean_interval_mps.map(|interval| wider(mean_mps, interval));
    for (value, interval) in drone.updraft_mps.iter().zip(&mut drone.interval_mps) {
        *interval = value.zip(*interval).map(|(value, interval)| wider(value, interval));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    /// One drone in air of 0 m/s that says 0.5, of which its calibration knows the zero to 0.1 m/s, and a posterior.
    fn map(posterior_mps: f64, fleet: (f64, f64)) -> UpdraftMap {
        let fleet = json!({ "value": fleet.0, "se": fleet.1 });
        serde_json::from_value(json!({
            "law": "linear",
            "time_s": [0.0, 1.0],
            "common": { "se_mps": 0.1, "half_width_mps": 0.196, "zero_mps": 0.1 },
            "posterior": {
                "fleet": fleet, "zero_shift_mps": 0.0, "uniform_probability": 0.1,
            },
            "drones": [{
                "slot": 1, "name": "", "position_m": null, "height_m": 10.0, "mapping": "own",
                "mean": { "value": 0.5, "se": 0.1 }, "mean_interval_mps": [0.304, 0.696],
                "errors": { "zero_mps": 0.1, "total_mps": 0.1 },
                "updraft_mps": [0.5, null], "interval_mps": [[0.304, 0.7], null],
                "posterior_mps": [posterior_mps, 0.0], "truth_mps": [0.0, 0.0],
            }],
        }))
        .unwrap()
    }

    #[test]
    fn a_zero_that_the_posterior_doubts_is_doubted_in_each_drone_s_own_values() {
        let mut found = map(0.1, (0.1, 0.2));
        widen(&mut found);
        let total = f64::hypot(0.2, 0.4);
        let drone = &found.drones[0];
        let common = found.common.unwrap();
        for se in [drone.mean.se, drone.errors.total_mps, drone.errors.zero_mps, common.se_mps] {
            assert!((se - total).abs() < 1e-12, "{se} instead of {total}");
        }
        assert!((common.half_width_mps - half_mps(total)).abs() < 1e-12);
        let [low, high] = drone.interval_mps[0].unwrap();
        assert!((low - (0.5 - half_mps(total))).abs() < 1e-12, "{low}");
        assert!(high > 0.5 + half_mps(total), "the upper side was the wider one before: {high}");
        assert_eq!(drone.interval_mps[1], None);
        assert_eq!(drone.updraft_mps[0], Some(0.5), "values stay");
        assert_eq!(found.truth.unwrap().inside_share, Some(1.0), "counted again");
    }

    #[test]
    fn nothing_is_narrowed() {
        let mut found = map(0.49, (0.49, 0.05));
        let before = found.clone();
        widen(&mut found);
        assert_eq!(found, before);
    }
}
