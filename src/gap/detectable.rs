//! Power of a flight: the smallest size of each effect that it would have named.

use super::candidates::{Candidate, Updraft, Variant, library};
use super::compare::Comparison;
use super::error::GapError;
use super::explain::Found;
use super::gls::{Column, Problem, Solution, Split, White};
use super::refine::{doubts, slopes};
use super::response::shifted;
use super::search::FLOOR_NATS;
use super::verdict::Detectable;
use crate::effects::{LIBRARY, Sought, find};
use crate::vehicle::Vehicle;

/// Fisher z from which an effect counts as found nearly always: Phi(5 - 4) = 84 % (docs/physics.md, 3.3).
const SEEN_Z: f64 = 5.0;
/// Correlation from which two effects are listed as leaving the same trace. Chosen.
const SAME: f64 = 0.9;
/// A trace this small is not excited by the flight, us at the usual size: a fiftieth of the pulse that is
/// material. Chosen.
const NOTHING_US: f64 = 0.05;
/// Other updrafts that a flight may have been in, from the one that it is explained in, m/s: as far as the search goes, in steps
/// between which little changes.
const BESIDE_MPS: [f64; 10] = [0.2, -0.2, 0.4, -0.4, 0.7, -0.7, 1.2, -1.2, 2.0, -2.0];

/// The table for everything in the library, with the final model and noise.
///
/// # Errors
/// Effects of the vehicle that are not valid.
pub(super) fn detectable(found: &Found) -> Result<Vec<Detectable>, GapError> {
    let comparison = &found.comparison;
    let patterns = comparison.patterns(&found.vehicle, found.gusts_mps)?;
    let split = Split::of(&comparison.residual(&found.vehicle, found.gusts_mps)?);
    let doubts = doubts(comparison, &found.vehicle, &found.parameters)?;
    let problem = Problem::new(&patterns, &split).doubting(&doubts).with(&found.extras);
    let groups = shifted(&patterns, &problem, &problem.at(&found.noise.hyper));
    let sizes = slopes(comparison, &found.vehicle, &found.parameters)?;
    // Sizes that were fitted are free, but for an effect's own.
    let free_but = |effect: Option<&str>| {
        let of = found.parameters.iter().zip(&sizes);
        let free: Vec<Column> = of
            .filter(|(parameter, _)| Some(parameter.effect) != effect)
            .map(|(_, slope)| slope.clone())
            .collect();
        problem.among(&groups).with(&free).at(&found.noise.hyper)
    };
    let solution = free_but(None);
    let candidates = library(&found.vehicle, comparison, Updraft::Same)?;
    let drones = comparison.data.counts();
    let elsewhere = elsewhere(comparison, &found.vehicle)?;
    let elsewhere: Vec<White> = elsewhere.iter().map(|column| solution.white(column)).collect();
    let best: Vec<(&Candidate, Option<Trace>)> = candidates
        .iter()
        .map(|candidate| {
            let is_found = found.parameters.iter().any(|one| one.effect == candidate.name);
            let own = is_found.then(|| free_but(Some(candidate.name)));
            let form = usual_form(candidate.name, &found.vehicle);
            let solution = own.as_ref().unwrap_or(&solution);
            (candidate, strongest(candidate, form, solution, (&drones, &elsewhere)))
        })
        .collect();
    let mut table = Vec::new();
    for effect in LIBRARY {
        let definition = effect.definition();
        let nothing = |why: &str| Detectable {
            effect: definition.name.to_owned(),
            parameter: String::new(),
            unit: String::new(),
            usual: 0.0,
            smallest: None,
            usual_z: 0.0,
            would_be_seen: false,
            like: Vec::new(),
            why: why.to_owned(),
        };
        if let Sought::No(why) = &definition.sought {
            table.push(nothing(why));
            continue;
        }
        let Some((candidate, trace)) =
            best.iter().find(|(candidate, _)| candidate.name == definition.name)
        else {
            continue;
        };
        let (Some(size), Some(trace)) = (candidate.size, trace) else {
            table.push(nothing("the vehicle cannot have it"));
            continue;
        };
        let usual_z = trace.z(size.usual.abs());
        let smallest = trace.smallest((2.0 * FLOOR_NATS).sqrt());
        let like: Vec<String> = best
            .iter()
            .filter(|(other, _)| other.name != candidate.name)
            .filter_map(|(other, trace)| Some((other, trace.as_ref()?)))
            .filter(|(_, other)| solution.likeness(&trace.white, &other.white).abs() > SAME)
            .map(|(other, _)| other.name.to_owned())
            .collect();
        let excited = trace.us * size.usual.abs() > NOTHING_US;
        let reach = smallest.is_finite() && smallest <= size.high && excited;
        let why = if !excited {
            "this flight does not excite it: its trace is below a twentieth of a microsecond"
        } else if !reach {
            "even the largest possible size is lost in air and noise"
        } else {
            ""
        };
        table.push(Detectable {
            effect: definition.name.to_owned(),
            parameter: size.name.to_owned(),
            unit: size.unit.to_owned(),
            usual: size.usual,
            smallest: reach.then_some(smallest),
            usual_z: if usual_z.is_finite() { usual_z } else { 0.0 },
            would_be_seen: usual_z >= SEEN_Z,
            like,
            why: why.to_owned(),
        });
    }
    Ok(table)
}

/// What a flight shows of an effect.
struct Trace {
    /// A form of it, whitened.
    white: White,
    /// Its z per unit of the size in the updraft that the flight is explained in.
    per_size: f64,
    /// What each other updraft does to the flight.
    beside: Vec<Beside>,
    /// How much it changes the pulse, us per unit of the size.
    us: f64,
}

/// What another updraft does to a flight besides what the slope of the response tells.
struct Beside {
    /// How far that is from what noise explains, as a Fisher z.
    z: f64,
    /// What it has in common with an effect, z per unit of its size.
    along: f64,
}

impl Beside {
    /// Square of the z of what it has not in common with the effect.
    fn across2(&self) -> f64 {
        (self.z * self.z - self.along * self.along).max(0.0)
    }
}

impl Trace {
    /// Fisher z of a size: what tells it from a flight without the effect in whichever updraft is most like it.
    fn z(&self, size: f64) -> f64 {
        let here = self.per_size * size;
        let apart2 = |one: &Beside| one.across2() + (here - one.along).powi(2);
        self.beside.iter().map(apart2).fold(here * here, f64::min).max(0.0).sqrt()
    }

    /// The size from which this z is reached whichever updraft the flight was in.
    fn smallest(&self, z: f64) -> f64 {
        let needed = |one: &Beside| {
            let across2 = one.across2();
            (across2 < z * z).then(|| one.along + (z * z - across2).sqrt())
        };
        self.beside.iter().filter_map(needed).fold(z, f64::max) / self.per_size
    }
}

/// What other updrafts of the whole flight do to the pulse, us.
fn elsewhere(comparison: &Comparison, vehicle: &Vehicle) -> Result<Vec<Column>, GapError> {
    let here = comparison.pulses_by_lean(vehicle)?;
    let there = |by_mps: &f64| {
        let there = comparison.clone().in_updraft(comparison.scene.updraft_mps + by_mps);
        // Where the vehicle cannot fly, it was not.
        Some(there.pulses_by_lean(vehicle).ok()?.less(&here))
    };
    Ok(BESIDE_MPS.iter().filter_map(there).collect())
}

/// The form in which a vehicle has an effect if nothing else is said, of those that are tried; `None`: it has one.
fn usual_form(effect: &str, vehicle: &Vehicle) -> Option<f64> {
    let definition = find(effect)?.definition();
    let Sought::Shape { shape: Some((name, forms)), .. } = &definition.sought else { return None };
    let usual = (definition.parameter(name)?.default)(vehicle);
    forms.iter().copied().min_by(|a, b| (a - usual).abs().total_cmp(&(b - usual).abs()))
}

/// How a flight shows a candidate best in this form. Of another form the flight may show more, or nothing: a vortex ring that begins
/// in a slower descent is met where that of the usual onset is not.
fn strongest(
    candidate: &Candidate,
    form: Option<f64>,
    solution: &Solution,
    (drones, elsewhere): (&[usize], &[White]),
) -> Option<Trace> {
    let now = candidate.size.map_or(0.0, |size| size.now);
    let is_usual = |variant: &&Variant| form.is_none() || variant.form == form;
    let has_usual = candidate.variants.iter().any(|variant| is_usual(&variant));
    let (white, per_size, variant, by) = candidate
        .variants
        .iter()
        .filter(|variant| !has_usual || is_usual(variant))
        .map(|variant| {
            let white = solution.white(&variant.column);
            let by = (variant.size - now).abs().max(1e-12);
            let per_size = solution.information(&white).max(0.0).sqrt() / by;
            (white, per_size, variant, by)
        })
        .max_by(|a, b| a.1.total_cmp(&b.1))?;
    let beside = elsewhere.iter().map(|other| {
        let z = solution.information(other).max(0.0).sqrt();
        Beside { z, along: z * solution.likeness(&white, other) }
    });
    let beside = beside.collect();
    let us = variant.column.spread(drones) / by;
    Some(Trace { white, per_size, beside, us })
}

#[cfg(test)]
mod tests {
    use super::super::trial;
    use super::*;

    fn trace(beside: Vec<Beside>) -> Trace {
        Trace { white: White::default(), per_size: 2.0, beside, us: 1.0 }
    }

    #[test]
    fn an_updraft_that_does_the_same_hides_a_size() {
        let alone = trace(Vec::new());
        assert!((alone.z(5.0) - 10.0).abs() < 1e-12);
        assert!((alone.smallest(4.0) - 2.0).abs() < 1e-12);
        // Another updraft is nearly what a size of 5 does, and nothing of what it leaves is seen.
        let hidden = trace(vec![Beside { z: 10.0, along: 10.0 }]);
        assert!(hidden.z(5.0) < 1e-12 && (hidden.z(2.0) - 4.0).abs() < 1e-12);
        assert!((hidden.smallest(4.0) - 7.0).abs() < 1e-12);
        // What only that updraft does tells it, and one that does the contrary is none.
        let told = trace(vec![Beside { z: 12.0, along: 10.0 }, Beside { z: 10.0, along: -10.0 }]);
        assert!((told.z(5.0) - 44.0_f64.sqrt()).abs() < 1e-12, "{}", told.z(5.0));
        assert!((told.smallest(4.0) - 2.0).abs() < 1e-12);
    }

    #[test]
    fn other_updrafts_bend_the_response() {
        let data = trial::data(4, |_, _| 0.0);
        let comparison = trial::comparison(&data);
        let there = elsewhere(&comparison, &comparison.vehicle).unwrap();
        assert_eq!(there.len(), BESIDE_MPS.len());
        let rose = |by_mps: f64| {
            let place = BESIDE_MPS.iter().position(|one| *one == by_mps).unwrap();
            there[place].at(0, 0, 0)
        };
        assert!(rose(0.4) < 0.0 && rose(-0.4) > 0.0, "less thrust holds a drone in rising air");
        assert!(rose(2.0) < 3.0 * rose(0.4));
    }
}
