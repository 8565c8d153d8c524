//! Correlation of pairs of drones over their distance (eq. 8).

use nalgebra::DMatrix;

use super::curve::{CurvePoint, exponential};
use super::field::Field;
use super::result::{DistanceClass, Interval};
use crate::base::estimate::Estimate;
use crate::numeric::{Sorted, mean};

/// Distances that differ by less than this share of the spacing are the same nominal distance.
const SAME_SHARE: f64 = 0.03;
/// With fewer pairs per distance than this the places form no grid, and distances are binned.
const FEWEST_PAIRS: f64 = 2.5;
/// Drones are in the same row when their places differ by less than this share of the spacing.
const ROW_SHARE: f64 = 0.25;

/// Values of each drone about its mean in units of its standard deviation (the paper's u-hat), from
/// one column for each drone with NaN in gaps; 0 in gaps.
pub(super) fn scored(columns: &DMatrix<f64>) -> DMatrix<f64> {
    let mut scored = columns.clone();
    for mut column in scored.column_iter_mut() {
        let mean = super::field::mean(column.iter().copied());
        let sd = super::field::mean(column.iter().map(|value| (value - mean).powi(2))).sqrt();
        for value in column.iter_mut() {
            let z = (*value - mean) / sd;
            *value = if z.is_finite() { z } else { 0.0 };
        }
    }
    scored
}

/// Seconds that two drones have in common.
pub(super) fn common_seconds(columns: &DMatrix<f64>) -> DMatrix<f64> {
    let known = columns.map(|value| f64::from(u8::from(value.is_finite())));
    known.transpose() * &known
}

/// Mean product of every pair of drones over the seconds that both have.
pub(super) fn correlations(scored: &DMatrix<f64>, seconds: &DMatrix<f64>) -> DMatrix<f64> {
    (scored.transpose() * scored).component_div(seconds)
}

/// Pairs of one nominal distance.
#[derive(Clone, Debug)]
pub(super) struct Class {
    pub(super) nominal_m: f64,
    pub(super) distance_m: f64,
    pub(super) pairs: Vec<(usize, usize)>,
}

/// Which pairs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Pairs {
    All,
    AlongX,
    AlongY,
}

/// The pairs of drones by nominal distance, nearest first; those that share too few seconds are out.
pub(super) fn classes(field: &Field, seconds: &DMatrix<f64>, which: Pairs) -> Vec<Class> {
    let spacing = field.spacing_m();
    let fewest = super::field::SHORTEST_S as f64 / 2.0;
    let mut pairs: Vec<(f64, (usize, usize))> = Vec::new();
    for (i, one) in field.places.iter().enumerate() {
        for (j, other) in field.places.iter().enumerate().skip(i + 1) {
            let (dx, dy) = ((one[0] - other[0]).abs(), (one[1] - other[1]).abs());
            let fits = match which {
                Pairs::All => true,
                Pairs::AlongX => dy < ROW_SHARE * spacing,
                Pairs::AlongY => dx < ROW_SHARE * spacing,
            };
            let shared = seconds.get((i, j)).copied().unwrap_or(0.0);
            if fits && dx.hypot(dy) > 0.01 && shared >= fewest {
                pairs.push((dx.hypot(dy), (i, j)));
            }
        }
    }
    pairs.sort_by(|left, right| left.0.total_cmp(&right.0));
    let exact = grouped(&pairs, |first, distance| distance - first < SAME_SHARE * spacing);
    if pairs.len() as f64 >= FEWEST_PAIRS * exact.len() as f64 || which != Pairs::All {
        return exact;
    }
    let bin = |distance: f64| (distance / spacing).floor();
    grouped(&pairs, |first, distance| bin(first) == bin(distance))
}

fn grouped(pairs: &[(f64, (usize, usize))], same: impl Fn(f64, f64) -> bool) -> Vec<Class> {
    let mut groups: Vec<Vec<(f64, (usize, usize))>> = Vec::new();
    for pair in pairs {
        match groups.last_mut() {
            Some(group) if group.first().is_some_and(|first| same(first.0, pair.0)) => {
                group.push(*pair);
            }
            _ => groups.push(vec![*pair]),
        }
    }
    groups
        .into_iter()
        .map(|group| {
            let distances: Vec<f64> = group.iter().map(|pair| pair.0).collect();
            let middle = Sorted::taken(&distances).quantile(0.5).unwrap_or(f64::NAN);
            Class {
                nominal_m: middle,
                distance_m: middle,
                pairs: group.iter().map(|p| p.1).collect(),
            }
        })
        .collect()
}

/// Medians of the classes.
pub(super) fn medians(classes: &[Class], correlations: &DMatrix<f64>) -> Vec<f64> {
    let mut values = Vec::new();
    classes
        .iter()
        .map(|class| {
            values.clear();
            values.extend(class.pairs.iter().filter_map(|pair| correlations.get(*pair).copied()));
            Sorted::of(&mut values).quantile(0.5).unwrap_or(f64::NAN)
        })
        .collect()
}

/// The paper's length: `exp(-r / lambda)` fitted to medians, all alike or weighted.
pub(super) fn length(
    classes: &[Class],
    medians: &[f64],
    weights: Option<&[f64]>,
) -> Option<Estimate> {
    exponential(&points(classes, medians, weights))
}

/// Medians as points of a curve.
pub(super) fn points(
    classes: &[Class],
    medians: &[f64],
    weights: Option<&[f64]>,
) -> Vec<CurvePoint> {
    classes
        .iter()
        .zip(medians)
        .enumerate()
        .map(|(index, (class, value))| CurvePoint {
            distance: class.distance_m,
            value: *value,
            weight: weights.and_then(|weights| weights.get(index).copied()).unwrap_or(1.0),
        })
        .filter(|point| point.value.is_finite() && point.weight.is_finite())
        .collect()
}

/// The classes as results.
pub(super) fn described(classes: &[Class], correlations: &DMatrix<f64>) -> Vec<DistanceClass> {
    classes
        .iter()
        .map(|class| {
            let mut values: Vec<f64> =
                class.pairs.iter().filter_map(|pair| correlations.get(*pair).copied()).collect();
            let sorted = Sorted::of(&mut values);
            let at = |share: f64| sorted.quantile(share).unwrap_or(f64::NAN);
            DistanceClass {
                nominal_m: class.nominal_m,
                distance_m: class.distance_m,
                median: at(0.5),
                mean: mean(sorted.values()).unwrap_or(f64::NAN),
                quartiles: Interval { low: at(0.25), high: at(0.75) },
                correlations: values,
                median_se: None,
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs_along_a_row_are_classed_by_their_distance() {
        let places = [100.0, 107.0].into_iter().flat_map(|y| [50.0, 57.0, 64.0].map(|x| [x, y]));
        let field = Field { places: places.collect(), rows: Vec::new(), seconds: 0, running: 1 };
        let seconds = DMatrix::from_element(6, 6, 1000.0);
        let found = |which| -> Vec<(f64, usize)> {
            let classes = classes(&field, &seconds, which);
            classes.iter().map(|class| (class.distance_m, class.pairs.len())).collect()
        };
        assert_eq!(found(Pairs::AlongX), [(7.0, 4), (14.0, 2)]);
        assert_eq!(found(Pairs::AlongY), [(7.0, 3)]);
        assert_eq!(classes(&field, &DMatrix::zeros(6, 6), Pairs::AlongX).len(), 0);
    }
}
