//! A foreign effect of the direction of the horizontal air velocity against the nose.

use super::{Foreign, lowered};
use crate::effects::definition::Parameter;
use crate::effects::{
    Class, Definition, Effect, Hook, InFlight, Now, Reference, Signal, Signals, Sought, Start,
    Values,
};
use crate::gap::Dependence;
use crate::vehicle::Airframe;

const AMPLITUDE: usize = 0;
const KNEE: usize = 1;

/// Dependence on the direction of the air.
#[derive(Debug)]
struct Heading;

/// What the benchmark knows of it.
pub(super) const FOREIGN: Foreign =
    Foreign { effect: &Heading, depends_on: &[Dependence::Heading], turns: true };

/// The change at a horizontal air velocity: forward, and to the left.
fn pulse_us(values: &Values, forward_mps: f64, left_mps: f64) -> f64 {
    let speed = forward_mps.hypot(left_mps).hypot(values[KNEE]);
    values[AMPLITUDE] * forward_mps / speed
}

/// One drone in flight.
#[derive(Clone, Debug)]
struct Acting {
    values: Values,
    /// Change of the pulse now.
    pulse_us: f64,
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
                    role: None,
                },
                Parameter {
                    name: "knee_mps",
                    unit: "m/s",
                    what: "speed from which the direction counts (v_0)",
                    low: 0.01,
                    high: 20.0,
                    default: |_| 1.0,
                    role: None,
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

    fn start(&self, start: &Start<'_>, _airframe: &mut Airframe) -> Option<Box<dyn InFlight>> {
        Some(Box::new(Acting { values: *start.values, pulse_us: 0.0 }))
    }
}

impl InFlight for Acting {
    fn follow(&mut self, now: &Now) {
        self.pulse_us = pulse_us(&self.values, now.relative_mps.x, now.relative_mps.y);
    }

    fn command(&self, command: f64) -> f64 {
        lowered(command, self.pulse_us)
    }
}
