//! Prediction of how well a flight will separate explanations, without flying it: Fisher
//! information under the noise that was found.

use nalgebra::{DMatrix, DVector};

use super::known::{Flight, Known};
use super::questions::{Question, Sought};
use super::scenery::Scenery;
use crate::effects;
use crate::gap::GapError;
use crate::gap::candidates::{Updraft, one, set};
use crate::gap::dependence::Dependence;
use crate::gap::generic::{Generic, all};
use crate::gap::gls::{Column, Solution, White};
use crate::gap::refine::{fitted, half_interval, size_of, slopes};
use crate::gap::refly::mean_drone;
use crate::gap::verdict::{Interval, Shape};
use crate::numeric;
use crate::vehicle::Vehicle;

/// Effects with a smaller trace at their usual size do not matter for the pulse, us: 0.1 m/s, as in the
/// search.
const MATTERS_US: f64 = 2.5;
/// Half of a 95 % interval, standard errors.
const NORMAL: f64 = 1.96;
/// A new effect of more times its tried form is another effect, as the search has it.
const MOST_TIMES: f64 = 5.0;

/// Predicted separation of one explanation from another.
#[derive(Clone, Debug, PartialEq)]
pub struct Separation {
    /// Name of the other explanation; empty: no effect at all.
    pub from: String,
    /// Fisher z of the separation.
    pub z: f64,
    /// Size of the other explanation that looks most like the first.
    pub size: Option<f64>,
}

/// Predicted separations of a flight, question by question.
pub type Predicted = Vec<Vec<Separation>>;

/// Smallest Fisher z of a question; 0 if the flight cannot answer it at all.
pub fn least(separations: &[Separation]) -> f64 {
    let least = numeric::least(separations.iter().map(|one| one.z));
    least.filter(|z| z.is_finite()).unwrap_or_default()
}

/// Predicts what a flight will tell.
///
/// # Errors
/// The model cannot fly the plan, or effects are not valid.
pub fn predict(
    known: &Known,
    flight: &Flight,
    (charge, payload): (bool, bool),
    questions: &[Question],
) -> Result<Predicted, GapError> {
    let scenery = Scenery::new(known, flight, charge, payload)?;
    let effects: Vec<&str> =
        questions.iter().filter_map(|question| question.leaves_out()).collect();
    let mut solutions: Vec<(Option<&str>, Solution)> = vec![(None, scenery.solution(None)?)];
    for effect in effects {
        solutions.push((Some(effect), scenery.solution(Some(effect))?));
    }
    questions
        .iter()
        .map(|question| {
            let of = |entry: &&(Option<&str>, Solution)| entry.0 == question.leaves_out();
            let Some((_, solution)) = solutions.iter().find(of) else { return Ok(Vec::new()) };
            match &question.sought {
                Sought::Seen { effect } => scenery.seen(solution, effect),
                Sought::Apart { effects, size } => scenery.apart(solution, effects, size.as_ref()),
                Sought::Shape { depends_on, shape } => {
                    Ok(scenery.shape(solution, *depends_on, shape))
                }
            }
        })
        .collect()
}

/// Fisher z of an effect's present size (or of its usual one where the model lacks it) with everything
/// else free: what its size over its standard error will be.
///
/// # Errors
/// As [`predict`].
pub fn size_z(known: &Known, flight: &Flight, charge: bool, effect: &str) -> Result<f64, GapError> {
    let scenery = Scenery::new(known, flight, charge, false)?;
    let seen = scenery.seen(&scenery.solution(Some(effect))?, effect)?;
    Ok(least(&seen))
}

/// The size of an effect over its standard error as a verdict will state it, if the flight tells it from nothing: by what the
/// pulse changes at this size and not in proportion, with Student's law of the air and with the form that is not known
/// better. `None`: steady flight does not show the effect.
///
/// # Errors
/// As [`predict`].
pub fn stated_z(
    known: &Known,
    flight: &Flight,
    (charge, payload): (bool, bool),
    effect: &str,
    size: f64,
) -> Result<Option<f64>, GapError> {
    let Some(known_effect) = effects::find(effect) else { return Ok(None) };
    let effects::Sought::Shape { size: name, .. } = known_effect.definition().sought else {
        return Ok(None);
    };
    let Some(parameter) = size_of(effect, name) else { return Ok(None) };
    let scenery = Scenery::new(known, flight, charge, payload)?;
    let mut with = scenery.comparison.vehicle.clone();
    set(&mut with, effect, name, size);
    let own = std::slice::from_ref(&parameter);
    let fitted_all = [&known.parameters[..], own].concat();
    let solution = scenery.solution_of(&with, &known.parameters, &fitted_all)?;
    let Some(slope) = scenery.regressors(slopes, &with, own)?.pop() else { return Ok(None) };
    let se = solution.information(&solution.white(&slope)).max(0.0).sqrt().recip();
    let half = half_interval(&scenery.comparison, &known.hyper);
    let stated = fitted(own, &[(size, se)], half);
    let z = stated.first().map(|one| z_of(one.value, 0.0));
    Ok(z.filter(|z| z.is_finite()))
}

/// A value's distance from another in standard errors, by its 95 % interval.
pub fn z_of(value: Interval, from: f64) -> f64 {
    let se = (value.high - value.low) / (2.0 * NORMAL);
    (value.value - from).abs() / se
}

/// Whether an effect of the usual size moves the pulse of this flight by as much as matters.
///
/// # Errors
/// As [`predict`].
pub fn matters(known: &Known, flight: &Flight, effect: &str) -> Result<bool, GapError> {
    let scenery = Scenery::new(known, flight, false, false)?;
    let Some(candidate) = one(&known.model, &scenery.comparison, Updraft::Same, effect)? else {
        return Ok(false);
    };
    let Some(size) = candidate.size else { return Ok(false) };
    Ok(candidate.variants.iter().any(|variant| {
        let times = (size.usual / step(variant.size, size.now)).abs();
        variant.column.range() * times >= MATTERS_US
    }))
}

fn step(size: f64, now: f64) -> f64 {
    (size - now).abs().max(1e-12)
}

impl Question {
    /// The effect of the model that is in question itself, and so not among what is free.
    fn leaves_out(&self) -> Option<&str> {
        match &self.sought {
            Sought::Apart { effects, .. } => effects.first().map(String::as_str),
            Sought::Shape { .. } | Sought::Seen { .. } => None,
        }
    }
}

impl Scenery<'_> {
    fn seen(&self, solution: &Solution, effect: &str) -> Result<Vec<Separation>, GapError> {
        let Some(candidate) = self.candidate(&self.known.model, effect)? else {
            return Ok(Vec::new());
        };
        let Some(size) = candidate.size else { return Ok(Vec::new()) };
        let looked_for = if size.now == 0.0 { size.usual } else { size.now };
        let z = |variant: &crate::gap::candidates::Variant| {
            let information = solution.information(&solution.white(&variant.column)).max(0.0);
            information.sqrt() * (looked_for / step(variant.size, size.now)).abs()
        };
        let z = candidate.variants.iter().map(z).fold(0.0, f64::max);
        Ok(vec![Separation { from: String::new(), z, size: Some(looked_for) }])
    }

    fn apart(
        &self,
        solution: &Solution,
        effects: &[String],
        size: Option<&(String, f64, Option<f64>)>,
    ) -> Result<Vec<Separation>, GapError> {
        let [first, others @ ..] = effects else { return Ok(Vec::new()) };
        let (with, without) = self.with_and_without(first, size);
        let scene = &self.comparison.scene;
        let trace = |with: &Vehicle, without: &Vehicle| -> Result<Column, GapError> {
            Ok(scene.pulses(with)?.less(&scene.pulses(without)?))
        };
        let light = trace(&with, &without)?;
        let loaded = match (self.loaded(&with), self.loaded(&without)) {
            (Some(with), Some(without)) => Some(trace(&with, &without)?),
            _ => None,
        };
        let own = solution.white(&self.merged(light, loaded));
        let strength = solution.information(&own).max(0.0).sqrt();
        let mut separations = Vec::new();
        for other in others {
            let Some(rival) = self.candidate(&without, other)? else {
                // What something unknown would depend on.
                let generics = all(scene, &self.comparison.headings());
                let on = Dependence::of(other);
                separations.extend(on.and_then(|on| from_shape(solution, &own, &generics, on)));
                continue;
            };
            // The form and size of the rival that looks most like it, of those that it can have.
            let nearest = rival
                .variants
                .iter()
                .map(|variant| {
                    let white = solution.white(&variant.column);
                    let alike = solution.likeness(&own, &white).clamp(-1.0, 1.0);
                    let per_time = solution.information(&white).max(0.0).sqrt();
                    let best = alike * strength / per_time.max(1e-12);
                    let is_free = rival.was_there || rival.size.is_none();
                    let times = if is_free { best } else { best.clamp(0.0, MOST_TIMES) };
                    let left = strength * strength - 2.0 * times * alike * strength * per_time
                        + (times * per_time).powi(2);
                    (left.max(0.0).sqrt(), times, variant.size)
                })
                .min_by(|a, b| a.0.total_cmp(&b.0));
            let Some((z, times, tried)) = nearest else { continue };
            let size = rival
                .size
                .filter(|_| times != 0.0)
                .map(|size| (size.now + times * (tried - size.now)).clamp(size.low, size.high));
            separations.push(Separation { from: other.clone(), z, size });
        }
        Ok(separations)
    }

    /// The model with an effect, and as it was before.
    fn with_and_without(
        &self,
        effect: &str,
        size: Option<&(String, f64, Option<f64>)>,
    ) -> (Vehicle, Vehicle) {
        let (mut with, mut without) = (self.comparison.vehicle.clone(), self.known.model.clone());
        match size {
            Some((name, value, before)) => {
                set(&mut with, effect, name, *value);
                match before {
                    Some(before) => set(&mut without, effect, name, *before),
                    None => {
                        without.effects.remove(effect);
                    }
                }
            }
            None => {
                without.effects.remove(effect);
            }
        }
        (with, mean_drone(&without))
    }

    fn shape(&self, solution: &Solution, depends_on: Dependence, shape: &Shape) -> Vec<Separation> {
        let generics = all(&self.comparison.scene, &self.comparison.headings());
        let Some(own) = generics.iter().find(|generic| generic.depends_on == depends_on) else {
            return Vec::new();
        };
        let along = |bins: &Vec<f64>| bins.iter().map(|x| interpolated(shape, *x)).collect();
        let target = solution.white(&Column::Shared(own.along.iter().map(along).collect()));
        let mut others: Vec<Dependence> = Vec::new();
        for rival in generics.iter().map(|generic| generic.depends_on) {
            if rival != depends_on && !others.contains(&rival) {
                others.push(rival);
            }
        }
        let from = |other: Dependence| from_shape(solution, &target, &generics, other);
        others.into_iter().filter_map(from).collect()
    }
}

/// How well something is told from any free shape along a signal.
fn from_shape(
    solution: &Solution,
    target: &White,
    generics: &[Generic],
    depends_on: Dependence,
) -> Option<Separation> {
    let strength = solution.information(target).max(0.0).sqrt();
    let along = generics.iter().filter(|generic| generic.depends_on == depends_on);
    let left = along.map(|generic| (1.0 - explained(solution, target, generic)).max(0.0).sqrt());
    let z = strength * left.reduce(f64::min)?;
    Some(Separation { from: depends_on.to_string(), z, size: None })
}

/// Share of something that a free shape explains.
fn explained(solution: &Solution, target: &White, rival: &Generic) -> f64 {
    let whites: Vec<White> = rival.columns.iter().map(|column| solution.white(column)).collect();
    let whites: Vec<&White> =
        whites.iter().filter(|white| solution.information(white) > 1e-9).collect();
    let count = whites.len();
    let alike = DMatrix::from_fn(count, count, |row, column| {
        if row == column { 1.0 + 1e-9 } else { solution.likeness(whites[row], whites[column]) }
    });
    let with = DVector::from_fn(count, |row, _| solution.likeness(target, whites[row]));
    alike.cholesky().map_or(0.0, |factor| with.dot(&factor.solve(&with))).clamp(0.0, 1.0)
}

/// A shape at a place; beyond its ends the nearest value.
fn interpolated(shape: &Shape, x: f64) -> f64 {
    let mut points: Vec<(f64, f64)> =
        shape.x.iter().copied().zip(shape.us.iter().copied()).collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let above = points.partition_point(|point| point.0 < x);
    let below = above.checked_sub(1).and_then(|place| points.get(place));
    match (below, points.get(above)) {
        (Some((x0, y0)), Some((x1, y1))) if x1 > x0 => y0 + (y1 - y0) * (x - x0) / (x1 - x0),
        (Some((_, y)), _) | (None, Some((_, y))) => *y,
        (None, None) => 0.0,
    }
}
