//! One effect in place of all that was found: taken into the model, flown in its own updraft, and fitted.
//!
//! A round of the search holds effects against each other in the updraft and the air that it has settled in, and the first
//! finding shapes all that come after it. Where the truth is another effect in another updraft, several findings can stand
//! for it, or the wrong one alone. So the end of a search is held against each single effect that explained much of it.

use rayon::prelude::*;

use super::contest::PRODUCT_NATS;
use super::decide::{CLASS_NATS, margin_nats};
use super::dependence::{Dependence, depends_on_climb, depends_on_no_more};
use super::error::GapError;
use super::explain::{Found, Left, Only, Options, Searched, Setting};
use super::search::{FLOOR_NATS, FREE_FLOOR_NATS};
use super::verdict::{Finding, Step, is_strong_wind};
use crate::effects::{Class, Definition, LIBRARY, Role, Signal, Sought, find};

/// Effects that are flown in place of what was found, at most. Chosen to bound the time.
const MOST: usize = 5;
/// An effect that explained less than this share of what the best did is none that may stand for it. Chosen: what is
/// flown in an updraft half a metre per second off explains a fifth less.
const SHARE: f64 = 0.5;

/// Effects that explain a flight in updrafts which differ by more are told apart only by how each bends the curve, m/s: one
/// must explain clearly more. Chosen: twice what a flight tells of its updraft.
const OTHER_AIR_MPS: f64 = 0.1;

/// An effect of the climb is not named alone where another one explains less by no more than this, nats, and at least this share
/// of what it does: how slow the pulse's noise is and how drones scatter are known to as many nats, and an updraft of its own lets
/// each effect take most of what another one is. Chosen after five foreign flights in which a wrong one was 14 to 22 nats
/// ahead, with 76 to 88 % left to the right one; where the right one was ahead, none of 40 others came as near.
const NOISE_NATS: f64 = 25.0;
/// See [`NOISE_NATS`].
const NOISE_SHARE: f64 = 0.75;

/// A search that ended, and how well its findings explain the flight, nats.
struct Ended {
    found: Found,
    nats: f64,
    /// The effect that alone was searched for, if it was one.
    only: Option<Only>,
    /// What was left to be looked for.
    left: Option<Left>,
}

impl Ended {
    /// A search with these options; `None`: it found more or less than was asked for, or not in the same bins.
    fn of(
        options: &Options,
        bins: &[usize],
        flown: impl Fn(&Options) -> Result<Searched, GapError>,
    ) -> Option<Self> {
        let Searched { found, left } = flown(options).ok()?;
        let is_alike = found.steps.len() == options.most_steps
            && found.comparison.data.bins_of_groups() == bins;
        let nats = || found.explains().ok().filter(|nats| nats.is_finite());
        let nats = is_alike.then(nats).flatten()?;
        Some(Self { found, nats, only: options.only, left })
    }
}

/// What is to be told: a search that ended, and the names of its finding if that is the only one.
struct Decided {
    ended: Ended,
    names: Vec<String>,
}

/// What explains a flight best: what was found, one effect in its place, or nothing. Effects that explain it as well as a
/// single finding are told as a class with it. `by_leans` says whether leans tell a drag of the rotors, or nearly do.
///
/// # Errors
/// Effects of a vehicle that are not valid.
pub(super) fn fewer_instead(
    found: Found,
    options: &Options,
    by_leans: bool,
    setting: Setting<'_>,
) -> Result<Found, GapError> {
    let bins = found.comparison.data.bins_of_groups();
    let flown = |options: &Options| setting.search(options);
    let ended = |options: &Options| Ended::of(options, &bins, flown);
    let nothing = Options { most_steps: 0, each_flown: true, ..*options };
    let mut effects = rivals(&found.steps, by_leans);
    // What was found goes on where others are beaten, so it takes longest, and begins first.
    let known = leads(&found);
    effects.sort_by_key(|effect| !known.iter().any(|one| one == effect));
    let (updraft_mps, nats) = (found.updraft_mps, found.explains()?);
    let by = |only: Only| alone(options, only);
    let each = effects
        .into_iter()
        .map(|effect| by(Only { effect, updraft_mps, beaten_nats: nats, is_bent: false }));
    let all: Vec<Options> = each.chain([nothing]).collect();
    let mut others: Vec<Ended> = all.par_iter().filter_map(ended).collect();
    others.sort_by(|a, b| b.nats.total_cmp(&a.nats));
    let Decided { ended, names } = decided(Ended { found, nats, only: None, left: None }, others);
    let mut found = match (ended.only, ended.left) {
        // What is left beside it is sought only now.
        (Some(only), Some(left)) => {
            setting.look_for_rest(&Options { rest: true, ..by(only) }, left)?
        }
        _ => ended.found,
    };
    if let [step] = &mut found.steps[..] {
        step.finding = of(names, &step.finding);
    }
    Ok(found)
}

/// An effect with which the model as it is comes so much nearer to the logs need not explain more than any other: what else
/// explains them is that nearly all of a doubted wind was misread. Chosen.
const MUCH_NEARER: f64 = 0.5;
/// Drags by which a drone reads another wind from its leans.
const WIND_READERS: [Role; 2] = [Role::BodyDragTop, Role::RotorDrag];

/// One effect in place of nothing, where it explains a flight clearly better in the updraft and the wind that go with it. In a
/// strong wind that was read without a drag, what nobody knows of that wind hides the drag, and so it may where a drag, or an effect of
/// the climb, explains enough to be named and moves the pulse by too little; and a shape of the climb that could
/// not be taken in may be an effect in another updraft. A curve of the thrust is always asked for where it bends the response as
/// another updraft does. An effect with which the raw gap falls by half need not explain it
/// clearly better. `flown` searches with these options, and `rest` looks for what is left.
///
/// # Errors
/// Effects of a vehicle that are not valid.
pub(super) fn effect_after_all(
    found: Found,
    options: &Options,
    flown: impl Fn(&Options) -> Result<Searched, GapError> + Sync,
    rest: impl FnOnce(&Options, Left) -> Result<Found, GapError>,
) -> Result<Found, GapError> {
    let Found { comparison, rest: end, .. } = &found;
    let wind = &comparison.wind;
    let passes = end.gain_nats > end.threshold_nats;
    let reads_wind = WIND_READERS.iter().any(|role| role.is_of(&end.candidate));
    let is_like_drag = find(&end.candidate).is_some_and(|one| is_of_climb(one.definition()));
    let is_misread = wind.measured.is_none()
        && (is_strong_wind(wind.mean_mps) || passes && (reads_wind || is_like_drag));
    let is_left = passes && Dependence::of(&end.candidate) == Some(Dependence::Climb);
    if !found.steps.is_empty() || !options.updraft {
        return Ok(found);
    }
    let drags = WIND_READERS.iter().filter(|_| is_misread).filter_map(|role| role.place());
    let mut effects: Vec<&'static str> = drags.map(|place| place.name()).collect();
    add_new(&mut effects, shapes().filter(|name| is_left && depends_on_climb(name)));
    let hinted = effects.clone();
    add_new(&mut effects, Role::ThrustExpo.place().map(|place| place.name()));
    let bins = comparison.data.bins_of_groups();
    let price_nats = if is_left { FREE_FLOOR_NATS } else { FLOOR_NATS };
    let (updraft_mps, without_nats) = (found.updraft_mps, found.explains()?);
    let raw_us = comparison.raw_gap_us()?;
    let ended = |effect: &&'static str| {
        let beaten_nats = without_nats + price_nats;
        let only = Only { effect, updraft_mps, beaten_nats, is_bent: !hinted.contains(effect) };
        Ended::of(&alone(options, only), &bins, &flown)
    };
    let is_better = |it: &Ended| {
        let with_us = it.found.comparison.raw_gap_us().unwrap_or(f64::INFINITY);
        it.nats > without_nats + further_price_nats([raw_us, with_us], price_nats)
    };
    let better = effects.par_iter().filter_map(ended).filter(is_better);
    let best = better.reduce_with(|one, other| if other.nats > one.nats { other } else { one });
    match best {
        Some(Ended { only: Some(only), left: Some(left), .. }) => {
            rest(&Options { rest: true, ..alone(options, only) }, left)
        }
        Some(best) => Ok(best.found),
        None => Ok(found),
    }
}

/// What an effect must explain beyond its own price to stand in place of nothing, nats, where it changes the raw gap so, us.
fn further_price_nats([without_us, with_us]: [f64; 2], price_nats: f64) -> f64 {
    if with_us < MUCH_NEARER * without_us { 0.0 } else { price_nats }
}

/// Whether an effect is one of the climb: a battery's load grows in a climb, and yet it goes with time.
fn is_of_climb(effect: &Definition) -> bool {
    depends_on_climb(effect.name) && effect.class != Class::TimeDrift
}

/// Options of a search for one effect alone.
fn alone(options: &Options, only: Only) -> Options {
    Options { only: Some(only), most_steps: 1, replicates: 0, rest: false, ..*options }
}

/// Effects of the library that explained much where something was found, those that explained most first.
fn rivals(steps: &[Step], by_leans: bool) -> Vec<&'static str> {
    // What was found alone has its turn as well, in the updraft in which it explains most.
    let lead = match steps {
        [step] => step.finding.effects().first().and_then(|name| find(name)),
        _ => None,
    };
    let lead = lead.map(|effect| effect.definition().name);
    let mut all: Vec<(f64, &'static str)> = Vec::new();
    for step in steps {
        let effects = || step.rivals.iter().filter(|rival| !rival.generic);
        let most = effects().map(|rival| rival.gain_nats).fold(0.0, f64::max);
        for rival in effects().filter(|rival| rival.gain_nats > SHARE * most) {
            let Some(effect) = find(&rival.name) else { continue };
            all.push((rival.gain_nats, effect.definition().name));
        }
    }
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut names: Vec<&'static str> = Vec::new();
    add_new(&mut names, all.into_iter().map(|(_, name)| name).filter(|name| lead != Some(name)));
    names.truncate(MOST);
    names.extend(lead);
    let unknown: Vec<Dependence> = steps
        .iter()
        .filter_map(|step| match &step.finding {
            Finding::Unknown { depends_on, .. } => Some(*depends_on),
            Finding::Name { .. } | Finding::Class { .. } => None,
        })
        .collect();
    // Of the climb alone, any effect may explain little in this updraft and all in one of its own.
    let begins_with_climb = |step: &Step| {
        let first = step.finding.effects().first().and_then(|name| find(name));
        first.is_some_and(|effect| is_of_climb(effect.definition()))
    };
    if unknown.contains(&Dependence::Climb) || steps.iter().any(begins_with_climb) {
        add_new(&mut names, shapes().filter(|name| depends_on_climb(name)));
    }
    // Along the rotors' axis it is much like inflow and drag, and no round looks for it. Beside a single name it would
    // only be that name's stand-in, unless leans tell a drag of the rotors; what is unknown of the climb may be it as well.
    let axial = [Role::InflowShare, Role::BodyDragTop];
    let is_asked = |name: &&'static str| {
        steps.len() > 1 && axial.iter().any(|role| role.is_of(name)) || Role::RotorDrag.is_of(name)
    };
    let is_unknown = unknown.iter().any(|depends_on| depends_on.is_of(Signal::Climb));
    if by_leans || is_unknown || names.iter().any(is_asked) {
        add_new(&mut names, Role::MomentumDrag.place().map(|place| place.name()));
    }
    names
}

/// Effects of the library that show in the pulse by a shape.
fn shapes() -> impl Iterator<Item = &'static str> {
    let all = LIBRARY.iter().map(|effect| effect.definition());
    all.filter(|one| matches!(one.sought, Sought::Shape { .. })).map(|one| one.name)
}

/// Adds the names that are not there yet.
fn add_new(names: &mut Vec<&'static str>, more: impl IntoIterator<Item = &'static str>) {
    for name in more {
        if !names.contains(&name) {
            names.push(name);
        }
    }
}

/// Holds what was found against fewer findings, best first.
fn decided(there: Ended, mut others: Vec<Ended>) -> Decided {
    let as_it_is = |ended: Ended| Decided { ended, names: Vec::new() };
    let is_single = there.found.steps.len() == 1;
    // Where something would be found after all it is not nothing.
    let is_all = |found: &Found| found.rest.gain_nats <= found.rest.threshold_nats;
    let still = others.iter().position(|other| other.found.steps.is_empty());
    let mut still = still.map(|place| others.remove(place));
    let is_nothing = |still: &Ended| {
        // An effect that no search found must explain clearly more.
        let is_beaten = others.first().is_some_and(|best| best.nats > still.nats + FLOOR_NATS);
        still.nats >= there.nats && is_all(&still.found) && !is_beaten
    };
    if let Some(still) = still.take_if(|still| is_nothing(still)) {
        return as_it_is(still);
    }
    let still = still.map(|it| (it.nats, it.found.updraft_mps));
    let Some(best) = others.first() else { return as_it_is(there) };
    let gain = |of: &Found| of.steps.iter().map(|step| step.gain_nats).fold(0.0, f64::max);
    // One effect that was not found before is simpler than several of its kind, if it explains nearly as much.
    let known = leads(&there.found);
    let is_simpler = |name: &String| {
        !known.contains(name) && known.iter().all(|other| depends_on_no_more(other, name))
    };
    let is_simpler = known.len() > 1 && leads(&best.found).iter().all(is_simpler);
    let simpler_nats = if is_simpler { CLASS_NATS } else { 0.0 };
    let is_instead = best.nats > there.nats - simpler_nats;
    if !is_single && !is_instead {
        return as_it_is(there);
    }
    let is_unknown = there.found.steps.iter().all(|step| step.finding.effects().is_empty());
    if is_unknown && !is_instead {
        return as_it_is(there);
    }
    let told = if is_instead { best } else { &there };
    let (most, margin) = (best.nats.max(there.nats), margin_nats(gain(&told.found)));
    let updraft_mps = told.found.updraft_mps;
    let mut names = Vec::new();
    // The same effect is what it was, wherever it explains more, and so are those that it was not told from.
    let is_same = is_single && leads(&best.found) == known;
    if is_single && (!is_instead || is_same) {
        names.extend(all(&there.found));
    }
    // Who was found first must be beaten clearly.
    let is_beside = is_single && is_instead && there.nats > most - PRODUCT_NATS;
    let beside = is_beside.then(|| leads(&there.found));
    let is_near = |other: &&Ended| {
        let is_in_other_air = (other.found.updraft_mps - updraft_mps).abs() > OTHER_AIR_MPS;
        other.nats > most - if is_in_other_air { margin.max(PRODUCT_NATS) } else { margin }
    };
    let near = others.iter().filter(is_near);
    for name in near.flat_map(|other| all(&other.found)).chain(beside.into_iter().flatten()) {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    // A shape that explains nearly as much is no less likely than one effect in an updraft of its own.
    if is_unknown && is_instead && best.nats < there.nats + CLASS_NATS {
        let shape = there.found.steps.iter().find_map(|step| match &step.finding {
            Finding::Unknown { depends_on, .. } => Some(depends_on.name().to_owned()),
            Finding::Name { .. } | Finding::Class { .. } => None,
        });
        names.extend(shape);
    }
    let is_alone = names.len() == 1;
    if let Some((still_nats, _)) = still {
        let all = others.iter().chain(is_single.then_some(&there));
        names.extend(beside_alone(&names, all, most, still_nats));
    }
    let ended = if is_instead { others.swap_remove(0) } else { there };
    // Elsewhere the model itself explains nearly as much: what the updraft then leaves of the climb is in doubt.
    let is_elsewhere = |(nats, mps): (f64, f64)| {
        ended.nats < nats + PRODUCT_NATS && (mps - ended.found.updraft_mps).abs() > OTHER_AIR_MPS
    };
    if is_alone
        && names.first().is_some_and(|name| depends_on_climb(name))
        && still.is_some_and(is_elsewhere)
    {
        names.push(Dependence::Climb.name().to_owned());
    }
    Decided { ended, names }
}

/// Other effects of the climb that nearly explain the flight as well as the only one that would be named; `most` is how well
/// the best of all does, and `still` how well nothing does, nats.
fn beside_alone<'a>(
    names: &[String],
    others: impl Iterator<Item = &'a Ended>,
    most: f64,
    still: f64,
) -> Vec<String> {
    let mut effects = names.iter().filter(|name| find(name).is_some());
    let (Some(alone), None) = (effects.next(), effects.next()) else { return Vec::new() };
    if !depends_on_climb(alone) {
        return Vec::new();
    }
    let least = (most - NOISE_NATS).max(still + NOISE_SHARE * (most - still));
    let near = others.filter(|other| other.nats > least);
    let mut found: Vec<String> = Vec::new();
    for name in near.flat_map(|other| leads(&other.found)) {
        if name != *alone && depends_on_climb(&name) && !found.contains(&name) {
            found.push(name);
        }
    }
    found
}

/// The first name of each finding.
fn leads(found: &Found) -> Vec<String> {
    let effects = found.steps.iter().map(|step| step.finding.effects());
    effects.filter_map(|names| names.first().map(|name| (*name).to_owned())).collect()
}

/// All names of each finding.
fn all(found: &Found) -> Vec<String> {
    let effects = found.steps.iter().flat_map(|step| step.finding.effects());
    effects.map(str::to_owned).collect()
}

/// A finding with these names, and the sizes that the first of them has.
fn of(names: Vec<String>, finding: &Finding) -> Finding {
    match finding {
        Finding::Name { parameters, .. } | Finding::Class { parameters, .. } if names.len() > 1 => {
            Finding::Class { effects: names, parameters: parameters.clone() }
        }
        other => other.clone(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::trial;
    use super::super::verdict::Rest;
    use super::*;

    /// A search that ended with these effects, the classes among them written with a slash.
    fn ended(nats: f64, findings: &[&str]) -> Ended {
        let data = trial::data(2, |_, _| 0.0);
        let mut found = Found::nothing(trial::comparison(&data));
        found.steps = findings.iter().map(|names| step(names, 20.0, &[])).collect();
        Ended { found, nats, only: None, left: None }
    }

    fn step(names: &str, gain_nats: f64, rivals: &[(&str, f64)]) -> Step {
        let effects: Vec<String> = names.split('/').map(str::to_owned).collect();
        let finding = match &effects[..] {
            [effect] => trial::name(effect),
            _ => Finding::Class { effects, parameters: Vec::new() },
        };
        trial::step(finding, gain_nats, rivals)
    }

    fn told(there: Ended, others: Vec<Ended>) -> Vec<String> {
        let Decided { ended, names } = decided(there, others);
        let own = ended.found.steps.iter().map(|step| step.finding.effects().join("/")).collect();
        if ended.found.steps.len() == 1 && names.len() > 1 { vec![names.join("/")] } else { own }
    }

    #[test]
    fn an_effect_that_explains_more_in_its_own_updraft_stands_instead() {
        let found = || ended(0.0, &["thrust-curve/face-drag"]);
        assert_eq!(told(found(), vec![ended(20.0, &["response-drift"])]), ["response-drift"]);
        // Who was found first must be beaten clearly, others by the margin of a class.
        let others = || vec![ended(12.0, &["response-drift"]), ended(7.0, &["vortex-ring"])];
        assert_eq!(told(found(), others()), ["response-drift/vortex-ring/thrust-curve"]);
        let far = vec![ended(12.0, &["response-drift"]), ended(5.0, &["vortex-ring"])];
        assert_eq!(told(found(), far), ["response-drift/thrust-curve"]);
    }

    #[test]
    fn an_effect_in_another_updraft_must_be_beaten_clearly() {
        let in_air = |nats: f64, effect: &str, updraft_mps: f64| {
            let mut ended = ended(nats, &[effect]);
            ended.found.updraft_mps = updraft_mps;
            ended
        };
        let beside = |nats: f64, updraft_mps: f64| {
            let others = vec![in_air(nats, "vortex-ring", updraft_mps)];
            told(in_air(0.0, "thrust-curve", -0.4), others).concat()
        };
        assert_eq!(beside(-12.0, -0.45), "thrust-curve");
        assert_eq!(beside(-12.0, -0.2), "thrust-curve/vortex-ring");
        assert_eq!(beside(-14.0, -0.2), "thrust-curve");
    }

    #[test]
    fn an_effect_that_needs_another_updraft_must_explain_clearly_more_than_nothing() {
        let of = |nats: f64, updraft_mps: f64, effect: &str| {
            let mut there = ended(nats, &[effect]);
            there.found.updraft_mps = updraft_mps;
            told(there, vec![ended(0.0, &[]), ended(nats - 30.0, &["vortex-ring"])]).concat()
        };
        assert_eq!(of(12.0, 0.2, "thrust-curve"), "thrust-curve/climb");
        assert_eq!(of(14.0, 0.2, "thrust-curve"), "thrust-curve");
        assert_eq!(of(12.0, 0.05, "thrust-curve"), "thrust-curve");
        assert_eq!(of(12.0, 0.2, "motor-thermal"), "motor-thermal", "it has nothing of the climb");
    }

    #[test]
    fn of_the_climb_none_is_named_alone_that_is_ahead_by_what_is_known_of_the_noise() {
        let beside = |still: f64, other: f64, effect: &str| {
            let mut others = vec![ended(other, &[effect]), ended(still, &[])];
            others.sort_by(|a, b| b.nats.total_cmp(&a.nats));
            told(ended(0.0, &["response-drift"]), others).concat()
        };
        assert_eq!(beside(-110.0, -24.0, "face-drag"), "response-drift/face-drag");
        assert_eq!(beside(-110.0, -26.0, "face-drag"), "response-drift", "far behind");
        assert_eq!(beside(-80.0, -19.0, "face-drag"), "response-drift/face-drag");
        assert_eq!(beside(-80.0, -21.0, "face-drag"), "response-drift", "it explains too little");
        assert_eq!(beside(-110.0, -24.0, "motor-thermal"), "response-drift", "not of the climb");
        let others = || vec![ended(-24.0, &["face-drag"]), ended(-110.0, &[])];
        let class = told(ended(0.0, &["response-drift/vortex-ring"]), others());
        assert_eq!(class, ["response-drift/vortex-ring"], "in doubt already");
        let of_time = told(ended(0.0, &["motor-thermal"]), others());
        assert_eq!(of_time, ["motor-thermal"]);
        let beaten = vec![ended(20.0, &["face-drag"]), ended(-110.0, &[])];
        let told = told(ended(0.0, &["response-drift"]), beaten);
        assert_eq!(told, ["face-drag/response-drift"], "who was found first and is beaten");
    }

    #[test]
    fn an_effect_that_explains_as_well_is_a_class_with_what_was_found() {
        let others = vec![ended(-3.0, &["battery"]), ended(-9.0, &["vortex-ring"])];
        assert_eq!(told(ended(0.0, &["motor-thermal"]), others), ["motor-thermal/battery"]);
        assert_eq!(told(ended(0.0, &["motor-thermal"]), Vec::new()), ["motor-thermal"]);
    }

    #[test]
    fn who_was_not_told_apart_stays_so() {
        let found = || ended(0.0, &["thrust-curve/vortex-ring"]);
        // The same effect explains more in an updraft of its own.
        let same = vec![ended(0.5, &["thrust-curve"])];
        assert_eq!(told(found(), same), ["thrust-curve/vortex-ring"]);
        assert_eq!(told(found(), vec![ended(20.0, &["face-drag"])]), ["face-drag"]);
        // Whoever is as good brings those along that are not told from it.
        let others = vec![ended(-3.0, &["momentum-drag/rotor-inflow"])];
        let all = told(ended(0.0, &["parasitic-drag"]), others);
        assert_eq!(all, ["parasitic-drag/momentum-drag/rotor-inflow"]);
    }

    #[test]
    fn nothing_stands_instead_of_findings_that_explain_no_more_than_they_cost() {
        let of = |gain_nats: f64| {
            let mut nothing = ended(0.0, &[]);
            nothing.found.rest = Rest { gain_nats, threshold_nats: 8.0, ..Rest::default() };
            vec![nothing, ended(-2.0, &["battery"])]
        };
        let nothing = || of(5.0);
        assert!(told(ended(-1.0, &["battery"]), nothing()).is_empty());
        assert_eq!(told(ended(1.0, &["battery"]), nothing()), ["battery"]);
        assert_eq!(told(ended(-1.0, &["battery"]), of(9.0)), ["battery"], "something is left");
        let beside = |nats: f64| {
            let others = of(5.0).into_iter().chain([ended(nats, &["momentum-drag"])]).rev();
            told(ended(-1.0, &["battery"]), others.collect())
        };
        assert!(beside(7.0).is_empty(), "no search found it");
        assert_eq!(beside(9.0).concat(), "momentum-drag/battery");
    }

    #[test]
    fn one_effect_is_simpler_than_several_of_its_kind() {
        let pair = || ended(0.0, &["thrust-curve", "rotor-inflow"]);
        assert_eq!(told(pair(), vec![ended(-3.0, &["momentum-drag"])]), ["momentum-drag"]);
        assert_eq!(
            told(pair(), vec![ended(-7.0, &["momentum-drag"])]),
            ["thrust-curve", "rotor-inflow"]
        );
        // One of the two was found beside the other for a reason.
        assert_eq!(
            told(pair(), vec![ended(-3.0, &["rotor-inflow"])]),
            ["thrust-curve", "rotor-inflow"]
        );
        // A battery is of another kind.
        let pair = ended(0.0, &["rotor-inflow", "battery"]);
        assert_eq!(told(pair, vec![ended(-3.0, &["momentum-drag"])]), ["rotor-inflow", "battery"]);
    }

    #[test]
    fn who_explained_half_as_much_has_its_turn_and_what_was_found_too() {
        let rivals_of = |effect: &str| {
            let others = [("climb", 30.0), ("face-drag", 25.0), ("battery", 12.0)];
            rivals(&[step(effect, 26.0, &others)], false)
        };
        assert_eq!(rivals_of("motor-thermal"), ["face-drag", "motor-thermal"]);
        // Of the climb every effect has its turn, whatever it explained.
        for effect in ["thrust-curve", "rotor-inflow"] {
            let all = rivals_of(effect);
            assert_eq!(all[..2], ["face-drag", effect]);
            for other in ["parasitic-drag", "thrust-curve", "vortex-ring", "rotor-inflow"] {
                assert!(all.contains(&other), "{other} in place of {effect}");
            }
            assert!(!all.contains(&"motor-thermal"), "{all:?}");
        }
        // A battery's load grows in a climb, and yet it goes with time.
        assert_eq!(rivals_of("battery"), ["face-drag", "battery"]);
        let two = [step("thrust-curve", 26.0, &[]), step("battery", 26.0, &[])];
        assert!(rivals(&two, false).contains(&"momentum-drag"), "no round looks for it");
        // So has a drag of the rotors that leans told, also beside a single name.
        let by_lean =
            [step("translational-lift/blade-flapping", 26.0, &[("blade-flapping", 24.0)])];
        assert!(rivals(&by_lean, false).contains(&"momentum-drag"));
        let inflow = [step("rotor-inflow", 26.0, &[])];
        assert!(!rivals(&inflow, false).contains(&"momentum-drag"));
        assert!(rivals(&inflow, true).contains(&"momentum-drag"), "leans told it, not this search");
    }

    #[test]
    fn what_is_unknown_of_the_climb_is_held_against_each_effect_of_the_climb() {
        let unknown = |depends_on: Dependence| {
            let finding = Finding::Unknown { depends_on, formula: None };
            trial::step(finding, 60.0, &[("climb", 60.0), ("rotor-inflow", 40.0)])
        };
        let all = rivals(&[unknown(Dependence::Climb)], false);
        assert_eq!(all[0], "rotor-inflow", "the likeliest first");
        for effect in ["parasitic-drag", "thrust-curve", "vortex-ring", "face-drag"] {
            assert!(all.contains(&effect), "{effect}");
        }
        assert!(!all.contains(&"motor-thermal") && !all.contains(&"turbulence"));
        assert!(all.contains(&"momentum-drag"), "along the rotors' axis it is of the climb");
        let with_height = rivals(&[unknown(Dependence::ClimbHeight)], false);
        assert_eq!(with_height, ["rotor-inflow", "momentum-drag"]);
        assert_eq!(rivals(&[unknown(Dependence::Height)], false), ["rotor-inflow"]);
        let instead = |nats: f64| {
            let mut there = ended(0.0, &[]);
            there.found.steps = vec![unknown(Dependence::Climb)];
            told(there, vec![ended(nats, &["parasitic-drag"])])
        };
        assert_eq!(instead(5.0), ["parasitic-drag/climb"]);
        assert_eq!(instead(7.0), ["parasitic-drag"]);
        assert!(!instead(-1.0).concat().contains("parasitic-drag"));
    }

    #[test]
    fn a_drag_by_which_a_strong_wind_was_misread_stands_in_place_of_nothing() {
        let data = trial::data(2, |_, _| 0.0);
        // As rare as an updraft is, so much less is explained with nothing.
        let told = |updraft_mps: f64, wind_mps: f64, left: (&str, f64), options: &Options| {
            let mut nothing = Found::nothing(trial::comparison(&data));
            nothing.updraft_mps = updraft_mps;
            nothing.comparison.wind.mean_mps = [wind_mps, 0.0];
            let (candidate, gain_nats) = (left.0.to_owned(), left.1);
            nothing.rest = Rest { candidate, gain_nats, threshold_nats: 8.0, ..Rest::default() };
            let flown = |options: &Options| {
                let mut there = Found::nothing(trial::comparison(&data));
                let only = options.only.unwrap();
                if !only.is_bent {
                    there.steps = vec![step(only.effect, 20.0, &[])];
                }
                Ok(Searched { found: there, left: None })
            };
            let none_left = |_: &Options, _: Left| unreachable!("nothing is left");
            let there = effect_after_all(nothing, options, flown, none_left).unwrap();
            !there.steps.is_empty()
        };
        let options = Options::default();
        let none = ("", 0.0);
        assert!(told(20.0, 9.0, none, &options));
        assert!(!told(20.0, 5.0, none, &options), "nothing hides it");
        assert!(!told(15.0, 9.0, none, &options), "nothing explains nearly as much");
        let still_air = Options { updraft: false, ..options };
        assert!(!told(20.0, 9.0, none, &still_air), "a table is not flown again");
        assert!(
            told(20.0, 5.0, ("parasitic-drag", 9.3), &options),
            "by the drag the wind is weaker"
        );
        assert!(!told(20.0, 5.0, ("parasitic-drag", 7.0), &options), "chance explains as much");
        assert!(!told(20.0, 5.0, ("battery", 9.3), &options), "nobody reads a wind by it");
        assert!(told(20.0, 5.0, ("rotor-inflow", 9.3), &options), "in the climb it is like a drag");
    }

    #[test]
    fn what_brings_the_model_much_nearer_has_no_further_price() {
        assert_eq!(further_price_nats([23.9, 9.4], 8.0), 0.0);
        assert_eq!(further_price_nats([23.9, 12.0], 8.0), 8.0);
        assert_eq!(further_price_nats([23.9, f64::INFINITY], 8.0), 8.0, "unknown");
    }

    #[test]
    fn a_shape_of_the_climb_that_was_not_taken_in_may_be_an_effect() {
        let data = trial::data(2, |_, _| 0.0);
        let tried = |candidate: &str, gain_nats: f64| {
            let mut nothing = Found::nothing(trial::comparison(&data));
            let candidate = candidate.to_owned();
            nothing.rest = Rest { gain_nats, candidate, threshold_nats: 14.0, ..Rest::default() };
            let asked = std::sync::Mutex::new(Vec::new());
            let flown = |options: &Options| {
                let Only { effect, is_bent, .. } = options.only.unwrap();
                asked.lock().unwrap().push(if is_bent { "bent" } else { effect });
                Ok(Searched { found: Found::nothing(trial::comparison(&data)), left: None })
            };
            let none_left = |_: &Options, _: Left| unreachable!("nothing is left");
            let there = effect_after_all(nothing, &Options::default(), flown, none_left).unwrap();
            assert!(there.steps.is_empty(), "none of them was found");
            asked.into_inner().unwrap()
        };
        let effects = tried("climb", 15.0);
        assert!(effects.contains(&"vortex-ring") && effects.contains(&"thrust-curve"));
        assert!(
            !effects.contains(&"bent"),
            "in each updraft, not only where it bends the response"
        );
        assert!(!effects.contains(&"density"), "of the height");
        // A curve may bend the response as another updraft does, whatever is left.
        assert_eq!(tried("climb", 14.0), ["bent"], "chance gains as much");
        assert_eq!(tried("height", 40.0), ["bent"]);
    }
}
