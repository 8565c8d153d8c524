//! Drag of the body in the air stream.

use super::definition::{Class, Definition, Hook, Parameter, Signal, Sought, Values};
use super::reference::DENSITY;
use super::{Change, Effect, Now, Own, Reference, Signals};
use crate::vehicle::Vehicle;

const VERTICAL: usize = 0;
const HORIZONTAL: usize = 1;

/// Parasitic body drag.
#[derive(Debug)]
pub(super) struct ParasiticDrag;

const USUAL_VERTICAL_M2: f64 = 0.02;

/// Vertical drag area of a vehicle on which this effect acts, else 0, m².
pub(super) fn vertical_m2(vehicle: &Vehicle) -> f64 {
    let Some(table) = vehicle.effects.get("parasitic-drag").filter(|table| table.on) else {
        return 0.0;
    };
    table.parameters.get("vertical_m2").copied().unwrap_or(USUAL_VERTICAL_M2)
}

impl Effect for ParasiticDrag {
    fn definition(&self) -> &'static Definition {
        &Definition {
            name: "parasitic-drag",
            title: "Parasitic body drag",
            what: "the body resists the air with the square of its speed",
            explanation: "Plates, arms and battery stand in the stream: an odd, quadratic response \
                that adds to the linear one of the rotors. AirSim has it already, with four times \
                the area of the rotor discs; real bodies have much less. In steady windows its \
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
                    default: |_| USUAL_VERTICAL_M2,
                },
                Parameter {
                    name: "horizontal_m2",
                    unit: "m²",
                    what: "drag coefficient times area for horizontal flow (S_h)",
                    low: 0.0,
                    high: 1.0,
                    default: |_| 0.01,
                },
            ],
            hooks: &[Hook::Loads],
            shown: (Signal::Climb, -3.5, 3.5),
            sought: Sought::Shape { size: "vertical_m2", sizes: &[0.02, 0.1], shape: None },
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

    fn loads(&self, own: &mut Own, now: &Now, change: &mut Change) {
        let pressure = DENSITY * now.density_ratio / 2.0 * now.relative_mps.norm();
        let [vertical, horizontal] = [own.values[VERTICAL], own.values[HORIZONTAL]];
        change.force_n.x -= pressure * horizontal * now.relative_mps.x;
        change.force_n.y -= pressure * horizontal * now.relative_mps.y;
        change.force_n.z -= pressure * vertical * now.relative_mps.z;
    }
}
