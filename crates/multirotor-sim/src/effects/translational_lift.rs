//! Horizontal air speed carries the rotor's own inflow away.

use super::definition::{Class, Definition, Hook, Parameter, Signal, Sought, Values};
use super::disc::{Disc, LEAST_SHARE, MOST_SHARE, flow_us, share_of};
use super::role::Role;
use super::{Change, Effect, InFlight, Now, Reference, Signals, Start, momentum};
use crate::vehicle::Airframe;

const SHARE: usize = 0;
const SQUARE: usize = 1;
/// Thrust that a share of one adds by the square where the edgewise speed is the induced velocity in hover: about
/// what momentum theory adds there.
const SQUARE_GAIN: f64 = 0.25;
/// Thrust over that in still air below which a rotor has no state worth a correction.
const LEAST_THRUST: f64 = 0.05;

/// Translational lift.
#[derive(Debug)]
pub(super) struct TranslationalLift;

/// The rotor of one drone.
#[derive(Clone, Debug)]
struct Rotor {
    disc: Disc,
    share: f64,
    square: f64,
}

/// What the advancing blades make of the thrust at an edgewise speed over the induced velocity in hover: the
/// thrust of a blade goes with 1 + 3/2 of the squared advance ratio (Leishman, ch. 2).
fn advancing(share: f64, square: f64, edgewise: f64) -> f64 {
    1.0 + SQUARE_GAIN * square * share * edgewise * edgewise
}

impl Effect for TranslationalLift {
    fn definition(&self) -> &'static Definition {
        &Definition {
            name: "translational-lift",
            title: "Translational lift",
            what: "in wind the rotors induce less flow and give more thrust at the same speed",
            explanation: "Edgewise flow brings fresh air to the disc, so the same momentum needs \
                less induced velocity (Glauert). The saved inflow is thrust: hovering in wind needs \
                a smaller pulse. In constant wind it hides in u0; a gust of 1 m/s at 5 m/s looks \
                like a sink of almost half as much.",
            formula: "v_i sqrt(v² + (V + v_i)²) = v_h²;  T = k w² - k2 w (V + v_i), of which a part goes with v²",
            source: "Glauert 1926; Leishman, Principles of Helicopter Aerodynamics, ch. 2",
            class: Class::Horizontal,
            signals: &[Signal::Horizontal, Signal::Climb, Signal::Tilt],
            parameters: &[
                Parameter {
                    name: "inflow_share",
                    unit: "",
                    what: "share of the geometric thrust lost to the inflow in hover",
                    low: LEAST_SHARE,
                    high: MOST_SHARE,
                    default: share_of,
                    role: Some(Role::WindLift),
                },
                Parameter {
                    name: "square",
                    unit: "",
                    what: "part of it that goes with the square of the speed, as the thrust of \
                        advancing blades does",
                    low: 0.0,
                    high: 1.0,
                    default: |_| 0.0,
                    role: Some(Role::WindLiftSquare),
                },
            ],
            hooks: &[Hook::Loads],
            shown: (Signal::Horizontal, 0.0, 8.0),
            sought: Sought::Shape {
                size: "inflow_share",
                sizes: |_| &[0.02, 0.5],
                usual: None,
                shape: Some(("square", &[0.0, 1.0])),
            },
        }
    }

    fn pulse_us(&self, at: &Reference, values: &Values, signals: &Signals) -> f64 {
        let induced_mps = at.hover_induced_mps();
        let axial = signals.axial_mps() / induced_mps;
        let edgewise = signals.edgewise_mps() / induced_mps;
        let flow = |edgewise| axial + momentum::induced(axial, edgewise);
        let more = advancing(values[SHARE], values[SQUARE], edgewise);
        let share = values[SHARE] * (1.0 - values[SQUARE]);
        flow_us(at, share, flow(edgewise)) - flow_us(at, share, flow(0.0))
            + at.thrust_us(more.recip())
    }

    fn start(&self, start: &Start<'_>, airframe: &mut Airframe) -> Option<Box<dyn InFlight>> {
        Some(Box::new(Rotor {
            disc: Disc::of(airframe),
            share: start.values[SHARE],
            square: start.values[SQUARE],
        }))
    }
}

impl InFlight for Rotor {
    fn loads(&mut self, now: &Now, change: &mut Change) {
        let Some((axial, edgewise)) = self.disc.speeds(now) else { return };
        let share = self.share * (1.0 - self.square);
        let without = momentum::at_speed(share, axial, 0.0);
        let with = momentum::at_speed(share, axial, edgewise);
        if without.thrust > LEAST_THRUST {
            change.thrust *=
                with.thrust / without.thrust * advancing(self.share, self.square, edgewise);
            change.torque +=
                self.disc.merit * (with.thrust * with.flow - without.thrust * without.flow);
        }
    }
}
