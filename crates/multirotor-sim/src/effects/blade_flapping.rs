//! Horizontal drag of the rotors: blade flapping and induced drag.

use super::definition::{Class, Definition, Hook, Parameter, Signal, Sought, Values};
use super::role::Role;
use super::{Change, Effect, InFlight, Now, Reference, Signals, Start};
use crate::vehicle::Airframe;

const DRAG: usize = 0;

/// Blade flapping and rotor drag (H-force).
#[derive(Debug)]
pub(super) struct BladeFlapping;

/// The rotors of one drone.
#[derive(Clone, Debug)]
struct Rotors {
    drag_per_weight: f64,
    weight_n: f64,
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
                plane; what the same blades answer to air along their axis is rotor inflow.",
            formula: "H = 4 k_d w v = lambda sqrt(T m g) v;  in hover tan(phi) = \
                lambda v sqrt(cos phi), T = m g cos(phi)",
            source: "Hoffmann et al. 2007; Mahony, Kumar and Corke 2012; RotorPy k_d",
            class: Class::Horizontal,
            signals: &[Signal::Horizontal],
            parameters: &[Parameter {
                name: "drag_per_weight",
                unit: "s/m",
                what: "force over weight per horizontal air speed in hover (lambda); 0.0175 is 1 \
                    degree of lean per m/s",
                low: 0.0,
                high: 0.1,
                default: |_| 0.021,
                role: Some(Role::RotorDrag),
            }],
            hooks: &[Hook::Loads],
            shown: (Signal::Horizontal, 0.0, 8.0),
            sought: Sought::No(
                "told from the lean at known speeds over ground (horizontal legs), not from the pulse",
            ),
        }
    }

    fn pulse_us(&self, at: &Reference, values: &Values, signals: &Signals) -> f64 {
        at.thrust_us(lean(values[DRAG], signals.horizontal_mps).cos())
    }

    fn start(&self, start: &Start<'_>, _airframe: &mut Airframe) -> Option<Box<dyn InFlight>> {
        let weight_n = start.reference.weight_n();
        Some(Box::new(Rotors { drag_per_weight: start.values[DRAG], weight_n }))
    }
}

impl InFlight for Rotors {
    fn loads(&mut self, now: &Now, change: &mut Change) {
        let thrust_n = (now.thrust_n * change.thrust).max(0.0);
        let factor = self.drag_per_weight * (thrust_n * self.weight_n).sqrt();
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
