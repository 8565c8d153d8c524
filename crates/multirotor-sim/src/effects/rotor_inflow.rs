//! Thrust falls with the flow through the rotor: momentum and blade element theory.

use super::definition::{Class, Definition, Hook, Parameter, Signal, Sought, Values};
use super::reference::DENSITY;
use super::{Change, Effect, Now, Own, Reference, Signals, Start, momentum};
use crate::vehicle::{Airframe, Vehicle};

const SHARE: usize = 0;
const SPREAD: usize = 1;
/// Below this induced velocity a rotor only idles, m/s.
const IDLE_MPS: f64 = 0.5;

/// Share of the geometric thrust that a small low-pitch rotor loses to its own inflow.
const USUAL_SHARE: f64 = 0.5;
pub(super) const LEAST_SHARE: f64 = 0.0;
pub(super) const MOST_SHARE: f64 = 0.9;

/// Rotor inflow.
#[derive(Debug)]
pub(super) struct RotorInflow;

/// The inflow share that a vehicle's file states for this effect, for effects that build on it.
pub(super) fn share_of(vehicle: &Vehicle) -> f64 {
    let table = vehicle.effects.get("rotor-inflow");
    table.and_then(|table| table.parameters.get("inflow_share")).copied().unwrap_or(USUAL_SHARE)
}

/// The rotor as the effects on its inflow need it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Disc {
    /// Twice density at sea level times area, kg/m.
    pub(super) flow_factor: f64,
    /// Share of the torque in hover that makes the induced flow.
    pub(super) merit: f64,
}

impl Disc {
    pub(super) fn of(airframe: &Airframe) -> Self {
        Self {
            flow_factor: 2.0 * DENSITY * airframe.disc_area_m2(),
            merit: airframe.figure_of_merit().min(1.0),
        }
    }

    /// Axial and edgewise speed over the induced velocity in still air at the present rotor speed;
    /// `None` while the rotors do not carry.
    pub(super) fn speeds(&self, now: &Now) -> Option<(f64, f64)> {
        let square = now.thrust_n / (self.flow_factor * now.density_ratio);
        if square < IDLE_MPS * IDLE_MPS {
            return None;
        }
        let induced_mps = square.sqrt();
        let relative = now.relative_mps / induced_mps;
        Some((relative.z, relative.xy().norm()))
    }
}

/// The pulse that keeps the hover thrust when the flow through the disc is `flow` times the induced
/// velocity in hover, us.
pub(super) fn flow_us(at: &Reference, share: f64, flow: f64) -> f64 {
    let speed = momentum::speed_for_flow(share, flow);
    let merit = at.airframe.figure_of_merit().min(1.0);
    at.pulse_us(speed, momentum::torque_for_flow(merit, flow, speed))
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
                },
                Parameter {
                    name: "spread",
                    unit: "",
                    what: "standard deviation of the share between drones, relative",
                    low: 0.0,
                    high: 0.2,
                    default: |_| 0.0,
                },
            ],
            hooks: &[Hook::Loads],
            shown: (Signal::Climb, -3.5, 3.5),
            sought: Sought::Shape {
                size: "inflow_share",
                sizes: &[0.15, 0.3, 0.5, 0.7],
                shape: None,
            },
        }
    }

    fn pulse_us(&self, at: &Reference, values: &Values, signals: &Signals) -> f64 {
        let share = (values[SHARE] * (1.0 + values[SPREAD] * signals.deviation)).min(MOST_SHARE);
        let axial = signals.axial_mps() / at.hover_induced_mps();
        flow_us(at, share, axial + momentum::induced(axial, 0.0)) - at.hover_us()
    }

    fn start(&self, own: &mut Own, _start: &Start<'_>, airframe: &mut Airframe) {
        let share = own.values[SHARE] * (1.0 + own.values[SPREAD] * own.deviation);
        own.values[SHARE] = share.clamp(LEAST_SHARE, MOST_SHARE);
        let disc = Disc::of(airframe);
        own.state[0] = disc.flow_factor;
        own.state[1] = disc.merit;
    }

    fn loads(&self, own: &mut Own, now: &Now, change: &mut Change) {
        let disc = Disc { flow_factor: own.state[0], merit: own.state[1] };
        let Some((axial, _)) = disc.speeds(now) else { return };
        let working = momentum::at_speed(own.values[SHARE], axial, 0.0);
        change.thrust *= working.thrust;
        change.torque += disc.merit * (working.thrust * working.flow - 1.0);
    }
}
