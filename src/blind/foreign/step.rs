//! A foreign effect: a step of the pulse at one instant.

use super::{Foreign, lowered};
use crate::effects::definition::Parameter;
use crate::effects::{
    Class, Definition, Effect, Hook, InFlight, Now, Reference, Signal, Signals, Sought, Start,
    Values,
};
use crate::gap::Dependence;
use crate::vehicle::Airframe;

const JUMP: usize = 0;
const AT: usize = 1;

/// Step of the pulse.
#[derive(Debug)]
struct Step;

/// What the benchmark knows of it.
pub(super) const FOREIGN: Foreign =
    Foreign { effect: &Step, depends_on: &[Dependence::Step, Dependence::Time], turns: false };

/// The change at a time.
fn pulse_us(values: &Values, time_s: f64) -> f64 {
    if time_s >= values[AT] { values[JUMP] } else { 0.0 }
}

/// One drone in flight.
#[derive(Clone, Debug)]
struct Acting {
    values: Values,
    /// Since the motors started.
    time_s: f64,
    /// Change of the pulse now.
    pulse_us: f64,
}

impl Effect for Step {
    fn definition(&self) -> &'static Definition {
        &Definition {
            name: "step",
            title: "Step of the pulse",
            what: "from one moment on the pulse is higher or lower",
            explanation: "Something came loose, or a controller changed its mode: no library has it.",
            formula: "du = J (t >= t_0)",
            source: "made for the blind benchmark",
            class: Class::TimeDrift,
            signals: &[Signal::Time],
            parameters: &[
                Parameter {
                    name: "jump_us",
                    unit: "us",
                    what: "change of the pulse (J)",
                    low: -100.0,
                    high: 100.0,
                    default: |_| 15.0,
                    role: None,
                },
                Parameter {
                    name: "at_s",
                    unit: "s",
                    what: "when, after motor start (t_0)",
                    low: 0.0,
                    high: 3600.0,
                    default: |_| 200.0,
                    role: None,
                },
            ],
            hooks: &[Hook::Command],
            shown: (Signal::Time, 0.0, 600.0),
            sought: Sought::No("in no library"),
        }
    }

    fn pulse_us(&self, _at: &Reference, values: &Values, signals: &Signals) -> f64 {
        pulse_us(values, signals.time_s)
    }

    fn start(&self, start: &Start<'_>, _airframe: &mut Airframe) -> Option<Box<dyn InFlight>> {
        Some(Box::new(Acting { values: *start.values, time_s: 0.0, pulse_us: 0.0 }))
    }
}

impl InFlight for Acting {
    fn follow(&mut self, now: &Now) {
        if now.turning {
            self.time_s += now.dt_s;
        }
        self.pulse_us = pulse_us(&self.values, self.time_s);
    }

    fn command(&self, command: f64) -> f64 {
        lowered(command, self.pulse_us)
    }
}
