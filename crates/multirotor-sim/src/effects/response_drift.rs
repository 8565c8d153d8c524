//! The response to vertical air speed changes during the flight.

use super::definition::{Class, Definition, Hook, Parameter, Signal, Sought, Values};
use super::{Change, Effect, InFlight, Now, Reference, Settled, Signals, Start};
use crate::vehicle::Airframe;

const SLOPE: usize = 0;
const TIME: usize = 1;

/// Drift of the response.
#[derive(Debug)]
pub(super) struct ResponseDrift;

/// The rotors of one drone.
#[derive(Clone, Debug)]
struct Rotors {
    /// Force against the axial speed after one second, N/(m/s).
    per_speed_second: f64,
    /// Since the motors started.
    time_s: f64,
}

/// Further thrust that is needed at a speed and a time, as a share of the weight.
fn demand(at: &Reference, values: &Values, axial_mps: f64, time_s: f64) -> f64 {
    values[SLOPE] / at.own_sensitivity_us() * axial_mps * time_s / values[TIME]
}

impl Effect for ResponseDrift {
    fn definition(&self) -> &'static Definition {
        &Definition {
            name: "response-drift",
            title: "Drift of the response",
            what: "the response to vertical air speed grows or falls during the flight",
            explanation: "Blades ice up, wear or bend, and a motor that warms up answers otherwise: \
                at the end of the flight a climb costs another pulse than at its start, and hover \
                costs the same. It takes equal speeds at different times to see it; a ladder that \
                flies each speed once takes it for a curve of the response.",
            formula: "T = m g (1 + K V t/(L t_0));  du = K V t/t_0",
            source: "a Taylor series of the response in time, whatever the cause",
            class: Class::AxialLinear,
            signals: &[Signal::Climb, Signal::Horizontal, Signal::Tilt, Signal::Time],
            parameters: &[
                Parameter {
                    name: "slope_us",
                    unit: "us/(m/s)",
                    what: "change of the response within the time t_0 (K)",
                    low: -30.0,
                    high: 30.0,
                    default: |_| 5.0,
                    role: None,
                },
                Parameter {
                    name: "time_s",
                    unit: "s",
                    what: "time in which it changes so much (t_0): ten minutes, about a flight",
                    low: 1.0,
                    high: 36_000.0,
                    default: |_| 600.0,
                    role: None,
                },
            ],
            hooks: &[Hook::Command, Hook::Loads],
            shown: (Signal::Climb, -3.5, 3.5),
            sought: Sought::Shape {
                size: "slope_us",
                sizes: |_| &[-5.0, 5.0],
                usual: None,
                shape: None,
            },
        }
    }

    fn pulse_us(&self, at: &Reference, values: &Values, signals: &Signals) -> f64 {
        let time_s = signals.time_s.max(0.0);
        at.thrust_us(1.0 + demand(at, values, signals.axial_mps(), time_s))
    }

    fn start(&self, start: &Start<'_>, _airframe: &mut Airframe) -> Option<Box<dyn InFlight>> {
        let per_speed_second =
            start.reference.weight_n() * demand(start.reference, start.values, 1.0, 1.0);
        Some(Box::new(Rotors { per_speed_second, time_s: 0.0 }))
    }
}

impl InFlight for Rotors {
    fn follow(&mut self, now: &Now) {
        if now.turning {
            self.time_s += now.dt_s;
        }
    }

    fn loads(&mut self, now: &Now, change: &mut Change) {
        change.force_n.z -= self.per_speed_second * self.time_s * now.relative_mps.z;
    }

    fn settle(&mut self, at: &Settled) {
        self.time_s = at.time_s.max(0.0);
    }
}
