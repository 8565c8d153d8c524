//! Backward check: an effect that was named must still improve the model with all that came after
//! it.

use super::compare::Comparison;
use super::dependence::depend_on_the_same;
use super::error::GapError;
use super::explain::Found;
use super::gls::{Problem, Split};
use super::refine::{Parameter, doubts, slopes};
use super::refly::mean_drone;
use super::response::shifted;
use crate::vehicle::Vehicle;

/// A vehicle with one effect as it was.
fn taken_back(vehicle: &Vehicle, effect: &str, original: &Vehicle) -> Vehicle {
    let mut vehicle = vehicle.clone();
    match original.effects.get(effect) {
        Some(table) => {
            vehicle.effects.insert(effect.to_owned(), table.clone());
        }
        None => {
            vehicle.effects.remove(effect);
        }
    }
    mean_drone(&vehicle)
}

/// An effect whose trace has a Fisher z below this is removed again. Three standard errors by convention;
/// below the z = 4 of naming (docs/physics.md, 3.3), so that chance does not remove what was just named. Not
/// measured.
const KEPT_Z: f64 = 3.0;
/// Standard errors within which a size is what the model had: half of a 95 % interval.
const SAME_Z: f64 = 1.96;
/// Share of an effect's trace that its form may be off by: other forms of the same physics (a linear inflow, a round
/// body's drag) left a second effect of a few hundredths. Chosen, three times the error of sizes in
/// [`super::refine`].
const WITHIN_FORM: f64 = 0.1;

/// An effect that is no more than what the form of a larger one is not known by: small beside it, and dependent on
/// the same.
fn within_the_form(traces: &[(&'static str, f64)]) -> Option<&'static str> {
    let (largest, most_us) = *traces.iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
    let (small, _) = *traces
        .iter()
        .filter(|(_, us)| *us < WITHIN_FORM * most_us)
        .find(|(effect, _)| depend_on_the_same(effect, largest))?;
    Some(small)
}

impl Found {
    /// The effect whose trace says least, if that is too little. By its trace and not by the error of
    /// its size: an effect may begin with a jump (translational lift saves power at any share).
    pub(super) fn weakest(
        &self,
        comparison: &Comparison,
        original: &Vehicle,
    ) -> Result<Option<&'static str>, GapError> {
        if self.parameters.is_empty() {
            return Ok(None);
        }
        let patterns = comparison.patterns(&self.vehicle, self.gusts_mps)?;
        let split = Split::of(&comparison.residual(&self.vehicle, self.gusts_mps)?);
        let doubts = doubts(comparison, &self.vehicle, &self.parameters)?;
        let mut worst: Option<(&'static str, f64)> = None;
        let mut traces: Vec<(&'static str, f64)> = Vec::new();
        let mut effects: Vec<&'static str> = self.parameters.iter().map(|p| p.effect).collect();
        effects.dedup();
        for effect in effects {
            let others: Vec<Parameter> =
                self.parameters.iter().filter(|p| p.effect != effect).cloned().collect();
            let slopes = slopes(comparison, &self.vehicle, &others)?;
            let problem =
                Problem::new(&patterns, &split).doubting(&doubts).with(&self.extras).with(&slopes);
            let groups = shifted(&patterns, &problem, &problem.at(&self.noise.hyper));
            let solution = problem.among(&groups).at(&self.noise.hyper);
            let without = taken_back(&self.vehicle, effect, original);
            let trace = comparison.change(&without, &self.vehicle)?;
            let z = solution.information(&solution.white(&trace)).sqrt();
            if z < KEPT_Z && worst.is_none_or(|(_, least)| z < least) {
                worst = Some((effect, z));
            }
            traces.push((effect, trace.spread(&comparison.data.counts())));
        }
        Ok(worst.map(|(effect, _)| effect).or_else(|| within_the_form(&traces)))
    }

    /// The effect that was found last, if the model had it already and what was fitted of it is what it had: beside what was found
    /// before, it is another form of what is there, and no other size.
    pub(super) fn same_as_before(&self) -> Option<&'static str> {
        let [_, .., last] = &self.steps[..] else { return None };
        let effect = last.finding.effects().first().copied()?;
        let all = self.parameters.iter().zip(&self.values);
        let of_it: Vec<_> = all.filter(|(one, _)| one.effect == effect).collect();
        let is_same = |(one, (value, se)): &(&Parameter, &(f64, f64))| {
            one.before.is_some_and(|before| (value - before).abs() < SAME_Z * se)
        };
        let (first, _) = of_it.first()?;
        of_it.iter().all(is_same).then_some(first.effect)
    }

    /// Takes an effect back: the model has it as it was.
    pub(super) fn drop_effect(&mut self, effect: &str, original: &Vehicle) {
        self.vehicle = taken_back(&self.vehicle, effect, original);
        self.parameters.retain(|parameter| parameter.effect != effect);
        self.steps.retain(|step| step.finding.effects().first() != Some(&effect));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_later_finding_of_the_size_that_the_model_had_is_none() {
        use super::super::trial::{self, name};
        let data = trial::data(2, |_, _| 0.0);
        let found = |values: &[(f64, f64)], before: Option<f64>, earlier: usize| {
            let mut found = Found::nothing(trial::comparison(&data));
            let unknown = name("battery");
            found.steps.extend((0..earlier).map(|_| trial::step(unknown.clone(), 20.0, &[])));
            found.steps.push(trial::step(name("rotor-inflow"), 14.4, &[]));
            let of = |name: &'static str| Parameter {
                effect: "rotor-inflow",
                name,
                unit: "",
                bounds: (0.0, 1.0),
                before,
            };
            found.parameters = ["inflow_share", "induced"].map(of)[..values.len()].to_vec();
            found.values = values.to_vec();
            found.same_as_before()
        };
        assert_eq!(found(&[(0.397, 0.05)], Some(0.402), 1), Some("rotor-inflow"));
        assert_eq!(found(&[(0.397, 0.05)], Some(0.402), 0), None, "all that was found");
        assert_eq!(found(&[(0.397, 0.002)], Some(0.402), 1), None, "another size");
        assert_eq!(found(&[(0.4, 0.05), (0.9, 0.05)], Some(0.402), 1), None, "one is another");
        assert_eq!(found(&[(0.397, 0.05)], None, 1), None, "new");
        assert_eq!(found(&[], Some(0.402), 1), None);
    }

    #[test]
    fn what_is_within_a_tenth_of_its_like_is_its_form() {
        let beside = |effect, us| within_the_form(&[("rotor-inflow", 30.0), (effect, us)]);
        assert_eq!(beside("thrust-curve", 2.9), Some("thrust-curve"));
        assert_eq!(beside("thrust-curve", 3.1), None);
        assert_eq!(beside("motor-thermal", 2.9), None, "it depends on something else");
        assert_eq!(within_the_form(&[("rotor-inflow", 30.0)]), None);
    }
}
