//! A foreign effect that is a sinusoid over height.

use super::{Foreign, lowered};
use crate::effects::definition::Parameter;
use crate::effects::{
    Class, Definition, Effect, Hook, InFlight, Now, Reference, Signal, Signals, Sought, Start,
    Values,
};
use crate::gap::Dependence;
use crate::vehicle::Airframe;

const AMPLITUDE: usize = 0;
const WAVELENGTH: usize = 1;
const PHASE: usize = 2;

/// Wave along the height.
#[derive(Debug)]
struct HeightWave;

/// What the benchmark knows of it.
pub(super) const FOREIGN: Foreign =
    Foreign { effect: &HeightWave, depends_on: &[Dependence::Height], turns: false };

/// The change at a height.
fn pulse_us(values: &Values, height_m: f64) -> f64 {
    let turns = height_m / values[WAVELENGTH];
    values[AMPLITUDE] * (std::f64::consts::TAU * turns + values[PHASE]).sin()
}

/// One drone in flight.
#[derive(Clone, Debug)]
struct Acting {
    values: Values,
    /// Change of the pulse now.
    pulse_us: f64,
}

impl Effect for HeightWave {
    fn definition(&self) -> &'static Definition {
        &Definition {
            name: "height-wave",
            title: "Wave along the height",
            what: "the pulse goes up and down with height",
            explanation: "A shear layer, or a map of something: no library has it.",
            formula: "du = C sin(2 pi h/l + p)",
            source: "made for the blind benchmark",
            class: Class::HeightTrend,
            signals: &[Signal::Height],
            parameters: &[
                Parameter {
                    name: "amplitude_us",
                    unit: "us",
                    what: "amplitude (C)",
                    low: 0.0,
                    high: 100.0,
                    default: |_| 12.0,
                    role: None,
                },
                Parameter {
                    name: "wavelength_m",
                    unit: "m",
                    what: "wavelength (l)",
                    low: 5.0,
                    high: 1000.0,
                    default: |_| 40.0,
                    role: None,
                },
                Parameter {
                    name: "phase_rad",
                    unit: "rad",
                    what: "phase at the ground (p)",
                    low: -10.0,
                    high: 10.0,
                    default: |_| 0.0,
                    role: None,
                },
            ],
            hooks: &[Hook::Command],
            shown: (Signal::Height, 0.0, 90.0),
            sought: Sought::No("in no library"),
        }
    }

    fn pulse_us(&self, _at: &Reference, values: &Values, signals: &Signals) -> f64 {
        pulse_us(values, signals.height_m)
    }

    fn start(&self, start: &Start<'_>, _airframe: &mut Airframe) -> Option<Box<dyn InFlight>> {
        Some(Box::new(Acting { values: *start.values, pulse_us: 0.0 }))
    }
}

impl InFlight for Acting {
    fn follow(&mut self, now: &Now) {
        self.pulse_us = pulse_us(&self.values, now.height_m);
    }

    fn command(&self, command: f64) -> f64 {
        lowered(command, self.pulse_us)
    }
}
