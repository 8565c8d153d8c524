//! Gusts faster than the windows: a curved response does not average to the response of the mean.

use std::f64::consts::{FRAC_1_SQRT_2, FRAC_2_PI};

use rand_distr::{Distribution as _, StandardNormal};
use rand_pcg::Pcg64;
use statrs::function::erf::erf;

use super::definition::{Class, Definition, Hook, Parameter, Signal, Sought, Values};
use super::model::base_drag_m2;
use super::reference::DENSITY;
use super::role::Role;
use super::{Air, Effect, InFlight, Now, Reference, Settled, Signals, Start};
use crate::vehicle::{Airframe, Vehicle};

const SIGMA: usize = 0;
const TIME: usize = 1;
const CURVATURE: usize = 2;

const MOST_CURVATURE: f64 = 50.0;

/// Turbulence rectification.
#[derive(Debug)]
pub(super) struct Turbulence;

/// A of `A V|V|` from the drag of the box and, where that acts, of the body, us/(m/s)².
fn curvature(vehicle: &Vehicle) -> f64 {
    let at = Reference::of(vehicle);
    let drag_m2 = base_drag_m2(vehicle) + Role::BodyDragTop.value(vehicle).unwrap_or(0.0) / 2.0;
    (at.sensitivity_us() * drag_m2 * DENSITY / at.weight_n()).clamp(0.0, MOST_CURVATURE)
}

/// Mean of (V - w)|V - w| over normal w of mean 0 and standard deviation `sigma`.
pub(super) fn mean_signed_square(velocity: f64, sigma: f64) -> f64 {
    if sigma <= 0.0 {
        return velocity * velocity.abs();
    }
    let x = velocity / sigma;
    sigma
        * sigma
        * ((x * x + 1.0) * erf(x * FRAC_1_SQRT_2) + FRAC_2_PI.sqrt() * x * (-x * x / 2.0).exp())
}

/// The gusts that one drone meets.
#[derive(Clone, Debug)]
struct Gusts {
    gust_mps: f64,
    /// What is left of a gust after a step.
    decay: f64,
    /// Standard deviation of what a step adds, m/s.
    kick_mps: f64,
    sigma_mps: f64,
    rng: Pcg64,
}

impl Effect for Turbulence {
    fn definition(&self) -> &'static Definition {
        &Definition {
            name: "turbulence",
            title: "Turbulence rectification",
            what: "gusts shift the mean of a curved response: a parabola looks like a line near 0",
            explanation: "A window's mean of f(V - w) is not f of the mean. Near hover a signed \
                parabola gains a linear slope 1.6 A s, further out it is A s². It fakes a little \
                inflow. The simulator flies in vertical gusts of this strength, faster than the \
                vehicle follows.",
            formula: "du = A [E f(V - w) - f(V)],  E f = (V² + s²) erf(V/(s sqrt 2)) + \
                sqrt(2/pi) s V exp(-V²/(2 s²))",
            source: "mean of a signed square under a normal distribution; Reynolds averaging",
            class: Class::AxialLinear,
            signals: &[Signal::Climb],
            parameters: &[
                Parameter {
                    name: "sigma_mps",
                    unit: "m/s",
                    what: "standard deviation of the vertical gusts",
                    low: 0.0,
                    high: 5.0,
                    default: |_| 0.5,
                    role: None,
                },
                Parameter {
                    name: "time_s",
                    unit: "s",
                    what: "time scale of the gusts (exponential correlation)",
                    low: 0.005,
                    high: 100.0,
                    default: |_| 0.1,
                    role: None,
                },
                Parameter {
                    name: "curvature",
                    unit: "us/(m/s)²",
                    what: "A of the response A V|V| that the gusts meet",
                    low: 0.0,
                    high: MOST_CURVATURE,
                    default: curvature,
                    role: None,
                },
            ],
            hooks: &[Hook::Air],
            shown: (Signal::Climb, -3.5, 3.5),
            sought: Sought::No("known physics: computed from the gusts that the logs show"),
        }
    }

    fn pulse_us(&self, _at: &Reference, values: &Values, signals: &Signals) -> f64 {
        let climb = signals.climb_mps;
        values[CURVATURE] * (mean_signed_square(climb, values[SIGMA]) - climb * climb.abs())
    }

    fn start(&self, start: &Start<'_>, _airframe: &mut Airframe) -> Option<Box<dyn InFlight>> {
        let decay = (-start.dt_s / start.values[TIME]).exp();
        let kick_mps = start.values[SIGMA] * (1.0 - decay * decay).sqrt();
        let (sigma_mps, rng) = (start.values[SIGMA], start.rng.clone());
        Some(Box::new(Gusts { gust_mps: 0.0, decay, kick_mps, sigma_mps, rng }))
    }
}

impl InFlight for Gusts {
    fn air(&mut self, _now: &Now, air: &mut Air) {
        let draw: f64 = StandardNormal.sample(&mut self.rng);
        self.gust_mps = self.gust_mps * self.decay + self.kick_mps * draw;
        air.velocity_mps.z += self.gust_mps;
    }

    fn settle(&mut self, _at: &Settled) {
        (self.gust_mps, self.kick_mps) = (0.0, 0.0);
    }

    fn gust_sd_mps(&self) -> f64 {
        self.sigma_mps
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::{Purpose, stream};

    #[test]
    fn mean_of_the_signed_square_is_the_monte_carlo_mean() {
        let mut rng = stream(1, 1, Purpose::Effects);
        for velocity in [-2.0, -0.3, 0.0, 0.1, 0.7, 3.5] {
            let sigma = 0.5;
            let count = 400_000;
            let mut sum = 0.0;
            let mut squares = 0.0;
            for _ in 0..count {
                let draw: f64 = StandardNormal.sample(&mut rng);
                let through = velocity - sigma * draw;
                sum += through * through.abs();
                squares += through.powi(4);
            }
            let n = f64::from(count);
            let mean = sum / n;
            let error = ((squares / n - mean * mean) / n).sqrt();
            let formula = mean_signed_square(velocity, sigma);
            assert!((formula - mean).abs() < 4.0 * error, "{velocity}: {formula}, {mean}");
        }
        // docs/physics.md, 2.5: slope 1.6 A s at hover, A s² far out.
        let slope = mean_signed_square(1e-4, 0.5) / 1e-4;
        assert!((slope - 2.0 * 0.5 * FRAC_2_PI.sqrt()).abs() < 1e-3, "{slope}");
        assert!((mean_signed_square(3.5, 0.5) - 12.25 - 0.25).abs() < 1e-6);
    }
}
