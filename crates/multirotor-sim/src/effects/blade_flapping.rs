//! Horizontal drag of the rotors: blade flapping and induced drag.

use super::definition::{Class, Definition, Hook, Parameter, Signal, Sought, Values};
use super::disc::Disc;
use super::role::Role;
use super::{Change, Effect, InFlight, Now, Reference, Signals, Start, momentum};
use crate::vehicle::Airframe;

const DRAG: usize = 0;
const WITH_FLOW: usize = 1;

/// Blade flapping and rotor drag (H-force).
#[derive(Debug)]
pub(super) struct BladeFlapping;

/// The rotors of one drone.
#[derive(Clone, Debug)]
struct Rotors {
    drag_per_weight: f64,
    with_flow: f64,
    weight_n: f64,
    disc: Disc,
}

/// Drag over that in hover in still air, where a part of it goes with the flow through the disc: axial and edgewise
/// speed over the induced velocity.
fn by_flow(part: f64, axial: f64, edgewise: f64) -> f64 {
    if part > 0.0 {
        (1.0 - part + part * (axial + momentum::induced(axial, edgewise))).max(0.0)
    } else {
        1.0
    }
}

impl Effect for BladeFlapping {
    fn definition(&self) -> &'static Definition {
        &Definition {
            name: "blade-flapping",
            title: "Blade flapping and rotor drag (H-force)",
            what: "rotors resist edgewise flow in proportion to speed, so the drone leans into wind",
            explanation: "Advancing blades lift more than retreating ones; they flap, and the \
                induced drag differs too. The sum is a force in the rotor plane, linear in the \
                horizontal air speed: a drone leans by a degree or more per m/s, where AirSim's \
                hardly leans at all. Leaning, the rotor plane's force carries part of the weight, \
                and the wind blows through the disc (which rotor inflow turns into a higher pulse). \
                It goes with the rotors' speed, the root of their thrust, times the speed in their \
                plane; what the same blades answer to air along their axis is rotor inflow. The \
                blades' lift leans back with the flow through the disc, so a part of the force goes \
                with that flow: in the same wind such a drone leans more climbing than descending.",
            formula: "H = 4 k_d w v = lambda sqrt(T m g) v, of which a part goes with (V + v_i)/v_h;  \
                in hover tan(phi) = lambda v sqrt(cos phi), T = m g cos(phi)",
            source: "Hoffmann et al. 2007; Mahony, Kumar and Corke 2012; RotorPy k_d",
            class: Class::Horizontal,
            signals: &[Signal::Horizontal],
            parameters: &[
                Parameter {
                    name: "drag_per_weight",
                    unit: "s/m",
                    what: "force over weight per horizontal air speed in hover (lambda); 0.0175 is \
                        1 degree of lean per m/s",
                    low: 0.0,
                    high: 0.1,
                    default: |_| 0.021,
                    role: Some(Role::RotorDrag),
                },
                Parameter {
                    name: "with_flow",
                    unit: "",
                    what: "part of it that goes with the flow through the disc",
                    low: 0.0,
                    high: 1.0,
                    default: |_| 0.0,
                    role: Some(Role::RotorDragFlow),
                },
            ],
            hooks: &[Hook::Loads],
            shown: (Signal::Horizontal, 0.0, 8.0),
            sought: Sought::No(
                "told from the lean at known speeds over ground (horizontal legs), not from the pulse",
            ),
        }
    }

    fn pulse_us(&self, at: &Reference, values: &Values, signals: &Signals) -> f64 {
        let induced_mps = at.hover_induced_mps();
        let axial = signals.axial_mps() / induced_mps;
        let edgewise = signals.edgewise_mps() / induced_mps;
        let drag = values[DRAG] * by_flow(values[WITH_FLOW], axial, edgewise);
        at.thrust_us(lean(drag, signals.horizontal_mps).cos())
    }

    fn start(&self, start: &Start<'_>, airframe: &mut Airframe) -> Option<Box<dyn InFlight>> {
        Some(Box::new(Rotors {
            drag_per_weight: start.values[DRAG],
            with_flow: start.values[WITH_FLOW],
            weight_n: start.reference.weight_n(),
            disc: Disc::of(airframe),
        }))
    }
}

impl InFlight for Rotors {
    fn loads(&mut self, now: &Now, change: &mut Change) {
        let thrust_n = (now.thrust_n * change.thrust).max(0.0);
        let speeds = if self.with_flow > 0.0 { self.disc.speeds(now) } else { None };
        let by_flow =
            speeds.map_or(1.0, |(axial, edgewise)| by_flow(self.with_flow, axial, edgewise));
        let factor = self.drag_per_weight * by_flow * (thrust_n * self.weight_n).sqrt();
        change.force_n.x -= factor * now.relative_mps.x;
        change.force_n.y -= factor * now.relative_mps.y;
    }
}

/// Lean in hover in a wind, rad: tan(phi) = lambda v sqrt(cos phi), where v cos(phi) is the flow in
/// the rotor plane.
pub(super) fn lean(drag_per_weight: f64, wind_mps: f64) -> f64 {
    let mut phi: f64 = 0.0;
    for _ in 0..8 {
        phi = (drag_per_weight * wind_mps * phi.cos().sqrt()).atan();
    }
    phi
}
