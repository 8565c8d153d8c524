//! The drone's idea of its vertical velocity is off or late.

use super::definition::{Class, Definition, Hook, Parameter, Signal, Sought, Values};
use super::role::Role;
use super::{Effect, InFlight, Reference, Signals, Start};
use crate::vehicle::{Airframe, Vehicle};

const BIAS: usize = 0;
const SD: usize = 1;
const LAG: usize = 2;
const LOG_ONLY: usize = 3;

/// Bias and lag of the vertical velocity.
#[derive(Debug)]
pub(super) struct VelocityError;

/// The estimator of one drone.
#[derive(Clone, Debug)]
struct Estimator {
    bias_mps: f64,
    /// How far this drone is off the bias of all.
    own_mps: f64,
    lag_s: f64,
    /// Whether the autopilot flies by the right velocity, and only its log has the error.
    log_only: bool,
    /// The velocity as it comes late; none before the first look.
    filtered_mps: Option<f64>,
}

impl Effect for VelocityError {
    fn refusal(&self, values: &Values, _vehicle: &Vehicle) -> Option<(usize, String)> {
        let is_switch = values[LOG_ONLY] == 0.0 || values[LOG_ONLY] == 1.0;
        (!is_switch).then(|| (LOG_ONLY, "it must be 0 or 1".to_owned()))
    }

    fn definition(&self) -> &'static Definition {
        &Definition {
            name: "velocity-error",
            title: "Bias and lag of the vertical velocity",
            what: "the measured vertical velocity V_U is off by a constant and lags behind",
            explanation: "The map of the air is a difference of velocities: an error of V_U goes \
                into it one to one. The pulse is not changed, but it is compared at the wrong \
                velocity. It shows against the rate of change of the height, without any look at \
                the pulse. An autopilot that flies by it holds another height and swings sooner, and off \
                by half a metre per second or more it neither begins a show nor lands as it should. \
                Larger errors are those of the log alone, which is filled from a slower filter or by \
                another clock (log_only).",
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
                    role: Some(Role::SensorBias),
                },
                Parameter {
                    name: "sd_mps",
                    unit: "m/s",
                    what: "standard deviation of the bias between drones",
                    low: 0.0,
                    high: 1.0,
                    default: |_| 0.02,
                    role: Some(Role::Spread),
                },
                Parameter {
                    name: "lag_s",
                    unit: "s",
                    what: "lag",
                    low: 0.0,
                    high: 1.0,
                    default: |_| 0.1,
                    role: Some(Role::SensorLag),
                },
                Parameter {
                    name: "log_only",
                    unit: "",
                    what: "1: only the log has the error; 0: the autopilot flies by it, too",
                    low: 0.0,
                    high: 1.0,
                    default: |_| 0.0,
                    role: Some(Role::SensorLogOnly),
                },
            ],
            hooks: &[Hook::Sense, Hook::Log],
            shown: (Signal::Drone, -2.0, 2.0),
            sought: Sought::No("told from the velocity against the height, without the pulse"),
        }
    }

    fn pulse_us(&self, _at: &Reference, values: &Values, signals: &Signals) -> f64 {
        let bias = values[BIAS] + values[SD] * signals.deviation;
        signals.sensitivity * (values[LAG] * signals.acceleration_mps2 - bias)
    }

    fn start(&self, start: &Start<'_>, _airframe: &mut Airframe) -> Option<Box<dyn InFlight>> {
        Some(Box::new(Estimator {
            bias_mps: start.values[BIAS],
            own_mps: start.values[SD] * start.deviation,
            lag_s: start.values[LAG],
            log_only: start.values[LOG_ONLY] >= 0.5,
            filtered_mps: None,
        }))
    }
}

impl Estimator {
    fn spoil(&mut self, dt_s: f64, climb_mps: &mut f64) {
        let mut filtered_mps = self.filtered_mps.unwrap_or(*climb_mps);
        filtered_mps += (*climb_mps - filtered_mps) * dt_s / (dt_s + self.lag_s);
        self.filtered_mps = Some(filtered_mps);
        *climb_mps = filtered_mps + self.bias_mps + self.own_mps;
    }
}

impl InFlight for Estimator {
    fn sense(&mut self, dt_s: f64, climb_mps: &mut f64) {
        if !self.log_only {
            self.spoil(dt_s, climb_mps);
        }
    }

    fn log(&mut self, dt_s: f64, climb_mps: &mut f64) {
        if self.log_only {
            self.spoil(dt_s, climb_mps);
        }
    }
}
