//! Drag of the air that rotors take with them.

use super::definition::{Class, Definition, Hook, Parameter, Signal, Sought, Values};
use super::reference::{DENSITY, GRAVITY};
use super::role::Role;
use super::{Change, Effect, InFlight, Now, Reference, Signals, Start};
use crate::vehicle::{Airframe, Vehicle};

const PER_S: usize = 0;
const AXIAL: usize = 1;
/// Momentum drag coefficient of ArduPilot's default frame (SIM_Frame.h).
const COEFFICIENT: f64 = 0.2;

/// Lean and thrust find each other in a few steps: a change of one is some percent of it in the other.
const STEPS: usize = 12;

/// Momentum drag of the rotors.
#[derive(Debug)]
pub(super) struct MomentumDrag;

/// The rotors of one drone.
#[derive(Clone, Debug)]
struct Rotors {
    /// Force over speed in hover at sea level, N/(m/s).
    per_speed: f64,
    weight_n: f64,
    axial: f64,
}

/// What ArduPilot's default frame would have with these rotors, 1/s.
fn usual_per_s(vehicle: &Vehicle) -> f64 {
    let frame = &vehicle.airframe;
    let weight_n = frame.mass_kg * GRAVITY;
    let force = COEFFICIENT * (DENSITY * frame.disc_area_m2() * weight_n).sqrt();
    (force / frame.mass_kg).clamp(0.0, MOST_PER_S)
}

/// Beyond this a drone leans by more than 10 degrees in 1 m/s of wind.
const MOST_PER_S: f64 = 2.0;

impl Effect for MomentumDrag {
    fn definition(&self) -> &'static Definition {
        &Definition {
            name: "momentum-drag",
            title: "Momentum drag of the rotors",
            what: "the air that goes through the rotors takes up the drone's horizontal speed",
            explanation: "A rotor turns the air that it takes in into its own direction, and loses that \
                air's speed across it: a force against the air, linear in the speed, that grows \
                with the flow, so with the root of thrust and density. ArduPilot's simulator has \
                it on all three axes (axial = 1); along the axis it is no momentum but a stand-in \
                for inflow, and cannot be told from it. In the rotor plane it differs \
                from blade flapping by the air's density alone.",
            formula: "F = -m k sqrt(T rho/(m g rho_0)) v;  in hover tan(phi) = k v/g sqrt(cos phi);  \
                with axial = 1, sqrt(T/(m g)) = c + sqrt(c² + cos phi), c = k V/(2 g)",
            source: "ArduPilot SIM_Motor.cpp (momentum_drag_coefficient), where k = \
                C sqrt(rho A m g)/m with C = 0.2",
            class: Class::Horizontal,
            signals: &[Signal::Horizontal, Signal::Climb],
            parameters: &[
                Parameter {
                    name: "per_s",
                    unit: "1/s",
                    what: "force over mass and air speed in hover at sea level (k); 0.17 is 1 degree \
                        of lean per m/s",
                    low: 0.0,
                    high: MOST_PER_S,
                    default: usual_per_s,
                    role: Some(Role::MomentumDrag),
                },
                Parameter {
                    name: "axial",
                    unit: "",
                    what: "share of it that acts along the rotor axis: 1 as in ArduPilot's simulator",
                    low: 0.0,
                    high: 1.0,
                    default: |_| 0.0,
                    role: None,
                },
            ],
            hooks: &[Hook::Loads],
            shown: (Signal::Horizontal, 0.0, 8.0),
            sought: Sought::No(
                "told from the lean at known speeds over ground, where it is that of blade flapping",
            ),
        }
    }

    fn pulse_us(&self, at: &Reference, values: &Values, signals: &Signals) -> f64 {
        let per_speed = values[PER_S] / GRAVITY * at.density_ratio.sqrt();
        let (up, across) = (signals.climb_mps, signals.horizontal_mps);
        // Lean and the root of thrust over weight, in turn.
        let mut root = 1.0;
        for _ in 0..STEPS {
            let drag = per_speed * root;
            let phi = (drag * across / (1.0 + drag * up)).atan();
            let along = values[AXIAL] * per_speed * (up * phi.cos() + across * phi.sin());
            root = f64::midpoint(along, (along * along + 4.0 * phi.cos()).sqrt());
        }
        at.thrust_us(root * root)
    }

    fn start(&self, start: &Start<'_>, _airframe: &mut Airframe) -> Option<Box<dyn InFlight>> {
        let weight_n = start.reference.weight_n();
        Some(Box::new(Rotors {
            per_speed: start.values[PER_S] * weight_n / GRAVITY,
            weight_n,
            axial: start.values[AXIAL],
        }))
    }
}

impl InFlight for Rotors {
    fn loads(&mut self, now: &Now, change: &mut Change) {
        let thrust_n = (now.thrust_n * change.thrust).max(0.0);
        let flow = (thrust_n / self.weight_n * now.density_ratio).sqrt();
        let factor = self.per_speed * flow;
        change.force_n.x -= factor * now.relative_mps.x;
        change.force_n.y -= factor * now.relative_mps.y;
        change.force_n.z -= factor * self.axial * now.relative_mps.z;
    }
}
