//! Mass differs from drone to drone.

use super::definition::{Class, Definition, Hook, Parameter, Signal, Sought, Values};
use super::role::Role;
use super::{Effect, InFlight, Reference, Signals, Start};
use crate::vehicle::Airframe;

const SD: usize = 0;

/// Mass differs from drone to drone.
#[derive(Debug)]
pub(super) struct MassSpread;

impl Effect for MassSpread {
    fn definition(&self) -> &'static Definition {
        &Definition {
            name: "mass-spread",
            title: "Spread of mass between drones",
            what: "each drone weighs a little more or less than the fleet",
            explanation: "A heavier drone needs more thrust at any speed: its offset u0 is higher, \
                and its slopes hardly change. From one flight it cannot be told from a steady \
                updraft at that drone or a bias of its vertical velocity; a known payload would \
                tell.",
            formula: "T = (1 + sd·z_i) m g;  du = L ln(1 + sd·z_i)",
            source: "spread of u0 in the paper's Table II (6.7 us, 2.2 %)",
            class: Class::DroneOffset,
            signals: &[Signal::Drone],
            parameters: &[Parameter {
                name: "sd",
                unit: "",
                what: "standard deviation of mass between drones, relative",
                low: 0.0,
                high: 0.1,
                default: |_| 0.012,
                role: Some(Role::MassSpread),
            }],
            hooks: &[Hook::Drone],
            shown: (Signal::Drone, -2.0, 2.0),
            sought: Sought::No(
                "a difference between drones: told from their offsets, not from the fleet's pulse",
            ),
        }
    }

    fn pulse_us(&self, at: &Reference, values: &Values, signals: &Signals) -> f64 {
        at.thrust_us(1.0 + values[SD] * signals.deviation)
    }

    fn start(&self, start: &Start<'_>, airframe: &mut Airframe) -> Option<Box<dyn InFlight>> {
        airframe.mass_kg *= 1.0 + start.values[SD] * start.deviation;
        None
    }
}
