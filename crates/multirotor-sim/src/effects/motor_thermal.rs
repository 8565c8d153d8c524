//! Motors and controllers warm up.

use super::definition::{Class, Definition, Hook, Parameter, Signal, Sought, Values};
use super::{Effect, Now, Own, Reference, Signals, Start};
use crate::vehicle::Airframe;

const DRIFT: usize = 0;
const TIME: usize = 1;
/// State: how warm (0 cold, 1 at its end), and the share of command lost when warm.
const WARMTH: usize = 0;
const LOSS: usize = 1;

/// Motor and controller thermal drift.
#[derive(Debug)]
pub(super) struct MotorThermal;

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
                },
                Parameter {
                    name: "time_s",
                    unit: "s",
                    what: "time constant of warming (tau)",
                    low: 1.0,
                    high: 3600.0,
                    default: |_| 120.0,
                },
            ],
            hooks: &[Hook::Command],
            shown: (Signal::Time, 0.0, 600.0),
            sought: Sought::Shape {
                size: "drift_us",
                sizes: &[-12.0, 12.0],
                shape: Some(("time_s", &[60.0, 100.0, 160.0])),
            },
        }
    }

    fn pulse_us(&self, _at: &Reference, values: &Values, signals: &Signals) -> f64 {
        -values[DRIFT] * (-signals.time_s.max(0.0) / values[TIME]).exp_m1()
    }

    fn start(&self, own: &mut Own, start: &Start<'_>, _airframe: &mut Airframe) {
        let drift_us = own.values[DRIFT];
        own.state[LOSS] = drift_us / (start.reference.hover_us() - 1000.0 + drift_us);
    }

    fn follow(&self, own: &mut Own, now: &Now) {
        if now.turning {
            own.state[WARMTH] += (1.0 - own.state[WARMTH]) * now.dt_s / own.values[TIME];
        }
    }

    fn command(&self, own: &Own, command: f64) -> f64 {
        command * (1.0 - own.state[LOSS] * own.state[WARMTH])
    }
}
