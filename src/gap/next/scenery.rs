//! A flight that is yet to be flown, with its noise, ready to be asked.

use super::elements::{PAYLOAD_EVERY, PAYLOAD_KG, lowest_charge};
use super::known::{Flight, Known, cells, charge_of};
use crate::effects::cell::cell_v;
use crate::gap::GapError;
use crate::gap::bins::{Bin, BinValues};
use crate::gap::candidates::{Candidate, Updraft, of_the_air, one};
use crate::gap::compare::{Comparison, Simulated};
use crate::gap::data::{Data, PlannedPart};
use crate::gap::explain::MOST_GUSTS_MPS;
use crate::gap::gls::{Column, Problem, Solution, Split};
use crate::gap::lean::{Wind, told_within_mps};
use crate::gap::refine::{Parameter, doubts, slopes};
use crate::gap::response::gusts_mps;
use crate::gap::scene::Scene;
use crate::mission::plan::Slot;
use crate::vehicle::Vehicle;

/// Regressors of a vehicle and its fitted sizes.
pub(super) type Regressors =
    fn(&Comparison, &Vehicle, &[Parameter]) -> Result<Vec<Column>, GapError>;

/// A flight with its noise, ready to be asked.
pub(super) struct Scenery<'a> {
    pub(super) known: &'a Known,
    pub(super) comparison: Comparison,
    /// Groups that carry the payload.
    heavy: Vec<bool>,
}

impl<'a> Scenery<'a> {
    pub(super) fn new(
        known: &'a Known,
        flight: &Flight,
        charge: bool,
        payload: bool,
    ) -> Result<Self, GapError> {
        let plan = &flight.plan;
        let place = |slot: &Slot| plan.slots.iter().position(|one| one.slot == slot.slot);
        let carries = |slot: &Slot| {
            payload && place(slot).is_some_and(|place| place.is_multiple_of(PAYLOAD_EVERY))
        };
        let (mut parts, mut heavy) = (Vec::new(), Vec::new());
        for (index, (bins, values)) in flight.groups.iter().enumerate() {
            for loaded in [false, true] {
                let slots: Vec<&Slot> = plan
                    .slots
                    .iter()
                    .filter(|slot| usize::from(slot.group) == index && carries(slot) == loaded)
                    .collect();
                if !slots.is_empty() && values.iter().any(Option::is_some) {
                    let name = plan.groups[index].name.clone();
                    parts.push(PlannedPart { name, slots, bins, values });
                    heavy.push(loaded);
                }
            }
        }
        let (count, lowest) = (plan.slots.len(), lowest_charge(plan));
        let cells = cells(&known.model);
        let endurance_s = known.model.limits.endurance_s.max(1.0);
        let resting_v = |slot: &Slot, bin: &Bin| {
            if !known.has_voltage {
                return f64::NAN;
            }
            let full =
                if charge { charge_of(place(slot).unwrap_or(0), count, lowest) } else { 1.0 };
            cells * cell_v(full - bin.middle_s().max(0.0) / endurance_s)
        };
        // Drones that the search will hold out tell it nothing.
        let (data, _) = Data::planned(plan, &parts, resting_v).split();
        // The simulated side is what all drones read.
        let side: Vec<Vec<Option<BinValues>>> = data
            .groups
            .iter()
            .map(|group| {
                let first = group.measured.first();
                first.map_or_else(Vec::new, |values| values.iter().copied().map(Some).collect())
            })
            .collect();
        let simulated = Simulated::Given { values: side, flew: &known.model, is_foreign: false };
        let mut comparison = Comparison::new(&data, &known.model, &simulated, Some(plan))?;
        // The wind is known here, and as well as the leans will tell it.
        let air =
            |bin: &Bin| [0, 1].map(|axis: usize| bin.velocity_mps[axis] - known.wind_mps[axis]);
        let groups = &comparison.data.groups;
        let wind = Wind {
            mean_mps: known.wind_mps,
            of_groups_mps: Vec::new(),
            of_groups_se_mps: Vec::new(),
            mean_se_mps: told_within_mps(&comparison.data, known.wind_mps),
            air_mps: groups.iter().map(|group| group.bins.iter().map(air).collect()).collect(),
            // With legs no candidate has to tell how the vehicle leans: neither here nor when it is flown.
            measured: comparison.wind.measured,
        };
        let amsl_m = plan.site.ground_amsl_m;
        comparison.scene = Scene::measured(&comparison.data, &comparison.side, &wind, amsl_m);
        comparison.wind = wind;
        Ok(Self { known, comparison, heavy })
    }

    /// The vehicle with the payload.
    pub(super) fn loaded(&self, vehicle: &Vehicle) -> Option<Vehicle> {
        self.heavy.contains(&true).then(|| {
            let mut loaded = vehicle.clone();
            loaded.airframe.mass_kg += PAYLOAD_KG;
            loaded
        })
    }

    /// Regressors of each group's own weight.
    pub(super) fn merged(&self, light: Column, loaded: Option<Column>) -> Column {
        fn pick<T: Clone>(light: Vec<T>, loaded: &[T], heavy: &[bool]) -> Vec<T> {
            let both = light.into_iter().zip(loaded).zip(heavy);
            both.map(|((light, loaded), heavy)| if *heavy { loaded.clone() } else { light })
                .collect()
        }
        let Some(loaded) = loaded else { return light };
        match (light, loaded) {
            (Column::Shared(light), Column::Shared(loaded)) => {
                Column::Shared(pick(light, &loaded, &self.heavy))
            }
            (Column::Own(light), Column::Own(loaded)) => {
                Column::Own(pick(light, &loaded, &self.heavy))
            }
            (light, _) => light,
        }
    }

    /// The noise, with all fitted sizes free but those of one effect, and with what the search will not know exactly.
    pub(super) fn solution(&self, but: Option<&str>) -> Result<Solution, GapError> {
        let is_free = |parameter: &&Parameter| Some(parameter.effect) != but;
        let free: Vec<Parameter> = self.known.parameters.iter().filter(is_free).cloned().collect();
        self.solution_of(&self.known.model, &free, &free)
    }

    /// The noise around a model, with what the search will not know exactly: sizes that are `free`, and the forms of all that
    /// it fits.
    pub(super) fn solution_of(
        &self,
        model: &Vehicle,
        free: &[Parameter],
        fitted: &[Parameter],
    ) -> Result<Solution, GapError> {
        let gusts = gusts_mps(&self.known.hyper).min(MOST_GUSTS_MPS);
        let patterns = self.comparison.patterns(model, gusts)?;
        let split = Split::of(&self.comparison.residual(model, gusts)?);
        let columns = self.regressors(slopes, model, free)?;
        let doubts = self.regressors(doubts, model, fitted)?;
        let problem = Problem::new(&patterns, &split).doubting(&doubts);
        Ok(problem.with(&columns).at(&self.known.hyper))
    }

    /// Regressors of a model, each group's with its own weight.
    pub(super) fn regressors(
        &self,
        of: Regressors,
        model: &Vehicle,
        parameters: &[Parameter],
    ) -> Result<Vec<Column>, GapError> {
        let light = of(&self.comparison, model, parameters)?;
        let loaded = match self.loaded(model) {
            Some(loaded) => of(&self.comparison, &loaded, parameters)?,
            None => Vec::new(),
        };
        // Who feels nothing has nothing to doubt, with a payload or without.
        let both = loaded.len() == light.len();
        let loaded = loaded.into_iter().map(Some).filter(|_| both).chain(std::iter::repeat(None));
        Ok(light.into_iter().zip(loaded).map(|(l, loaded)| self.merged(l, loaded)).collect())
    }

    /// An effect's forms, or a motion of the air, held against a vehicle.
    pub(super) fn candidate(
        &self,
        vehicle: &Vehicle,
        effect: &str,
    ) -> Result<Option<Candidate>, GapError> {
        let find = |vehicle: &Vehicle| -> Result<Option<Candidate>, GapError> {
            let scene = &self.comparison.scene;
            let is_it = |candidate: &Candidate| candidate.name == effect;
            let found = one(vehicle, &self.comparison, Updraft::Same, effect)?;
            if found.is_some() {
                return Ok(found);
            }
            let patterns = self.comparison.patterns(vehicle, 0.0)?;
            Ok(of_the_air(scene, &patterns, &self.known.hyper).into_iter().find(is_it))
        };
        let Some(mut light) = find(vehicle)? else { return Ok(None) };
        if let Some(loaded) = self.loaded(vehicle)
            && let Some(loaded) = find(&loaded)?
            && loaded.variants.len() == light.variants.len()
        {
            for (light, loaded) in light.variants.iter_mut().zip(loaded.variants) {
                light.column = self.merged(light.column.clone(), Some(loaded.column));
            }
        }
        Ok(Some(light))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::Role;
    use crate::gap::verdict::Verdict;
    use crate::mission::resolve::resolve;
    use crate::vehicle::library::builtin;

    #[test]
    fn who_leans_otherwise_reads_another_wind_only_where_no_leg_tells_it() {
        let model = builtin("airsim-generic-quad").unwrap();
        let known = Known::new(&Verdict::default(), model.clone(), [3.0, 0.0]);
        let mut drags = model;
        Role::BodyDragSide.set(&mut drags, 0.2);
        for (template, reads_another) in
            [("calibration", true), ("calibration-counterphase", false)]
        {
            let plan = resolve(template, &[]).unwrap().flights.remove(0).plan;
            let flight = Flight::new(&known, plan).unwrap();
            let scenery = Scenery::new(&known, &flight, false, false).unwrap();
            assert_eq!(scenery.comparison.leans_otherwise(&drags), reads_another, "{template}");
        }
    }
}
