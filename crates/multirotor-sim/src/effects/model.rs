//! All effects of a vehicle together, in closed form: the pulse that steady flight needs.

use super::definition::{Signal, Values};
use super::select::resolved;
use super::{Effect, EffectError, Reference, Signals};
use crate::vehicle::{Airframe, Vehicle};

/// Half of the step with which sensitivities are taken, m/s.
const STEP_MPS: f64 = 0.05;

/// A vehicle's steady model: the base and the sum of its effects.
pub struct Model {
    /// Vehicle without effects.
    pub reference: Reference,
    base_drag_m2: f64,
    effects: Vec<(&'static dyn Effect, Values)>,
}

impl Model {
    /// Model of a vehicle's file.
    ///
    /// # Errors
    /// An unknown effect or parameter, or a value out of bounds.
    pub fn of(vehicle: &Vehicle) -> Result<Self, EffectError> {
        Ok(Self {
            reference: Reference::of(vehicle),
            base_drag_m2: base_drag_m2(vehicle),
            effects: resolved(vehicle)?,
        })
    }

    /// The pulse that steady flight needs, us.
    pub fn pulse_us(&self, signals: &Signals) -> f64 {
        let hover_us = self.reference.in_air(signals.density_ratio).hover_us();
        let direct_us = self.direct_us(signals);
        let whole = Signals {
            increment_us: direct_us - hover_us,
            sensitivity: self.sensitivity(signals),
            ..*signals
        };
        direct_us + self.sum(&whole, true)
    }

    /// Change of the pulse per vertical air speed, us/(m/s), without effects that depend on it.
    pub fn sensitivity(&self, signals: &Signals) -> f64 {
        let at = |climb_mps| self.direct_us(&Signals { climb_mps, ..*signals });
        (at(signals.climb_mps + STEP_MPS) - at(signals.climb_mps - STEP_MPS)) / (2.0 * STEP_MPS)
    }

    /// The base and all effects that do not depend on the rest of the model.
    fn direct_us(&self, signals: &Signals) -> f64 {
        let at = self.reference.in_air(signals.density_ratio);
        let density = super::reference::DENSITY * signals.density_ratio;
        // The faces of AirSim's box meet the air along the rotor axis: a lean into the wind adds to it.
        let along = signals.axial_mps();
        let drag_n = self.base_drag_m2 * density * along * along.abs();
        at.hover_us() + at.thrust_us(1.0 + drag_n / at.weight_n()) + self.sum(signals, false)
    }

    fn sum(&self, signals: &Signals, on_model: bool) -> f64 {
        let at = self.reference.in_air(signals.density_ratio);
        self.effects
            .iter()
            .filter(|(effect, _)| depends_on_model(*effect) == on_model)
            .map(|(effect, values)| effect.pulse_us(&at, values, signals))
            .sum()
    }
}

/// Whether an effect acts on what the rest of the model says.
pub fn depends_on_model(effect: &dyn Effect) -> bool {
    let signals = effect.definition().signals;
    signals.contains(&Signal::ModelIncrement) || signals.contains(&Signal::Sensitivity)
}

/// Drag factor of AirSim's box along up: force / (density · speed²), m².
pub(super) fn base_drag_m2(vehicle: &Vehicle) -> f64 {
    airframe_drag_m2(&vehicle.airframe)
}

/// As [`base_drag_m2`], of an airframe.
pub(super) fn airframe_drag_m2(frame: &Airframe) -> f64 {
    let [x, y, _] = frame.body_m;
    let rotors_m2 = 4.0 * std::f64::consts::PI * frame.rotor_diameter_m.powi(2);
    frame.drag_coefficient / 2.0 * (x * y + rotors_m2)
}
