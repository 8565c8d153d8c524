//! Candidates for what the model lacks: effects of the library in their closed forms, and motions
//! of the air that look like them.

use std::borrow::Cow;
use std::sync::{Arc, OnceLock};

use super::compare::Comparison;
use super::decide::CLASS_NATS;
use super::gls::{Column, Solution};
use super::lean_law::GRAVITY;
use super::noise::{GroupPattern, Hyper};
use super::pack;
use super::response::{self, Response};
use super::scene::Scene;
use super::verdict::Interval;
use crate::effects::{Definition, EffectError, LIBRARY, Role, Sought, find, select};
use crate::sim::plant::drag::Drag;
use crate::vehicle::Vehicle;

/// Relative change of a size that is in the model already, for its derivative. Chosen: small against the
/// sizes that matter, large against the rounding of the closed forms. The sizes themselves come from a later
/// fit.
const CHANGE: f64 = 0.15;

/// Something that may be missing.
#[derive(Clone, Debug)]
pub(super) struct Candidate {
    /// Name: the effect's, or that of a motion of the air.
    pub name: &'static str,
    /// Whether the model has it with another size.
    pub was_there: bool,
    /// Whether the flight shows it only in the wind that the lean is taken for.
    pub by_lean: bool,
    /// The parameter that says how large it is, its unit and bounds.
    pub size: Option<Size>,
    /// Forms of the candidate, which differ in size and shape.
    pub variants: Vec<Variant>,
}

/// The parameter of an effect that says how large it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Size {
    /// Name of the parameter.
    pub name: &'static str,
    /// Unit of the parameter.
    pub unit: &'static str,
    /// Smallest value that is tried.
    pub low: f64,
    /// Largest value that is tried.
    pub high: f64,
    /// Value in the present model; 0 without the effect.
    pub now: f64,
    /// Usual value, in the parameter's unit.
    pub usual: f64,
}

/// One form of a candidate: an effect at one size and shape.
#[derive(Clone, Debug)]
pub(super) struct Variant {
    /// The vehicle with it.
    pub vehicle: Option<Vehicle>,
    /// Size of the effect in it.
    pub size: f64,
    /// Value of the parameter that says which form it has; `None`: it has but one.
    pub form: Option<f64>,
    /// Nats that this form must explain beyond the effect's usual form.
    pub price_nats: f64,
    /// Contribution to the pulse, us.
    pub column: Column,
    /// Updraft of the whole flight that goes with it, m/s; `None`: the one that the flight is taken in.
    pub updraft_mps: Option<f64>,
    /// Contribution to the response to vertical air speed.
    pub felt: Felt,
}

/// Contribution of a form to the response to vertical air speed, by group and bin; empty if there is none, or scatter does
/// not show it. Few forms explain so much that it is asked for: it is computed then.
#[derive(Clone, Debug, Default)]
pub(super) struct Felt(Option<Arc<Feeling>>);

/// What a contribution to the response is computed from.
#[derive(Debug)]
struct Feeling {
    scene: Scene,
    vehicle: Vehicle,
    /// Response without the form.
    without: Arc<Vec<Vec<Response>>>,
    felt: OnceLock<Vec<Vec<Response>>>,
}

impl Felt {
    /// Of a vehicle in a scene, beside a response; `None`: it cannot be flown so.
    fn of(scene: &Scene, vehicle: &Vehicle, without: &Arc<Vec<Vec<Response>>>) -> Option<Self> {
        let feeling = Feeling {
            scene: scene.clone(),
            vehicle: vehicle.clone(),
            without: Arc::clone(without),
            felt: OnceLock::new(),
        };
        if !scene.surely_answers(vehicle) {
            feeling.felt.set(feeling.computed()?).ok()?;
        }
        Some(Self(Some(Arc::new(feeling))))
    }

    /// By group and bin.
    pub(super) fn get(&self) -> &[Vec<Response>] {
        let Some(feeling) = &self.0 else { return &[] };
        if let Some(felt) = feeling.felt.get() {
            return felt;
        }
        // Nobody waits meanwhile: this thread may take up other work that asks for the same.
        let felt = feeling.computed().unwrap_or_default();
        feeling.felt.get_or_init(|| felt)
    }

    /// Whether scatter shows it.
    pub(super) fn is_some(&self) -> bool {
        !self.get().is_empty()
    }
}

impl Feeling {
    fn computed(&self) -> Option<Vec<Vec<Response>>> {
        let mut felt = self.scene.response(&self.vehicle).ok()?;
        response::add(&mut felt, -1.0, &self.without);
        if is_hardly_felt(&felt, &self.without) {
            felt.clear();
        }
        Some(felt)
    }
}

/// Whether the whole flight may be in another updraft with an effect than without.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Updraft {
    /// It is the same.
    Same,
    /// Where the effect says of the wind is another: a drone that leans in less wind meets less of it from below.
    MayDiffer,
}

/// Differences of the updraft that are tried where the wind is another, m/s: what a wind that is 10 m/s off does to a
/// drone that leans by 12 degrees.
const SHIFTS_MPS: [f64; 5] = [0.0, -1.0, 1.0, -2.0, 2.0];

/// Sizes of a drag that the model has already, as multiples, where the wind is read by it: far from a line.
const MULTIPLES: [f64; 2] = [2.0, 4.0];

/// A model that candidates are held against.
struct Base<'a> {
    comparison: &'a Comparison,
    updraft: Updraft,
    pulses: Column,
    response: Arc<Vec<Vec<Response>>>,
}

impl<'a> Base<'a> {
    fn of(
        vehicle: &Vehicle,
        comparison: &'a Comparison,
        updraft: Updraft,
    ) -> Result<Self, EffectError> {
        let scene = comparison.scene_of(vehicle);
        let (pulses, response) = (scene.pulses(vehicle)?, Arc::new(scene.response(vehicle)?));
        Ok(Self { comparison, updraft, pulses, response })
    }

    /// A candidate of a size in a vehicle, in the wind that the vehicle's own law reads from the leans and each updraft
    /// that may go with it. A form that the vehicle cannot have, or fly with, is none.
    fn forms(&self, vehicle: &Vehicle, size: f64) -> Vec<Variant> {
        let scene = self.comparison.scene_of(vehicle);
        let shifts_mps = match (self.updraft, &scene) {
            (Updraft::MayDiffer, Cow::Owned(_)) => &SHIFTS_MPS[..],
            _ => &SHIFTS_MPS[..1],
        };
        let form = |shift_mps: &f64| {
            let updraft_mps = scene.updraft_mps + shift_mps;
            let there = match *shift_mps {
                0.0 => Cow::Borrowed(&*scene),
                _ => Cow::Owned(
                    self.comparison.clone().in_updraft(updraft_mps).scene_of(vehicle).into_owned(),
                ),
            };
            let column = there.pulses(vehicle).ok()?.less(&self.pulses);
            let felt = Felt::of(&there, vehicle, &self.response)?;
            let updraft_mps = (*shift_mps != 0.0).then_some(updraft_mps);
            Some(Variant {
                vehicle: Some(vehicle.clone()),
                size,
                form: None,
                price_nats: 0.0,
                column,
                updraft_mps,
                felt,
            })
        };
        shifts_mps.iter().filter_map(form).collect()
    }
}

/// All effects of the library that steady flight can show, held against a vehicle.
///
/// # Errors
/// Effects of the vehicle that are not valid.
pub(super) fn library(
    vehicle: &Vehicle,
    comparison: &Comparison,
    updraft: Updraft,
) -> Result<Vec<Candidate>, EffectError> {
    of_library(vehicle, comparison, updraft, |_| true)
}

/// One effect of the library, held against a vehicle; `None`: there is none of that name that steady flight can show.
///
/// # Errors
/// Effects of the vehicle that are not valid.
pub(super) fn one(
    vehicle: &Vehicle,
    comparison: &Comparison,
    updraft: Updraft,
    name: &str,
) -> Result<Option<Candidate>, EffectError> {
    Ok(of_library(vehicle, comparison, updraft, |effect| effect == name)?.pop())
}

/// A vehicle with an effect of a size as a form of it, held against the same vehicle without; `None`: it cannot be flown so.
///
/// # Errors
/// Effects of the vehicle without that are not valid.
pub(super) fn form_of(
    with: &Vehicle,
    size: f64,
    (vehicle, comparison): (&Vehicle, &Comparison),
) -> Result<Option<Variant>, EffectError> {
    Ok(Base::of(vehicle, comparison, Updraft::Same)?.forms(with, size).pop())
}

fn of_library(
    vehicle: &Vehicle,
    comparison: &Comparison,
    updraft: Updraft,
    is_wanted: impl Fn(&str) -> bool,
) -> Result<Vec<Candidate>, EffectError> {
    let base = Base::of(vehicle, comparison, updraft)?;
    let mut found = Vec::new();
    let wanted = LIBRARY.iter().filter(|effect| is_wanted(effect.definition().name));
    for effect in wanted {
        let definition = effect.definition();
        let Sought::Shape { size, sizes, usual, shape } = &definition.sought else { continue };
        let Some(parameter) = definition.parameter(size) else {
            continue;
        };
        let table = vehicle.effects.get(definition.name).filter(|table| table.on);
        let now = table.map_or(0.0, |table| {
            let stated = table.parameters.get(*size).copied();
            stated.unwrap_or_else(|| (parameter.default)(vehicle))
        });
        let sizes: Vec<f64> = if now == 0.0 {
            sizes(vehicle).to_vec()
        } else {
            let step = now * CHANGE;
            let mut sizes =
                vec![if now + step <= parameter.high { now + step } else { now - step }];
            let multiples = MULTIPLES.map(|times| times * now);
            sizes.extend(multiples.into_iter().filter(|size| {
                let mut other = vehicle.clone();
                set(&mut other, definition.name, parameter.name, *size);
                *size <= parameter.high && comparison.leans_otherwise(&other)
            }));
            sizes
        };
        // A size that is in the model keeps its shape.
        let shapes: Vec<Option<(&str, f64)>> = match shape {
            Some((name, values)) if now == 0.0 => {
                values.iter().map(|value| Some((*name, *value))).collect()
            }
            _ => vec![None],
        };
        let is_body = parameter.role == Some(Role::BodyDragTop) && now == 0.0;
        let sides = if is_body { sides_tried(vehicle, comparison) } else { vec![None] };
        let mut prepared = vehicle.clone();
        pack::prepare(&mut prepared, definition, &comparison.scene);
        let mut variants = Vec::new();
        for value in sizes {
            for (shape, sides) in
                shapes.iter().flat_map(|one| sides.iter().map(move |sides| (one, *sides)))
            {
                let mut other = prepared.clone();
                set(&mut other, definition.name, size, value);
                if let Some((name, value)) = shape {
                    set(&mut other, definition.name, name, *value);
                }
                if let Some(sides) = sides {
                    Role::BodyDragSide.set(&mut other, sides * value);
                }
                let form = sides.or(shape.map(|(_, value)| value));
                let price_nats = shape
                    .map_or(0.0, |(name, value)| form_price_nats(definition, vehicle, name, value));
                let variant = |variant: Variant| Variant { form, price_nats, ..variant };
                variants.extend(base.forms(&other, value).into_iter().map(variant));
            }
        }
        let usual = usual.unwrap_or_else(|| (parameter.default)(vehicle));
        found.push(Candidate {
            name: definition.name,
            was_there: now != 0.0,
            by_lean: false,
            size: Some(Size {
                name: parameter.name,
                unit: parameter.unit,
                low: parameter.low,
                high: parameter.high,
                now,
                usual,
            }),
            variants,
        });
    }
    Ok(found)
}

/// Nats that a form must explain beyond the usual one of two: the size of an effect goes with it, and where a flight does not
/// tell them apart it is that of the usual form.
pub(super) fn form_price_nats(
    definition: &Definition,
    vehicle: &Vehicle,
    name: &str,
    value: f64,
) -> f64 {
    let is_unusual = definition.parameter(name).is_some_and(|parameter| {
        parameter.role.is_some_and(Role::is_choice) && value != (parameter.default)(vehicle)
    });
    if is_unusual { CLASS_NATS } else { 0.0 }
}

/// The share of momentum drag that acts along the rotors' axis, as in ArduPilot's own simulator.
const AXIAL: &str = "axial";

/// Sizes of momentum drag that are tried, as shares of what the vehicle has by default.
const AXIAL_SIZES: [f64; 2] = [0.5, 1.0];

/// Momentum drag on all axes: for vehicles of ArduPilot's own simulator, and instead of a drag of the rotors that the
/// leans told (`by_leans`): who loses its speed to the air that goes through the rotors leans as with blade flapping.
/// Elsewhere it is a stand-in for inflow, and looked for only where it `is_asked` for.
///
/// # Errors
/// Effects of the vehicle that are not valid.
pub(super) fn axial_drag(
    vehicle: &Vehicle,
    comparison: &Comparison,
    by_leans: bool,
    is_asked: bool,
) -> Result<Option<Candidate>, EffectError> {
    let (Some(place), Some(flapping)) = (Role::MomentumDrag.place(), Role::RotorDrag.place())
    else {
        return Ok(None);
    };
    let (name, parameter) = (place.name(), place.parameter);
    let (definition, size) = (place.effect.definition(), parameter.name);
    if Role::MomentumDrag.is_on(vehicle) {
        return Ok(None);
    }
    let usual = (parameter.default)(vehicle);
    let told = Role::RotorDrag.value(vehicle).filter(|_| by_leans);
    let sizes = match told {
        Some(drag_per_weight) => vec![drag_per_weight * GRAVITY],
        None if is_asked || vehicle.airframe.sitl.is_some() => {
            AXIAL_SIZES.map(|share| share * usual).to_vec()
        }
        None => return Ok(None),
    };
    let base = Base::of(vehicle, comparison, Updraft::Same)?;
    let mut variants = Vec::new();
    for value in sizes {
        let mut other = vehicle.clone();
        if told.is_some() {
            other.effects.remove(flapping.name());
        }
        select::set(&mut other, name, size, value);
        select::set(&mut other, name, AXIAL, 1.0);
        variants.extend(base.forms(&other, value));
    }
    let size = Size {
        name: parameter.name,
        unit: parameter.unit,
        low: parameter.low,
        high: parameter.high,
        now: 0.0,
        usual,
    };
    let size = Some(size);
    Ok(Some(Candidate { name: definition.name, was_there: false, by_lean: false, size, variants }))
}

/// Share of the response that a form must change before the scatter between drones is asked about it.
/// Chosen, not measured: a smaller change is lost in the estimate of the gusts.
const FELT: f64 = 0.1;

/// Whether what a form adds to the response is too little for scatter to show it.
fn is_hardly_felt(felt: &[Vec<Response>], response: &[Vec<Response>]) -> bool {
    let sum = |of: &[Vec<Response>]| -> f64 {
        of.iter().flatten().map(|one| one.at(0.0).abs() + one.at(FELT_AT_MPS).abs()).sum()
    };
    sum(felt) < FELT * sum(response)
}

/// Speed at which responses are compared besides the flown one, because some are flat in hover, m/s: the
/// strength of a field day's gusts (docs/physics.md, 4.1).
const FELT_AT_MPS: f64 = 0.5;

/// Sets a parameter of an effect and switches it on.
pub(super) fn set(vehicle: &mut Vehicle, effect: &str, parameter: &str, value: f64) {
    let role = find(effect).and_then(|effect| effect.definition().parameter(parameter)?.role);
    // A body that is larger is larger from all sides: leans, by which the wind is read, must know it.
    if role == Some(Role::BodyDragTop) {
        let sides = sides_of(vehicle);
        Role::BodyDragSide.set(vehicle, sides * value);
    }
    select::set(vehicle, effect, parameter, value);
}

/// Drag area of a body's sides over that of its top.
fn sides_of(vehicle: &Vehicle) -> f64 {
    let of = |role: Role| role.value(vehicle).filter(|area| *area > 0.0);
    if let (Some(top), Some(sides)) = (of(Role::BodyDragTop), of(Role::BodyDragSide)) {
        return sides / top;
    }
    let factor = Drag::new(&vehicle.airframe).factor_m2();
    let sides = (factor.x * factor.y).sqrt();
    if factor.z > 0.0 && sides > 0.0 { sides / factor.z } else { USUAL_SIDES }
}

/// Drag areas of a new body's sides over that of its top that are tried; `None`: as [`set`] chooses it. In wind the leans
/// tell a flat body, as the airframe is, from a round one, which resists alike from all sides.
fn sides_tried(vehicle: &Vehicle, comparison: &Comparison) -> Vec<Option<f64>> {
    let [x_mps, y_mps] = comparison.wind.mean_mps;
    let flat = sides_of(vehicle);
    if x_mps.hypot(y_mps) < LEAST_WIND_MPS || (flat / ROUND).ln().abs() < SAME_SIDES {
        return vec![None];
    }
    vec![Some(flat), Some(ROUND)]
}

/// Horizontal over vertical area of a round body.
const ROUND: f64 = 1.0;
/// Logarithm of the ratio of two shapes of a body that are as good as the same. Chosen.
const SAME_SIDES: f64 = 0.3;
/// Wind below which leans do not tell the shape of a body, m/s. Chosen: gusts of a calm day.
const LEAST_WIND_MPS: f64 = 1.0;

/// Horizontal over vertical area of a body's drag where the airframe states none. Chosen; the
/// `parasitic-drag` of the library has the same ratio by default.
const USUAL_SIDES: f64 = 0.5;

/// Drag of the rotors that is tried where no horizontal leg reveals it, s/m: 0.6 to 2 degrees of lean per
/// m/s, around the 1.0 to 1.5 of small rotors (docs/physics.md, 2.6).
const DRAGS: [f64; 3] = [0.01, 0.02, 0.035];

/// Rotors that drag, seen through the wind: where the flight has no horizontal legs the wind is read
/// from the lean by the model's law, and a drone with such rotors leans in less wind than that says.
///
/// # Errors
/// Effects of the vehicle that are not valid.
pub(super) fn read_otherwise(
    comparison: &Comparison,
    vehicle: &Vehicle,
    updraft: Updraft,
) -> Result<Option<Candidate>, EffectError> {
    let drag = Role::RotorDrag;
    let Some(place) = drag.place() else { return Ok(None) };
    if drag.is_on(vehicle) || comparison.wind.measured.is_some() {
        return Ok(None);
    }
    let base = Base::of(vehicle, comparison, updraft)?;
    let mut variants = Vec::new();
    for size in DRAGS {
        let mut other = vehicle.clone();
        drag.set(&mut other, size);
        let forms = base.forms(&other, size).into_iter();
        // In the same updraft the response is the same, but for what closed forms leave out.
        variants.extend(forms.map(|form| match form.updraft_mps {
            Some(_) => form,
            None => Variant { felt: Felt::default(), ..form },
        }));
    }
    let parameter = place.parameter;
    let size = Size {
        name: parameter.name,
        unit: parameter.unit,
        low: parameter.low,
        high: parameter.high,
        now: 0.0,
        usual: DRAGS[1],
    };
    Ok(Some(Candidate {
        name: place.name(),
        was_there: false,
        by_lean: true,
        size: Some(size),
        variants,
    }))
}

/// Step between the sizes tried for the drag that fits best, s/m: an eighth of a usual size; the top is then
/// found by a parabola. Chosen.
const DRAG_STEP: f64 = 0.0025;
/// Most of these steps, up to 0.06 s/m: three times the drag of small rotors. Chosen.
const MOST_DRAG_STEPS: u32 = 24;

/// What a size may gain less than the best and still be in its interval, nats: two standard errors.
const INTERVAL_NATS: f64 = 2.0;

/// The drag of the rotors that fits best by the wind that it lets the lean say, with its 95 %
/// interval, s/m. `there` is the comparison in the updraft that goes with it.
///
/// # Errors
/// Effects of the vehicle that are not valid.
pub(super) fn drag_by_lean(
    comparison: &Comparison,
    there: &Comparison,
    vehicle: &Vehicle,
    base: &Solution,
) -> Result<Option<Interval>, EffectError> {
    let without = comparison.pulses_by_lean(vehicle)?;
    let mut gains = Vec::new();
    for step in 1..=MOST_DRAG_STEPS {
        let size = DRAG_STEP * f64::from(step);
        let mut other = vehicle.clone();
        Role::RotorDrag.set(&mut other, size);
        let Ok(pulses) = there.pulses_by_lean(&other) else { continue };
        let gain = base.gain(&pulses.less(&without));
        // Gain of the form as it is, where `gain` has that of its best multiple.
        let information = 2.0 * gain.nats / gain.beta.powi(2);
        let as_it_is = (gain.beta - 0.5) * information;
        if as_it_is.is_finite() {
            gains.push((size, as_it_is));
        }
    }
    let high = Role::RotorDrag.place().map_or(0.0, |place| place.parameter.high);
    Ok(most_likely(&gains, high))
}

/// The most likely of some sizes, with the interval in which they gain nearly as much, nats; without any, nothing is gained, and
/// sizes beyond those that were tried, up to `high`, do as the last one.
fn most_likely(gains: &[(f64, f64)], high: f64) -> Option<Interval> {
    let best = (0..gains.len()).max_by(|a, b| gains[*a].1.total_cmp(&gains[*b].1))?;
    let (size, most) = gains[best];
    let needed = most - INTERVAL_NATS;
    // Between two sizes, of which the first is likely enough and the other is not, by a straight line.
    let between = |(inside, gain): (f64, f64), (outside, less): (f64, f64)| {
        inside + (outside - inside) * (gain - needed) / (gain - less)
    };
    let (before, after) = gains.split_at(best);
    let nothing = [(0.0, 0.0)];
    // Where sizes that go away from the best are no longer likely enough; beyond them all, it is the last that there can be.
    let edge = |sizes: &mut dyn Iterator<Item = &(f64, f64)>, last: f64| {
        let mut inside = gains[best];
        for next in sizes {
            if next.1 < needed {
                return between(inside, *next);
            }
            inside = *next;
        }
        last
    };
    let low = edge(&mut before.iter().rev().chain(&nothing), 0.0);
    let end = edge(&mut after.iter().skip(1), high.max(size));
    let (Some((_, below)), Some((_, above))) = (before.last(), after.get(1)) else {
        return Some(Interval { value: size, low, high: end });
    };
    // The parabola through the top.
    let curvature = 2.0 * most - below - above;
    let apart = if curvature > 0.0 { 0.5 * (above - below) / curvature } else { 0.0 };
    let value = size + apart * DRAG_STEP;
    let half = DRAG_STEP * (2.0 * INTERVAL_NATS / curvature).sqrt();
    let is_sharp = curvature > 0.0 && half < DRAG_STEP;
    let (low, high) = if is_sharp { (value - half, value + half) } else { (low, end) };
    Some(Interval { value, low, high })
}

/// Motions of the air that an effect may be mistaken for: not the vehicle's, and never added to it.
pub(super) fn of_the_air(
    scene: &Scene,
    patterns: &[GroupPattern],
    hyper: &Hyper,
) -> Vec<Candidate> {
    let last_s = scene.signals.iter().flatten().map(|s| s.time_s).fold(1.0, f64::max);
    let column = |of: &dyn Fn(&crate::effects::Signals) -> f64| {
        let group = |(signals, pattern): (&Vec<crate::effects::Signals>, &GroupPattern)| {
            let responses = pattern.responses(hyper);
            signals.iter().zip(responses).map(|(s, response)| -response * of(s)).collect()
        };
        Column::Shared(scene.signals.iter().zip(patterns).map(group).collect())
    };
    let air = |name, column| Candidate {
        name,
        was_there: false,
        by_lean: false,
        size: None,
        variants: vec![Variant {
            vehicle: None,
            size: 1.0,
            form: None,
            price_nats: 0.0,
            column,
            updraft_mps: None,
            felt: Felt::default(),
        }],
    };
    vec![
        air("updraft-drift", column(&|signals| signals.time_s / last_s)),
        // Free convection near the ground: w grows with the cube root of height.
        air("updraft-profile", column(&|signals| (signals.height_m.max(0.0) / 100.0).cbrt())),
    ]
}

#[cfg(test)]
mod tests {
    use super::super::search::admissible;
    use super::super::trial;
    use super::*;

    #[test]
    fn a_drag_that_gains_up_to_the_end_of_what_was_tried_is_not_known_there() {
        let gains = |of: fn(f64) -> f64| -> Vec<(f64, f64)> {
            let sizes = (1..=MOST_DRAG_STEPS).map(|step| DRAG_STEP * f64::from(step));
            sizes.map(|size| (size, of(size))).collect()
        };
        let told = |of: fn(f64) -> f64| most_likely(&gains(of), 0.1).unwrap();
        let near = |of: Interval, wanted: [f64; 3]| {
            let off = [of.value - wanted[0], of.low - wanted[1], of.high - wanted[2]];
            assert!(off.iter().all(|off| off.abs() < 3e-4), "{of:?}, not {wanted:?}");
        };
        // Two standard errors of 0.001 are below a step, and of 0.004 above one.
        near(told(|size| 30.0 - 0.5 * ((size - 0.0204) / 0.001).powi(2)), [0.0204, 0.0184, 0.0224]);
        near(told(|size| 30.0 - 0.5 * ((size - 0.03) / 0.004).powi(2)), [0.03, 0.022, 0.038]);
        // A drone that hides most of a misread wind: the less is left of it, the less another size changes.
        near(told(|size| 36.0 - 0.02 / size), [0.06, 0.00857, 0.1]);
        // Hardly anything gained.
        near(told(|size| 1.0 - 0.5 * ((size - 0.01) / 0.004).powi(2)), [0.01, 0.0, 0.018]);
        assert!(most_likely(&[], 0.1).is_none());
    }

    #[test]
    fn air_that_begins_to_rise_takes_away_the_pulse_that_a_drone_answers_with() {
        let data = trial::data(2, |_, _| 0.0);
        let comparison = trial::comparison(&data);
        let patterns = comparison.patterns(&trial::vehicle(), 0.2).unwrap();
        let hyper = Hyper::default();
        let motions = of_the_air(&comparison.scene, &patterns, &hyper);
        let drift = &motions.iter().find(|one| one.name == "updraft-drift").unwrap().variants[0];
        let responses = patterns[0].responses(&hyper);
        let (first, last) = (0, responses.len() - 1);
        let share = |bin: usize| drift.column.at(0, 0, bin) / responses[bin];
        assert!((share(last) + 1.0).abs() < 1e-9, "1 m/s at the end: {}", share(last));
        assert!((-0.1..0.0).contains(&share(first)), "and hardly any before: {}", share(first));
    }

    #[test]
    fn in_wind_a_new_body_is_tried_flat_and_round() {
        let mut comparison = trial::comparison(&trial::data(2, |_, _| 0.0));
        let sides = |comparison: &Comparison| -> Vec<f64> {
            let found = one(&trial::vehicle(), comparison, Updraft::Same, "parasitic-drag");
            let variants = found.unwrap().unwrap().variants;
            let of = |variant: &Variant| {
                let area = |role: Role| role.value(variant.vehicle.as_ref().unwrap()).unwrap();
                area(Role::BodyDragSide) / area(Role::BodyDragTop)
            };
            variants.iter().map(of).collect()
        };
        let still = sides(&comparison);
        assert!(still.iter().all(|sides| (sides - still[0]).abs() < 1e-9 && *sides < 0.2));
        comparison.wind.mean_mps = [3.0, 4.0];
        let blown = sides(&comparison);
        assert_eq!(blown.iter().filter(|sides| (*sides - ROUND).abs() < 1e-9).count(), still.len());
        assert_eq!(blown.len(), 2 * still.len());
    }

    #[test]
    fn a_compensation_of_the_battery_may_do_too_little_and_too_much() {
        let mut comparison = trial::comparison(&trial::data(2, |_, _| 0.0));
        (comparison.scene.cells, comparison.scene.resting_v) = (3.0, 11.5);
        let found = one(&trial::vehicle(), &comparison, Updraft::Same, "battery");
        let battery = found.unwrap().unwrap();
        let reached = |exponent: f64| {
            let beta = |variant: &Variant| exponent / variant.size;
            battery.variants.iter().any(|variant| admissible(&battery, variant, beta(variant)))
        };
        assert!([0.3, 1.0, -0.1, -0.6].into_iter().all(reached));
    }
}
