//! A foreign effect that grows with the product of vertical air speed and time.

use super::{Foreign, lowered};
use crate::effects::definition::Parameter;
use crate::effects::{
    Class, Definition, Effect, Hook, InFlight, Now, Reference, Signal, Signals, Sought, Start,
    Values,
};
use crate::gap::Dependence;
use crate::vehicle::Airframe;

const SLOPE: usize = 0;
const TIME: usize = 1;

/// Response that changes with time.
#[derive(Debug)]
struct ClimbTime;

/// What the benchmark knows of it.
pub(super) const FOREIGN: Foreign =
    Foreign { effect: &ClimbTime, depends_on: &[Dependence::ClimbTime], turns: false };

/// The change at a vertical air speed and a time.
fn pulse_us(values: &Values, climb_mps: f64, time_s: f64) -> f64 {
    values[SLOPE] * climb_mps * time_s / values[TIME]
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

impl Effect for ClimbTime {
    fn definition(&self) -> &'static Definition {
        &Definition {
            name: "climb-time",
            title: "Response that changes with time",
            what: "the response to vertical speed grows during the flight",
            explanation: "A rotor that comes loose answers differently at the end than at the start. \
                The library has the like of it.",
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
                    role: None,
                },
                Parameter {
                    name: "time_s",
                    unit: "s",
                    what: "length of the flight (T)",
                    low: 1.0,
                    high: 36000.0,
                    default: |_| 430.0,
                    role: None,
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

    fn start(&self, start: &Start<'_>, _airframe: &mut Airframe) -> Option<Box<dyn InFlight>> {
        Some(Box::new(Acting { values: *start.values, time_s: 0.0, pulse_us: 0.0 }))
    }
}

impl InFlight for Acting {
    fn follow(&mut self, now: &Now) {
        if now.turning {
            self.time_s += now.dt_s;
        }
        self.pulse_us = pulse_us(&self.values, now.relative_mps.z, self.time_s);
    }

    fn command(&self, command: f64) -> f64 {
        lowered(command, self.pulse_us)
    }
}
