//! Start of a prediction: the model and the noise that were found, and a plan flown by its mean
//! drone.

use crate::effects::Role;
use crate::gap::GapError;
use crate::gap::bins::{Bin, BinValues, of_segments};
use crate::gap::compare::thrust_exponent;
use crate::gap::noise::{
    GRADIENT, GUST_TIME, GUSTS, Hyper, LEAST, OFFSETS, OWN, PULSE_NOISE, SHARED, SHARED_TIME,
    SIDE_GUSTS, SLOPES, WHITE,
};
use crate::gap::refine::{Parameter, size_of};
use crate::gap::refly::{mean_drone, refly};
use crate::gap::verdict::{Finding, Noise, Verdict};
use crate::mission::plan::Plan;
use crate::vehicle::Vehicle;

/// Least noise of any kind, in its own unit: keeps logarithms finite. Numerical.
const LEAST_NOISE: f64 = 1e-3;

/// Knowledge from the flight before.
#[derive(Clone, Debug)]
pub struct Known {
    /// The vehicle with what was found.
    pub model: Vehicle,
    /// Sizes that were fitted; they stay free.
    pub(super) parameters: Vec<Parameter>,
    /// Noise and air.
    pub(super) hyper: Hyper,
    /// Mean horizontal wind, show frame, m/s.
    pub wind_mps: [f64; 2],
    /// Whether the logs have the voltage at rest.
    pub has_voltage: bool,
}

/// The noise of a verdict.
fn hyper_of(noise: &Noise) -> Hyper {
    let mut hyper = Hyper::default();
    let found = [
        (SHARED, noise.shared_air_mps),
        (SHARED_TIME, noise.shared_air_s),
        (OWN, noise.own_air_mps),
        (GUSTS, noise.gusts_mps),
        (GUST_TIME, noise.gusts_s),
        (WHITE, noise.white_us),
        (OFFSETS, noise.drones_us),
        (SLOPES, noise.slopes),
        (LEAST, noise.least_response),
        (GRADIENT, noise.gradient_mps),
        (SIDE_GUSTS, noise.side_gusts_mps),
        (PULSE_NOISE, noise.pulse_noise_us),
    ];
    for (place, value) in found {
        hyper.0[place] = value.max(LEAST_NOISE).ln();
    }
    hyper
}

impl Known {
    /// From a verdict with its model.
    pub fn new(verdict: &Verdict, model: Vehicle, wind_mps: [f64; 2]) -> Self {
        let mut parameters = Vec::new();
        for step in &verdict.steps {
            let (effect, fitted) = match &step.finding {
                Finding::Name { effect, parameters, .. } => (Some(effect), parameters),
                Finding::Class { effects, parameters } => (effects.first(), parameters),
                Finding::Unknown { .. } => continue,
            };
            let Some(effect) = effect else { continue };
            parameters.extend(fitted.iter().filter_map(|fitted| size_of(effect, &fitted.name)));
        }
        let has_voltage = verdict.has_resting_voltage();
        let hyper = hyper_of(&verdict.noise);
        Self { model, parameters, hyper, wind_mps, has_voltage }
    }
}

/// A plan flown by the simulator's mean drone: bins and values of each group.
#[derive(Clone, Debug)]
pub struct Flight {
    pub(super) plan: Plan,
    pub(super) groups: Vec<(Vec<Bin>, Vec<Option<BinValues>>)>,
}

impl Flight {
    /// Flies a plan.
    ///
    /// # Errors
    /// The model cannot fly it.
    pub fn new(known: &Known, plan: Plan) -> Result<Self, GapError> {
        let vehicle = mean_drone(&known.model);
        let exponent = thrust_exponent(&vehicle);
        let mut groups = Vec::new();
        for (index, group) in plan.groups.iter().enumerate() {
            let bins = of_segments(&group.segments);
            let mut slots = plan.slots.iter().filter(|slot| usize::from(slot.group) == index);
            let values = match slots.next() {
                Some(slot) => {
                    let [x_mps, y_mps] = known.wind_mps;
                    refly(&vehicle, &plan, slot, &bins, [x_mps, y_mps, 0.0], exponent)?
                }
                None => Vec::new(),
            };
            groups.push((bins, values));
        }
        Ok(Self { plan, groups })
    }

    /// Plan of the flight.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }
}

/// Charge of the battery of a place in a staggered fleet: evenly spaced from the lowest to full, and spread
/// over the grid.
pub fn charge_of(place: usize, count: usize, lowest: f64) -> f64 {
    // A step that has no factor in common with the count visits every rank once.
    let gcd = |mut a: usize, mut b: usize| {
        while b > 0 {
            (a, b) = (b, a % b);
        }
        a
    };
    let around = (count * 5 / 13).max(1);
    let step = (around..around + count.max(1)).find(|step| gcd(*step, count) == 1).unwrap_or(1);
    let rank = place * step % count.max(1);
    lowest + (1.0 - lowest) * rank as f64 / count.saturating_sub(1).max(1) as f64
}

/// Cells of the battery that a vehicle has or would have.
pub(super) fn cells(vehicle: &Vehicle) -> f64 {
    Role::BatteryCells.stated_or_default(vehicle).unwrap_or(1.0).max(1.0)
}
