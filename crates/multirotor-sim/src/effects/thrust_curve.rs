//! The motor controller's curve from command to thrust is not the model's.

use super::definition::{Class, Definition, Hook, Parameter, Signal, Sought, Values};
use super::{Effect, InFlight, Reference, Role, Signals, Start};
use crate::vehicle::{Airframe, RotorLaw, Vehicle};

const EXPO: usize = 0;

/// Thrust curve.
#[derive(Debug)]
pub(super) struct ThrustCurve;

fn curve(expo: f64, command: f64) -> f64 {
    (1.0 - expo) * command + expo * command * command
}

/// The command at which the curve has a value.
fn inverse(expo: f64, value: f64) -> f64 {
    let linear = 1.0 - expo;
    if expo.abs() < 1e-9 {
        return value;
    }
    ((linear * linear + 4.0 * expo * value).max(0.0).sqrt() - linear) / (2.0 * expo)
}

/// Sizes to try. Thrust that grows slower than the pulse is no curve that a rotor has: only a model
/// that is curved itself can be curved too much.
fn sizes(vehicle: &Vehicle) -> &'static [f64] {
    match vehicle.airframe.rotor {
        RotorLaw::Linear => &[0.3, 0.6],
        RotorLaw::Motor(_) => &[-0.3, 0.3, 0.6],
    }
}

/// The controller of one drone.
#[derive(Clone, Debug)]
struct Controller {
    expo: f64,
    /// Command in hover, 0..1.
    hover: f64,
    /// The curve there.
    at_hover: f64,
}

impl Effect for ThrustCurve {
    fn definition(&self) -> &'static Definition {
        &Definition {
            name: "thrust-curve",
            title: "Thrust curve of motor and controller",
            what: "the command acts through a curve: every response is scaled by one factor",
            explanation: "If thrust grows faster with the pulse than the model says, every \
                increment that the model predicts comes out smaller by the same factor; hover \
                itself is where it was. In steady windows it cannot be told from a wrong drag \
                factor; accelerations or a payload would tell.",
            formula: "c' = c_h g(c)/g(c_h),  g(c) = (1 - expo) c + expo c²;  near hover \
                du = (kappa - 1) du_model,  1/kappa = c_h g'(c_h)/g(c_h)",
            source: "ArduPilot MOT_THST_EXPO",
            class: Class::AxialShape,
            signals: &[Signal::ModelIncrement],
            parameters: &[Parameter {
                name: "expo",
                unit: "",
                what: "curvature: 0 is the model's own response, 1 is quadratic",
                low: -0.5,
                high: 1.0,
                default: |vehicle| vehicle.autopilot.mot_thst_expo.clamp(0.0, 1.0),
                role: Some(Role::ThrustExpo),
            }],
            hooks: &[Hook::Command],
            shown: (Signal::ModelIncrement, -100.0, 100.0),
            // An expo of 0 is no effect: the thrust curve of small motors.
            sought: Sought::Shape { size: "expo", sizes, usual: Some(0.5), shape: None },
        }
    }

    fn pulse_us(&self, at: &Reference, values: &Values, signals: &Signals) -> f64 {
        let expo = values[EXPO];
        let hover = (at.in_air(1.0).hover_us() - 1000.0) / 1000.0;
        let wanted = (at.hover_us() - 1000.0 + signals.increment_us) / 1000.0;
        1000.0 * (inverse(expo, curve(expo, hover) * wanted / hover) - wanted)
    }

    fn start(&self, start: &Start<'_>, _airframe: &mut Airframe) -> Option<Box<dyn InFlight>> {
        let expo = start.values[EXPO];
        let hover = (start.reference.hover_us() - 1000.0) / 1000.0;
        Some(Box::new(Controller { expo, hover, at_hover: curve(expo, hover) }))
    }
}

impl InFlight for Controller {
    fn command(&self, command: f64) -> f64 {
        self.hover * curve(self.expo, command) / self.at_hover
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curve_inverts() {
        for expo in [-0.4, 0.0, 0.52, 1.0] {
            for command in [0.1, 0.5, 0.9] {
                assert!((inverse(expo, curve(expo, command)) - command).abs() < 1e-12);
            }
        }
    }
}
