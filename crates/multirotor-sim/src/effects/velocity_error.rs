//! The drone's idea of its vertical velocity is off or late.

use super::definition::{Class, Definition, Hook, Parameter, Signal, Sought, Values};
use super::{Effect, Own, Reference, Signals};

const BIAS: usize = 0;
const SD: usize = 1;
const LAG: usize = 2;
/// State: filtered velocity, and whether there is one.
const FILTERED: usize = 0;
const STARTED: usize = 1;

/// Bias and lag of the vertical velocity.
#[derive(Debug)]
pub(super) struct VelocityError;

impl Effect for VelocityError {
    fn definition(&self) -> &'static Definition {
        &Definition {
            name: "velocity-error",
            title: "Bias and lag of the vertical velocity",
            what: "the measured vertical velocity V_U is off by a constant and lags behind",
            explanation: "The map of the air is a difference of velocities: an error of V_U goes \
                into it one to one. The pulse is not changed, but it is compared at the wrong \
                velocity. It shows against the rate of change of the height, without any look at \
                the pulse.",
            formula: "V_U = V + b - d·dV/dt;  at measured V_U: du = -S b + S d a",
            source: "EKF3 documentation; test of V_U against dh/dt",
            class: Class::VelocityChannel,
            signals: &[Signal::Drone, Signal::Acceleration, Signal::Sensitivity],
            parameters: &[
                Parameter {
                    name: "bias_mps",
                    unit: "m/s",
                    what: "bias of all drones",
                    low: -2.0,
                    high: 2.0,
                    default: |_| 0.0,
                },
                Parameter {
                    name: "sd_mps",
                    unit: "m/s",
                    what: "standard deviation of the bias between drones",
                    low: 0.0,
                    high: 1.0,
                    default: |_| 0.02,
                },
                Parameter {
                    name: "lag_s",
                    unit: "s",
                    what: "lag",
                    low: 0.0,
                    high: 1.0,
                    default: |_| 0.1,
                },
            ],
            hooks: &[Hook::Sense],
            shown: (Signal::Drone, -2.0, 2.0),
            sought: Sought::No("told from the velocity against the height, without the pulse"),
        }
    }

    fn pulse_us(&self, _at: &Reference, values: &Values, signals: &Signals) -> f64 {
        let bias = values[BIAS] + values[SD] * signals.deviation;
        signals.sensitivity * (values[LAG] * signals.acceleration_mps2 - bias)
    }

    fn sense(&self, own: &mut Own, dt_s: f64, climb_mps: &mut f64) {
        let Own { values, state, deviation, .. } = own;
        if state[STARTED] == 0.0 {
            state[STARTED] = 1.0;
            state[FILTERED] = *climb_mps;
        }
        state[FILTERED] += (*climb_mps - state[FILTERED]) * dt_s / (dt_s + values[LAG]);
        *climb_mps = state[FILTERED] + values[BIAS] + values[SD] * *deviation;
    }
}
