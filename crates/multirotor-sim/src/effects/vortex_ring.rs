//! In fast descent a rotor flies into its own wake.

use rand_distr::{Distribution as _, StandardNormal};
use rand_pcg::Pcg64;

use super::definition::{Class, Definition, Hook, Parameter, Signal, Sought, Values};
use super::disc::{Disc, LEAST_SHARE, MOST_SHARE, flow_us, share_of};
use super::role::Role;
use super::{Change, Effect, InFlight, Now, Reference, Settled, Signals, Start, momentum};
use crate::vehicle::Airframe;

const SHARE: usize = 0;
const ONSET: usize = 1;
const JITTER: usize = 2;
/// Half of the range of descent over which the state sets in, over the induced velocity.
const HALF_WIDTH: f64 = 0.25;
/// Time scale of the thrust's jitter, s: a wake is passed in some tenths of a second.
const JITTER_S: f64 = 0.15;
/// Coefficients of v_i/v_h = 1 + k1 x + k2 x² + k3 x³ + k4 x⁴.
const MEASURED: [f64; 4] = [-1.125, -1.372, -1.718, -0.655];
/// Damped fixed-point steps for the thrust at fixed speed.
const STEPS: usize = 8;

/// Vortex-ring state.
#[derive(Debug)]
pub(super) struct VortexRing;

/// Induced velocity over that in hover, as measured, less what momentum theory continued from climb
/// says; 0 above the onset. `descent` is the axial speed over the induced velocity in hover.
pub(super) fn excess(descent: f64, onset: f64) -> f64 {
    let ramp = ((-onset + HALF_WIDTH - descent) / (2.0 * HALF_WIDTH)).clamp(0.0, 1.0);
    if ramp == 0.0 {
        return 0.0;
    }
    let smooth = ramp * ramp * (3.0 - 2.0 * ramp);
    let measured = if descent < -2.0 {
        // Windmill brake state: momentum theory's other branch.
        -descent / 2.0 - (descent * descent / 4.0 - 1.0).max(0.0).sqrt()
    } else {
        let [k1, k2, k3, k4] = MEASURED;
        1.0 + descent * (k1 + descent * (k2 + descent * (k3 + descent * k4)))
    };
    smooth * (measured - momentum::induced(descent, 0.0))
}

/// The rotor of one drone.
#[derive(Clone, Debug)]
struct Rotor {
    disc: Disc,
    share: f64,
    onset: f64,
    jitter: f64,
    /// What is left of the noise after a step.
    decay: f64,
    /// Present noise of the thrust, in standard deviations.
    noise: f64,
    rng: Pcg64,
}

impl Effect for VortexRing {
    fn definition(&self) -> &'static Definition {
        &Definition {
            name: "vortex-ring",
            title: "Vortex-ring state",
            what: "descending at half the induced velocity or faster costs thrust and shakes",
            explanation: "Between about 0.5 and 1.5 times the induced velocity of hover, the wake \
                is blown back into the disc; momentum theory fails and more induced velocity is \
                measured than it says. The pulse for a fast descent is higher than the line from \
                slower speeds, and the thrust fluctuates. The asymmetry between climb and descent \
                and the jitter are its fingerprint.",
            formula: "v_i/v_h = 1 - 1.125 x - 1.372 x² - 1.718 x³ - 0.655 x⁴,  x = V/v_h in -2..0, \
                faded in around the onset; windmill branch below -2",
            source: "Leishman, Principles of Helicopter Aerodynamics, ch. 2; Talaeizadeh et al., \
                arXiv:1909.09069",
            class: Class::Descent,
            signals: &[Signal::Climb, Signal::Horizontal, Signal::Tilt],
            parameters: &[
                Parameter {
                    name: "inflow_share",
                    unit: "",
                    what: "share of the geometric thrust lost to the inflow in hover",
                    low: LEAST_SHARE,
                    high: MOST_SHARE,
                    default: share_of,
                    role: None,
                },
                Parameter {
                    name: "onset",
                    unit: "",
                    what: "descent over induced velocity at which the state has half set in",
                    low: 0.25,
                    high: 1.5,
                    default: |_| 0.5,
                    role: None,
                },
                Parameter {
                    name: "jitter",
                    unit: "",
                    what: "standard deviation of the thrust in the full state, relative",
                    low: 0.0,
                    high: 0.3,
                    default: |_| 0.03,
                    role: Some(Role::Scatter),
                },
            ],
            hooks: &[Hook::Loads],
            shown: (Signal::Climb, -6.0, 1.0),
            sought: Sought::Shape {
                size: "inflow_share",
                sizes: |_| &[0.5],
                usual: None,
                shape: Some(("onset", &[0.4, 0.5, 0.6, 0.7])),
            },
        }
    }

    fn pulse_us(&self, at: &Reference, values: &Values, signals: &Signals) -> f64 {
        let axial = signals.axial_mps() / at.hover_induced_mps();
        let flow = axial + momentum::induced(axial, 0.0);
        let share = values[SHARE];
        flow_us(at, share, flow + excess(axial, values[ONSET])) - flow_us(at, share, flow)
    }

    fn start(&self, start: &Start<'_>, airframe: &mut Airframe) -> Option<Box<dyn InFlight>> {
        Some(Box::new(Rotor {
            disc: Disc::of(airframe),
            share: start.values[SHARE],
            onset: start.values[ONSET],
            jitter: start.values[JITTER],
            decay: (-start.dt_s / JITTER_S).exp(),
            noise: 0.0,
            rng: start.rng.clone(),
        }))
    }
}

impl InFlight for Rotor {
    fn loads(&mut self, now: &Now, change: &mut Change) {
        let Some((axial, _)) = self.disc.speeds(now) else { return };
        let (share, onset) = (self.share, self.onset);
        if axial > HALF_WIDTH - onset {
            return;
        }
        let without = momentum::at_speed(share, axial, 0.0);
        let beta = momentum::beta(share);
        let mut thrust = without.thrust.max(0.05);
        let mut flow = without.flow;
        for _ in 0..STEPS {
            let scale = thrust.sqrt();
            let x = axial / scale;
            flow = axial + scale * (momentum::induced(x, 0.0) + excess(x, onset));
            let next = 1.0 + beta - beta * flow;
            thrust = f64::midpoint(thrust, next.max(0.05));
        }
        let depth = ((HALF_WIDTH - onset - axial) / (2.0 * HALF_WIDTH)).min(1.0);
        let decay = self.decay;
        let draw: f64 = StandardNormal.sample(&mut self.rng);
        self.noise = self.noise * decay + (1.0 - decay * decay).sqrt() * draw;
        let jitter = 1.0 + self.jitter * depth * self.noise;
        change.thrust *= jitter * thrust / without.thrust.max(0.05);
        change.torque += self.disc.merit * (thrust * flow - without.thrust * without.flow);
    }

    fn settle(&mut self, _at: &Settled) {
        self.jitter = 0.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn excess_is_a_bump_between_slow_and_very_fast_descent() {
        assert_eq!(excess(-0.2, 0.5), 0.0);
        assert_eq!(excess(1.0, 0.5), 0.0);
        // At x = -1 the measured curve has 1.816, momentum theory 1.618.
        assert!((excess(-1.0, 0.5) - 0.198).abs() < 1e-3, "{}", excess(-1.0, 0.5));
        assert!(excess(-2.0, 0.5) < 0.0, "windmilling");
        assert!((excess(-2.0, 0.5) - excess(-2.000_001, 0.5)).abs() < 0.05);
    }
}
