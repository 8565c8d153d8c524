//! The worked example of CONTRIBUTING compiles and does what it says there.

// example
use updraft::effects::definition::{Class, Definition, Hook, Parameter, Signal, Values};
use updraft::effects::{Effect, InFlight, Reference, Signals, Sought, Start};
use updraft::vehicle::Airframe;

const MASS: usize = 0;

/// A payload below the drone.
pub(crate) struct Payload;

impl Effect for Payload {
    fn definition(&self) -> &'static Definition {
        &Definition {
            name: "payload",
            title: "Payload",
            what: "a weight hangs below the drone",
            explanation: "It raises the pulse of hover like any mass, by a known amount: flights \
                with and without it tell mass from a steady updraft.",
            formula: "T = (m + m_p) g;  du = L ln(1 + m_p/m)",
            source: "Newton",
            class: Class::DroneOffset,
            signals: &[Signal::Drone],
            parameters: &[Parameter {
                name: "mass_kg",
                unit: "kg",
                what: "mass of the payload",
                low: 0.0,
                high: 10.0,
                default: |vehicle| 0.05 * vehicle.airframe.mass_kg,
                role: None,
            }],
            hooks: &[Hook::Drone],
            shown: (Signal::Drone, -2.0, 2.0),
            sought: Sought::No("an example"),
        }
    }

    fn pulse_us(&self, at: &Reference, values: &Values, _signals: &Signals) -> f64 {
        at.thrust_us(1.0 + values[MASS] / at.airframe.mass_kg)
    }

    fn start(&self, start: &Start<'_>, airframe: &mut Airframe) -> Option<Box<dyn InFlight>> {
        airframe.mass_kg += start.values[MASS];
        None
    }
}
// end

#[test]
fn contributing_shows_this_very_example() {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(root.join("CONTRIBUTING.md")).unwrap();
    let own = include_str!("example.rs");
    let (_, rest) = own.split_once("// example\n").unwrap();
    let (code, _) = rest.split_once("// end\n").unwrap();
    assert!(text.contains(&code.replace("updraft::", "crate::")), "CONTRIBUTING.md differs");
}

#[test]
fn five_percent_of_payload_is_fifteen_us_on_the_pixel() {
    let pixel = updraft::vehicle::library::builtin("pixel").unwrap();
    let mut values = [0.0; 8];
    values[MASS] = (Payload.definition().parameters[MASS].default)(&pixel);
    let us = Payload.pulse_us(&Reference::of(&pixel), &values, &Signals::default());
    assert!((us - 14.4).abs() < 0.3, "{us}");
}
