//! Correlations of the air in two flights, over distance and over time.

use super::result::{DistancePoint, LagPoint, StructureComparison};
use super::side::Couple;
use crate::analysis::statistics::result::{DistanceClass, FieldStatistics};
use crate::base::estimate::Estimate;

/// Distances are one up to this difference, m.
const SAME_DISTANCE_M: f64 = 0.25;
/// Lags are one up to this difference, s.
const SAME_LAG_S: f64 = 1e-6;

/// Correlations that both flights have; `None` where they have none in common.
pub(super) fn compare(
    couple: &Couple<'_>,
    [a, b]: [&FieldStatistics; 2],
) -> Option<StructureComparison> {
    let (distance, time) = (distances(a, b), lags(a, b));
    (!distance.is_empty() || !time.is_empty()).then(|| StructureComparison {
        pair: couple.pair(),
        distance,
        time,
    })
}

fn distances(a: &FieldStatistics, b: &FieldStatistics) -> Vec<DistancePoint> {
    let classes = |of: &FieldStatistics| -> Vec<DistanceClass> {
        of.space.as_ref().map_or_else(Vec::new, |space| space.all.classes.clone())
    };
    let others = classes(b);
    let median = |of: &DistanceClass| Estimate::new(of.median, of.median_se.unwrap_or(0.0));
    classes(a)
        .iter()
        .filter_map(|class| {
            let near =
                |one: &&DistanceClass| (one.nominal_m - class.nominal_m).abs() <= SAME_DISTANCE_M;
            let other = others.iter().find(near)?;
            let distance_m = class.distance_m;
            Some(DistancePoint { distance_m, reference: median(class), other: median(other) })
        })
        .filter(|point| point.reference.value.is_finite() && point.other.value.is_finite())
        .collect()
}

fn lags(a: &FieldStatistics, b: &FieldStatistics) -> Vec<LagPoint> {
    let (Some(a), Some(b)) = (&a.time, &b.time) else { return Vec::new() };
    let pairs = a.lag_s.iter().zip(&a.mean).zip(b.lag_s.iter().zip(&b.mean));
    pairs
        .filter(|((lag, _), (other, _))| (*lag - *other).abs() <= SAME_LAG_S)
        .filter(|((_, a), (_, b))| a.is_finite() && b.is_finite())
        .map(|((lag, a), (_, b))| LagPoint { lag_s: *lag, reference: *a, other: *b })
        .collect()
}
