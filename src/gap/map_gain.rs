//! Gain of the map of the air: its error by the model before and after.
//!
//! The law of the model is inverted in a measurement flight whose true air is known. What one drone's
//! rotors differ by from the others' is its mean residual in the calibration's hovers, as the paper's
//! baseline (eq. 5). What all drones have in common is told from the updraft that they share by the noise that
//! was found: air that lasts for minutes has no mean of zero in either flight, but where the response changes
//! with the speed it shows as a change between rungs and hovers, and both flights together say more than one.

use std::collections::BTreeMap;

use super::compare::{Comparison, Simulated};
use super::data::{Data, Flown};
use super::error::GapError;
use super::explain::Found;
use super::gls::{Problem, Split};
use super::make::{Explained, Input};
use super::refine::slopes;
use super::scene::Scene;
use super::verdict::{MapError, MapGain};
use crate::analysis::TruthSeries;
use crate::effects::{Model, Signals};
use crate::mission::plan::Plan;
use crate::numeric::{mean, rms};
use crate::vehicle::Vehicle;

/// A measurement flight whose true air is known.
#[derive(Debug)]
pub struct Measured<'a> {
    /// Name of the flight.
    pub name: &'a str,
    /// Plan that was flown.
    pub plan: &'a Plan,
    /// Logs of the drones.
    pub flown: &'a [Flown<'a>],
    /// True vertical air speed of each slot, m/s, up positive.
    pub truth: &'a BTreeMap<u16, TruthSeries>,
}

/// Half of the running mean in which estimates and truth are compared, s: the paper's 10 s.
const HALF_S: f64 = 5.0;
/// Vertical air is looked for up to this speed, m/s: beyond any thermal at show heights. Convention.
const FASTEST_MPS: f64 = 10.0;
/// Halvings of that interval: down to rounding.
const HALVINGS: usize = 40;

/// The error of the map before and after what was found; `None`: no drone has both flights and a
/// truth.
///
/// # Errors
/// See [`GapError`].
pub fn map_gain(
    input: &Input<'_>,
    explained: &Explained,
    measured: &Measured<'_>,
) -> Result<Option<MapGain>, GapError> {
    let Some(plan) = input.plan else { return Ok(None) };
    let exponent = super::compare::thrust_exponent(input.vehicle);
    let ladder = Data::of_plan(plan, input.flown, exponent);
    let hover = Data::of_plan(measured.plan, measured.flown, exponent);
    if ladder.drones() == 0 || hover.drones() == 0 {
        return Ok(None);
    }
    let found = &explained.found;
    let errors = |vehicle: &Vehicle| -> Result<Errors, GapError> {
        let calibration = Comparison::new(&ladder, vehicle, &Simulated::Refly(plan), Some(plan))?;
        let flight = Simulated::Refly(measured.plan);
        let comparison = Comparison::new(&hover, vehicle, &flight, Some(measured.plan))?;
        let zero = Zero::of(&calibration, found)?.and(Zero::of(&comparison, found)?);
        let offsets_us = about(zero.us, &offsets(&calibration, found.gusts_mps)?);
        errors_of(&comparison, found.gusts_mps, (&offsets_us, zero.variance_us2), measured.truth)
    };
    let before = errors(input.vehicle)?;
    let after = errors(&found.vehicle)?;
    let drones = hover
        .groups
        .iter()
        .flat_map(|group| &group.slots)
        .filter(|slot| measured.truth.contains_key(slot))
        .count();
    Ok((!before.off.is_empty() && !after.off.is_empty()).then(|| MapGain {
        flight: measured.name.to_owned(),
        drones,
        values: after.off.len(),
        zero_mps: rms(&after.truth).unwrap_or_default(),
        common_sd_mps: after.common_sd,
        before: summed(&before.off),
        after: summed(&after.off),
    }))
}

/// What all drones of a flight need more than the model says.
#[derive(Clone, Copy, Debug)]
struct Zero {
    us: f64,
    variance_us2: f64,
}

impl Zero {
    /// Of a flight, with everything found in doubt by its standard error.
    fn of(flight: &Comparison, found: &Found) -> Result<Self, GapError> {
        let vehicle = &flight.vehicle;
        let patterns = flight.patterns(vehicle, found.gusts_mps)?;
        let split = Split::of(&flight.residual(vehicle, found.gusts_mps)?);
        let mut doubts = slopes(flight, vehicle, &found.parameters)?;
        for (doubt, (_, error)) in doubts.iter_mut().zip(&found.values) {
            let per_size = doubt.clone();
            *doubt = per_size.each(|group, drone, bin| error * per_size.at(group, drone, bin));
        }
        let solution = Problem::new(&patterns, &split).doubting(&doubts).at(&found.noise.hyper);
        let variance_us2 = solution.covariance()[(0, 0)];
        Ok(Self { us: solution.beta[0], variance_us2 })
    }

    /// Of both, each by what it says.
    fn and(self, other: Self) -> Self {
        let all = self.variance_us2 + other.variance_us2;
        let share = if all > 0.0 { self.variance_us2 / all } else { 0.5 };
        Self {
            us: self.us + share * (other.us - self.us),
            variance_us2: share * other.variance_us2,
        }
    }
}

/// Offsets of drones shifted to another mean, us.
fn about(mean_us: f64, offsets_us: &BTreeMap<u16, f64>) -> BTreeMap<u16, f64> {
    let was_us = mean(offsets_us.values()).unwrap_or_default();
    offsets_us.iter().map(|(slot, offset_us)| (*slot, offset_us - was_us + mean_us)).collect()
}

/// Each drone's mean residual in the hovers of a flight, us.
fn offsets(flight: &Comparison, gusts_mps: f64) -> Result<BTreeMap<u16, f64>, GapError> {
    let residual = flight.residual(&flight.vehicle, gusts_mps)?;
    let mut offsets_us = BTreeMap::new();
    for (group, drones) in flight.data.groups.iter().zip(&residual) {
        for (slot, values) in group.slots.iter().zip(drones) {
            let hovers = group.bins.iter().zip(values).filter(|(bin, _)| bin.kind.is_hover());
            let (sum, count) = hovers.fold((0.0, 0.0), |(s, n), (_, value)| (s + value, n + 1.0));
            if count > 0.0 {
                offsets_us.insert(*slot, sum / count);
            }
        }
    }
    Ok(offsets_us)
}

/// How wrong the running means of the estimates are.
struct Errors {
    /// Estimate less truth, m/s.
    off: Vec<f64>,
    /// The truth itself, m/s.
    truth: Vec<f64>,
    /// What the doubt about the drones' common zero makes of the air, m/s.
    common_sd: f64,
}

/// Inverts a model in a flight, with each drone's offset and the variance of what they have in common.
fn errors_of(
    comparison: &Comparison,
    gusts_mps: f64,
    (offsets_us, variance_us2): (&BTreeMap<u16, f64>, f64),
    truth: &BTreeMap<u16, TruthSeries>,
) -> Result<Errors, GapError> {
    let model = Model::of(&comparison.vehicle)?;
    let residual = comparison.residual(&comparison.vehicle, gusts_mps)?;
    let Comparison { data, scene: Scene { signals, .. }, .. } = comparison;
    let (mut errors_mps, mut truths_mps, mut doubts_mps) = (Vec::new(), Vec::new(), Vec::new());
    for ((group, signals), drones) in data.groups.iter().zip(signals).zip(&residual) {
        for (slot, values) in group.slots.iter().zip(drones) {
            let (Some(offset_us), Some(truth)) = (offsets_us.get(slot), truth.get(slot)) else {
                continue;
            };
            let updraft_mps: Vec<f64> = signals
                .iter()
                .zip(values)
                .map(|(signals, value)| inverted(&model, signals, value - offset_us))
                .collect();
            doubts_mps.extend(signals.iter().map(|at| inverted(&model, at, variance_us2.sqrt())));
            for (bin, middle) in group.bins.iter().enumerate() {
                let near = |other: &usize| {
                    (group.bins[*other].middle_s() - middle.middle_s()).abs() < HALF_S
                };
                let near = (0..group.bins.len()).filter(near).map(|other| updraft_mps[other]);
                let mean_mps = mean(near).unwrap_or_default();
                let true_mps = truth.at_second(middle.middle_s().round() as i64);
                if group.bins[bin].kind.is_hover()
                    && let Some(true_mps) = true_mps.filter(|value| value.is_finite())
                {
                    errors_mps.push(mean_mps - true_mps);
                    truths_mps.push(true_mps);
                }
            }
        }
    }
    Ok(Errors {
        off: errors_mps,
        truth: truths_mps,
        common_sd: rms(&doubts_mps).unwrap_or_default(),
    })
}

/// The updraft in which the model asks for so much more pulse, m/s.
fn inverted(model: &Model, signals: &Signals, more_us: f64) -> f64 {
    let pulse_us = |updraft_mps: f64| {
        model.pulse_us(&Signals { climb_mps: signals.climb_mps - updraft_mps, ..*signals })
    };
    let wanted_us = pulse_us(0.0) + more_us;
    let (mut low, mut high) = (-FASTEST_MPS, FASTEST_MPS);
    for _ in 0..HALVINGS {
        let middle = f64::midpoint(low, high);
        // More updraft, less pulse.
        if pulse_us(middle) > wanted_us { low = middle } else { high = middle }
    }
    f64::midpoint(low, high)
}

fn summed(errors: &[f64]) -> MapError {
    let bias_mps = mean(errors).unwrap_or_default();
    let rms_mps = rms(errors).unwrap_or_default();
    let without_bias_mps = (rms_mps * rms_mps - bias_mps * bias_mps).max(0.0).sqrt();
    MapError { rms_mps, bias_mps, without_bias_mps }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicle::library;

    #[test]
    fn a_pulse_is_inverted_to_the_air_that_made_it() {
        let mut vehicle = library::builtin("airsim-generic-quad").unwrap();
        super::super::candidates::set(&mut vehicle, "rotor-inflow", "inflow_share", 0.3);
        let model = Model::of(&vehicle).unwrap();
        let signals = Signals::default();
        for updraft_mps in [-2.0, -0.3, 0.0, 0.7, 3.0] {
            let blown = Signals { climb_mps: -updraft_mps, ..signals };
            let more_us = model.pulse_us(&blown) - model.pulse_us(&signals);
            let found = inverted(&model, &signals, more_us);
            assert!((found - updraft_mps).abs() < 1e-6, "{updraft_mps}: {found}");
        }
    }

    #[test]
    fn two_flights_count_by_what_they_say() {
        let one = Zero { us: 4.0, variance_us2: 4.0 };
        let both = one.and(Zero { us: 9.0, variance_us2: 1.0 });
        assert!((both.us - 8.0).abs() < 1e-12 && (both.variance_us2 - 0.8).abs() < 1e-12);
        let sure = one.and(Zero { us: 9.0, variance_us2: 0.0 });
        assert!((sure.us - 9.0).abs() < 1e-12 && sure.variance_us2 == 0.0);
    }

    #[test]
    fn offsets_keep_their_differences_about_another_mean() {
        let moved = about(10.0, &BTreeMap::from([(1, 3.0), (2, 6.0), (3, 0.0)]));
        assert_eq!(moved, BTreeMap::from([(1, 10.0), (2, 13.0), (3, 7.0)]));
        assert!(about(10.0, &BTreeMap::new()).is_empty());
    }

    #[test]
    fn errors_are_split_into_bias_and_rest() {
        let error = summed(&[1.0, 3.0]);
        assert!((error.bias_mps - 2.0).abs() < 1e-12);
        assert!((error.rms_mps - 5.0_f64.sqrt()).abs() < 1e-12);
        assert!((error.without_bias_mps - 1.0).abs() < 1e-12);
    }
}
