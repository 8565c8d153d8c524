//! Thrust falls with the flow through the rotor: momentum and blade element theory.

use super::definition::{Class, Definition, Hook, Parameter, Signal, Sought, Values};
use super::disc::{Disc, LEAST_SHARE, MOST_SHARE, USUAL_SHARE, flow_us};
use super::role::Role;
use super::{Change, Effect, InFlight, Now, Reference, Signals, Start, momentum};
use crate::vehicle::Airframe;

const SHARE: usize = 0;
const SPREAD: usize = 1;
const INDUCED: usize = 2;
/// Rotor inflow.
#[derive(Debug)]
pub(super) struct RotorInflow;

/// The rotor of one drone.
#[derive(Clone, Debug)]
struct Rotor {
    disc: Disc,
    share: f64,
    induced: f64,
}

impl Effect for RotorInflow {
    fn definition(&self) -> &'static Definition {
        &Definition {
            name: "rotor-inflow",
            title: "Rotor inflow",
            what: "climbing costs rotor speed and descending saves it, in proportion to air speed",
            explanation: "A rotor's blades meet the air that flows through the disc; climbing adds \
                to that flow and takes angle of attack away. Thrust falls linearly with the axial \
                speed, and half of the climb is given back by a smaller induced velocity. This \
                makes the response of real drones linear in the vertical air speed, where AirSim's \
                is quadratic. The induced part of the torque goes with the flow, so current and \
                voltage drop add to the response.",
            formula: "T = k w² - k2 w (V + v_i);  T = 2 rho A (V + v_i) v_i;  at constant thrust \
                dw/dV = k2/(4k) / (1 - k2 v_h/(2 k w))",
            source: "Leishman, Principles of Helicopter Aerodynamics, ch. 2-3; Bangura et al., \
                arXiv:1601.00733",
            class: Class::AxialLinear,
            signals: &[Signal::Climb, Signal::Horizontal, Signal::Tilt],
            parameters: &[
                Parameter {
                    name: "inflow_share",
                    unit: "",
                    what: "share of the geometric thrust lost to the inflow in hover (k2 v_h/(k w))",
                    low: LEAST_SHARE,
                    high: MOST_SHARE,
                    default: |_| USUAL_SHARE,
                    role: Some(Role::InflowShare),
                },
                Parameter {
                    name: "spread",
                    unit: "",
                    what: "standard deviation of the share between drones, relative",
                    low: 0.0,
                    high: 0.2,
                    default: |_| 0.0,
                    role: Some(Role::InflowSpread),
                },
                Parameter {
                    name: "induced",
                    unit: "",
                    what: "share of momentum theory's change of the induced velocity with the \
                        climb; without it the response is straight far into descent",
                    low: 0.0,
                    high: 1.0,
                    default: |_| 1.0,
                    role: Some(Role::InflowInduced),
                },
            ],
            hooks: &[Hook::Loads],
            shown: (Signal::Climb, -3.5, 3.5),
            sought: Sought::Shape {
                size: "inflow_share",
                sizes: |_| &[0.15, 0.3, 0.5, 0.7],
                usual: None,
                shape: Some(("induced", &[1.0, 0.0])),
            },
        }
    }

    fn pulse_us(&self, at: &Reference, values: &Values, signals: &Signals) -> f64 {
        let share = (values[SHARE] * (1.0 + values[SPREAD] * signals.deviation)).min(MOST_SHARE);
        let axial = signals.axial_mps() / at.hover_induced_mps();
        let induced = 1.0 + values[INDUCED] * (momentum::induced(axial, 0.0) - 1.0);
        flow_us(at, share, axial + induced) - at.hover_us()
    }

    fn start(&self, start: &Start<'_>, airframe: &mut Airframe) -> Option<Box<dyn InFlight>> {
        let share = start.values[SHARE] * (1.0 + start.values[SPREAD] * start.deviation);
        let share = share.clamp(LEAST_SHARE, MOST_SHARE);
        let induced = start.values[INDUCED];
        Some(Box::new(Rotor { disc: Disc::of(airframe), share, induced }))
    }
}

impl InFlight for Rotor {
    fn loads(&mut self, now: &Now, change: &mut Change) {
        let Some((axial, _)) = self.disc.speeds(now) else { return };
        let working = momentum::in_climb(self.share, self.induced, axial);
        change.thrust *= working.thrust;
        change.torque += self.disc.merit * (working.thrust * working.flow - 1.0);
    }
}
