//! Names that do not stand alone: an effect is named alone only where nothing else may be meant. What is in doubt
//! becomes a class with what it may be instead.

use std::ops::RangeInclusive;

use super::candidates::set;
use super::contest::PRODUCT_NATS;
use super::decide::{CONTEST_MARGINS, margin_nats};
use super::dependence::{Dependence, depend_on_the_same, depends_on_climb, is_of_air, signals_of};
use super::error::GapError;
use super::explain::Found;
use super::generic::climb_shapes;
use super::gls::{Problem, Split};
use super::refine::{self, Parameter, half_interval};
use super::search::FREE_FLOOR_NATS;
use super::verdict::{Finding, Fitted, Rest, Rival, Step};
use crate::effects::{Role, Signal, find};

/// A value this near to the end of its range, as a share of the range, is at the end. Numerical.
const AT_BOUND: f64 = 1e-3;
/// An unknown that explains more than this share of what a name explains may be the same. Chosen: other forms of the same
/// physics left up to a seventh.
const UNKNOWN_SHARE: f64 = 1.0 / 7.0;
/// Share of a larger effect's size below which another form of that one may be meant. Chosen: other forms of the same
/// physics left up to a seventh.
const SMALL: f64 = 0.2;

/// An effect that is so many times as large as the whole gap is undone in part by another. Chosen: of 256 blind flights two had
/// such an effect beside another one, 1.3 and 1.9 times as large as the gap, and both named what was not there.
const UNDONE: f64 = 1.25;

/// A free shape of the climb that is left must explain so much to be told beside a name of the climb, nats: less than to be
/// found, since something is there.
const LEFT_NATS: f64 = 10.0;
/// And this share of what the name explains. Chosen: other forms of the same physics left up to a seventh.
const LEFT_SHARE: f64 = 1.0 / 7.0;

/// Share of a name's gain that a rival must have to stand for it. Chosen.
const RIVAL_SHARE: f64 = 0.25;

/// Wind in which drag of a body is nearly linear in the climb, m/s: half of the fastest climbs of ladders. Chosen.
const LEAST_WIND_MPS: f64 = 2.0;

/// Shapes of the climb that a flight whose response changes with time must be told from: as many as an unknown that
/// depends on climb may have.
const CLIMB_ORDERS: RangeInclusive<usize> = 1..=5;

/// Makes classes of the names in doubt at the end of a search.
///
/// # Errors
/// Effects of the vehicle that are not valid.
pub(super) fn review(found: &mut Found) -> Result<(), GapError> {
    at_their_bounds(found);
    beside_a_curve(found)?;
    beside_something_unknown(&mut found.steps);
    beside_something_larger(&mut found.steps);
    beside_what_the_air_may_be(&mut found.steps);
    beside_what_is_left(&mut found.steps, &found.rest);
    beside_inflow_and_drag_of_the_body(found);
    beside_a_class(&mut found.steps);
    what_another_finding_may_be(&mut found.steps);
    Ok(())
}

/// Names of what changes the response with time, where a curve of the climb does as well: on a ladder that flies each
/// speed once, time and speed go together.
fn beside_a_curve(found: &mut Found) -> Result<(), GapError> {
    for place in 0..found.steps.len() {
        let Some(effect) = new_name(&found.steps[place]) else { continue };
        let signals = signals_of(effect);
        let is_product = [Signal::Climb, Signal::Time].iter().all(|one| signals.contains(one));
        let own = found.parameters.iter().position(|parameter| parameter.effect == effect);
        let Some(own) = own.filter(|_| is_product) else { continue };
        let [nats, curve_nats] = gains(found, own)?;
        let is_curve = nats < curve_nats + PRODUCT_NATS;
        doubt(&mut found.steps[place], is_curve.then(|| Dependence::Climb.name().to_owned()));
    }
    Ok(())
}

/// What a size explains, nats, and what curves of the climb would explain in its place.
fn gains(found: &Found, size: usize) -> Result<[f64; 2], GapError> {
    let Found { comparison, parameters, gusts_mps, .. } = found;
    let Parameter { effect, name, before, .. } = parameters[size];
    let mut without = found.vehicle.clone();
    set(&mut without, effect, name, before.unwrap_or_default());
    let patterns = comparison.patterns(&found.vehicle, *gusts_mps)?;
    let residual = Split::of(&comparison.residual(&without, *gusts_mps)?);
    let doubts = refine::doubts(comparison, &found.vehicle, parameters)?;
    let mut sizes = refine::slopes(comparison, &found.vehicle, parameters)?;
    let own = sizes.remove(size);
    let curves = climb_shapes(&comparison.scene, CLIMB_ORDERS);
    let problem = Problem::new(&patterns, &residual).doubting(&doubts).with(&found.extras);
    let solution = problem.with(&sizes).at(&found.noise.hyper);
    Ok([solution.gain(&own).nats, solution.gain_of_all(&curves).1])
}

/// What an effect is told with that was found after others, and gains so much in the means, nats: the first of those that
/// depends on the same, unless the means alone would show a free shape. By less it may be what the form of that one leaves,
/// which no library has exactly, however well the drones scatter for it.
pub(super) fn form_of_what_was_found(steps: &[Step], effect: &str, plain: f64) -> Option<String> {
    if plain > FREE_FLOOR_NATS {
        return None;
    }
    let mut firsts = steps.iter().filter_map(|step| step.finding.effects().first().copied());
    firsts.find(|first| *first != effect && depend_on_the_same(first, effect)).map(str::to_owned)
}

/// An effect that is named alone, and was not in the model.
fn new_name(step: &Step) -> Option<&str> {
    match &step.finding {
        Finding::Name { effect, was_there: false, .. } => Some(effect),
        _ => None,
    }
}

/// An effect that is named alone, new or with another size than the model's.
fn lone_name(step: &Step) -> Option<&str> {
    match &step.finding {
        Finding::Name { effect, .. } => Some(effect),
        _ => None,
    }
}

/// The effects of each class, with its place among the steps.
fn classes(steps: &[Step]) -> Vec<(usize, Vec<String>)> {
    let of = |(place, step): (usize, &Step)| match &step.finding {
        Finding::Class { effects, .. } => Some((place, effects.clone())),
        Finding::Name { .. } | Finding::Unknown { .. } => None,
    };
    steps.iter().enumerate().filter_map(of).collect()
}

/// Makes a class of a name and others, if there are any.
fn doubt(step: &mut Step, others: impl IntoIterator<Item = String>) {
    let Finding::Name { effect, parameters, .. } = &step.finding else { return };
    let mut effects = vec![effect.clone()];
    effects.extend(others);
    if effects.len() > 1 {
        step.finding = Finding::Class { effects, parameters: parameters.clone() };
    }
}

/// The effect of the library that explains most beside the named one, if it comes near.
fn best_rival(step: &Step, effect: &str) -> Option<String> {
    let least = RIVAL_SHARE * step.gain_nats;
    let is_near =
        |rival: &&Rival| !rival.generic && rival.name != effect && rival.gain_nats > least;
    step.rivals.iter().find(is_near).map(|rival| rival.name.clone())
}

/// Names with a size at the end of what the effect can have, or that may be none: the fit wanted something else, and
/// the rival that explains most stands for it.
fn at_their_bounds(found: &mut Found) {
    let half = half_interval(&found.comparison, &found.noise.hyper);
    for step in &mut found.steps {
        let Some(effect) = new_name(step).map(str::to_owned) else { continue };
        // What leans bound is told by them.
        if Role::MomentumDrag.is_of(&effect) {
            continue;
        }
        let own = found.parameters.iter().zip(&found.values);
        let mut own = own.filter(|(parameter, _)| parameter.effect == effect).enumerate();
        let is_in_doubt =
            |(place, (parameter, (value, se))): (usize, (&Parameter, &(f64, f64)))| {
                let (low, high) = parameter.bounds;
                let near = AT_BOUND * (high - low);
                // The first parameter of an effect is its size.
                let may_be_none = place == 0 && value.abs() < half * se;
                may_be_none || !(low + near..=high - near).contains(value)
            };
        if own.any(is_in_doubt) {
            let other = best_rival(step, &effect);
            doubt(step, other);
        }
    }
}

/// Names beside something unknown that may be the same: what was found together with it, and what depends on the same
/// and explains a seventh as much; a step in time sets the climbs that were flown before it against those after it. An effect that
/// the model has, found after it with another size, may be what the free shape leaves of the unknown.
fn beside_something_unknown(steps: &mut [Step]) {
    let unknown: Vec<(usize, Dependence, f64)> = steps
        .iter()
        .enumerate()
        .filter_map(|(place, step)| match &step.finding {
            Finding::Unknown { depends_on, .. } => Some((place, *depends_on, step.gain_nats)),
            Finding::Name { .. } | Finding::Class { .. } => None,
        })
        .collect();
    for (place, step) in steps.iter_mut().enumerate() {
        let Some(effect) = lone_name(step) else { continue };
        let is_new = new_name(step).is_some();
        let near = unknown.iter().find(|(of, depends_on, gain_nats)| {
            let is_step = *depends_on == Dependence::Step;
            let alike = depends_on.may_show(effect) || is_step && depends_on_climb(effect);
            let is_after = *of < place && (is_new || alike);
            is_after || is_new && alike && *gain_nats > UNKNOWN_SHARE * step.gain_nats
        });
        let other = near.map(|(_, depends_on, _)| depends_on.name().to_owned());
        doubt(step, other);
    }
}

/// Names that are small beside a larger finding that depends on the same: the larger one's form may be another.
fn beside_something_larger(steps: &mut [Step]) {
    let sizes: Vec<(String, f64)> = steps
        .iter()
        .filter_map(|step| Some(((*step.finding.effects().first()?).to_owned(), step.size_us)))
        .collect();
    for step in steps {
        let Some(effect) = new_name(step).map(str::to_owned) else { continue };
        let larger = sizes.iter().find(|(other, size_us)| {
            step.size_us < SMALL * size_us && depend_on_the_same(&effect, other)
        });
        doubt(step, larger.map(|(other, _)| other.clone()));
    }
}

/// Motions of the air: no vehicle lacks them, and they can stand for what a model lacks. They are told with what explains
/// most beside them, of whatever kind, or else with something unknown that depends on the height as they do.
fn beside_what_the_air_may_be(steps: &mut [Step]) {
    for step in steps {
        let Some(motion) = new_name(step).filter(|name| find(name).is_none()) else { continue };
        let motion = motion.to_owned();
        let best = step.rivals.iter().find(|rival| rival.name != motion);
        let height = || Dependence::Height.name().to_owned();
        let other = best.map_or_else(height, |rival| rival.name.clone());
        doubt(step, [other]);
    }
}

/// Names beside what is left, if that depends on the same and explains a fair share of what the name does: an effect is
/// named alone only if it leaves nothing of its kind. What is left may be no finding because it hardly matters, or because only
/// the scatter between drones shows it.
fn beside_what_is_left(steps: &mut [Step], rest: &Rest) {
    match Dependence::of(&rest.candidate) {
        Some(depends_on) => beside_a_shape_that_is_left(steps, rest, depends_on),
        None => beside_an_effect_that_is_left(steps, rest),
    }
}

/// Names, of new effects and of other sizes than the model's, beside an effect that is left.
fn beside_an_effect_that_is_left(steps: &mut [Step], rest: &Rest) {
    for step in steps {
        let Some(effect) = lone_name(step) else { continue };
        let least_nats = rest.threshold_nats.max(RIVAL_SHARE * step.gain_nats);
        let is_other = rest.candidate != effect && depend_on_the_same(&rest.candidate, effect);
        let is_left = is_other && rest.gain_nats > least_nats;
        doubt(step, is_left.then(|| rest.candidate.clone()));
    }
}

fn beside_a_shape_that_is_left(steps: &mut [Step], rest: &Rest, depends_on: Dependence) {
    for step in steps {
        let Some(effect) = lone_name(step) else { continue };
        // Bodies and rotors feel the whole air: one thing may show in the climb and, by another form, in the wind.
        let may_be = depends_on.may_show(effect) || depends_on.is_of_air() && is_of_air(effect);
        let (least_nats, share) = if depends_on.is_of(Signal::Climb) && depends_on_climb(effect) {
            (LEFT_NATS, LEFT_SHARE)
        } else {
            (FREE_FLOOR_NATS.max(rest.threshold_nats), RIVAL_SHARE)
        };
        let is_left = may_be && rest.gain_nats > least_nats.max(share * step.gain_nats);
        doubt(step, is_left.then(|| depends_on.name().to_owned()));
    }
}

/// A drag of the rotors where no leg of known speed over ground told the wind. Momentum drag is inflow along the rotors' axis, which it
/// is told with; ArduPilot's own frame has it by its equations. In wind a body's drag is of the same form as either, as the square of a
/// speed that hardly changes is, and each reads another wind from the leans.
fn beside_inflow_and_drag_of_the_body(found: &mut Found) {
    let comparison = &found.comparison;
    if comparison.is_foreign() || comparison.wind.measured.is_some() {
        return;
    }
    let [x_mps, y_mps] = comparison.wind.mean_mps;
    let is_windy = x_mps.hypot(y_mps) >= LEAST_WIND_MPS;
    let names = |roles: &[Role]| -> Vec<String> {
        roles.iter().filter_map(|role| role.place()).map(|place| place.name().to_owned()).collect()
    };
    let bodies = if is_windy { names(&[Role::BodyDragTop, Role::FaceDragTop]) } else { Vec::new() };
    let has_own = found.vehicle.airframe.sitl.is_some();
    let inflow = if has_own { Vec::new() } else { names(&[Role::InflowShare]) };
    for step in &mut found.steps {
        if new_name(step).is_some_and(|effect| Role::MomentumDrag.is_of(effect)) {
            doubt(step, inflow.iter().chain(&bodies).cloned());
        } else if step.finding.effects().first().is_some_and(|first| Role::RotorDrag.is_of(first)) {
            // A class already: it lies across the rotors only, or along them as well.
            join(step, &bodies);
        }
    }
}

/// Adds names to a class, or makes one of a name.
fn join(step: &mut Step, others: &[String]) {
    let Finding::Class { effects, .. } = &mut step.finding else {
        return doubt(step, others.iter().cloned());
    };
    let new: Vec<String> = others.iter().filter(|one| !effects.contains(one)).cloned().collect();
    effects.extend(new);
}

/// Names of what was found after a class, and depends on the same: which effect the class is decides what form of it was taken
/// away, and so what is left.
fn beside_a_class(steps: &mut [Step]) {
    let classes = classes(steps);
    for (place, step) in steps.iter_mut().enumerate() {
        let Some(effect) = lone_name(step).map(str::to_owned) else { continue };
        let before = classes.iter().filter(|(of, _)| *of < place);
        let mut firsts = before.filter_map(|(_, effects)| effects.first());
        let first = firsts.find(|first| **first != effect && depend_on_the_same(first, &effect));
        doubt(step, first.cloned());
    }
}

/// Names of what depends on the wind, beside a class that leans tell: which drag it is decides the wind that the pulse is held
/// against. They are told with the first of the drags.
pub(super) fn beside_what_leans_tell(steps: &mut [Step], leans: Option<&Step>) {
    let Some(Finding::Class { effects, .. }) = leans.map(|step| &step.finding) else { return };
    for step in steps {
        let Some(effect) = lone_name(step).map(str::to_owned) else { continue };
        let is_of_wind = Dependence::Wind.may_show(&effect);
        let other = effects.first().filter(|first| **first != effect && is_of_wind);
        doubt(step, other.cloned());
    }
}

/// What changes the pulse by more than the whole gap, us (rms), beside a finding that depends on the same: each takes away what the
/// other one has too much, and what is left of both may be one thing that neither is. So names are classes, and either may be none.
pub(super) fn undone_by_another(steps: &mut [Step], gap_us: f64) {
    let first = |step: &Step| step.finding.effects().first().map(|&first| first.to_owned());
    let firsts: Vec<Option<String>> = steps.iter().map(first).collect();
    let mut undone = Vec::new();
    for (place, step) in steps.iter_mut().enumerate() {
        let Some(effect) = &firsts[place] else { continue };
        let is_other = |other: &String| other != effect && depend_on_the_same(effect, other);
        let other = firsts.iter().position(|other| other.as_ref().is_some_and(is_other));
        if let Some(other) = other.filter(|_| step.size_us > UNDONE * gap_us) {
            doubt(step, firsts[other].clone());
            undone.extend([place, other]);
        }
    }
    if undone.is_empty() {
        return;
    }
    what_another_finding_may_be(steps);
    for place in undone {
        let (Finding::Name { parameters, .. } | Finding::Class { parameters, .. }) =
            &mut steps[place].finding
        else {
            continue;
        };
        for Fitted { value, before, .. } in parameters {
            let none = before.unwrap_or_default();
            (value.low, value.high) = (value.low.min(none), value.high.max(none));
        }
    }
}

/// Names of what another finding is in doubt to be: one effect does not explain two things, and what the other one is decides
/// how much of this is left.
fn what_another_finding_may_be(steps: &mut [Step]) {
    let classes = classes(steps);
    for step in steps {
        let Some(effect) = lone_name(step).map(str::to_owned) else { continue };
        let class = classes.iter().map(|(_, effects)| effects).find(|one| one.contains(&effect));
        let others = class.into_iter().flatten().filter(|other| **other != effect);
        doubt(step, others.cloned());
    }
}

/// Names in a flight of which much is left that nothing explains: it may be one thing that neither the name nor its best
/// rival is.
pub(super) fn beside_what_nothing_explains(steps: &mut [Step]) {
    for step in steps {
        let Some(effect) = new_name(step).map(str::to_owned) else { continue };
        let other = best_rival(step, &effect);
        doubt(step, other);
    }
}

/// Names that a free shape, which could not be taken in, is left beside: an effect is named alone only if it leaves
/// nothing of its kind.
pub(super) fn beside_what_was_taken_back(steps: &mut [Step], free: Option<&Step>) {
    let Some(Step { finding: Finding::Unknown { depends_on, .. }, .. }) = free else { return };
    let looks = |name: &str| depends_on.may_show(name);
    for step in steps {
        let Some(effect) = new_name(step).filter(|effect| looks(effect)) else { continue };
        let near = step.gain_nats - CONTEST_MARGINS * margin_nats(step.gain_nats);
        let rivals = step.rivals.iter().filter(|rival| {
            !rival.generic && rival.name != effect && rival.gain_nats > near && looks(&rival.name)
        });
        let others: Vec<String> = rivals.map(|rival| rival.name.clone()).collect();
        doubt(step, others);
    }
}

#[cfg(test)]
mod tests {
    use super::super::compare::lean_law;
    use super::super::data::Group;
    use super::super::lean::Measured;
    use super::super::trial::{self, name};
    use super::super::verdict::Interval;
    use super::*;
    use crate::gap::refine::size_of;
    use crate::vehicle::library;

    fn step(finding: Finding, gain_nats: f64, size_us: f64, rivals: &[&str]) -> Step {
        let rivals: Vec<(&str, f64)> = rivals.iter().map(|name| (*name, 9.0)).collect();
        Step { size_us, ..trial::step(finding, gain_nats, &rivals) }
    }

    fn unknown(depends_on: Dependence) -> Finding {
        Finding::Unknown { depends_on, formula: None }
    }

    fn class(effects: &[&str]) -> Finding {
        let effects = effects.iter().map(|one| (*one).to_owned()).collect();
        Finding::Class { effects, parameters: Vec::new() }
    }

    fn told(steps: &[Step]) -> Vec<String> {
        steps.iter().map(|step| step.finding.effects().join(" ")).collect()
    }

    #[test]
    fn a_size_at_its_end_or_that_may_be_none_names_nothing_alone() {
        let data = trial::data(2, |_, _| 0.0);
        let of_gain = |gain_nats: f64, value: f64, se: f64| {
            let mut found = Found::nothing(trial::comparison(&data));
            let rivals = &["thrust-curve", "battery"];
            found.steps = vec![step(name("thrust-curve"), gain_nats, 9.0, rivals)];
            found.parameters = size_of("thrust-curve", "expo").into_iter().collect();
            found.values = vec![(value, se)];
            at_their_bounds(&mut found);
            told(&found.steps).remove(0)
        };
        let of = |value: f64, se: f64| of_gain(35.0, value, se);
        assert_eq!(of(0.5, 0.05), "thrust-curve");
        assert_eq!(of(1.0, 0.05), "thrust-curve battery", "the end of its range");
        assert_eq!(of(0.5, 0.4), "thrust-curve battery", "it may be none");
        assert_eq!(of_gain(37.0, 1.0, 0.05), "thrust-curve", "no rival is near");
    }

    #[test]
    fn what_changes_with_time_is_told_from_a_curve_by_speeds_that_are_flown_again() {
        let of = |is_flown_again: bool| {
            let mut data = trial::data(3, |_, _| 0.0);
            let Group { bins, measured, .. } = &mut data.groups[0];
            for bin in bins.iter_mut().filter(|bin| is_flown_again && bin.segment > 3) {
                bin.velocity_mps[2] /= bin.climb_mps().abs();
            }
            for (one, bin) in measured.iter_mut().flat_map(|values| values.iter_mut().zip(&*bins)) {
                one.climb_mps = bin.climb_mps();
                one.pulse_us += bin.climb_mps() * bin.middle_s();
            }
            let mut found = Found::nothing(trial::comparison(&data));
            found.steps = vec![step(name("response-drift"), 35.0, 9.0, &[])];
            found.parameters = size_of("response-drift", "slope_us").into_iter().collect();
            found.values = vec![(300.0, 1.0)];
            beside_a_curve(&mut found).unwrap();
            told(&found.steps).remove(0)
        };
        assert_eq!(of(false), "response-drift climb");
        assert_eq!(of(true), "response-drift");
    }

    #[test]
    fn what_is_beside_something_unknown_is_not_named_alone() {
        let of = |first: Finding, gain_nats: f64, then: Finding| {
            let mut steps = vec![step(first, gain_nats, 9.0, &[]), step(then, 50.0, 9.0, &[])];
            beside_something_unknown(&mut steps);
            told(&steps)
        };
        let climb = || unknown(Dependence::Climb);
        assert_eq!(of(name("face-drag"), 351.0, climb())[0], "face-drag");
        assert_eq!(of(name("face-drag"), 349.0, climb())[0], "face-drag climb");
        assert_eq!(
            of(name("battery"), 99.0, climb())[0],
            "battery",
            "it depends on something else"
        );
        assert_eq!(of(climb(), 9.0, name("battery"))[1], "battery climb", "found together with it");
        let in_a_step = || unknown(Dependence::Step);
        assert_eq!(of(name("face-drag"), 349.0, in_a_step())[0], "face-drag step");
        assert_eq!(of(name("face-drag"), 351.0, in_a_step())[0], "face-drag");
        let lift = of(name("translational-lift"), 99.0, in_a_step());
        assert_eq!(lift[0], "translational-lift step", "it depends on the climb as well");
    }

    #[test]
    fn another_size_beside_something_unknown_may_be_a_part_of_it() {
        let again = |effect: &str| {
            let (effect, parameters) = (effect.to_owned(), Vec::new());
            Finding::Name { effect, parameters, was_there: true }
        };
        let of = |first: Finding, then: Finding| {
            let mut steps = vec![step(first, 60.0, 9.0, &[]), step(then, 50.0, 9.0, &[])];
            beside_something_unknown(&mut steps);
            told(&steps)
        };
        let product = || unknown(Dependence::ClimbTime);
        assert_eq!(of(product(), again("parasitic-drag"))[1], "parasitic-drag climb-time");
        assert_eq!(of(product(), again("mass-spread"))[1], "mass-spread", "told by offsets");
        assert_eq!(of(again("parasitic-drag"), product())[0], "parasitic-drag", "found before");
    }

    #[test]
    fn what_was_found_after_a_class_of_its_kind_is_not_named_alone() {
        let after = |effect: &str| {
            let drags = step(class(&["face-drag", "momentum-drag"]), 129.0, 20.0, &[]);
            let mut steps = vec![drags, step(name(effect), 26.0, 12.0, &[])];
            beside_a_class(&mut steps);
            told(&steps).remove(1)
        };
        assert_eq!(after("translational-lift"), "translational-lift face-drag");
        assert_eq!(after("face-drag"), "face-drag", "found again with another size");
        assert_eq!(after("motor-thermal"), "motor-thermal", "it depends on something else");
        let drags = step(class(&["face-drag", "momentum-drag"]), 26.0, 12.0, &[]);
        let mut steps = vec![step(name("translational-lift"), 129.0, 20.0, &[]), drags];
        beside_a_class(&mut steps);
        assert_eq!(told(&steps)[0], "translational-lift", "found before");
    }

    #[test]
    fn what_leans_leave_in_doubt_is_in_doubt_in_the_pulse() {
        let beside = |effect: &str, leans: &[&str]| {
            let mut steps = vec![step(name(effect), 38.0, 20.0, &[])];
            let leans = match leans {
                [one] => name(one),
                several => class(several),
            };
            beside_what_leans_tell(&mut steps, Some(&step(leans, 15.0, 12.0, &[])));
            told(&steps).concat()
        };
        let drags = ["blade-flapping", "momentum-drag"];
        assert_eq!(beside("translational-lift", &drags), "translational-lift blade-flapping");
        assert_eq!(beside("translational-lift", &drags[..1]), "translational-lift", "a name");
        let bodies = ["parasitic-drag", "face-drag"];
        assert_eq!(beside("translational-lift", &bodies), "translational-lift parasitic-drag");
        for effect in ["battery", "thrust-curve"] {
            assert_eq!(beside(effect, &bodies), effect, "it does not depend on the wind");
        }
        let mut steps = vec![step(name("translational-lift"), 38.0, 20.0, &[])];
        beside_what_leans_tell(&mut steps, None);
        assert_eq!(told(&steps).concat(), "translational-lift");
    }

    #[test]
    fn what_another_finding_may_be_is_not_named_alone() {
        let of = |effects: &[&str]| {
            let inflow = step(name("rotor-inflow"), 129.0, 20.0, &[]);
            let mut steps = vec![inflow, step(class(effects), 26.0, 12.0, &[])];
            what_another_finding_may_be(&mut steps);
            told(&steps)
        };
        let both = ["rotor-inflow response-drift", "response-drift rotor-inflow"];
        assert_eq!(of(&["response-drift", "rotor-inflow"]), both);
        let three = of(&["response-drift", "rotor-inflow", "climb"]);
        assert_eq!(three[0], "rotor-inflow response-drift climb");
        assert_eq!(of(&["response-drift", "climb"])[0], "rotor-inflow");
    }

    #[test]
    fn what_is_small_beside_its_like_may_be_its_form() {
        let of = |effect: &str, size_us: f64| {
            let small = step(name(effect), 20.0, size_us, &["vortex-ring"]);
            let mut steps = vec![step(name("rotor-inflow"), 300.0, 30.0, &[]), small];
            beside_something_larger(&mut steps);
            assert_eq!(told(&steps)[0], "rotor-inflow");
            told(&steps).remove(1)
        };
        assert_eq!(of("thrust-curve", 6.1), "thrust-curve");
        assert_eq!(of("thrust-curve", 5.9), "thrust-curve rotor-inflow");
        assert_eq!(of("motor-thermal", 5.9), "motor-thermal", "it depends on something else");
    }

    #[test]
    fn a_second_effect_of_a_kind_must_show_in_the_means_as_a_shape_must() {
        let of = |effect: &str, plain: f64| {
            let steps = [step(name("face-drag"), 108.0, 15.0, &[])];
            form_of_what_was_found(&steps, effect, plain)
        };
        assert_eq!(of("thrust-curve", 14.0), Some("face-drag".to_owned()));
        assert_eq!(of("thrust-curve", 14.0 + 1e-9), None);
        assert_eq!(of("face-drag", 9.0), None, "found again with another size");
        assert_eq!(of("motor-thermal", 9.0), None, "it depends on something else");
        assert_eq!(form_of_what_was_found(&[], "thrust-curve", 9.0), None, "the first");
    }

    #[test]
    fn a_motion_of_the_air_is_never_named_alone() {
        let of = |effect: &str, rivals: &[&str]| {
            let mut steps = [step(name(effect), 28.0, 9.0, rivals)];
            beside_what_the_air_may_be(&mut steps);
            told(&steps).concat()
        };
        let seen = ["updraft-profile", "climb", "height"];
        assert_eq!(of("updraft-profile", &seen), "updraft-profile climb");
        assert_eq!(of("updraft-profile", &[]), "updraft-profile height");
        assert_eq!(of("battery", &seen), "battery", "an effect of the vehicle");
    }

    #[test]
    fn what_a_shape_is_left_beside_has_the_rivals_of_that_kind() {
        let free = step(unknown(Dependence::Climb), 30.0, 9.0, &[]);
        let mut steps = vec![step(name("face-drag"), 15.0, 9.0, &["vortex-ring", "battery"])];
        beside_what_was_taken_back(&mut steps, Some(&free));
        assert_eq!(told(&steps), ["face-drag vortex-ring"]);
    }

    #[test]
    fn a_flight_that_is_not_explained_names_nothing_alone() {
        let of = |gain_nats: f64| {
            let mut steps = [step(name("face-drag"), gain_nats, 9.0, &["battery", "thrust-curve"])];
            beside_what_nothing_explains(&mut steps);
            told(&steps).concat()
        };
        assert_eq!(of(30.0), "face-drag battery");
        assert_eq!(of(40.0), "face-drag", "no rival is near");
    }

    #[test]
    fn a_name_that_leaves_much_of_its_kind_is_a_class() {
        let of = |effect: &str, own_nats: f64, candidate: &str, gain_nats: f64| {
            let mut steps = [step(name(effect), own_nats, 9.0, &[])];
            let candidate = candidate.to_owned();
            beside_what_is_left(&mut steps, &Rest { gain_nats, candidate, ..Rest::default() });
            told(&steps).concat()
        };
        let told_with =
            |candidate: &str, gain_nats: f64| of("face-drag", 84.0, candidate, gain_nats);
        assert_eq!(told_with("climb", 12.0), "face-drag");
        assert_eq!(told_with("climb", 12.0 + 1e-9), "face-drag climb");
        assert_eq!(told_with("wind", 21.0), "face-drag");
        assert_eq!(told_with("wind", 21.0 + 1e-9), "face-drag wind", "a body feels the whole air");
        assert_eq!(told_with("voltage", 90.0), "face-drag", "a drag has no battery");
        assert_eq!(told_with("rotor-inflow", 21.0), "face-drag");
        assert_eq!(told_with("rotor-inflow", 21.0 + 1e-9), "face-drag rotor-inflow");
        assert_eq!(told_with("face-drag", 90.0), "face-drag", "another size of the same");
        assert_eq!(told_with("motor-thermal", 90.0), "face-drag", "it depends on something else");
        assert_eq!(of("face-drag", 20.0, "climb", 10.0), "face-drag", "chance gains as much");
        assert_eq!(of("face-drag", 20.0, "wind", 14.0), "face-drag", "chance gains as much");
        let curve = of("thrust-curve", 84.0, "climb-time", 67.0);
        assert_eq!(curve, "thrust-curve climb-time", "it feels the climb by the model's pulse");
    }

    #[test]
    fn another_size_that_leaves_a_shape_of_its_kind_is_a_class() {
        let resized = |effect: &str| Finding::Name {
            effect: effect.to_owned(),
            parameters: Vec::new(),
            was_there: true,
        };
        let of = |candidate: &str, gain_nats: f64| {
            let mut steps = [step(resized("rotor-inflow"), 32.0, 9.0, &[])];
            let candidate = candidate.to_owned();
            beside_what_is_left(&mut steps, &Rest { gain_nats, candidate, ..Rest::default() });
            told(&steps).concat()
        };
        assert_eq!(of("climb", 23.0), "rotor-inflow climb");
        assert_eq!(of("climb", 9.0), "rotor-inflow", "chance gains as much");
        assert_eq!(of("voltage", 23.0), "rotor-inflow");
    }

    #[test]
    fn what_is_larger_than_the_gap_is_undone_by_another() {
        let of = |sizes_us: [f64; 2], effects: [&str; 2]| {
            let one = |place: usize| step(name(effects[place]), 40.0, sizes_us[place], &[]);
            let mut steps = [one(0), one(1)];
            undone_by_another(&mut steps, 20.0);
            told(&steps).join(", ")
        };
        let drag_and_curve = ["face-drag", "thrust-curve"];
        assert_eq!(of([18.0, 25.0], drag_and_curve), "face-drag, thrust-curve", "not larger");
        let both = "face-drag thrust-curve, thrust-curve face-drag";
        assert_eq!(of([18.0, 25.1], drag_and_curve), both, "neither stands alone");
        let of_time = of([18.0, 25.1], ["motor-thermal", "face-drag"]);
        assert_eq!(of_time, "motor-thermal, face-drag", "it depends on something else");
    }

    #[test]
    fn either_of_two_that_undo_each_other_may_be_none() {
        let size = |value: f64, before: Option<f64>| Fitted {
            name: String::new(),
            unit: String::new(),
            value: Interval { value, low: value - 0.1, high: value + 0.1 },
            before,
        };
        let one = |effect: &str, size_us: f64, fitted: Fitted| {
            let mut step = step(name(effect), 40.0, size_us, &[]);
            if let Finding::Name { parameters, .. } = &mut step.finding {
                parameters.push(fitted);
            }
            step
        };
        let intervals = |gap_us: f64| {
            let mut steps = [
                one("thrust-curve", 10.0, size(0.9, None)),
                one("rotor-inflow", 21.0, size(0.2, Some(0.4))),
                one("battery", 5.0, size(0.3, None)),
            ];
            undone_by_another(&mut steps, gap_us);
            steps.map(|step| {
                let (Finding::Name { parameters, .. } | Finding::Class { parameters, .. }) =
                    step.finding
                else {
                    return (0.0, 0.0);
                };
                (parameters[0].value.low, parameters[0].value.high)
            })
        };
        assert_eq!(intervals(12.0), [(0.0, 1.0), (0.1, 0.4), (0.3 - 0.1, 0.3 + 0.1)]);
        assert_eq!(intervals(20.0)[0], (0.8, 1.0));
        // Of what is a class already, too.
        let both = ["thrust-curve".to_owned(), "face-drag".to_owned()];
        let of = |effects: &[String], size_us: f64, value: f64| {
            let finding =
                Finding::Class { effects: effects.to_vec(), parameters: vec![size(value, None)] };
            step(finding, 40.0, size_us, &[])
        };
        let turned = [both[1].clone(), both[0].clone()];
        let mut steps = [of(&both, 10.0, 0.9), of(&turned, 21.0, 0.4)];
        undone_by_another(&mut steps, 12.0);
        for step in steps {
            let Finding::Class { parameters, .. } = step.finding else { panic!("a class") };
            assert_eq!(parameters[0].value.low, 0.0);
        }
    }

    #[test]
    fn a_class_is_joined_by_who_is_not_in_it() {
        let mut both = step(class(&["blade-flapping", "momentum-drag"]), 20.0, 13.0, &[]);
        join(&mut both, &["momentum-drag".to_owned(), "face-drag".to_owned()]);
        assert_eq!(told(&[both]), ["blade-flapping momentum-drag face-drag"]);
    }

    #[test]
    fn momentum_drag_without_legs_may_be_inflow_and_a_bodys() {
        let data = trial::data(2, |_, _| 0.0);
        let of_vehicle = |vehicle: &str, effect: &str, wind_mps: [f64; 2], measured: bool| {
            let mut found = Found::nothing(trial::comparison(&data));
            found.vehicle = library::builtin(vehicle).unwrap();
            let law = lean_law(&found.comparison.vehicle, 0.0, 0.0);
            let wind = &mut found.comparison.wind;
            wind.mean_mps = wind_mps;
            wind.measured = measured.then_some(Measured { law, linear_se: 1e-3, misfit_nats: 0.0 });
            found.steps = vec![step(name(effect), 118.0, 19.0, &[])];
            beside_inflow_and_drag_of_the_body(&mut found);
            told(&found.steps).concat()
        };
        let of = |effect: &str, wind_mps: [f64; 2], measured: bool| {
            of_vehicle("airsim-generic-quad", effect, wind_mps, measured)
        };
        let wind = [3.0, -4.0];
        let all = "momentum-drag rotor-inflow parasitic-drag face-drag";
        assert_eq!(of("momentum-drag", wind, false), all);
        assert_eq!(of("momentum-drag", wind, true), "momentum-drag", "legs told the wind");
        let calm = of("momentum-drag", [1.0, -1.0], false);
        assert_eq!(calm, "momentum-drag rotor-inflow", "hardly any wind");
        assert_eq!(of("rotor-inflow", wind, false), "rotor-inflow");
        let across = "blade-flapping parasitic-drag face-drag";
        assert_eq!(of("blade-flapping", wind, false), across);
        assert_eq!(of("blade-flapping", wind, true), "blade-flapping", "legs told the wind");
        let own = of_vehicle("arducopter-sitl", "momentum-drag", [1.0, -1.0], false);
        assert_eq!(own, "momentum-drag", "the frame of ArduPilot's simulator has it on all axes");
    }
}
