//! The rotors' thrust coefficient differs from drone to drone.

use super::definition::{Class, Definition, Hook, Parameter, Signal, Sought, Values};
use super::role::Role;
use super::{Effect, InFlight, Reference, Signals, Start};
use crate::vehicle::Airframe;

const SD: usize = 0;

/// The thrust coefficient differs from drone to drone.
#[derive(Debug)]
pub(super) struct ThrustSpread;

impl Effect for ThrustSpread {
    fn definition(&self) -> &'static Definition {
        &Definition {
            name: "thrust-spread",
            title: "Spread of thrust coefficient between drones",
            what: "each drone's rotors and motors give a little more or less thrust at one pulse",
            explanation: "Propellers, motors and magnets differ. Unlike mass, a weak rotor raises \
                the offset u0 and all slopes together, so the two correlate over the fleet.",
            formula: "T_i = (1 + sd·z_i) T;  du = -L ln(1 + sd·z_i)",
            source: "spread of u0 in the paper's Table II (6.7 us, 2.2 %)",
            class: Class::DroneOffset,
            signals: &[Signal::Drone],
            parameters: &[Parameter {
                name: "sd",
                unit: "",
                what: "standard deviation of the thrust coefficient between drones, relative",
                low: 0.0,
                high: 0.1,
                default: |_| 0.018,
                role: Some(Role::ThrustSpread),
            }],
            hooks: &[Hook::Drone],
            shown: (Signal::Drone, -2.0, 2.0),
            sought: Sought::No(
                "a difference between drones: told from their offsets and responses",
            ),
        }
    }

    fn pulse_us(&self, at: &Reference, values: &Values, signals: &Signals) -> f64 {
        at.thrust_us(1.0 / (1.0 + values[SD] * signals.deviation))
    }

    fn start(&self, start: &Start<'_>, airframe: &mut Airframe) -> Option<Box<dyn InFlight>> {
        airframe.thrust_coefficient *= 1.0 + start.values[SD] * start.deviation;
        None
    }
}
