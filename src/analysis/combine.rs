//! One estimate of the air from several indicators of rotor effort.
//!
//! Pulse, rotor speed and power of one flight see the same air through errors of their own (battery, motors, noise).
//! How large these are, and how far they go together, is told by what the calibration's windows leave over from each
//! indicator's line. The weights are those of least variance.

use nalgebra::{DMatrix, DVector};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::budget::TruthCheck;
use super::kind::Symbol;
use super::result::{DroneAnalysis, DroneUpdraft, FlightAnalysis, UpdraftMap};
use super::truth;
use crate::flight::Indicator;
use crate::mission::plan::Purpose;
use crate::numeric::mean;

/// Fewest windows that all indicators have.
const FEWEST_WINDOWS: usize = 10;
/// A combination that lowers the error by less than this share is no better than the best indicator. Chosen.
const WORTH: f64 = 0.02;

/// A map from several indicators together.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CombinedMap {
    /// The indicators with their errors and weights.
    pub indicators: Vec<CombinedIndicator>,
    /// Correlation of the indicators' errors.
    pub correlation: Vec<Vec<f64>>,
    /// Windows of the calibration that tell them.
    pub windows: usize,
    /// Error of one window by all indicators together, m/s.
    pub residual_mps: f64,
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
    /// What one window of the calibration leaves over from its line, m/s.
    pub residual_mps: f64,
    /// Weight; the weights' sum is 1, and one may be negative where errors go together.
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

/// Combines the maps of one flight that were made of several indicators: its calibration and its map by each of them.
/// `None` where they have too few windows or values in common.
pub fn combine(seen: &[(&FlightAnalysis, &FlightAnalysis)]) -> Option<CombinedMap> {
    let calibrations: Vec<&FlightAnalysis> =
        seen.iter().map(|(calibration, _)| *calibration).collect();
    let maps: Option<Vec<&UpdraftMap>> = seen.iter().map(|(_, hover)| hover.map.as_ref()).collect();
    let maps = maps.filter(|maps| maps.len() > 1)?;
    let rows = residuals_mps(&calibrations);
    if rows.len() < FEWEST_WINDOWS {
        return None;
    }
    let n = maps.len();
    // Errors as they were seen; believed is less of what goes together, which would make weights wild.
    let covariance = covariance_of(&rows, n, 1.0);
    let believed = 1.0 - ((n + 1) as f64 / rows.len() as f64).min(1.0);
    let sd = |index: usize| covariance[(index, index)].max(0.0).sqrt();
    let best = (0..n).min_by(|one, other| sd(*one).total_cmp(&sd(*other)))?;
    let weights = least_variance(&covariance_of(&rows, n, believed))?;
    let together_mps = (weights.transpose() * &covariance * &weights)[(0, 0)].max(0.0).sqrt();
    let lowers = together_mps < (1.0 - WORTH) * sd(best);
    // Weights that lower nothing are not used.
    let best_alone = DVector::from_fn(n, |index, _| if index == best { 1.0 } else { 0.0 });
    let weights = if lowers { weights } else { best_alone };
    let best_mps = sd(best);
    let residual_mps = if lowers { together_mps } else { best_mps };
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
            indicator: seen[index].1.indicator,
            residual_mps: sd(index),
            weight: weights[index],
            rms_mps: maps[index].truth.map(|truth| truth.rms_mps),
        })
        .collect();
    let mut found = CombinedMap {
        indicators,
        correlation: (0..n)
            .map(|row| {
                (0..n).map(|column| covariance[(row, column)] / (sd(row) * sd(column))).collect()
            })
            .collect(),
        windows: rows.len(),
        residual_mps,
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

/// What each window leaves over from its drone's line, m/s, by each indicator.
fn residuals_mps(calibrations: &[&FlightAnalysis]) -> Vec<Vec<f64>> {
    let Some(first) = calibrations.first() else { return Vec::new() };
    let counterparts = |drone: &DroneAnalysis| -> Option<Vec<&DroneAnalysis>> {
        let same = |other: &&DroneAnalysis| other.slot == drone.slot && other.name == drone.name;
        calibrations.iter().map(|flight| flight.drones.iter().find(same)).collect()
    };
    let mut rows = Vec::new();
    for drone in &first.drones {
        let Some(drones) = counterparts(drone) else { continue };
        for window in drone.windows.iter().filter(|window| window.kind.is_leg()) {
            let of = |one: &&DroneAnalysis| {
                let line = one.laws.as_ref()?.linear.as_ref()?;
                let (slope, level) = (line.value(Symbol::Slope)?, line.value(Symbol::U0)?);
                let there = one.windows.iter().find(|other| other.start_s == window.start_s)?;
                let effort = there.effort_phi.trimmed - there.offset_us.unwrap_or_default();
                let left = (effort - level) / slope - there.velocity_mps.trimmed;
                (there.rejected.is_empty() && left.is_finite()).then_some(left)
            };
            let row: Option<Vec<f64>> = drones.iter().map(of).collect();
            rows.extend(row);
        }
    }
    rows
}

/// Covariance of the indicators' errors, of which a share is believed off the diagonal: with few windows errors go
/// together by chance.
fn covariance_of(rows: &[Vec<f64>], n: usize, believed: f64) -> DMatrix<f64> {
    let centre: Vec<f64> =
        (0..n).map(|column| mean(rows.iter().map(|row| row[column])).unwrap_or_default()).collect();
    DMatrix::from_fn(n, n, |row, column| {
        let product = |one: &Vec<f64>| (one[row] - centre[row]) * (one[column] - centre[column]);
        let value = mean(rows.iter().map(product)).unwrap_or_default();
        if row == column { value } else { believed * value }
    })
}

/// Weights with the sum 1 under which the error is least.
fn least_variance(covariance: &DMatrix<f64>) -> Option<DVector<f64>> {
    let ones = DVector::from_element(covariance.nrows(), 1.0);
    let solved = covariance.clone().cholesky()?.solve(&ones);
    let sum = solved.sum();
    (sum.is_finite() && sum > 0.0).then(|| solved / sum)
}

fn together(
    drone: &DroneUpdraft,
    first: &UpdraftMap,
    maps: &[&UpdraftMap],
    weights: &DVector<f64>,
) -> Option<CombinedDrone> {
    let drones: Option<Vec<&DroneUpdraft>> = maps
        .iter()
        .map(|map| map.drones.iter().find(|other| same(other, drone.slot, &drone.name)))
        .collect();
    let drones = drones?;
    let value = |time_s: &f64| {
        let of = |(map, drone): (&&UpdraftMap, &&DroneUpdraft)| {
            let offset = time_s - map.time_s.first()?;
            let index = (offset >= -0.5).then(|| offset.round() as usize)?;
            drone.updraft_mps.get(index).copied().flatten()
        };
        let values: Option<Vec<f64>> = maps.iter().zip(&drones).map(of).collect();
        Some(values?.iter().zip(weights.iter()).map(|(value, weight)| value * weight).sum())
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
        format!(
            "{} {:.3} m/s (weight {:.2}{rms})",
            of.indicator.words(),
            of.residual_mps,
            of.weight
        )
    };
    let each: Vec<String> = found.indicators.iter().map(one).collect();
    let truth = found.truth.map_or_else(String::new, |truth| {
        format!("; the map of all together is {:.3} m/s off the truth", truth.rms_mps)
    });
    let verdict = if found.lowers {
        format!(
            "together {:.3} m/s, {:.0} % less than the best alone",
            found.residual_mps,
            100.0 * (1.0 - found.residual_mps / best_mps)
        )
    } else {
        format!(
            "together no better than the best alone, {:.3} m/s, which stands",
            found.residual_mps
        )
    };
    format!(
        "several indicators, by what {} windows of the calibration leave over: {}; {verdict}{truth}",
        found.windows,
        each.join(", ")
    )
}

/// Adds the combination to the maps of the first of several analyses of the same flights, each with another indicator.
pub fn add(analyses: &mut [super::result::Analysis]) {
    let Some((first, others)) = analyses.split_first_mut() else { return };
    let calibration = |flights: &[FlightAnalysis]| {
        flights.iter().position(|one| one.purpose == Purpose::Calibration)
    };
    for index in 0..first.flights.len() {
        if first.flights[index].map.is_none() {
            continue;
        }
        let name = first.flights[index].name.clone();
        let all = || std::iter::once(&*first).chain(&*others);
        let seen: Option<Vec<(&FlightAnalysis, &FlightAnalysis)>> = all()
            .map(|analysis| {
                let calibration = analysis.flights.get(calibration(&analysis.flights)?)?;
                let hover = analysis.flights.iter().find(|one| one.name == name)?;
                Some((calibration, hover))
            })
            .collect();
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

    /// Errors of two indicators, a part of which they share.
    fn rows(count: usize) -> Vec<Vec<f64>> {
        let mut rng = stream(4, 0, Stream::Sensors);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        (0..count)
            .map(|_| {
                let shared = 0.1 * normal();
                vec![shared + 0.3 * normal(), shared + 0.15 * normal()]
            })
            .collect()
    }

    #[test]
    fn weights_are_those_of_the_least_variance() {
        let covariance = covariance_of(&rows(4000), 2, 1.0);
        let weights = least_variance(&covariance).unwrap();
        // Own variances 0.09 and 0.0225, whatever is shared: a fifth and four fifths.
        assert!((weights[0] - 0.2).abs() < 0.02, "{weights}");
        let error = (weights.transpose() * &covariance * &weights)[(0, 0)].sqrt();
        // 0.01 shared, and 0.09 with 0.0225 by their inverses: 0.028.
        assert!((error - 0.028_f64.sqrt()).abs() < 0.006, "{error}");
        assert!(error < covariance[(1, 1)].sqrt());
    }

    #[test]
    fn a_share_of_what_goes_together_is_believed() {
        let rows = rows(12);
        let (half, whole) = (covariance_of(&rows, 2, 0.5), covariance_of(&rows, 2, 1.0));
        assert!((half[(0, 1)] / whole[(0, 1)] - 0.5).abs() < 1e-9);
        assert_eq!(half[(0, 0)], whole[(0, 0)]);
        assert_eq!(least_variance(&DMatrix::zeros(2, 2)), None);
    }
}
