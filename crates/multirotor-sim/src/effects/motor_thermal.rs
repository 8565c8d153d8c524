//! Motors and controllers warm up.

use super::definition::{Class, Definition, Hook, Parameter, Signal, Sought, Values};
use super::role::Role;
use super::{Effect, InFlight, Now, Reference, Settled, Signals, Start};
use crate::vehicle::Airframe;

const DRIFT: usize = 0;
const TIME: usize = 1;

/// Motor and controller thermal drift.
#[derive(Debug)]
pub(super) struct MotorThermal;

/// The motors of one drone.
#[derive(Clone, Debug)]
struct Motors {
    time_s: f64,
    /// Share of the command that is lost when warm.
    loss: f64,
    /// 0 cold, 1 at its end.
    warmth: f64,
}

impl Effect for MotorThermal {
    fn definition(&self) -> &'static Definition {
        &Definition {
            name: "motor-thermal",
            title: "Motor and controller thermal drift",
            what: "the pulse for hover drifts in the first minutes as the motors warm up",
            explanation: "Warm windings resist more (+0.39 %/K: the pulse rises), warm magnets are \
                weaker and let the motor turn faster at the same voltage (-0.11 %/K: the pulse \
                falls). Magnets usually win. Within one flight it looks like battery sag or a slow \
                change of the updraft.",
            formula: "du = M (1 - exp(-t/tau))",
            source: "temperature coefficients of copper and neodymium magnets",
            class: Class::TimeDrift,
            signals: &[Signal::Time],
            parameters: &[
                Parameter {
                    name: "drift_us",
                    unit: "us",
                    what: "change of the hover pulse from cold to warm (M)",
                    low: -50.0,
                    high: 50.0,
                    default: |_| -10.0,
                    role: None,
                },
                Parameter {
                    name: "time_s",
                    unit: "s",
                    what: "time constant of warming (tau)",
                    low: 1.0,
                    high: 3600.0,
                    default: |_| 120.0,
                    role: Some(Role::WarmUpTime),
                },
            ],
            hooks: &[Hook::Command],
            shown: (Signal::Time, 0.0, 600.0),
            sought: Sought::Shape {
                size: "drift_us",
                sizes: |_| &[-12.0, 12.0],
                usual: None,
                shape: Some(("time_s", &[60.0, 100.0, 160.0])),
            },
        }
    }

    fn pulse_us(&self, _at: &Reference, values: &Values, signals: &Signals) -> f64 {
        -values[DRIFT] * (-signals.time_s.max(0.0) / values[TIME]).exp_m1()
    }

    fn start(&self, start: &Start<'_>, _airframe: &mut Airframe) -> Option<Box<dyn InFlight>> {
        let drift_us = start.values[DRIFT];
        let loss = drift_us / (start.reference.hover_us() - 1000.0 + drift_us);
        Some(Box::new(Motors { time_s: start.values[TIME], loss, warmth: 0.0 }))
    }
}

impl InFlight for Motors {
    fn follow(&mut self, now: &Now) {
        if now.turning {
            self.warmth += (1.0 - self.warmth) * now.dt_s / self.time_s;
        }
    }

    fn settle(&mut self, at: &Settled) {
        self.warmth = -(-at.time_s.max(0.0) / self.time_s).exp_m1();
    }

    fn command(&self, command: f64) -> f64 {
        command * (1.0 - self.loss * self.warmth)
    }
}
