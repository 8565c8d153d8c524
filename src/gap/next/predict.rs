//! How well a flight will separate, without flying it: Fisher information under the noise that was found.

use nalgebra::{DMatrix, DVector};

use super::questions::{Question, Sought};
use crate::effects::battery::cell_v;
use crate::effects::find;
use crate::gap::GapError;
use crate::gap::bins::{Bin, BinValues, of_segments};
use crate::gap::candidates::{Candidate, difference, library, set};
use crate::gap::compare::{Comparison, Simulated, thrust_exponent};
use crate::gap::data::{Data, PlannedPart};
use crate::gap::generic::{Generic, all};
use crate::gap::gls::{Column, Problem, Solution, Split, White};
use crate::gap::noise::{
    GUST_TIME, GUSTS, Hyper, LEAST, OFFSETS, OWN, SHARED, SHARED_TIME, SLOPES, WHITE,
};
use crate::gap::refine::{Parameter, size_of, slopes};
use crate::gap::refly::{mean_drone, refly};
use crate::gap::verdict::{Finding, Noise, Shape, Verdict};
use crate::mission::plan::{Plan, Slot};
use crate::vehicle::Vehicle;

use super::elements::{PAYLOAD_EVERY, PAYLOAD_KG, lowest_charge};

/// Effects with a smaller trace at their usual size do not matter for the pulse, us: 0.1 m/s.
const MATTERS_US: f64 = 2.5;
/// Least noise of any kind, in its own unit.
const LEAST_NOISE: f64 = 1e-3;

/// What is known from the flight before.
#[derive(Clone, Debug)]
pub struct Known {
    /// The vehicle that was held against the logs.
    pub base: Vehicle,
    /// The vehicle with what was found.
    pub model: Vehicle,
    /// Sizes that were fitted; they stay free.
    parameters: Vec<Parameter>,
    /// Noise and air.
    hyper: Hyper,
    /// Mean horizontal wind, show frame, m/s.
    pub wind_mps: [f64; 2],
    /// Whether the logs have the voltage at rest.
    pub has_voltage: bool,
}

/// How well one thing is told from another.
#[derive(Clone, Debug, PartialEq)]
pub struct Separation {
    /// From what; empty: from nothing.
    pub from: String,
    /// Fisher z.
    pub z: f64,
    /// Size of that other thing that looks most like it.
    pub size: Option<f64>,
}

/// What a flight will tell, question by question.
pub type Predicted = Vec<Vec<Separation>>;

/// The least z of a question; 0: the flight does not tell at all.
pub fn least(separations: &[Separation]) -> f64 {
    let least = separations.iter().map(|one| one.z).fold(f64::INFINITY, f64::min);
    if least.is_finite() { least } else { 0.0 }
}

/// The noise of a verdict.
pub fn hyper_of(noise: &Noise) -> Hyper {
    let mut hyper = Hyper::default();
    let found = [
        (SHARED, noise.shared_air_mps),
        (SHARED_TIME, noise.shared_air_s),
        (OWN, noise.own_air_mps),
        (GUSTS, noise.gusts_mps),
        (GUST_TIME, noise.gusts_s),
        (WHITE, noise.white_us),
        (OFFSETS, noise.drones_us),
        (SLOPES, noise.slopes),
        (LEAST, noise.least_response),
    ];
    for (place, value) in found {
        hyper.0[place] = value.max(LEAST_NOISE).ln();
    }
    hyper
}

impl Known {
    /// From a verdict with its two vehicles.
    pub fn new(verdict: &Verdict, base: Vehicle, model: Vehicle, wind_mps: [f64; 2]) -> Self {
        let mut parameters = Vec::new();
        for step in &verdict.steps {
            let (effect, fitted) = match &step.finding {
                Finding::Name { effect, parameters, .. } => (Some(effect), parameters),
                Finding::Class { effects, parameters } => (effects.first(), parameters),
                Finding::Unknown { .. } => continue,
            };
            let Some(effect) = effect else { continue };
            parameters.extend(fitted.iter().filter_map(|fitted| size_of(effect, &fitted.name)));
        }
        // The search says so where it is so.
        let has_voltage = !verdict.cautions.iter().any(|text| text.contains("BAT.VoltR"));
        let hyper = hyper_of(&verdict.noise);
        Self { base, model, parameters, hyper, wind_mps, has_voltage }
    }
}

/// A plan flown by the simulator's mean drone: bins and values of each group.
#[derive(Clone, Debug)]
pub struct Flight {
    plan: Plan,
    groups: Vec<(Vec<Bin>, Vec<Option<BinValues>>)>,
}

impl Flight {
    /// Flies a plan.
    ///
    /// # Errors
    /// The model cannot fly it.
    pub fn new(known: &Known, plan: Plan) -> Result<Self, GapError> {
        let vehicle = mean_drone(&known.model);
        let exponent = thrust_exponent(&vehicle);
        let mut groups = Vec::new();
        for (index, group) in plan.groups.iter().enumerate() {
            let bins = of_segments(&group.segments);
            let mut slots = plan.slots.iter().filter(|slot| usize::from(slot.group) == index);
            let values = match slots.next() {
                Some(slot) => refly(&vehicle, &plan, slot, &bins, known.wind_mps, exponent)?,
                None => Vec::new(),
            };
            groups.push((bins, values));
        }
        Ok(Self { plan, groups })
    }

    /// Its plan.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }
}

/// A flight with its noise, ready to be asked.
struct Scenery<'a> {
    known: &'a Known,
    comparison: Comparison,
    /// Groups that carry the payload.
    heavy: Vec<bool>,
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
                    Ok(scenery.shape(solution, depends_on, shape))
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

/// Whether an effect of the usual size moves the pulse of this flight by as much as matters.
///
/// # Errors
/// As [`predict`].
pub fn matters(known: &Known, flight: &Flight, effect: &str) -> Result<bool, GapError> {
    let scenery = Scenery::new(known, flight, false, false)?;
    let candidates = library(&known.model, &scenery.comparison.scene)?;
    let Some(candidate) = candidates.iter().find(|candidate| candidate.name == effect) else {
        return Ok(false);
    };
    let Some(size) = candidate.size else { return Ok(false) };
    let range = |column: &Column| {
        let values: Vec<f64> = match column {
            Column::Shared(values) => values.iter().flatten().copied().collect(),
            Column::Own(values) => values.iter().flatten().flatten().copied().collect(),
        };
        let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        most - values.iter().copied().fold(f64::INFINITY, f64::min)
    };
    Ok(candidate.variants.iter().any(|variant| {
        let times = (size.usual / step(variant.size, size.now)).abs();
        range(&variant.column) * times >= MATTERS_US
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

impl<'a> Scenery<'a> {
    fn new(
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
        let data = Data::planned(plan, &parts, resting_v);
        // The simulated side is what all drones read.
        let side: Vec<Vec<Option<BinValues>>> = data
            .groups
            .iter()
            .map(|group| {
                let first = group.measured.first();
                first.map_or_else(Vec::new, |values| values.iter().copied().map(Some).collect())
            })
            .collect();
        let simulated = Simulated::Given(side);
        let comparison = Comparison::new(&data, &known.model, &simulated, Some(plan))?;
        if std::env::var_os("DEBUGWIND").is_some() {
            eprintln!("DEBUG wind {:?} law {:?}", comparison.wind.mean_mps, comparison.wind.measured);
            for (bin, (signals, air)) in comparison.data.groups[0].bins.iter().zip(comparison.scene.signals[0].iter().zip(&comparison.wind.air_mps[0])) {
                eprintln!("DEBUG {:?} {:?} {air:?} {:.2} {:.4}", bin.kind, bin.velocity_mps, signals.horizontal_mps, signals.tilt_rad);
            }
        }
        Ok(Self { known, comparison, heavy })
    }

    /// The vehicle with the payload.
    fn loaded(&self, vehicle: &Vehicle) -> Option<Vehicle> {
        self.heavy.contains(&true).then(|| {
            let mut loaded = vehicle.clone();
            loaded.airframe.mass_kg += PAYLOAD_KG;
            loaded
        })
    }

    /// Regressors of each group's own weight.
    fn merged(&self, light: Column, loaded: Option<Column>) -> Column {
        let Some(loaded) = loaded else { return light };
        fn pick<T: Clone>(light: Vec<T>, loaded: &[T], heavy: &[bool]) -> Vec<T> {
            let both = light.into_iter().zip(loaded).zip(heavy);
            both.map(|((light, loaded), heavy)| if *heavy { loaded.clone() } else { light })
                .collect()
        }
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

    /// The noise, with all fitted sizes free but those of one effect.
    fn solution(&self, but: Option<&str>) -> Result<Solution, GapError> {
        let model = &self.known.model;
        let patterns = self.comparison.patterns(model)?;
        let split = Split::of(&self.comparison.residual(model, 0.0)?);
        let free: Vec<Parameter> = self
            .known
            .parameters
            .iter()
            .filter(|parameter| Some(parameter.effect) != but)
            .cloned()
            .collect();
        let light = slopes(&self.comparison, model, &free)?;
        let loaded = match self.loaded(model) {
            Some(loaded) => Some(slopes(&self.comparison, &loaded, &free)?),
            None => None,
        };
        let columns: Vec<Column> = light
            .into_iter()
            .enumerate()
            .map(|(index, light)| {
                let loaded = loaded.as_ref().and_then(|loaded| loaded.get(index)).cloned();
                self.merged(light, loaded)
            })
            .collect();
        Ok(Problem::new(&patterns, &split).with(&columns).at(&self.known.hyper))
    }

    /// An effect's forms, held against a vehicle.
    fn candidate(&self, vehicle: &Vehicle, effect: &str) -> Result<Option<Candidate>, GapError> {
        let find = |vehicle: &Vehicle| -> Result<Option<Candidate>, GapError> {
            let all = library(vehicle, &self.comparison.scene)?;
            Ok(all.into_iter().find(|candidate| candidate.name == effect))
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
            Ok(difference(&scene.pulses(with)?, &scene.pulses(without)?))
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
            let Some(rival) = self.candidate(&without, other)? else { continue };
            // The form of the rival that looks most like it.
            let likest = rival
                .variants
                .iter()
                .map(|variant| {
                    let white = solution.white(&variant.column);
                    let alike = solution.likeness(&own, &white).clamp(-1.0, 1.0);
                    (alike, solution.information(&white).max(0.0).sqrt(), variant.size)
                })
                .max_by(|a, b| a.0.abs().total_cmp(&b.0.abs()));
            let Some((alike, rival_strength, tried)) = likest else { continue };
            let matched = rival.size.map(|size| {
                let times = alike * strength / rival_strength.max(1e-12);
                (size.now + times * (tried - size.now)).clamp(size.low, size.high)
            });
            separations.push(Separation {
                from: other.clone(),
                z: strength * (1.0 - alike * alike).max(0.0).sqrt(),
                size: matched,
            });
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

    fn shape(&self, solution: &Solution, depends_on: &str, shape: &Shape) -> Vec<Separation> {
        let generics = all(&self.comparison.scene, &self.comparison.headings());
        let Some(own) = generics.iter().find(|generic| generic.depends_on == depends_on) else {
            return Vec::new();
        };
        let along = |bins: &Vec<f64>| bins.iter().map(|x| interpolated(shape, *x)).collect();
        let target = solution.white(&Column::Shared(own.along.iter().map(along).collect()));
        let strength = solution.information(&target).max(0.0).sqrt();
        let mut separations: Vec<Separation> = Vec::new();
        for rival in generics.iter().filter(|generic| generic.depends_on != depends_on) {
            let z = strength * (1.0 - explained(solution, &target, rival)).max(0.0).sqrt();
            match separations.iter_mut().find(|other| other.from == rival.depends_on) {
                Some(other) => other.z = other.z.min(z),
                None => {
                    let from = rival.depends_on.to_owned();
                    separations.push(Separation { from, z, size: None });
                }
            }
        }
        separations
    }
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

/// Charge of the battery of a place in a staggered fleet: evenly spaced from the lowest to full, and spread
/// over the grid.
pub fn charge_of(place: usize, count: usize, lowest: f64) -> f64 {
    // A step that has no factor in common with the count visits every rank once.
    let gcd = |mut a: usize, mut b: usize| {
        while b > 0 {
            (a, b) = (b, a % b);
        }
        a
    };
    let around = (count * 5 / 13).max(1);
    let step = (around..around + count.max(1)).find(|step| gcd(*step, count) == 1).unwrap_or(1);
    let rank = place * step % count.max(1);
    lowest + (1.0 - lowest) * rank as f64 / count.saturating_sub(1).max(1) as f64
}

/// Cells of the battery that a vehicle has or would have.
fn cells(vehicle: &Vehicle) -> f64 {
    let stated = vehicle.effects.get("battery").and_then(|table| table.parameters.get("cells"));
    let default = || {
        let parameters = find("battery").map(|effect| effect.definition().parameters)?;
        let cells = parameters.iter().find(|known| known.name == "cells")?;
        Some((cells.default)(vehicle))
    };
    stated.copied().or_else(default).unwrap_or(1.0).max(1.0)
}
