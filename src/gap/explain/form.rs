//! Which of its forms an effect has that was found.

use super::super::candidates::{form_price_nats, set};
use super::super::error::GapError;
use super::super::verdict::{Form, Step};
use super::Search;
use crate::effects::select::value_of;
use crate::effects::{Definition, Parameter, Role, Sought, find};
use crate::vehicle::Vehicle;

impl Search<'_> {
    /// Gives the effect that was found last its other forms, and keeps that with which the model, flown and fitted,
    /// explains most. By steady states alone one can be as good as another with which no drone flies like this.
    pub(super) fn chooses_form(&mut self) -> Result<(), GapError> {
        let Some(step) = self.found.steps.last() else { return Ok(()) };
        let Some(effect) = step.finding.effects().first().and_then(|name| find(name)) else {
            return Ok(());
        };
        let definition = effect.definition();
        if !self.found.parameters.iter().any(|one| one.effect == definition.name) {
            return Ok(());
        }
        for (form, value) in others(definition, &self.found.vehicle) {
            let price_nats =
                |value: f64| form_price_nats(definition, self.vehicle, form.name, value);
            let now = value_of(&self.found.vehicle, definition.name, form.name);
            let needed_nats = price_nats(value) - now.map_or(0.0, price_nats);
            let before = (self.comparison.clone(), self.found.clone());
            set(&mut self.found.vehicle, definition.name, form.name, value);
            let is_better = match self.is_fitted_here() {
                Err(error) if error.is_not_flown() => false,
                fitted => fitted? && self.found.explains()? > before.1.explains()? + needed_nats,
            };
            if !is_better {
                (self.comparison, self.found) = before;
            }
        }
        Ok(())
    }
}

/// Writes into each step which of two forms its effect has in the model.
pub(in super::super) fn tell(steps: &mut [Step], model: &Vehicle) {
    for step in steps {
        let effect = step.finding.effects().first().and_then(|name| find(name));
        step.form = effect.and_then(|effect| {
            let definition = effect.definition();
            let (form, _) = forms(definition)?;
            let value = value_of(model, definition.name, form.name)?;
            let is_usual = value == (form.default)(model);
            Some(Form { name: form.name.to_owned(), value, is_usual })
        });
    }
}

/// The parameter by which the search chooses between forms of an effect, and its values.
fn forms(definition: &Definition) -> Option<(&Parameter, &[f64])> {
    let Sought::Shape { shape: Some((name, values)), .. } = &definition.sought else { return None };
    let form = definition.parameter(name)?;
    form.role.is_some_and(Role::is_choice).then_some((form, *values))
}

/// The forms of an effect that a vehicle's has not, where they are a choice.
fn others<'a>(definition: &'a Definition, vehicle: &Vehicle) -> Vec<(&'a Parameter, f64)> {
    let Some((form, values)) = forms(definition) else { return Vec::new() };
    let now = value_of(vehicle, definition.name, form.name);
    values.iter().filter(|value| now != Some(**value)).map(|value| (form, *value)).collect()
}

#[cfg(test)]
mod tests {
    use super::super::super::compare::{Comparison, Simulated};
    use super::super::super::model_flights::ModelFlights;
    use super::super::super::{refine, trial};
    use super::super::Options;
    use super::super::tests::begun;
    use super::*;
    use crate::effects::{Model, Signals};

    /// A drone whose rotors lose thrust to the climb, with momentum theory's change of the induced velocity or without.
    fn with(induced: f64) -> Vehicle {
        let mut vehicle = trial::vehicle();
        set(&mut vehicle, "rotor-inflow", "inflow_share", 0.4);
        set(&mut vehicle, "rotor-inflow", "induced", induced);
        vehicle
    }

    #[test]
    fn the_form_that_explains_more_when_it_is_flown_is_kept() {
        let chosen = |flew: f64, found: f64| {
            let (vehicle, simulated) = (trial::vehicle(), Simulated::Closed);
            let [flown, known] = [&with(flew), &vehicle].map(|one| Model::of(one).unwrap());
            let data = trial::data(4, |drone, bin| {
                let height = Signals { height_m: 30.0, density_ratio: 1.0, ..Signals::default() };
                let signals = Signals { climb_mps: bin.climb_mps(), ..height };
                let ripple_us =
                    0.1 * f64::from((7 * bin.segment as i32 + 3 * drone as i32) % 5 - 2);
                flown.pulse_us(&signals) - known.pulse_us(&signals) + ripple_us
            });
            let comparison = Comparison::new(&data, &vehicle, &simulated, None).unwrap();
            let (options, flights) = (Options::default(), ModelFlights::default());
            let mut search = begun(&data, &vehicle, (&simulated, &options, &flights), comparison);
            search.found.vehicle = with(found);
            search.found.parameters.extend(refine::size_of("rotor-inflow", "inflow_share"));
            search.found.steps.push(trial::step(trial::name("rotor-inflow"), 20.0, &[]));
            assert!(search.is_fitted_here().unwrap());
            search.chooses_form().unwrap();
            value_of(&search.found.vehicle, "rotor-inflow", "induced")
        };
        assert_eq!([chosen(1.0, 0.0), chosen(1.0, 1.0)], [Some(1.0); 2]);
        assert_eq!([chosen(0.0, 0.0), chosen(0.0, 1.0)], [Some(0.0); 2]);
    }
}
