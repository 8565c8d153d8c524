//! Errors that the products of a measurement will have, before it is flown: what its time and its drones can tell of
//! air whose scales are assumed.
//!
//! The air is a Gaussian field whose covariance is `sd² exp(-|d - V s|/L) exp(-|s|/tau)` between points d apart and times
//! s apart, which is that of the simulator's `field`. Means over a record scatter by its integral, variances and
//! covariances by that of its square (Lenschow, Mann and Kristensen 1994); drones that see the same eddies count as the
//! field has them in common. The noise of the instrument is not in it.

use schemars::JsonSchema;
use serde::Serialize;
use turbulence_statistics::moments::expected;

use super::running::RUNNING_S;
use super::track;
use super::windows::Target;
use crate::mission::Plan;
use crate::mission::plan::{Purpose, Segment};
use crate::numeric;
use crate::sim::air::{convective_length_m, convective_sd_mps};

/// Height of the inversion that is assumed, m: a fair summer noon over land.
const ZI_M: f64 = 1_400.0;
/// Convective velocity scale that is assumed, m/s: moderate convection. With `ZI_M` w scatters by half a metre per second at
/// 100 m.
const W_STAR_MPS: f64 = 1.0;
/// Wind that is assumed, m/s: what is flown in comfortably.
const WIND_MPS: f64 = 3.0;
/// Relative error for which the duration is stated.
const WANTED: f64 = 0.1;
/// Directions of the wind that are averaged over, degrees from show x: it is not known before the day.
const DIRECTIONS_DEG: [f64; 4] = [0.0, 45.0, 90.0, 135.0];
/// Steps of integrals over time, each way. Numerical.
const STEPS: usize = 150;
/// Most pairs of drones that are looked at; of more, a sample of so many.
const MOST_PAIRS: usize = 20_000;
/// Separations are looked at once to this, m.
const SAME_M: f64 = 0.1;

/// Scales of the air that somebody knows, in place of the usual ones.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AssumedAir {
    /// Integral time of w over a drone that hovers, s; `None`: that of convective air at its height in a wind of 3 m/s.
    pub integral_s: Option<f64>,
    /// Standard deviation of w, m/s; `None`: that of convective air at its height.
    pub sd_mps: Option<f64>,
}

/// A number for one drone and for all of them together.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct OneAndFleet {
    /// Of one drone.
    pub drone: f64,
    /// Of all drones together.
    pub fleet: f64,
}

/// The covariance of two drones, and its error.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct ExpectedCovariance {
    /// Distance of the drones, m.
    pub distance_m: f64,
    /// Covariance that the assumed air has over it, share of the variance.
    pub share: f64,
    /// Standard error of the covariance of one such pair, share of the variance.
    pub error: f64,
}

/// Errors that a measurement will have in the air that is assumed.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct ExpectedErrors {
    /// Height above ground for which the air is assumed, m: the mean of what is measured.
    pub height_m: f64,
    /// Time that is measured in one piece of air, s: of a column, at each of its heights.
    pub measured_s: f64,
    /// Heights that are measured one after the other; 1 but for a column.
    pub heights: usize,
    /// Integral time of w over a drone as it flies, s.
    pub integral_s: f64,
    /// Integral length of w that is assumed, m.
    pub length_m: f64,
    /// Standard deviation of w that is assumed, m/s.
    pub sd_mps: f64,
    /// Whether somebody gave the integral time; else it is that of convective air.
    pub integral_is_given: bool,
    /// Whether somebody gave the standard deviation.
    pub sd_is_given: bool,
    /// Speed over ground, m/s, 0 in hover.
    pub speed_mps: f64,
    /// Standard error of the mean of w, as a mean of the air and not only of its passing eddies, m/s.
    pub mean_mps: OneAndFleet,
    /// Standard error of the zero that a calibration in the same air gives: slow air during the ladder, m/s. `None` without
    /// a calibration in the mission.
    pub zero_mps: Option<OneAndFleet>,
    /// Standard error of the variance of w, share of it.
    pub variance: OneAndFleet,
    /// Share of the variance that the record's own mean takes, before it is corrected.
    pub variance_lost: f64,
    /// Duration after which the variance is known to 10 %, s.
    pub variance_to_tenth_s: OneAndFleet,
    /// Covariances between two drones: neighbours, and those farthest apart. None of one drone.
    pub covariances: Vec<ExpectedCovariance>,
}

/// Scales of the assumed air, as a drone that flies meets it.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Scales {
    sd_mps: f64,
    length_m: f64,
    /// Speed of the air past the drone, m/s.
    past_mps: f64,
    /// Rate at which eddies turn over, 1/s.
    decay_per_s: f64,
}

impl Scales {
    fn of(air: AssumedAir, height_m: f64, speed_mps: f64) -> Self {
        let length_m = convective_length_m(ZI_M, height_m.clamp(1.0, ZI_M));
        let own_mps = convective_sd_mps(W_STAR_MPS, ZI_M, height_m.clamp(1.0, ZI_M)).max(0.01);
        let (mut wind_mps, mut decay_per_s) = (WIND_MPS, own_mps / length_m);
        if let Some(given_s) = air.integral_s {
            // What the wind does not explain is the eddies' own time.
            let rate = 1.0 / given_s;
            wind_mps = wind_mps.min(rate * length_m);
            decay_per_s = (rate - wind_mps / length_m).max(0.0);
        }
        let past_mps = wind_mps.hypot(speed_mps);
        Self { sd_mps: air.sd_mps.unwrap_or(own_mps), length_m, past_mps, decay_per_s }
    }

    /// Integral time over one drone, s.
    fn integral_s(&self) -> f64 {
        1.0 / (self.past_mps / self.length_m + self.decay_per_s)
    }

    /// Correlation of points this far apart, m, so many seconds apart, with the air coming along x.
    fn correlation(&self, apart_m: [f64; 2], later_s: f64) -> f64 {
        let distance_m = f64::hypot(apart_m[0] - self.past_mps * later_s, apart_m[1]);
        (-distance_m / self.length_m - self.decay_per_s * later_s.abs()).exp()
    }

    /// Means over two records of this length of some function of the correlation at a lag and at its opposite:
    /// `1/t` times the integral of `(1 - |s|/t) of(rho(d, s), rho(d, -s))`.
    fn over_record(&self, apart_m: [f64; 2], length_s: f64, of: impl Fn(f64, f64) -> f64) -> f64 {
        let reach_s =
            8.0 * self.integral_s() + f64::hypot(apart_m[0], apart_m[1]) / self.past_mps.max(0.1);
        let step_s = reach_s.min(length_s) / STEPS as f64;
        let value = |index: usize| {
            let later_s = (index as f64 + 0.5) * step_s;
            let (ahead, behind) =
                (self.correlation(apart_m, later_s), self.correlation(apart_m, -later_s));
            (1.0 - later_s / length_s) * (of(ahead, behind) + of(behind, ahead))
        };
        (0..STEPS).map(value).sum::<f64>() * step_s / length_s
    }
}

/// Separations of drones with their number, each pair in both orders, and a drone with itself.
struct Separations {
    /// Number of drones.
    drones: usize,
    /// Distances along and across the wind, m, and weights that add up to 1.
    of_pairs: Vec<([f64; 2], f64)>,
}

impl Separations {
    fn of(places_m: &[[f64; 2]], directions_deg: &[f64]) -> Self {
        let drones = places_m.len();
        let mut counted = std::collections::BTreeMap::<[i64; 2], f64>::new();
        let mut count = |one: [f64; 2], other: [f64; 2]| {
            // The directions are alike on both sides of the axes.
            let key =
                [one[0] - other[0], one[1] - other[1]].map(|m| (m.abs() / SAME_M).round() as i64);
            *counted.entry(key).or_default() += 1.0;
        };
        if drones * drones.saturating_sub(1) / 2 <= MOST_PAIRS {
            for (index, one) in places_m.iter().enumerate() {
                places_m.iter().skip(index + 1).for_each(|other| count(*one, *other));
            }
        } else {
            for pair in 0..MOST_PAIRS {
                let (one, other) =
                    (pair * 7_919 % drones, (pair * 104_729 + pair / drones) % drones);
                if one != other {
                    count(places_m[one], places_m[other]);
                }
            }
        }
        let all: f64 = counted.values().sum();
        let mut of_pairs = Vec::new();
        for (key, number) in counted {
            let [x, y] = key.map(|cells| cells as f64 * SAME_M);
            for direction_deg in directions_deg {
                let (sin, cos) = direction_deg.to_radians().sin_cos();
                let weight = number / all / directions_deg.len() as f64;
                of_pairs.push(([cos * x + sin * y, cos * y - sin * x], weight));
            }
        }
        Self { drones, of_pairs }
    }

    /// Mean of a quantity over all pairs of drones, those with themselves included.
    fn mean(&self, of: impl Fn([f64; 2]) -> f64) -> f64 {
        let own = 1.0 / self.drones.max(1) as f64;
        let between: f64 =
            self.of_pairs.iter().map(|(apart_m, weight)| weight * of(*apart_m)).sum();
        own * of([0.0; 2]) + (1.0 - own) * between
    }
}

/// What a group of a plan measures.
struct Measured {
    height_m: f64,
    /// Duration of one piece of air, s.
    length_s: f64,
    heights: usize,
    speed_mps: f64,
}

impl Measured {
    fn of(segments: &[Segment]) -> Option<Self> {
        let own = || segments.iter().filter(|segment| !segment.calibrates_wind);
        let targets: Vec<(Target, &Segment)> = own()
            .filter_map(|segment| {
                let window = segment.window?;
                let target = Target {
                    kind: segment.kind,
                    label: segment.label.clone(),
                    start_s: window.start_ms as f64 / 1000.0,
                    end_s: window.end_ms as f64 / 1000.0,
                    commanded_mps: segment.velocity_mps[2],
                };
                Some((target, segment))
            })
            .collect();
        let segment_of = |target: &Target| {
            targets
                .iter()
                .find(|(one, _)| one.start_s == target.start_s)
                .map(|(_, segment)| *segment)
        };
        let height_m = |target: &Target| {
            segment_of(target).map(|segment| f64::midpoint(segment.from_m[2], segment.to_m[2]))
        };
        let plain: Vec<Target> = targets.iter().map(|(target, _)| target.clone()).collect();
        let looked = track::measuring(&plain, height_m);
        let length_s = |target: &&Target| target.end_s - target.start_s;
        let total_s: f64 = looked.iter().map(length_s).sum();
        if looked.is_empty() || total_s < RUNNING_S {
            return None;
        }
        let weighed = |of: &dyn Fn(&Segment) -> f64| -> f64 {
            let sum: f64 = (looked.iter())
                .filter_map(|target| Some(length_s(target) * of(segment_of(target)?)))
                .sum();
            sum / total_s
        };
        let heights: std::collections::BTreeSet<i64> =
            looked.iter().filter_map(|target| height_m(target)).map(|m| m.round() as i64).collect();
        let hovers = looked.iter().all(|target| target.kind.is_hover());
        let column = hovers && looked.len() > 1;
        Some(Self {
            height_m: weighed(&|segment| f64::midpoint(segment.from_m[2], segment.to_m[2])),
            length_s: if column {
                looked.iter().map(length_s).fold(f64::INFINITY, f64::min)
            } else {
                total_s
            },
            heights: if column { heights.len() } else { 1 },
            speed_mps: weighed(&|segment| {
                let [x, y, z] = segment.velocity_mps;
                x.hypot(y).hypot(z)
            }),
        })
    }
}

/// Time over which a calibration's ladder averages the air, and its mean height; `None` without a ladder.
fn ladder(plan: &Plan) -> Option<(f64, f64)> {
    let group = plan.groups.first()?;
    let legs: Vec<&Segment> = group
        .segments
        .iter()
        .filter(|segment| segment.kind.is_leg() && segment.window.is_some())
        .collect();
    let (first, last) = (legs.first()?.window?, legs.last()?.window?);
    let length_s = (last.end_ms.checked_sub(first.start_ms)?) as f64 / 1000.0;
    let height_m = numeric::mean(legs.iter().map(|leg| f64::midpoint(leg.from_m[2], leg.to_m[2])))?;
    (length_s > 0.0).then_some((length_s, height_m))
}

/// Errors that a measurement will have; `None` of a calibration, and of a plan that measures nothing. `calibration` is that of
/// the same mission.
pub fn expected_errors(
    plan: &Plan,
    calibration: Option<&Plan>,
    air: AssumedAir,
) -> Option<ExpectedErrors> {
    if plan.purpose != Purpose::Measurement {
        return None;
    }
    let measured = plan.groups.iter().find_map(|group| Measured::of(&group.segments))?;
    let places_m: Vec<[f64; 2]> =
        plan.slots.iter().map(|slot| [slot.home_m[0], slot.home_m[1]]).collect();
    let scales = Scales::of(air, measured.height_m, measured.speed_mps);
    let separations = Separations::of(&places_m, &DIRECTIONS_DEG);
    let errors = errors(&scales, &separations, measured.length_s);
    let zero_mps = calibration.and_then(ladder).map(|(length_s, height_m)| {
        let scales = Scales::of(air, height_m, 0.0);
        self::errors(&scales, &separations, length_s).mean_mps
    });
    Some(ExpectedErrors {
        height_m: measured.height_m,
        measured_s: measured.length_s,
        heights: measured.heights,
        integral_s: scales.integral_s(),
        length_m: scales.length_m,
        sd_mps: scales.sd_mps,
        integral_is_given: air.integral_s.is_some(),
        sd_is_given: air.sd_mps.is_some(),
        speed_mps: measured.speed_mps,
        mean_mps: errors.mean_mps,
        zero_mps,
        variance: errors.variance,
        variance_lost: expected(scales.integral_s(), measured.length_s).lost,
        variance_to_tenth_s: errors.variance_to_tenth_s,
        covariances: covariances(&scales, &places_m, measured.length_s),
    })
}

/// Errors of moments over a record.
struct Moments {
    mean_mps: OneAndFleet,
    variance: OneAndFleet,
    variance_to_tenth_s: OneAndFleet,
}

fn errors(scales: &Scales, separations: &Separations, length_s: f64) -> Moments {
    let one = expected(scales.integral_s(), length_s);
    let in_mean = separations.mean(|apart_m| scales.over_record(apart_m, length_s, |rho, _| rho));
    let square = |length_s: f64| {
        2.0 * separations.mean(|apart_m| scales.over_record(apart_m, length_s, |rho, _| rho * rho))
    };
    // Long records: the error falls with the square root of their length.
    let long_s = 1e3 * scales.integral_s();
    let squared = WANTED * WANTED;
    Moments {
        mean_mps: OneAndFleet {
            drone: scales.sd_mps * one.mean,
            fleet: scales.sd_mps * in_mean.max(0.0).sqrt(),
        },
        variance: OneAndFleet { drone: one.variance, fleet: square(length_s).max(0.0).sqrt() },
        variance_to_tenth_s: OneAndFleet {
            drone: turbulence_statistics::moments::length_for_variance_s(
                scales.integral_s(),
                WANTED,
            ),
            fleet: square(long_s) * long_s / squared,
        },
    }
}

/// Covariances of the drones that are nearest to each other, and of those that are farthest apart.
fn covariances(scales: &Scales, places_m: &[[f64; 2]], length_s: f64) -> Vec<ExpectedCovariance> {
    let first = places_m.first().copied().unwrap_or_default();
    let far = |from: [f64; 2], to: &[f64; 2]| f64::hypot(from[0] - to[0], from[1] - to[1]);
    // Of the first drone, in a corner or in the middle: the whole fleet would be all pairs.
    let distances = || places_m.iter().skip(1).map(|place| far(first, place));
    let Some((nearest_m, farthest_m)) = numeric::extent(distances()) else { return Vec::new() };
    let mut all = vec![nearest_m];
    if farthest_m > nearest_m + SAME_M {
        all.push(farthest_m);
    }
    let of = |distance_m: f64| {
        let mean = |of: &dyn Fn([f64; 2]) -> f64| {
            let turned = DIRECTIONS_DEG.map(|deg| {
                let (sin, cos) = deg.to_radians().sin_cos();
                of([cos * distance_m, -sin * distance_m])
            });
            turned.iter().sum::<f64>() / turned.len() as f64
        };
        let own = scales.over_record([0.0; 2], length_s, |rho, _| rho * rho);
        let shared =
            mean(&|apart_m| scales.over_record(apart_m, length_s, |ahead, behind| ahead * behind));
        ExpectedCovariance {
            distance_m,
            share: scales.correlation([distance_m, 0.0], 0.0),
            error: (own + shared).max(0.0).sqrt(),
        }
    };
    all.into_iter().map(of).collect()
}

#[cfg(test)]
mod tests;
