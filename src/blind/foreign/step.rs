//! A foreign effect: a step of the pulse at one instant.

use super::{PULSE_US, TIME_S, lowered};
use crate::effects::definition::Parameter;
use crate::effects::{
    Class, Definition, Effect, Hook, Now, Own, Reference, Signal, Signals, Sought, Values,
};

const JUMP: usize = 0;
const AT: usize = 1;

/// Step of the pulse.
#[derive(Debug)]
pub(super) struct Step;

/// The change at a time.
fn pulse_us(values: &Values, time_s: f64) -> f64 {
    if time_s >= values[AT] { values[JUMP] } else { 0.0 }
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
                },
                Parameter {
                    name: "at_s",
                    unit: "s",
                    what: "when, after motor start (t_0)",
                    low: 0.0,
                    high: 3600.0,
                    default: |_| 200.0,
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

    fn follow(&self, own: &mut Own, now: &Now) {
        if now.turning {
            own.state[TIME_S] += now.dt_s;
        }
        own.state[PULSE_US] = pulse_us(&own.values, own.state[TIME_S]);
    }

    fn command(&self, own: &Own, command: f64) -> f64 {
        lowered(command, own.state[PULSE_US])
    }
}
