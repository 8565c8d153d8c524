//! A foreign effect that grows with the product of vertical air speed and time.

use super::{PULSE_US, TIME_S, lowered};
use crate::effects::definition::Parameter;
use crate::effects::{
    Class, Definition, Effect, Hook, Now, Own, Reference, Signal, Signals, Sought, Values,
};

const SLOPE: usize = 0;
const TIME: usize = 1;

/// Response that changes with time.
#[derive(Debug)]
pub(super) struct ClimbTime;

/// The change at a vertical air speed and a time.
fn pulse_us(values: &Values, climb_mps: f64, time_s: f64) -> f64 {
    values[SLOPE] * climb_mps * time_s / values[TIME]
}

impl Effect for ClimbTime {
    fn definition(&self) -> &'static Definition {
        &Definition {
            name: "climb-time",
            title: "Response that changes with time",
            what: "the response to vertical speed grows during the flight",
            explanation: "A rotor that comes loose answers differently at the end than at the start: no library has it.",
            formula: "du = K V t/T",
            source: "made for the blind benchmark",
            class: Class::AxialLinear,
            signals: &[Signal::Climb, Signal::Time],
            parameters: &[
                Parameter {
                    name: "slope_us",
                    unit: "us/(m/s)",
                    what: "change of the response after the time T (K)",
                    low: -50.0,
                    high: 50.0,
                    default: |_| 10.0,
                },
                Parameter {
                    name: "time_s",
                    unit: "s",
                    what: "length of the flight (T)",
                    low: 1.0,
                    high: 36000.0,
                    default: |_| 430.0,
                },
            ],
            hooks: &[Hook::Command],
            shown: (Signal::Climb, -3.5, 3.5),
            sought: Sought::No("in no library"),
        }
    }

    fn pulse_us(&self, _at: &Reference, values: &Values, signals: &Signals) -> f64 {
        pulse_us(values, signals.climb_mps, signals.time_s)
    }

    fn follow(&self, own: &mut Own, now: &Now) {
        if now.turning {
            own.state[TIME_S] += now.dt_s;
        }
        own.state[PULSE_US] = pulse_us(&own.values, now.relative_mps.z, own.state[TIME_S]);
    }

    fn command(&self, own: &Own, command: f64) -> f64 {
        lowered(command, own.state[PULSE_US])
    }
}
