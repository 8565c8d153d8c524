//! Drag of the body in the air stream.

use super::definition::{Class, Definition, Hook, Parameter, Signal, Sought, Values};
use super::reference::DENSITY;
use super::role::Role;
use super::{Change, Effect, InFlight, Now, Reference, Signals, Start};
use crate::vehicle::Airframe;

const VERTICAL: usize = 0;
const HORIZONTAL: usize = 1;

/// Parasitic body drag.
#[derive(Debug)]
pub(super) struct ParasiticDrag;

/// The body of one drone.
#[derive(Clone, Debug)]
struct Body {
    vertical_m2: f64,
    horizontal_m2: f64,
}

impl Effect for ParasiticDrag {
    fn definition(&self) -> &'static Definition {
        &Definition {
            name: "parasitic-drag",
            title: "Parasitic body drag",
            what: "the body resists the air with the square of its speed",
            explanation: "Plates, arms and battery stand in the stream: an odd, quadratic response \
                that adds to the linear one of the rotors. AirSim has it already, with four times \
                the area of the rotor discs; real bodies have much less, and another effect scales the box's. \
                With equal areas it is a body in one piece, which resists with |v| v whichever way \
                the air comes. In steady windows its \
                size cannot be told from a wrong thrust curve.",
            formula: "D = rho/2 |v| (S_h v_x, S_h v_y, S_v v_z) along the body's axes, S = C_D area;  \
                du = A V|V|, A = L rho S_v/(2 m g)",
            source: "Hoerner, Fluid-Dynamic Drag",
            class: Class::AxialShape,
            signals: &[Signal::Climb, Signal::Horizontal],
            parameters: &[
                Parameter {
                    name: "vertical_m2",
                    unit: "m²",
                    what: "drag coefficient times area for vertical flow (S_v)",
                    low: 0.0,
                    high: 1.0,
                    default: |_| 0.02,
                    role: Some(Role::BodyDragTop),
                },
                Parameter {
                    name: "horizontal_m2",
                    unit: "m²",
                    what: "drag coefficient times area for horizontal flow (S_h)",
                    low: 0.0,
                    high: 1.0,
                    default: |_| 0.01,
                    role: Some(Role::BodyDragSide),
                },
            ],
            hooks: &[Hook::Loads],
            shown: (Signal::Climb, -3.5, 3.5),
            sought: Sought::Shape {
                size: "vertical_m2",
                sizes: |_| &[0.02, 0.1],
                usual: None,
                shape: None,
            },
        }
    }

    fn pulse_us(&self, at: &Reference, values: &Values, signals: &Signals) -> f64 {
        let speed = signals.climb_mps.hypot(signals.horizontal_mps);
        let per_weight = DENSITY * at.density_ratio / 2.0 * speed / at.weight_n();
        let own_lean = (per_weight * values[HORIZONTAL] * signals.horizontal_mps).atan();
        // The plate leans with the rotors: the wind presses on its top.
        let leaning = Signals { tilt_rad: signals.tilt_rad.max(own_lean), ..*signals };
        let along = per_weight * values[VERTICAL] * leaning.axial_mps();
        at.thrust_us(own_lean.cos() + along)
    }

    fn start(&self, start: &Start<'_>, _airframe: &mut Airframe) -> Option<Box<dyn InFlight>> {
        let [vertical_m2, horizontal_m2] = [start.values[VERTICAL], start.values[HORIZONTAL]];
        Some(Box::new(Body { vertical_m2, horizontal_m2 }))
    }
}

impl InFlight for Body {
    fn loads(&mut self, now: &Now, change: &mut Change) {
        let pressure = DENSITY * now.density_ratio / 2.0 * now.relative_mps.norm();
        change.force_n.x -= pressure * self.horizontal_m2 * now.relative_mps.x;
        change.force_n.y -= pressure * self.horizontal_m2 * now.relative_mps.y;
        change.force_n.z -= pressure * self.vertical_m2 * now.relative_mps.z;
    }
}
