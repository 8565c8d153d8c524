//! The paper's correction of the pulse for tilt takes too much away.

use super::definition::{Class, Definition, Parameter, Signal, Sought, Values};
use super::{Effect, Reference, Signals};

const SENSITIVITY: usize = 0;

/// Tilt-compensation formula.
#[derive(Debug)]
pub(super) struct TiltFormula;

impl Effect for TiltFormula {
    fn definition(&self) -> &'static Definition {
        &Definition {
            name: "tilt-formula",
            title: "Tilt-compensation formula",
            what: "u cos(phi) subtracts from the whole pulse, not from the part that makes thrust",
            explanation: "Nothing the drone does: an error of the analysis. Thrust along the \
                vertical falls with cos(phi), and the pulse that makes up for it is du/dlnT per \
                relative thrust, about 300 us on a small drone; multiplying the raw pulse takes \
                1546 us times (1 - cos phi) away. The difference looks like an updraft of 0.2 m/s \
                at 5 degrees. Its coefficient is known: correct the formula, do not fit it.",
            formula: "du_phi = -(u - L)(1 - cos phi),  L = du/dlnT",
            source: "linear expansion of the thrust curve",
            class: Class::Horizontal,
            signals: &[Signal::Tilt],
            parameters: &[Parameter {
                name: "sensitivity_us",
                unit: "us",
                what: "change of the pulse per relative change of thrust (L)",
                low: 0.0,
                high: 2000.0,
                default: |vehicle| Reference::of(vehicle).sensitivity_us(),
                role: None,
            }],
            hooks: &[],
            shown: (Signal::Tilt, 0.0, 0.2),
            sought: Sought::No("known: the correction by thrust has no such error"),
        }
    }

    fn pulse_us(&self, at: &Reference, values: &Values, signals: &Signals) -> f64 {
        -(at.hover_us() - values[SENSITIVITY]) * (1.0 - signals.tilt_rad.cos())
    }
}
