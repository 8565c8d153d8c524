//! A foreign effect that is a sinusoid over height.

use super::{PULSE_US, TIME_S, lowered};
use crate::effects::definition::Parameter;
use crate::effects::{
    Class, Definition, Effect, Hook, Now, Own, Reference, Signal, Signals, Sought, Values,
};

const AMPLITUDE: usize = 0;
const WAVELENGTH: usize = 1;
const PHASE: usize = 2;

/// Wave along the height.
#[derive(Debug)]
pub(super) struct HeightWave;

/// The change at a height.
fn pulse_us(values: &Values, height_m: f64) -> f64 {
    let turns = height_m / values[WAVELENGTH];
    values[AMPLITUDE] * (std::f64::consts::TAU * turns + values[PHASE]).sin()
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
                },
                Parameter {
                    name: "wavelength_m",
                    unit: "m",
                    what: "wavelength (l)",
                    low: 5.0,
                    high: 1000.0,
                    default: |_| 40.0,
                },
                Parameter {
                    name: "phase_rad",
                    unit: "rad",
                    what: "phase at the ground (p)",
                    low: -10.0,
                    high: 10.0,
                    default: |_| 0.0,
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

    fn follow(&self, own: &mut Own, now: &Now) {
        if now.turning {
            own.state[TIME_S] += now.dt_s;
        }
        own.state[PULSE_US] = pulse_us(&own.values, now.height_m);
    }

    fn command(&self, own: &Own, command: f64) -> f64 {
        lowered(command, own.state[PULSE_US])
    }
}
