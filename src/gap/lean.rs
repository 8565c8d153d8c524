//! Wind from the leans of the fleet.

use super::bins::{Bin, BinValues, have_two_headings};
use super::data::{Data, Group};
use super::filter::{Filter, LooksAt, Observation, State};
use super::lean_fit::{Body, Fitted, Point, fit, fit_body, hovering_wind};
use super::lean_law::LeanLaw;
use super::lean_misfit;
use crate::numeric::Moments;

/// Below this slope of the lean a bin's own lean says less than the flight's mean wind, rad/(m/s): noise of
/// the attitude of 0.1 degrees would be 0.4 m/s. Chosen.
const LEAST_SLOPE: f64 = 0.004;

/// The horizontal air as the leans of a flight show it.
#[derive(Clone, Debug, PartialEq)]
pub struct Wind {
    /// Mean wind, show frame, the direction it blows to, m/s; of several flights that of all together.
    pub mean_mps: [f64; 2],
    /// Where the logs are of several flights: the mean wind of that which each group flew in, m/s; empty otherwise.
    pub of_groups_mps: Vec<[f64; 2]>,
    /// Standard error of the mean wind along either axis, m/s.
    pub mean_se_mps: f64,
    /// That of each group's own mean wind, m/s; empty: they share one.
    pub of_groups_se_mps: Vec<f64>,
    /// Air speed of each group's drones in each bin, show frame, m/s.
    pub air_mps: Vec<Vec<[f64; 2]>>,
    /// Lean law that the flight's horizontal legs showed; `None` if it has none, so that the
    /// model's was taken.
    pub measured: Option<Measured>,
}

/// A lean law measured by horizontal legs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// Most probable law.
    pub law: LeanLaw,
    /// Standard error of the law's linear part, rad/(m/s).
    pub linear_se: f64,
    /// Minus the logarithm of its posterior density, but for a constant, nats.
    pub misfit_nats: f64,
}

/// Finds the wind. Horizontal legs at known speeds measure the lean law as well.
///
/// `flown` is the simulated side with the air that it was flown in: legs are short, and what a lean
/// still lacks of its steady value there lacks in the simulator, too.
pub(super) fn wind(
    data: &Data,
    law: LeanLaw,
    flown: Option<(&[Vec<BinValues>], [f64; 3])>,
) -> Wind {
    wind_by(data, law, law, flown)
}

/// The wind that a law reads where the simulated side was flown by another: what a lean lacks of its steady value is
/// the other's.
pub(super) fn wind_by(
    data: &Data,
    law: LeanLaw,
    flown_law: LeanLaw,
    flown: Option<(&[Vec<BinValues>], [f64; 3])>,
) -> Wind {
    let leans = settled_leans(data, flown_law, flown);
    let MeanWind { mean_mps, law, legs } = MeanWind::of(data, &leans, law, flown.is_some());
    let of_groups_mps = of_flights(data, &leans, law);
    let air_mps = data
        .groups
        .iter()
        .zip(&leans)
        .enumerate()
        .map(|(index, (group, leans))| {
            let mean_mps = of_groups_mps.get(index).copied().unwrap_or(mean_mps);
            let air = |(bin, lean): (&Bin, &[f64; 2])| {
                let steady = [bin.velocity_mps[0] - mean_mps[0], bin.velocity_mps[1] - mean_mps[1]];
                let tells = law.slope(steady[0].hypot(steady[1])) > LEAST_SLOPE;
                if tells { law.air(*lean, bin.climb_mps()) } else { steady }
            };
            let raw: Vec<[f64; 2]> = group.bins.iter().zip(leans).map(air).collect();
            smooth(group, &raw)
        })
        .collect();
    let doubt_mps = |mean_mps: &[f64; 2]| {
        let speed_mps = mean_mps[0].hypot(mean_mps[1]);
        let law_mps = legs.as_ref().map_or(LAW_DOUBT * speed_mps, |legs| {
            legs.mean_se_mps.hypot(LEGS_DOUBT * speed_mps).min(LAW_DOUBT * speed_mps)
        });
        LEAST_DOUBT_MPS.hypot(law_mps)
    };
    let mean_se_mps = doubt_mps(&mean_mps);
    let of_groups_se_mps = of_groups_mps.iter().map(doubt_mps).collect();
    let measured =
        legs.map(|legs| Measured { law, linear_se: legs.linear_se, misfit_nats: legs.misfit_nats });
    Wind { mean_mps, of_groups_mps, mean_se_mps, of_groups_se_mps, air_mps, measured }
}

/// The mean wind of the flight that each group flew in, by a law, m/s; empty: there is one flight.
fn of_flights(data: &Data, leans: &[Vec<[f64; 2]>], law: LeanLaw) -> Vec<[f64; 2]> {
    if data.flights().len() < 2 {
        return Vec::new();
    }
    let of_group = |group: &Group| {
        let is_own = |other: &Group| other.flight == group.flight;
        let own = data.groups.iter().zip(leans).filter(|(other, _)| is_own(other));
        hovering_wind(&points(own), law)
    };
    data.groups.iter().map(of_group).collect()
}

/// Standard error along an axis with which the leans of a flight that is yet to be flown will tell a mean wind, m/s.
pub(super) fn told_within_mps(data: &Data, mean_mps: [f64; 2]) -> f64 {
    let share = if data.has_legs() { LEGS_DOUBT } else { LAW_DOUBT };
    LEAST_DOUBT_MPS.hypot(share * mean_mps[0].hypot(mean_mps[1]))
}

/// Mean of the wind that [`wind`] finds, show frame, m/s.
pub(super) fn mean_wind(
    data: &Data,
    law: LeanLaw,
    flown: Option<(&[Vec<BinValues>], [f64; 3])>,
) -> [f64; 2] {
    mean_wind_by(data, law, law, flown)
}

/// As [`mean_wind`], by a law other than the one by which the simulated side was flown.
pub(super) fn mean_wind_by(
    data: &Data,
    law: LeanLaw,
    flown_law: LeanLaw,
    flown: Option<(&[Vec<BinValues>], [f64; 3])>,
) -> [f64; 2] {
    MeanWind::of(data, &settled_leans(data, flown_law, flown), law, flown.is_some()).mean_mps
}

/// Mean leans of each group, by bin, less what they lack of their steady values, rad.
fn settled_leans(
    data: &Data,
    law: LeanLaw,
    flown: Option<(&[Vec<BinValues>], [f64; 3])>,
) -> Vec<Vec<[f64; 2]>> {
    data.groups
        .iter()
        .enumerate()
        .map(|(index, group)| {
            let lean = |bin: usize| {
                let mean = |axis: usize| group.mean(bin, |values| values.lean_rad[axis]);
                let unsettled = flown.and_then(|(side, [x_mps, y_mps, updraft_mps])| {
                    let there = LeanLaw { updraft_mps, ..law };
                    let values = side.get(index)?.get(bin)?;
                    let velocity = group.bins[bin].velocity_mps;
                    let air = [velocity[0] - x_mps, velocity[1] - y_mps];
                    let steady = there.lean(air, velocity[2]);
                    Some([values.lean_rad[0] - steady[0], values.lean_rad[1] - steady[1]])
                });
                let [x, y] = unsettled.unwrap_or_default();
                [mean(0) - x, mean(1) - y]
            };
            (0..group.bins.len()).map(lean).collect()
        })
        .collect()
}

/// The mean lean of groups in each bin.
fn points<'a>(groups: impl Iterator<Item = (&'a Group, &'a Vec<[f64; 2]>)>) -> Vec<Point> {
    let of_group = |(group, leans): (&Group, &Vec<[f64; 2]>)| -> Vec<Point> {
        let height_m = |bin: usize| group.mean(bin, |values| values.height_m);
        let each = group.bins.iter().zip(leans).enumerate();
        each.map(|(place, (bin, lean))| Point::of(bin, height_m(place), *lean)).collect()
    };
    groups.flat_map(of_group).collect()
}

/// Whether there are legs enough to fit a law to.
fn moves(points: &[Point]) -> bool {
    let legs = || points.iter().filter(|point| point.moves);
    legs().count() >= FEWEST_MOVING && have_two_headings(legs().map(|point| point.velocity_mps))
}

/// A round body that the model lacks, by the legs that measured a law from the model's; `None`: there are none. `flown` is as
/// in [`wind`].
pub(super) fn body(
    data: &Data,
    law: LeanLaw,
    flown: (&[Vec<BinValues>], [f64; 3]),
    measured: &Measured,
) -> Option<Body> {
    let leans = settled_leans(data, law, Some(flown));
    let points = points(data.groups.iter().zip(&leans));
    moves(&points).then(|| fit_body(points, law, measured.misfit_nats))
}

/// How unlikely the leans are by a vehicle's law in the updraft that it holds in, nats, but for a constant. `flown` is as in
/// [`wind`].
pub(super) fn misfit_nats(data: &Data, law: LeanLaw, flown: (&[Vec<BinValues>], [f64; 3])) -> f64 {
    let leans = settled_leans(data, law, Some(flown));
    lean_misfit::misfit_nats(points(data.groups.iter().zip(&leans)), law)
}

/// The mean of the wind with the law of the lean that it was read by.
struct MeanWind {
    mean_mps: [f64; 2],
    law: LeanLaw,
    /// What horizontal legs said of both.
    legs: Option<Fitted>,
}

impl MeanWind {
    fn of(data: &Data, leans: &[Vec<[f64; 2]>], law: LeanLaw, is_flown: bool) -> Self {
        let points = points(data.groups.iter().zip(leans));
        if moves(&points) && is_flown {
            let legs = fit(points, law);
            return Self { mean_mps: legs.mean_mps, law: legs.law, legs: Some(legs) };
        }
        Self { mean_mps: hovering_wind(&points, law), law, legs: None }
    }
}

/// Least error of the wind that leans show, m/s: the trim of an attitude, some tenths of a degree, on a
/// drone that leans by 1 to 2 degrees per m/s. Chosen.
const LEAST_DOUBT_MPS: f64 = 0.1;
/// Error of that wind as a share of it, where horizontal legs measured the law. Chosen; the drag of AirSim's
/// sides differs by as much.
pub(super) const LEGS_DOUBT: f64 = 0.08;
/// The error where only the model's law is known. Chosen: bodies may differ from the model by some tenths.
const LAW_DOUBT: f64 = 0.3;

/// Time scales of gusts that are tried, s: half, once and twice the 25 s of the benchmark's horizontal
/// gusts.
const GUST_S: [f64; 3] = [12.0, 25.0, 60.0];
/// Shares of the variance that are tried as scatter rather than gusts, from almost none to almost all. A
/// grid.
const SCATTER: [f64; 5] = [0.02, 0.08, 0.2, 0.45, 0.8];

/// The air as it most probably was: a regressor with scatter of its own would be fitted too small.
/// What the drone flies itself is known and is left out of the smoothing.
fn smooth(group: &Group, raw: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let wind = |axis: usize| -> Vec<f64> {
        let flown = group.bins.iter().zip(raw);
        smoothed(
            group,
            &flown.map(|(bin, air)| bin.velocity_mps[axis] - air[axis]).collect::<Vec<f64>>(),
        )
    };
    let (x, y) = (wind(0), wind(1));
    group
        .bins
        .iter()
        .zip(x.iter().zip(&y))
        .map(|(bin, (x, y))| [bin.velocity_mps[0] - x, bin.velocity_mps[1] - y])
        .collect()
}

/// Posterior mean of a series that is exponentially correlated with white scatter on top.
fn smoothed(group: &Group, values: &[f64]) -> Vec<f64> {
    let count = values.len();
    let Some(moments) = Moments::of(values) else { return Vec::new() };
    let (mean, variance) = (moments.mean, moments.population_variance());
    if variance < 1e-6 || count < 4 {
        return values.to_vec();
    }
    let times: Vec<f64> = group.bins.iter().map(Bin::middle_s).collect();
    let rest: Vec<f64> = values.iter().map(|value| value - mean).collect();
    let filter = |time_s: f64, share: f64| {
        let seen = |time_s: &f64| Observation {
            time_s: *time_s,
            looks_at: LooksAt::from_slice(&[(0, 1.0)]),
            noise: variance * share,
        };
        let gusts = State { variance: variance * (1.0 - share), time_s };
        Filter::new(vec![gusts], times.iter().map(seen).collect())
    };
    let mut best: Option<(f64, State, Filter)> = None;
    for time_s in GUST_S {
        for share in SCATTER {
            let filter = filter(time_s, share);
            let chi2: f64 = filter.whiten(&rest).iter().map(|value| value * value).sum();
            let likelihood = -0.5 * (chi2 + filter.log_det);
            if best.as_ref().is_none_or(|(most, ..)| likelihood > *most) {
                best = Some((likelihood, filter.states[0], filter));
            }
        }
    }
    let Some((_, gusts, filter)) = best else { return values.to_vec() };
    // What is in a bin itself comes once.
    let weighed = filter.weigh(&rest);
    let mut smooth = vec![mean; count];
    for (forward, has_own) in [(true, true), (false, false)] {
        let (mut heard, mut before_s) = (0.0, None);
        for step in 0..count {
            let bin = if forward { step } else { count - 1 - step };
            let apart_s = before_s.map_or(0.0, |before_s: f64| (times[bin] - before_s).abs());
            before_s = Some(times[bin]);
            heard *= (-apart_s / gusts.time_s).exp();
            smooth[bin] += gusts.variance * (heard + if has_own { weighed[bin] } else { 0.0 });
            heard += weighed[bin];
        }
    }
    smooth
}

/// Fewest bins of horizontal flight that measure a lean law: two numbers from two headings.
const FEWEST_MOVING: usize = 4;

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::super::trial;
    use super::*;
    use crate::base::air::SEA_LEVEL_DENSITY;

    #[test]
    fn a_smooth_series_is_its_mean_over_gusts_and_scatter() {
        let data = trial::data(1, |_, _| 0.0);
        let group = &data.groups[0];
        let times: Vec<f64> = group.bins.iter().map(Bin::middle_s).collect();
        let count = times.len();
        let values: Vec<f64> = (0..count)
            .map(|bin| 3.0 + (0.2 * bin as f64).sin() + 0.3 * (7.7 * bin as f64).sin())
            .collect();
        let moments = Moments::of(&values).unwrap();
        let rest = DVector::from_iterator(count, values.iter().map(|value| value - moments.mean));
        let variance = moments.population_variance();
        let mut best = (f64::NEG_INFINITY, DVector::zeros(count));
        for time_s in GUST_S {
            for share in SCATTER {
                let gusts = DMatrix::from_fn(count, count, |a, b| {
                    (1.0 - share) * variance * (-(times[a] - times[b]).abs() / time_s).exp()
                });
                let whole = &gusts + DMatrix::identity(count, count) * share * variance;
                let factor = whole.cholesky().unwrap();
                let weighed = factor.solve(&rest);
                let likelihood = -0.5 * (rest.dot(&weighed) + factor.ln_determinant());
                if likelihood > best.0 {
                    best = (likelihood, gusts * weighed);
                }
            }
        }
        for (value, expected) in smoothed(group, &values).iter().zip(best.1.iter()) {
            let off = value - moments.mean - expected;
            assert!(off.abs() < 1e-9, "{value} {expected}");
        }
    }

    #[test]
    fn what_a_side_lacks_of_its_steady_lean_is_lacking_by_its_own_law() {
        let vehicle = trial::vehicle();
        let flown_law = LeanLaw::of(&vehicle, SEA_LEVEL_DENSITY, 0.0);
        let law = LeanLaw { linear: flown_law.linear + 0.03, ..flown_law };
        let wind_mps = [3.0, -1.0];
        let mut data = trial::data(2, |_, _| 0.0);
        for group in &mut data.groups {
            for drone in &mut group.measured {
                for (bin, value) in group.bins.iter().zip(drone) {
                    value.lean_rad = flown_law.lean([-wind_mps[0], -wind_mps[1]], bin.climb_mps());
                }
            }
        }
        // Simulated in the same wind, and steady: the other law reads the leans as they are.
        let side: Vec<Vec<BinValues>> =
            data.groups.iter().map(|group| group.measured[0].clone()).collect();
        let flown = Some((side.as_slice(), [wind_mps[0], wind_mps[1], 0.0]));
        let read = mean_wind_by(&data, law, flown_law, flown);
        let as_they_are = mean_wind(&data, law, None);
        let off_mps = (read[0] - as_they_are[0]).hypot(read[1] - as_they_are[1]);
        assert!(off_mps < 1e-6, "{read:?} for {as_they_are:?}");
        let own = mean_wind(&data, flown_law, flown);
        assert!((own[0] - wind_mps[0]).abs() < 0.1, "{own:?}");
        assert!(own[0] - read[0] > 0.5, "who leans more leans so in less wind: {read:?}");
    }

    #[test]
    fn each_flight_has_the_wind_that_its_own_leans_show() {
        let law = LeanLaw::of(&trial::vehicle(), SEA_LEVEL_DENSITY, 0.0);
        let mut data = trial::data(1, |_, _| 0.0);
        data.groups.push(data.groups[0].clone());
        let winds_mps = [[0.0, 0.0], [4.0, -3.0]];
        for (group, [x_mps, y_mps]) in data.groups.iter_mut().zip(winds_mps) {
            for (bin, value) in group.bins.iter().zip(&mut group.measured[0]) {
                value.lean_rad = law.lean([-x_mps, -y_mps], bin.climb_mps());
            }
        }
        let together = wind(&data, law, None);
        assert!(together.of_groups_mps.is_empty() && together.of_groups_se_mps.is_empty());
        data.groups[1].flight = 1;
        let apart = wind(&data, law, None);
        for (group, [x_mps, y_mps]) in winds_mps.into_iter().enumerate() {
            let [own_x_mps, own_y_mps] = apart.of_groups_mps[group];
            assert!((own_x_mps - x_mps).hypot(own_y_mps - y_mps) < 1e-6, "{apart:?}");
        }
        let [calm_mps, windy_mps] = [0, 1].map(|group: usize| apart.of_groups_se_mps[group]);
        assert!(calm_mps == LEAST_DOUBT_MPS && windy_mps > 1.4, "{calm_mps} {windy_mps}");
    }
}
