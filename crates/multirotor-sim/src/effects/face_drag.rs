//! The drag that the airframe itself has is more or less than its model says.

use super::definition::{Class, Definition, Hook, Parameter, Signal, Sought, Values};
use super::model::airframe_drag_m2;
use super::reference::DENSITY;
use super::role::Role;
use super::{Change, Effect, InFlight, Now, Reference, Signals, Start};
use crate::vehicle::{Airframe, Vehicle};

const NAME: &str = "face-drag";
const TOP: usize = 0;
const SIDES: usize = 1;
/// A face keeps a tenth of its drag at least, and has four times of it at most: what is beyond belongs to
/// another body.
const LEAST: f64 = -0.9;
const MOST: f64 = 3.0;
/// AirSim's faces do not feel slower air, m/s (FastPhysicsEngine::getDragWrench).
const DEAD_BAND_MPS: f64 = 0.1;

/// Drag of the airframe's own faces.
#[derive(Debug)]
pub(super) struct FaceDrag;

/// The airframe of one drone.
#[derive(Clone, Debug)]
struct Faces {
    top: f64,
    sides: f64,
}

/// Change of the top face that a vehicle's file states, else the usual one: a body that is larger is
/// larger from all sides.
fn top_of(vehicle: &Vehicle) -> f64 {
    let stated = vehicle.effects.get(NAME).and_then(|table| table.parameters.get("top"));
    stated.copied().unwrap_or(0.5)
}

/// Sizes to try: none where the airframe has no drag of its own.
fn sizes(vehicle: &Vehicle) -> &'static [f64] {
    let frame = &vehicle.airframe;
    let has_drag = frame.sitl.is_some() || frame.drag_coefficient > 0.0;
    if has_drag { &[-0.4, 0.5] } else { &[] }
}

impl Effect for FaceDrag {
    fn definition(&self) -> &'static Definition {
        &Definition {
            name: NAME,
            title: "Drag of the airframe's own faces",
            what: "the faces of the airframe resist the air more or less than its model says",
            explanation: "AirSim's drag is that of a box: each face feels only the air along its own \
                axis. Real bodies have another size and shape, and the top differs from the sides. \
                This scales the drag that the airframe itself has (AirSim's box with its discs, or \
                the body of ArduPilot's frame); an airframe without any is not changed. A body that \
                stands in the stream besides is parasitic drag. In still air the two cannot be told \
                apart; in wind a box's top does not feel the wind, and a body in one piece does.",
            formula: "D_z = (1 + k_top) D_z0(v_z),  D_xy = (1 + k_sides) D_xy0(v_xy);  \
                du = k_top A V|V|",
            source: "AirSim FastPhysicsEngine::getDragWrench; Hoerner, Fluid-Dynamic Drag",
            class: Class::AxialShape,
            signals: &[Signal::Climb, Signal::Horizontal, Signal::Tilt],
            parameters: &[
                Parameter {
                    name: "top",
                    unit: "",
                    what: "relative change of the drag of the top and bottom face (k_top)",
                    low: LEAST,
                    high: MOST,
                    default: top_of,
                    role: Some(Role::FaceDragTop),
                },
                Parameter {
                    name: "sides",
                    unit: "",
                    what: "relative change of the drag of the other faces (k_sides); as the top \
                        where it is not stated",
                    low: LEAST,
                    high: MOST,
                    default: top_of,
                    role: Some(Role::FaceDragSide),
                },
            ],
            hooks: &[Hook::Loads],
            shown: (Signal::Climb, -3.5, 3.5),
            sought: Sought::Shape { size: "top", sizes, usual: Some(0.5), shape: None },
        }
    }

    fn pulse_us(&self, at: &Reference, values: &Values, signals: &Signals) -> f64 {
        let along = signals.axial_mps();
        if along.abs() <= DEAD_BAND_MPS {
            return 0.0;
        }
        let density = DENSITY * at.density_ratio;
        let drag = airframe_drag_m2(&at.airframe) * density * along * along.abs() / at.weight_n();
        at.thrust_us(1.0 + (1.0 + values[TOP]) * drag) - at.thrust_us(1.0 + drag)
    }

    fn start(&self, start: &Start<'_>, _airframe: &mut Airframe) -> Option<Box<dyn InFlight>> {
        Some(Box::new(Faces { top: 1.0 + start.values[TOP], sides: 1.0 + start.values[SIDES] }))
    }
}

impl InFlight for Faces {
    fn loads(&mut self, _now: &Now, change: &mut Change) {
        change.drag.x *= self.sides;
        change.drag.y *= self.sides;
        change.drag.z *= self.top;
    }
}
