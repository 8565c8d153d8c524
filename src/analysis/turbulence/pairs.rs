//! Pairs of drones: covariance and coherence by distance, and the speed of the pattern.

use rayon::prelude::*;
use turbulence_statistics::Record;
use turbulence_statistics::points::{self, Advection, At};
use turbulence_statistics::spectrum::{CrossBand, Instrument, cross};
use turbulence_statistics::transfer::Transfer;

use super::make::{Aligned, Drone};
use super::result::{AtDistance, CoherentBand, Interval};
use crate::numeric::{mean, median};

/// Step of records that pairs are compared by, s: what is faster has nothing in common over metres.
const STEP_S: f64 = 1.0;
/// Drones that are compared with each other at most: the work goes with the square of their number.
const MOST_DRONES: usize = 64;
/// Pairs of a distance whose coherence is looked at, at most.
const MOST_COHERENT: usize = 60;
/// Classes of distance at most.
const MOST_CLASSES: f64 = 24.0;
/// Longest lag, s, and the same as a share of the record.
const LONGEST_LAG_S: f64 = 60.0;
const LONGEST_SHARE: f64 = 0.125;

/// A drone that is compared with others.
pub(super) struct Placed {
    place_m: [f64; 2],
    record: Record,
}

/// A record in steps of a second: means of blocks that are whole.
pub(super) fn coarse(record: &Record) -> Record {
    let each = ((STEP_S / record.step_s()).round() as usize).max(1);
    let of = |block: &[f64]| Some(block.iter().sum::<f64>() / each as f64);
    let blocks = record.values().chunks_exact(each).map(of);
    Record::new(record.step_s() * each as f64, blocks)
}

/// Not more of them than can be compared, spread over all.
pub(super) fn spread<T>(all: &[T]) -> Vec<&T> {
    let count = all.len().min(MOST_DRONES);
    (0..count).filter_map(|index| all.get(index * all.len() / count)).collect()
}

/// The drones that are compared.
pub(super) fn chosen(drones: &[Drone<'_>], aligned: &[Aligned]) -> Vec<Placed> {
    let placed: Vec<(&Aligned, [f64; 2])> = drones
        .iter()
        .zip(aligned)
        .filter_map(|(drone, one)| Some((one, drone.place_m?)))
        .filter(|(_, place_m)| place_m.iter().all(|m| m.is_finite()))
        .collect();
    let placed = spread(&placed);
    placed
        .iter()
        .map(|(one, place_m)| Placed { place_m: *place_m, record: coarse(&one.w) })
        .collect()
}

fn points(drones: &[Placed]) -> Vec<At<'_>> {
    drones.iter().map(|one| At { place_m: one.place_m, record: &one.record }).collect()
}

fn apart_m(one: &Placed, other: &Placed) -> f64 {
    let [x, y] = [0, 1].map(|axis| other.place_m[axis] - one.place_m[axis]);
    x.hypot(y)
}

/// Width of the classes: the distance of neighbours, or more where there would be too many classes.
fn width_m(drones: &[Placed]) -> Option<f64> {
    let others = |one: usize| drones.iter().enumerate().filter(move |(other, _)| *other != one);
    let nearest = |one: usize| {
        others(one).map(|(_, other)| apart_m(&drones[one], other)).fold(f64::INFINITY, f64::min)
    };
    let neighbour = median((0..drones.len()).map(nearest).filter(|m| *m > 0.0).collect())?;
    let all = drones.iter().flat_map(|one| drones.iter().map(move |other| apart_m(one, other)));
    let farthest = all.fold(0.0, f64::max);
    // Neighbours on a grid are not split by the last digit of their distance.
    let width = 0.999 * neighbour.max(farthest / MOST_CLASSES);
    (width.is_finite() && width > 0.0).then_some(width)
}

/// Covariance by distance and lag, with the coherence of some pairs.
pub(super) fn by_distance(drones: &[Placed], length_s: f64, scale_se: f64) -> Vec<AtDistance> {
    let Some(width) = width_m(drones) else { return Vec::new() };
    let lags = (LONGEST_LAG_S.min(LONGEST_SHARE * length_s) / STEP_S) as usize;
    let classes = points::by_distance(&points(drones), width, lags, scale_se);
    let class = |class: points::DistanceClass| {
        let number = (class.distance_m / width) as u64;
        let of = class.covariance;
        AtDistance {
            distance_m: class.distance_m,
            pairs: class.pairs,
            covariance: Interval { value: of.value, low: of.low, high: of.high },
            correlation: None,
            by_lag: class.by_lag,
            coherence: coherence(drones, |metres| (metres / width) as u64 == number),
        }
    };
    classes.into_par_iter().map(class).collect()
}

/// Mean coherence of pairs at a distance.
fn coherence(drones: &[Placed], is_apart: impl Fn(f64) -> bool) -> Vec<CoherentBand> {
    let mut pairs = Vec::new();
    for (index, one) in drones.iter().enumerate() {
        let others = drones.iter().skip(index + 1);
        pairs
            .extend(others.filter(|other| is_apart(apart_m(one, other))).map(|other| (one, other)));
    }
    let count = pairs.len().min(MOST_COHERENT);
    let used = (0..count).filter_map(|index| pairs.get(index * pairs.len() / count));
    // The response is the same for both, and divides out.
    let instrument = Instrument { transfer: Transfer::NONE, ..Instrument::default() };
    let each: Vec<Vec<CrossBand>> = used
        .map(|(one, other)| cross(&one.record, &other.record, &instrument))
        .filter(|bands| !bands.is_empty())
        .collect();
    let bands = each.iter().map(Vec::len).min().unwrap_or(0);
    let band = |index: usize| {
        let over =
            |of: fn(&CrossBand) -> f64| mean(each.iter().filter_map(|one| one.get(index)).map(of));
        Some(CoherentBand {
            frequency_hz: over(|band| band.frequency_hz)?,
            coherence: over(|band| band.coherence)?,
            one_pair_from: over(|band| band.coherence_threshold)?,
        })
    };
    // With one line everything is coherent.
    let told = |index: &usize| {
        each.first().and_then(|one| one.get(*index)).is_some_and(|band| band.freedom >= 8.0)
    };
    (0..bands).filter(told).filter_map(band).collect()
}

/// How fast the pattern passes the drones.
pub(super) fn advection(drones: &[Placed], length_s: f64) -> Option<Advection> {
    points::advection(&points(drones), LONGEST_LAG_S.min(LONGEST_SHARE * length_s))
}
