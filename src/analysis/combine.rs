//! One estimate of the air from several indicators of rotor effort.
//!
//! Pulse, rotor speed and power of one flight see the same air, after a calibration in the same air, through errors of
//! their own (battery, motors, sensors, noise). Only these tell how to weigh them: what a calibration's windows leave over
//! from each indicator's line is mostly the air that all of them met, and weights that make it small take the air
//! of the hover out as well. The indicators' own errors are what their maps of the hover differ by: of three, each
//! one's part follows from the differences of the pairs (the three-cornered hat: Gray and Allan 1974), of two each has a
//! half. What moves a whole map (battery, wind, density) no difference within the hover tells: it is that of the maps' own
//! errors. The weights are those of least variance of errors that are independent.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::budget::TruthCheck;
use super::result::{DroneUpdraft, FlightAnalysis, UpdraftMap};
use super::truth;
use crate::flight::Indicator;
use crate::numeric::mean;

/// Fewest values that all indicators have.
const FEWEST_VALUES: usize = 10;
/// Least share of the pairs' mean variance that is an indicator's own: a difference of variances may be nothing by
/// chance. Chosen.
const LEAST_SHARE: f64 = 0.05;
/// A combination that lowers the error by less than this share is no better than the best indicator. Chosen.
const WORTH: f64 = 0.02;

/// A map from several indicators together.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CombinedMap {
    /// The indicators with their errors and weights.
    pub indicators: Vec<CombinedIndicator>,
    /// Values of the hover that tell them.
    pub values: usize,
    /// Error of all indicators together that is not that of the calibration's air, m/s.
    pub own_mps: f64,
    /// Whether that is lower than the best indicator's alone by 2 % or more.
    pub lowers: bool,
    /// The drones' estimates at the map's times.
    pub drones: Vec<CombinedDrone>,
    /// Comparison with the true air, when it is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub truth: Option<TruthCheck>,
    /// What came of it, in a sentence.
    pub words: String,
}

/// One indicator of a combination.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CombinedIndicator {
    /// The indicator.
    pub indicator: Indicator,
    /// Error of one value that other indicators do not share, m/s.
    pub own_mps: f64,
    /// Weight; the weights' sum is 1.
    pub weight: f64,
    /// Error of its own map against the true air, root mean square, m/s, when it is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rms_mps: Option<f64>,
}

/// One drone's estimate from all indicators.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CombinedDrone {
    /// Slot number, if planned.
    pub slot: Option<u16>,
    /// Label.
    pub name: String,
    /// Mean over the hover, m/s, up positive.
    pub mean_mps: Option<f64>,
    /// Running 10 s estimate at each of the map's times, m/s; null where an indicator has none.
    pub updraft_mps: Vec<Option<f64>>,
}

/// Combines the maps of one flight that were made of several indicators. `None` where they have too few values in
/// common.
pub fn combine(seen: &[&FlightAnalysis]) -> Option<CombinedMap> {
    let maps: Option<Vec<&UpdraftMap>> = seen.iter().map(|hover| hover.map.as_ref()).collect();
    let maps = maps.filter(|maps| maps.len() > 1)?;
    let series = series_of(&maps);
    let values = series.iter().map(Vec::len).sum();
    if values < FEWEST_VALUES {
        return None;
    }
    let n = maps.len();
    let within = own_variances(&pairs(&series, n));
    let own: Vec<f64> =
        within.iter().zip(&maps).map(|(within, map)| within + systematic(map)).collect();
    let least = own.iter().copied().fold(f64::INFINITY, f64::min);
    let sum: f64 = own.iter().map(|variance| variance.recip()).sum();
    if !(least > 0.0 && sum.is_finite()) {
        return None;
    }
    let together_mps = sum.recip().sqrt();
    let best_mps = least.sqrt();
    let lowers = together_mps < (1.0 - WORTH) * best_mps;
    // Weights that lower nothing are not used.
    let best = own.iter().position(|variance| *variance <= least)?;
    let alone = |index: usize| f64::from(u8::from(index == best));
    let weight = |index: usize| if lowers { own[index].recip() / sum } else { alone(index) };
    let weights: Vec<f64> = (0..n).map(weight).collect();
    let own_mps = if lowers { together_mps } else { best_mps };
    let first = maps.first()?;
    let drones: Vec<CombinedDrone> =
        first.drones.iter().filter_map(|drone| together(drone, first, &maps, &weights)).collect();
    let checked: Vec<DroneUpdraft> = drones
        .iter()
        .filter_map(|one| {
            let own = first.drones.iter().find(|drone| same(drone, one.slot, &one.name))?;
            Some(DroneUpdraft {
                updraft_mps: one.updraft_mps.clone(),
                interval_mps: Vec::new(),
                mean_interval_mps: None,
                ..own.clone()
            })
        })
        .collect();
    let indicators: Vec<CombinedIndicator> = (0..n)
        .map(|index| CombinedIndicator {
            indicator: seen[index].indicator,
            own_mps: own[index].sqrt(),
            weight: weights[index],
            rms_mps: maps[index].truth.map(|truth| truth.rms_mps),
        })
        .collect();
    let mut found = CombinedMap {
        indicators,
        values,
        own_mps,
        lowers,
        drones,
        truth: truth::check(&checked),
        words: String::new(),
    };
    found.words = sentence(&found, best_mps);
    Some(found)
}

fn same(drone: &DroneUpdraft, slot: Option<u16>, name: &str) -> bool {
    if slot.is_some() { drone.slot == slot } else { drone.name == name }
}

/// The values of each drone that all maps have: at each second one of each map.
fn series_of(maps: &[&UpdraftMap]) -> Vec<Vec<Vec<f64>>> {
    let Some(first) = maps.first() else { return Vec::new() };
    let of_drone = |drone: &DroneUpdraft| {
        let drones = counterparts(drone, maps)?;
        let values = first.time_s.iter().filter_map(|time_s| at(maps, &drones, *time_s));
        Some(values.collect::<Vec<Vec<f64>>>())
    };
    first.drones.iter().filter_map(of_drone).collect()
}

/// A drone in each of the maps.
fn counterparts<'a>(
    drone: &DroneUpdraft,
    maps: &[&'a UpdraftMap],
) -> Option<Vec<&'a DroneUpdraft>> {
    let of =
        |map: &&'a UpdraftMap| map.drones.iter().find(|other| same(other, drone.slot, &drone.name));
    maps.iter().map(of).collect()
}

/// The values of a drone by all maps at a time; `None` where one has none.
fn at(maps: &[&UpdraftMap], drones: &[&DroneUpdraft], time_s: f64) -> Option<Vec<f64>> {
    let of = |(map, drone): (&&UpdraftMap, &&DroneUpdraft)| {
        let offset = time_s - map.time_s.first()?;
        let index = (offset >= -0.5).then(|| offset.round() as usize)?;
        drone.updraft_mps.get(index).copied().flatten()
    };
    maps.iter().zip(drones).map(of).collect()
}

/// Mean squares by which the maps of each pair differ, without the mean difference of all.
fn pairs(series: &[Vec<Vec<f64>>], n: usize) -> Vec<Vec<f64>> {
    let square = |one: usize, other: usize| {
        let differences = || series.iter().flatten().map(|values| values[one] - values[other]);
        let middle = mean(differences()).unwrap_or_default();
        mean(differences().map(|difference| (difference - middle).powi(2))).unwrap_or_default()
    };
    (0..n).map(|one| (0..n).map(|other| square(one, other)).collect()).collect()
}

/// Each indicator's own part of the differences, as variances.
fn own_variances(pairs: &[Vec<f64>]) -> Vec<f64> {
    let n = pairs.len();
    let sum: f64 = pairs.iter().flatten().sum::<f64>() / 2.0;
    let usual = sum / (n * (n - 1) / 2) as f64 / 2.0;
    let own = |index: usize| {
        if n == 2 {
            return usual;
        }
        let with: f64 = pairs[index].iter().sum();
        (with - sum / (n - 1) as f64) / (n - 2) as f64
    };
    (0..n).map(|index| own(index).max(2.0 * LEAST_SHARE * usual)).collect()
}

/// Variance of what moves a whole map and has nothing to do with the air of the calibration, (m/s)².
fn systematic(map: &UpdraftMap) -> f64 {
    let of = |drone: &DroneUpdraft| {
        let errors = drone.errors;
        [errors.battery_mps, errors.wind_mps, errors.density_mps]
            .iter()
            .map(|error| error * error)
            .sum::<f64>()
    };
    mean(map.drones.iter().map(of)).unwrap_or_default()
}

fn together(
    drone: &DroneUpdraft,
    first: &UpdraftMap,
    maps: &[&UpdraftMap],
    weights: &[f64],
) -> Option<CombinedDrone> {
    let drones = counterparts(drone, maps)?;
    let value = |time_s: &f64| {
        let values = at(maps, &drones, *time_s)?;
        Some(values.iter().zip(weights).map(|(value, weight)| value * weight).sum())
    };
    let updraft_mps: Vec<Option<f64>> = first.time_s.iter().map(value).collect();
    Some(CombinedDrone {
        slot: drone.slot,
        name: drone.name.clone(),
        mean_mps: mean(updraft_mps.iter().flatten()),
        updraft_mps,
    })
}

fn sentence(found: &CombinedMap, best_mps: f64) -> String {
    let one = |of: &CombinedIndicator| {
        let rms = of.rms_mps.map_or_else(String::new, |rms| format!(", map {rms:.3} off"));
        format!("{} {:.3} m/s (weight {:.2}{rms})", of.indicator.words(), of.own_mps, of.weight)
    };
    let each: Vec<String> = found.indicators.iter().map(one).collect();
    let truth = found.truth.map_or_else(String::new, |truth| {
        format!("; the map of all together is {:.3} m/s off the truth", truth.rms_mps)
    });
    let verdict = if found.lowers {
        format!(
            "together {:.3} m/s, {:.0} % less than the best alone",
            found.own_mps,
            100.0 * (1.0 - found.own_mps / best_mps)
        )
    } else {
        format!("together no better than the best alone, {:.3} m/s, which stands", found.own_mps)
    };
    format!(
        "several indicators, by errors of their own over {} values: {}; {verdict}{truth}",
        found.values,
        each.join(", ")
    )
}

/// Adds the combination to the maps of the first of several analyses of the same flights, each with another indicator.
pub fn add(analyses: &mut [super::result::Analysis]) {
    let Some((first, others)) = analyses.split_first_mut() else { return };
    for index in 0..first.flights.len() {
        if first.flights[index].map.is_none() {
            continue;
        }
        let name = first.flights[index].name.clone();
        let all = || std::iter::once(&*first).chain(&*others);
        let seen: Option<Vec<&FlightAnalysis>> =
            all().map(|analysis| analysis.flights.iter().find(|one| one.name == name)).collect();
        let combined = seen.and_then(|seen| combine(&seen));
        if let Some(map) = &mut first.flights[index].map {
            map.combined = combined;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::rng::{Purpose as Stream, stream};
    use rand_distr::{Distribution as _, StandardNormal};

    /// Values of indicators with these errors of their own, and twice as much of air that all see.
    fn series(own_mps: &[f64]) -> Vec<Vec<Vec<f64>>> {
        let mut rng = stream(4, 0, Stream::Sensors);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let mut values = || {
            let air_mps = 2.0 * normal();
            own_mps.iter().map(|own| air_mps + own * normal() + 0.7 * own).collect()
        };
        (0..10).map(|_| (0..400).map(|_| values()).collect()).collect()
    }

    #[test]
    fn three_indicators_tell_their_own_errors_whatever_the_air() {
        let own_mps = [0.3, 0.15, 0.6];
        let found = own_variances(&pairs(&series(&own_mps), 3));
        for (found, own) in found.iter().zip(own_mps) {
            assert!((found.sqrt() / own - 1.0).abs() < 0.1, "{found} {own}");
        }
        let [one, other] = own_variances(&pairs(&series(&[0.3, 0.1]), 2))[..] else { panic!() };
        assert_eq!(one, other, "two do not tell whose the difference is");
        assert!((one - 0.05).abs() < 0.004, "{one}");
    }

    #[test]
    fn no_indicator_is_without_an_error() {
        // The third is the mean of the others: of its own it would have less than nothing.
        let mut series = series(&[0.3, 0.3, 0.0]);
        for values in series.iter_mut().flatten() {
            values[2] = f64::midpoint(values[0], values[1]);
        }
        let found = own_variances(&pairs(&series, 3));
        assert!(found.iter().all(|variance| *variance > 0.0), "{found:?}");
    }
}
