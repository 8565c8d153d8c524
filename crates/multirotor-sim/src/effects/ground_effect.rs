//! Near the ground the rotors' wake cannot leave, and thrust grows.

use super::definition::{Class, Definition, Hook, Parameter, Signal, Sought, Values};
use super::{Change, Effect, InFlight, Now, Reference, Signals, Start};
use crate::vehicle::Airframe;

const RADIUS: usize = 0;
const SPACING: usize = 1;
const DIAGONAL: usize = 2;
const BODY_LIFT: usize = 3;
const ROTOR_HEIGHT: usize = 4;
/// The formula grows without bound at the ground; real rotors do not gain more than this.
const MOST_GAIN: f64 = 1.5;

/// Ground effect.
#[derive(Debug)]
pub(super) struct GroundEffect;

/// Thrust over thrust far from the ground at a height of the drone, m.
fn gain(values: &Values, height_m: f64) -> f64 {
    let h = height_m.max(0.0) + values[ROTOR_HEIGHT];
    let (d, b) = (values[SPACING], values[DIAGONAL]);
    let square = values[RADIUS] * values[RADIUS];
    let h4 = 4.0 * h * h;
    let one = |distance_square: f64| square * h / (distance_square + h4).powf(1.5);
    let lost = square / (16.0 * h * h)
        + one(d * d)
        + one(2.0 * d * d) / 2.0
        + 2.0 * values[BODY_LIFT] * one(b * b);
    if lost < 1.0 - 1.0 / MOST_GAIN { 1.0 / (1.0 - lost) } else { MOST_GAIN }
}

/// The rotors of one drone above the ground: the effect's parameters.
#[derive(Clone, Debug)]
struct Rotors(Values);

impl Effect for GroundEffect {
    fn definition(&self) -> &'static Definition {
        &Definition {
            name: "ground-effect",
            title: "Ground effect",
            what: "below about a metre the ground holds the wake up and the pulse falls",
            explanation: "The images of the rotors below the ground reduce the inflow; between the \
                rotors the reflected wake lifts the body. It is gone two rotor spacings up: only \
                take-off, landing and hovering below a metre see it.",
            formula: "T/T_inf = 1/(1 - (R/4h)² - R² h/(d²+4h²)^1.5 - (R²/2) h/(2d²+4h²)^1.5 - \
                2 K_b R² h/(b²+4h²)^1.5);  du = -L ln(T/T_inf)",
            source: "Cheeseman and Bennett 1955; Sanchez-Cuevas et al. 2017 (multirotors)",
            class: Class::NearGround,
            signals: &[Signal::Height],
            parameters: &[
                Parameter {
                    name: "radius_m",
                    unit: "m",
                    what: "rotor radius (R)",
                    low: 0.01,
                    high: 2.0,
                    default: |vehicle| vehicle.airframe.rotor_diameter_m / 2.0,
                    role: None,
                },
                Parameter {
                    name: "spacing_m",
                    unit: "m",
                    what: "distance of neighbouring rotors (d)",
                    low: 0.02,
                    high: 5.0,
                    default: |vehicle| vehicle.airframe.arm_m * std::f64::consts::SQRT_2,
                    role: None,
                },
                Parameter {
                    name: "diagonal_m",
                    unit: "m",
                    what: "distance of opposite rotors (b)",
                    low: 0.02,
                    high: 5.0,
                    default: |vehicle| vehicle.airframe.arm_m * 2.0,
                    role: None,
                },
                Parameter {
                    name: "body_lift",
                    unit: "",
                    what: "strength of the fountain between the rotors (K_b)",
                    low: 0.0,
                    high: 5.0,
                    default: |_| 2.0,
                    role: None,
                },
                Parameter {
                    name: "rotor_height_m",
                    unit: "m",
                    what: "height of the rotors above the drone's own reference point",
                    low: 0.01,
                    high: 2.0,
                    default: |_| 0.06,
                    role: None,
                },
            ],
            hooks: &[Hook::Loads],
            shown: (Signal::Height, 0.1, 3.0),
            sought: Sought::Shape {
                size: "radius_m",
                sizes: |_| &[0.08, 0.2],
                usual: None,
                shape: None,
            },
        }
    }

    fn pulse_us(&self, at: &Reference, values: &Values, signals: &Signals) -> f64 {
        at.thrust_us(1.0 / gain(values, signals.height_m))
    }

    fn start(&self, start: &Start<'_>, _airframe: &mut Airframe) -> Option<Box<dyn InFlight>> {
        Some(Box::new(Rotors(*start.values)))
    }
}

impl InFlight for Rotors {
    fn loads(&mut self, now: &Now, change: &mut Change) {
        change.thrust *= gain(&self.0, now.height_m);
    }
}
