//! Maps of two flights side by side: the fleet's mean, means by place, strength and scales of the air.
//!
//! Errors of a map that both flights share cancel in the difference and are left out of it: those of a calibration that
//! both rest on, and the exponent of the air's density, which is a constant of the vehicle. Battery and wind were
//! others in each flight: their errors count twice.

use nalgebra::DMatrix;

use super::chance::{chi2_above, holm, two_sided, two_sided_t};
use super::result::{MapComparison, MeanComparison, PlaceChange, PlaceComparison, ScaleComparison};
use super::side::Couple;
use crate::analysis::LawKind;
use crate::analysis::result::{DroneUpdraft, FlightAnalysis, UpdraftMap};
use crate::analysis::statistics::result::{FieldStatistics, Interval, Scale};
use crate::base::estimate::Estimate;
use crate::numeric::{Line, mean};

/// Standard errors to each side of a normal 95 % interval.
const NORMAL: f64 = 1.959963984540054;
/// Drones are at one place up to this distance, m: surveyed homes are not exactly on their grid.
const SAME_PLACE_M: f64 = 0.5;
/// Hovers are at one height up to this difference, m.
const SAME_HEIGHT_M: f64 = 5.0;
/// Fewest places that make a pattern.
const FEWEST_PLACES: usize = 3;
/// Share of the smaller map's places that both must have.
const COMMON_SHARE: f64 = 0.5;
/// Independent places without which a correlation means nothing.
const FEWEST_INDEPENDENT: f64 = 3.0;
/// Places that the number of independent ones is found from.
const MOST_PLACES: usize = 600;

/// The calibrations that two maps rest on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Calibrations {
    /// They are one.
    pub(super) are_one: bool,
    /// Relative standard error of their laws' slope, which makes any change too large or too small.
    pub(super) slope_share: f64,
    /// Scatter of the drones' laws over their stated errors, by which those are widened here, too; 1 or more.
    pub(super) scatter: f64,
}

impl Calibrations {
    /// One calibration is as good as two where its law is flat near hover: an error of its zero is then no shift.
    fn as_far_as_errors_cancel(self, maps: [&UpdraftMap; 2]) -> Self {
        let is_flat = maps.iter().any(|map| map.law == LawKind::SignedQuadratic);
        Self { are_one: self.are_one && !is_flat, ..self }
    }
}

/// Compares the maps of two flights. Also tells why places were not compared.
pub(super) fn compare(
    couple: &Couple<'_>,
    [a, b]: [&UpdraftMap; 2],
    calibrations: Calibrations,
) -> Option<(MapComparison, Option<String>)> {
    let is_shared = calibrations.are_one;
    let calibrations = calibrations.as_far_as_errors_cancel([a, b]);
    let mean = means(a, b, calibrations)?;
    let fleet = |map: &UpdraftMap| map.posterior.as_ref().and_then(|posterior| posterior.fleet);
    let posterior = fleet(a).zip(fleet(b)).filter(|_| !calibrations.are_one);
    let flights = [couple.reference.flight, couple.other.flight];
    let (places, reason) = match by_place(a, b, calibrations, flights) {
        Ok(places) => (Some(places), None),
        Err(reason) => (None, Some(reason)),
    };
    let comparison = MapComparison {
        pair: couple.pair(),
        mean,
        posterior: posterior.map(|(a, b)| of_normals(a, b)),
        same_calibration: is_shared,
        errors_cancel: calibrations.are_one,
        places,
        scales: scales(flights, [a, b]),
    };
    Some((comparison, reason))
}

fn of_normals(a: Estimate, b: Estimate) -> MeanComparison {
    let interval = |of: Estimate| [of.value - NORMAL * of.se, of.value + NORMAL * of.se];
    let change = Estimate::new(b.value - a.value, a.se.hypot(b.se));
    let z = (change.se > 0.0).then(|| change.value / change.se);
    MeanComparison {
        reference: a,
        reference_interval: Some(interval(a)),
        other: b,
        other_interval: Some(interval(b)),
        change,
        change_interval: Some(interval(change)),
        z,
        p_value: z.map(two_sided),
    }
}

/// Variance of a drone's mean by errors of its own.
fn own_variance(map: &UpdraftMap, drone: &DroneUpdraft, calibrations: Calibrations) -> f64 {
    let errors = &drone.errors;
    let of_law = if calibrations.are_one {
        0.0
    } else {
        let common = map.common.map_or(0.0, |common| common.law_mps);
        (errors.law_mps.powi(2) - common * common).max(0.0) * calibrations.scatter.powi(2)
    };
    errors.window_mps.powi(2) + errors.velocity_mps.powi(2) + of_law
}

/// Means over the drones, and what is known of their errors.
struct FleetMean {
    value: f64,
    own_variance: f64,
    /// Standard error of zero and law, and half the width of its 95 % interval.
    zero: [f64; 2],
    /// Standard error of battery and wind.
    flight: f64,
    density: f64,
    is_known: bool,
}

impl FleetMean {
    fn of(map: &UpdraftMap, calibrations: Calibrations) -> Option<Self> {
        let drones = || map.drones.iter().filter(|drone| drone.mean.value.is_finite());
        let value = mean(drones().map(|drone| drone.mean.value))?;
        let n = drones().count() as f64;
        let own = drones().map(|drone| own_variance(map, drone, calibrations)).sum::<f64>();
        let common = map.common.unwrap_or_default();
        let flight = common.battery_mps.hypot(common.wind_mps);
        let zero = common.zero_mps.hypot(common.law_mps);
        let rest = flight.hypot(common.density_mps);
        let half = (common.half_width_mps.powi(2) - (NORMAL * rest).powi(2)).max(0.0).sqrt();
        Some(Self {
            value,
            own_variance: own / (n * n),
            zero: [zero, half.max(NORMAL * zero)],
            flight,
            density: common.density_mps,
            is_known: map.common.is_some(),
        })
    }

    fn alone(&self) -> (Estimate, f64) {
        let rest = self.flight.hypot(self.density).hypot(self.own_variance.sqrt());
        (Estimate::new(self.value, self.zero[0].hypot(rest)), self.zero[1].hypot(NORMAL * rest))
    }
}

fn means(a: &UpdraftMap, b: &UpdraftMap, calibrations: Calibrations) -> Option<MeanComparison> {
    let (a, b) = (FleetMean::of(a, calibrations)?, FleetMean::of(b, calibrations)?);
    let is_known = a.is_known && b.is_known;
    let interval = |value: f64, half: f64| is_known.then_some([value - half, value + half]);
    let rest = (a.own_variance + b.own_variance).sqrt().hypot(a.flight.hypot(b.flight));
    let rest = rest.hypot(a.density - b.density);
    let [zero, half] =
        [0, 1].map(|of| if calibrations.are_one { 0.0 } else { a.zero[of].hypot(b.zero[of]) });
    let rest = rest.hypot((b.value - a.value) * calibrations.slope_share);
    let change = Estimate::new(b.value - a.value, if is_known { zero.hypot(rest) } else { 0.0 });
    let half = half.hypot(NORMAL * rest);
    // The interval of a zero is wider than a normal one: its half width says what is beyond chance.
    let z = (is_known && half > 0.0).then(|| change.value * NORMAL / half);
    let ((of_a, half_a), (of_b, half_b)) = (a.alone(), b.alone());
    Some(MeanComparison {
        reference: of_a,
        reference_interval: interval(of_a.value, half_a),
        other: of_b,
        other_interval: interval(of_b.value, half_b),
        change,
        change_interval: interval(change.value, half),
        z,
        p_value: z.map(two_sided),
    })
}

/// Means by place. `Err`: why not.
fn by_place(
    a: &UpdraftMap,
    b: &UpdraftMap,
    calibrations: Calibrations,
    flights: [&FlightAnalysis; 2],
) -> Result<PlaceComparison, String> {
    if a.is_scan() || b.is_scan() {
        return Err("the drones moved, so that they have no places of their own".to_owned());
    }
    let placed =
        |map: &UpdraftMap| map.drones.iter().filter(|one| one.position_m.is_some()).count();
    let (in_a, in_b) = (placed(a), placed(b));
    if in_a == 0 || in_b == 0 {
        return Err("the places of the drones are not known".to_owned());
    }
    let mut taken = vec![false; b.drones.len()];
    let mut places = Vec::new();
    for drone in a.drones.iter().filter(|drone| drone.mean.value.is_finite()) {
        let Some(position_m) = drone.position_m else { continue };
        let is_here = |other: &DroneUpdraft| {
            other.mean.value.is_finite()
                && (other.height_m - drone.height_m).abs() <= SAME_HEIGHT_M
                && other.position_m.is_some_and(|at| {
                    (at[0] - position_m[0]).hypot(at[1] - position_m[1]) <= SAME_PLACE_M
                })
        };
        let found = b.drones.iter().enumerate().find(|(at, other)| !taken[*at] && is_here(other));
        let Some((at, other)) = found else { continue };
        taken[at] = true;
        let own = |map: &UpdraftMap, drone: &DroneUpdraft| {
            Estimate::new(drone.mean.value, own_variance(map, drone, calibrations).sqrt())
        };
        let (reference, other) = (own(a, drone), own(b, other));
        let change = Estimate::new(other.value - reference.value, reference.se.hypot(other.se));
        let (name, slot) = (drone.name.clone(), drone.slot);
        places.push(PlaceChange { name, slot, position_m, reference, other, change });
    }
    let enough = (COMMON_SHARE * in_a.min(in_b) as f64).max(FEWEST_PLACES as f64);
    if (places.len() as f64) < enough {
        return Err(format!(
            "the grids differ: of {in_a} and {in_b} places, {} are the same",
            places.len()
        ));
    }
    let (chi2, dof) = pattern(&places)
        .ok_or_else(|| "the errors of the drones' means are not known".to_owned())?;
    let values: Vec<[f64; 2]> =
        places.iter().map(|place| [place.reference.value, place.other.value]).collect();
    let correlation = pearson(&values);
    let lengths = [length_m(flights[0], a), length_m(flights[1], b)];
    let effective_places = match lengths {
        [Some(of_a), Some(of_b)] => independent(&places, [of_a, of_b]),
        _ => None,
    };
    let by_chance = |r: f64, n: f64| {
        let dof = n - 2.0;
        let t = r * (dof / (1.0 - r * r).max(f64::MIN_POSITIVE)).sqrt();
        two_sided_t(t, Some(dof))
    };
    let correlation_p_value = correlation
        .zip(effective_places)
        .filter(|(_, n)| *n >= FEWEST_INDEPENDENT)
        .map(|(r, n)| by_chance(r, n));
    Ok(PlaceComparison {
        chi2,
        dof,
        p_value: chi2_above(chi2, dof),
        correlation,
        effective_places,
        correlation_p_value,
        places,
    })
}

/// Chi² of the changes about their weighted mean; `None` where an error is not known.
fn pattern(places: &[PlaceChange]) -> Option<(f64, usize)> {
    let changes = || places.iter().map(|place| place.change);
    if !changes().all(|change| change.se > 0.0 && change.se.is_finite()) {
        return None;
    }
    let weight: f64 = changes().map(|change| change.se.powi(-2)).sum();
    let center = changes().map(|change| change.value * change.se.powi(-2)).sum::<f64>() / weight;
    let chi2 = changes().map(|change| ((change.value - center) / change.se).powi(2)).sum();
    Some((chi2, places.len() - 1))
}

fn pearson(values: &[[f64; 2]]) -> Option<f64> {
    let line = Line::through(values.iter().map(|[a, b]| (*a, *b)))?;
    Some(line.correlation()?.clamp(-1.0, 1.0))
}

/// Length of the air's correlation, m: of the posterior's scales, else of maximum likelihood.
fn length_m(flight: &FlightAnalysis, map: &UpdraftMap) -> Option<f64> {
    let scales = map.posterior.as_ref().and_then(|posterior| posterior.scales.as_ref());
    let likelihood = || Some(flight.statistics.as_ref()?.likelihood.as_ref()?.lambda_m.value);
    scales.map(|scales| scales.length_m.value).or_else(likelihood).filter(|length| *length > 0.0)
}

/// Effective number of places for the correlation of two independent fields with exponential correlations
/// (Dutilleul 1993): 1 + tr(PA) tr(PB) / tr(PA PB), where P takes out the mean.
fn independent(places: &[PlaceChange], lengths_m: [f64; 2]) -> Option<f64> {
    let step = places.len().div_ceil(MOST_PLACES);
    let at: Vec<[f64; 2]> = places.iter().step_by(step).map(|place| place.position_m).collect();
    let n = at.len();
    let centred = |length_m: f64| {
        let of = |row: usize, column: usize| {
            let apart = (at[row][0] - at[column][0]).hypot(at[row][1] - at[column][1]);
            (-apart / length_m).exp()
        };
        let mut matrix = DMatrix::from_fn(n, n, of);
        let rows: Vec<f64> = matrix.row_iter().map(|row| row.mean()).collect();
        let all = mean(rows.iter().copied()).unwrap_or_default();
        for row in 0..n {
            for column in 0..n {
                matrix[(row, column)] += all - rows[row] - rows[column];
            }
        }
        matrix
    };
    let [a, b] = lengths_m.map(centred);
    let both = a.dot(&b);
    (both > 0.0).then(|| 1.0 + a.trace() * b.trace() / both)
}

/// Rows of the air at a drone, which the posterior has nothing of.
const OF_DRONES: usize = 2;

/// Strength and scales that both flights have.
fn scales(flights: [&FlightAnalysis; 2], maps: [&UpdraftMap; 2]) -> Vec<ScaleComparison> {
    type Of = fn(&FieldStatistics) -> Option<(f64, Option<[f64; 2]>)>;
    let of_statistics: [(&str, &str, Of); 5] = [
        ("standard deviation of the air at a drone", "m/s", |of| {
            let drone = &of.baseline.as_ref()?.drone;
            // What air that is slower than the record has is not in it.
            let interval = (!drone.is_open).then(|| ends(drone.sd_interval_mps));
            Some((drone.sd_mps, interval))
        }),
        ("integral time of the air at a drone", "s", |of| {
            let drone = &of.baseline.as_ref()?.drone;
            let interval = (!drone.is_open).then(|| ends(drone.integral_time_interval_s));
            Some((drone.integral_time_s, interval))
        }),
        ("correlation length by the pairs of drones", "m", |of| {
            of.space.as_ref()?.all.lambda_m.as_ref().map(of_scale)
        }),
        ("correlation length of maximum likelihood", "m", |of| {
            Some(of_scale(&of.likelihood.as_ref()?.lambda_m))
        }),
        ("correlation time of maximum likelihood", "s", |of| {
            Some(of_scale(&of.likelihood.as_ref()?.tau_s))
        }),
    ];
    let statistics = flights.map(|flight| flight.statistics.as_ref());
    let posterior =
        maps.map(|map| map.posterior.as_ref().and_then(|posterior| posterior.scales.as_ref()));
    // The others are of one exponential field, and of what one flight happens to show of it: their intervals do not hold in air
    // that has gusts besides, and told flights in the same air apart.
    let told = if posterior.iter().all(Option::is_some) { OF_DRONES } else { of_statistics.len() };
    let mut rows: Vec<ScaleComparison> = of_statistics
        .into_iter()
        .take(told)
        .filter_map(|(name, unit, of)| {
            Some(row(name, unit, of(statistics[0]?)?, of(statistics[1]?)?))
        })
        .collect();
    if let [Some(a), Some(b)] = posterior {
        for (name, unit, of) in [
            ("correlation length of the posterior map", "m", [a.length_m, b.length_m]),
            ("correlation time of the posterior map", "s", [a.time_s, b.time_s]),
        ] {
            let [a, b] = of.map(|scale| (scale.value, Some(scale.interval)));
            rows.push(row(name, unit, a, b));
        }
    }
    let p_values: Vec<f64> = rows.iter().map(|row| row.p_value.unwrap_or(f64::NAN)).collect();
    for (row, p) in rows.iter_mut().zip(holm(&p_values)) {
        row.p_holm = (!p.is_nan()).then_some(p);
    }
    rows
}

fn ends(of: Interval) -> [f64; 2] {
    [of.low, of.high]
}

fn of_scale(scale: &Scale) -> (f64, Option<[f64; 2]>) {
    (scale.value, scale.interval_95.filter(|_| scale.undetermined.is_none()).map(ends))
}

fn row(
    name: &str,
    unit: &str,
    (reference, reference_interval): (f64, Option<[f64; 2]>),
    (other, other_interval): (f64, Option<[f64; 2]>),
) -> ScaleComparison {
    let z = reference_interval
        .zip(other_interval)
        .and_then(|(of_a, of_b)| log_ratio_z((reference, of_a), (other, of_b)));
    ScaleComparison {
        name: name.to_owned(),
        unit: unit.to_owned(),
        reference,
        reference_interval,
        other,
        other_interval,
        z,
        p_value: z.map(two_sided),
        p_holm: None,
    }
}

/// Logarithm of a ratio over its error, from the halves of the intervals that face each other; `None` where they are
/// no intervals of positive numbers.
fn log_ratio_z((a, of_a): (f64, [f64; 2]), (b, of_b): (f64, [f64; 2])) -> Option<f64> {
    let is_one = |value: f64, [low, high]: [f64; 2]| {
        low > 0.0 && low <= value && value <= high && high.is_finite()
    };
    if !(is_one(a, of_a) && is_one(b, of_b)) {
        return None;
    }
    let (up, down) = (
        |value: f64, of: [f64; 2]| (of[1] / value).ln(),
        |value: f64, of: [f64; 2]| (value / of[0]).ln(),
    );
    let halves = if b >= a { [up(a, of_a), down(b, of_b)] } else { [down(a, of_a), up(b, of_b)] };
    let se = halves[0].hypot(halves[1]) / NORMAL;
    (se > 0.0).then(|| (b / a).ln() / se)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place(x: f64, y: f64, a: f64, b: f64) -> PlaceChange {
        PlaceChange {
            name: String::new(),
            slot: None,
            position_m: [x, y],
            reference: Estimate::new(a, 0.1),
            other: Estimate::new(b, 0.1),
            change: Estimate::new(b - a, 0.2),
        }
    }

    #[test]
    fn a_shift_of_all_is_no_pattern() {
        let shifted: Vec<_> = (0..5).map(|i| place(f64::from(i), 0.0, 0.3, 0.7)).collect();
        let (chi2, dof) = pattern(&shifted).unwrap();
        assert!(chi2 < 1e-12 && dof == 4);
        let mut one = shifted;
        one[0] = place(0.0, 0.0, 0.3, 1.7);
        // By hand: one of five is 1 off, so that the squares sum up to 0.8, over 0.04.
        assert!((pattern(&one).unwrap().0 - 20.0).abs() < 1e-9);
    }

    #[test]
    fn the_zero_of_one_calibration_cancels_by_a_line_alone() {
        let map = |law: &str, mean_mps: f64| -> UpdraftMap {
            serde_json::from_value(serde_json::json!({
                "law": law, "time_s": [], "common": { "se_mps": 0.3, "half_width_mps": 0.6, "zero_mps": 0.3 },
                "drones": [{
                    "slot": 1, "name": "Drone 1", "position_m": null, "height_m": 100.0, "mapping": "own",
                    "mean": { "value": mean_mps, "se": 0.3 }, "updraft_mps": [], "truth_mps": null,
                }],
            }))
            .unwrap()
        };
        let error = |law: &str, slope_share: f64| {
            let (a, b) = (map(law, 0.2), map(law, 0.8));
            let one = Calibrations { are_one: true, slope_share, scatter: 1.0 };
            means(&a, &b, one.as_far_as_errors_cancel([&a, &b])).unwrap().change.se
        };
        assert!(error("linear", 0.0) < 1e-9);
        assert!((error("linear", 0.1) - 0.06).abs() < 1e-9);
        assert!((error("signed quadratic", 0.0) - 0.3 * 2.0_f64.sqrt()).abs() < 1e-9);
    }

    #[test]
    fn places_far_apart_are_independent_and_near_ones_are_not() {
        let grid = |spacing: f64| -> Vec<PlaceChange> {
            let at = |i: i32| (f64::from(i % 5) * spacing, f64::from(i / 5) * spacing);
            (0..25).map(|i| place(at(i).0, at(i).1, 0.0, 0.0)).collect()
        };
        // 25 independent places have 24 degrees of freedom beside their mean.
        assert!((independent(&grid(1e4), [100.0, 100.0]).unwrap() - 25.0).abs() < 0.1);
        // NumPy: 1 + trace(PAP)**2 / trace(PAP @ PAP).
        let near = independent(&grid(7.0), [145.0, 145.0]).unwrap();
        assert!((near - 6.805269246629946).abs() < 1e-9, "{near}");
    }

    #[test]
    fn intervals_that_face_each_other_count() {
        let z = log_ratio_z((10.0, [5.0, 20.0]), (20.0, [10.0, 25.0])).unwrap();
        // By hand: ln 2 / (hypot(ln 2, ln 2) / 1.96).
        assert!((z - NORMAL / 2.0_f64.sqrt()).abs() < 1e-9);
        assert_eq!(log_ratio_z((10.0, [0.0, 20.0]), (20.0, [10.0, 25.0])), None);
    }
}
