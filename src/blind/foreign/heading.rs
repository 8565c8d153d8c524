//! A foreign effect of the direction of the horizontal air velocity against the nose.

use super::{PULSE_US, TIME_S, lowered};
use crate::effects::definition::Parameter;
use crate::effects::{
    Class, Definition, Effect, Hook, Now, Own, Reference, Signal, Signals, Sought, Values,
};

const AMPLITUDE: usize = 0;
const KNEE: usize = 1;

/// Dependence on the direction of the air.
#[derive(Debug)]
pub(super) struct Heading;

/// The change at a horizontal air velocity: forward, and to the left.
fn pulse_us(values: &Values, forward_mps: f64, left_mps: f64) -> f64 {
    let speed = forward_mps.hypot(left_mps).hypot(values[KNEE]);
    values[AMPLITUDE] * forward_mps / speed
}

impl Effect for Heading {
    fn definition(&self) -> &'static Definition {
        &Definition {
            name: "heading",
            title: "Dependence on the direction of the air",
            what: "air from ahead costs more than air from behind",
            explanation: "A body that is not the same from all sides: no library has it.",
            formula: "du = C v_x/sqrt(v^2 + v_0^2), v_x forward",
            source: "made for the blind benchmark",
            class: Class::Horizontal,
            signals: &[Signal::Horizontal],
            parameters: &[
                Parameter {
                    name: "amplitude_us",
                    unit: "us",
                    what: "pulse with the air straight from ahead (C)",
                    low: -100.0,
                    high: 100.0,
                    default: |_| 15.0,
                },
                Parameter {
                    name: "knee_mps",
                    unit: "m/s",
                    what: "speed from which the direction counts (v_0)",
                    low: 0.01,
                    high: 20.0,
                    default: |_| 1.0,
                },
            ],
            hooks: &[Hook::Command],
            shown: (Signal::Horizontal, 0.0, 8.0),
            sought: Sought::No("in no library"),
        }
    }

    fn pulse_us(&self, _at: &Reference, values: &Values, signals: &Signals) -> f64 {
        pulse_us(values, signals.horizontal_mps, 0.0)
    }

    fn follow(&self, own: &mut Own, now: &Now) {
        if now.turning {
            own.state[TIME_S] += now.dt_s;
        }
        own.state[PULSE_US] = pulse_us(&own.values, now.relative_mps.x, now.relative_mps.y);
    }

    fn command(&self, own: &Own, command: f64) -> f64 {
        lowered(command, own.state[PULSE_US])
    }
}
