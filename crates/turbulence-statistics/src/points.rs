//! Covariance between points, and how fast the air passes from one to another.

use crate::Record;
use crate::autocovariance::cross;
use crate::moments::{Known, Moment};
use crate::quantile::WIDTH;

/// Correlations below this say nothing of when the air comes by.
const LEAST_CORRELATION: f64 = 0.25;
/// Pairs that an advection is told from.
const FEWEST_PAIRS: usize = 6;
/// Winds beyond are not looked for, m/s.
const FASTEST_MPS: f64 = 40.0;
/// A speed with a larger share of itself as standard error is not told from a pattern that stands.
const LARGEST_SHARE: f64 = 0.5;
/// Share of the lags' squares, weighted by correlation, that one velocity must explain: fields that are carried past reach
/// 0.4 to 1, noise and waves that stand 0.15 at most (tests).
const EXPLAINED: f64 = 0.25;

/// Record at a place: metres east and north of anywhere.
#[derive(Clone, Debug)]
pub struct At<'a> {
    /// Place, m: east and north (or any two axes, in which advection is told then).
    pub place_m: [f64; 2],
    /// Record at this place.
    pub record: &'a Record,
}

/// Covariances of pairs whose distance is in a class.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct DistanceClass {
    /// Mean distance, m.
    pub distance_m: f64,
    /// Number of pairs.
    pub pairs: usize,
    /// Mean covariance without lag, (m/s)², with its errors: those of one pair, as pairs of one fleet are not independent.
    pub covariance: Moment,
    /// Mean covariance at lags of 0, 1, ... steps of either sign, (m/s)²; at 0 that of [`DistanceClass::covariance`]. What the
    /// means of the records took is added at all lags alike.
    pub by_lag: Vec<f64>,
}

/// Distance of a pair, its covariance, and that by lag.
type Pair = (f64, Moment, Vec<f64>);

/// Mean covariances in classes of distance that are `width_m` wide, with lags up to `lags` steps.
pub fn by_distance(
    points: &[At<'_>],
    width_m: f64,
    lags: usize,
    scale_se: f64,
) -> Vec<DistanceClass> {
    let mut classes = std::collections::BTreeMap::<u64, Vec<Pair>>::new();
    let known: Vec<_> =
        points.iter().filter_map(|at| Some((at.place_m, Known::of(at.record)?))).collect();
    for (i, (place_m, one)) in known.iter().enumerate() {
        for (other_m, other) in &known[i + 1..] {
            let [x, y] = [0, 1].map(|axis| other_m[axis] - place_m[axis]);
            let distance_m = x.hypot(y);
            let Some((moment, [later, earlier])) = one.covariance(other, lags, scale_se) else {
                continue;
            };
            let both = later
                .iter()
                .zip(earlier)
                .take(lags + 1)
                .map(|(a, b)| 0.5 * (a + b) + moment.systematic);
            let class = (distance_m / width_m) as u64;
            classes.entry(class).or_default().push((distance_m, moment, both.collect()));
        }
    }
    let class = |pairs: Vec<Pair>| {
        let count = pairs.len() as f64;
        let mean = |of: &dyn Fn(&Pair) -> f64| pairs.iter().map(of).sum::<f64>() / count;
        let value = mean(&|(_, moment, _)| moment.value);
        let random = mean(&|(_, moment, _)| moment.random);
        let width = WIDTH * random.hypot(value * scale_se);
        let covariance = Moment {
            value,
            low: value - width,
            high: value + width,
            random,
            systematic: mean(&|(_, moment, _)| moment.systematic),
            time_s: mean(&|(_, moment, _)| moment.time_s),
        };
        DistanceClass {
            distance_m: mean(&|(distance_m, ..)| *distance_m),
            pairs: pairs.len(),
            covariance,
            by_lag: (0..=lags).map(|lag| mean(&|(.., by_lag)| by_lag[lag])).collect(),
        }
    };
    classes.into_values().map(class).collect()
}

/// Advection of the air's pattern past the points.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct Advection {
    /// Velocity in the axes of the places, m/s.
    pub velocity_mps: [f64; 2],
    /// Standard error of the speed, m/s.
    pub speed_se_mps: f64,
    /// Number of pairs that it is from.
    pub pairs: usize,
}

impl Advection {
    /// Speed, m/s.
    pub fn speed_mps(&self) -> f64 {
        let [x, y] = self.velocity_mps;
        x.hypot(y)
    }
}

/// Lag at which two records are most alike, steps (positive: the second is later), and the correlation there.
fn best_lag(a: &Record, b: &Record, most: usize) -> Option<(f64, f64)> {
    let (later, earlier) = (cross(a, b, most), cross(b, a, most));
    let scale = (cross(a, a, 0)[0] * cross(b, b, 0)[0]).sqrt();
    let all: Vec<f64> = earlier.iter().skip(1).rev().chain(&later).map(|of| of / scale).collect();
    let (at, peak) = all
        .iter()
        .enumerate()
        .filter(|(_, value)| !value.is_nan())
        .max_by(|(_, a), (_, b)| a.total_cmp(b))?;
    // A parabola through the peak and its neighbours; a peak at the end is none.
    let (before, after) = (all.get(at.checked_sub(1)?)?, all.get(at + 1)?);
    let bend = before - 2.0 * peak + after;
    let shift = if bend < 0.0 { 0.5 * (before - after) / bend } else { 0.0 };
    Some((at as f64 - most as f64 + shift.clamp(-0.5, 0.5), *peak))
}

/// Velocity at which the pattern passes the points, by the lags at which pairs are most alike: a frozen pattern that is
/// carried at `U` is most alike after `d · U / |U|²`. Pairs count by their correlation; the error is that of leaving out
/// each point in turn (jackknife). `None` where too few pairs are alike, where no velocity explains a quarter of the lags (noise,
/// waves that stand), or where the pattern cannot be told from one that stands.
pub fn advection(points: &[At<'_>], longest_s: f64) -> Option<Advection> {
    let step_s = points.first()?.record.step_s();
    let most = (longest_s / step_s) as usize;
    let mut pairs: Vec<Alike> = Vec::new();
    for (i, one) in points.iter().enumerate() {
        for (j, other) in points.iter().enumerate().skip(i + 1) {
            let apart = [0, 1].map(|axis| other.place_m[axis] - one.place_m[axis]);
            let Some((lag, correlation)) = best_lag(one.record, other.record, most) else {
                continue;
            };
            if correlation >= LEAST_CORRELATION {
                pairs.push((i, j, apart, lag * step_s, correlation));
            }
        }
    }
    let fit = |without: Option<usize>| {
        let used = pairs.iter().filter(|(i, j, ..)| Some(*i) != without && Some(*j) != without);
        slowness(&used.map(|(_, _, apart, lag_s, correlation)| (*apart, *lag_s, *correlation)))
    };
    if pairs.len() < FEWEST_PAIRS {
        return None;
    }
    let velocity_mps = fit(None)?;
    let speed = |velocity: [f64; 2]| velocity[0].hypot(velocity[1]);
    let without: Vec<f64> =
        (0..points.len()).filter_map(|point| fit(Some(point))).map(speed).collect();
    let count = without.len() as f64;
    if without.len() < 3 || speed(velocity_mps) > FASTEST_MPS {
        return None;
    }
    let mean = without.iter().sum::<f64>() / count;
    let squares: f64 = without.iter().map(|value| (value - mean).powi(2)).sum();
    let speed_se_mps = ((count - 1.0) / count * squares).sqrt();
    // Without one of the points it would be another wind.
    if speed_se_mps > LARGEST_SHARE * speed(velocity_mps)
        || explained(&pairs, velocity_mps) < EXPLAINED
    {
        return None;
    }
    Some(Advection { velocity_mps, speed_se_mps, pairs: pairs.len() })
}

/// Two points, their distance along each axis, m, the lag at which they are most alike, s, and the correlation there.
type Alike = (usize, usize, [f64; 2], f64, f64);

/// Share of the lags' squares that a velocity explains, pairs weighted by their correlation.
fn explained(pairs: &[Alike], [x, y]: [f64; 2]) -> f64 {
    let square = x * x + y * y;
    let (mut left, mut all) = (0.0, 0.0);
    for (_, _, apart, lag_s, correlation) in pairs {
        let expected_s = (apart[0] * x + apart[1] * y) / square;
        left += correlation.powi(2) * (lag_s - expected_s).powi(2);
        all += correlation.powi(2) * lag_s.powi(2);
    }
    1.0 - left / all
}

/// Velocity whose slowness explains lags over distances; outliers, as of pairs that are alike by chance, count less.
fn slowness(pairs: &(impl Iterator<Item = ([f64; 2], f64, f64)> + Clone)) -> Option<[f64; 2]> {
    let mut slow = [0.0, 0.0];
    let mut scale_s = f64::INFINITY;
    for _ in 0..20 {
        let (mut normal, mut right) = ([0.0; 3], [0.0; 2]);
        let mut left = Vec::new();
        for ([x, y], lag_s, correlation) in pairs.clone() {
            let off = lag_s - slow[0] * x - slow[1] * y;
            left.push(off.abs());
            let weight = correlation.powi(2) / (1.0 + (off / scale_s).powi(2));
            normal = [
                normal[0] + weight * x * x,
                normal[1] + weight * x * y,
                normal[2] + weight * y * y,
            ];
            right = [right[0] + weight * x * lag_s, right[1] + weight * y * lag_s];
        }
        let determinant = normal[0] * normal[2] - normal[1] * normal[1];
        if determinant.is_nan() || determinant <= 1e-9 * normal[0] * normal[2] {
            return None;
        }
        slow = [
            (right[0] * normal[2] - right[1] * normal[1]) / determinant,
            (right[1] * normal[0] - right[0] * normal[1]) / determinant,
        ];
        left.sort_by(f64::total_cmp);
        scale_s = (3.0 * left.get(left.len() / 2)?).max(0.1);
    }
    let square = slow[0].powi(2) + slow[1].powi(2);
    (square > 0.0).then(|| slow.map(|of| of / square))
}
