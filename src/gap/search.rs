//! One round of the search: the best explanation of the residual, and whether chance would give as
//! much.

use rand_distr::{Distribution as _, StandardNormal};
use rayon::prelude::*;

use super::candidates::{Candidate, Variant};
use super::decide::CLASS_NATS;
use super::dependence::Dependence;
use super::generic::Generic;
use super::gls::{Column, Likelihood, Problem, Solution, Split, Start};
use super::noise::GroupPattern;
use super::response::{Response, add_to, settled};
use crate::base::rng::{Purpose, stream};

/// Candidates this near to the best by the quick scan are fitted with their own noise, nats. 7 before the
/// scatter between drones took part, which can turn ranks round; chosen. More costs only time.
const NEAR_NATS: f64 = 20.0;
/// What gains less at once is not fitted, nats. Chosen: next to nothing beside a threshold.
const LEAST_GAIN_NATS: f64 = 0.5;
/// At most this many are fitted. Chosen for time.
const MOST_FITTED: usize = 8;
/// Free shapes that are fitted. Chosen for time.
const SHAPES_FITTED: usize = 3;
/// Forms of one effect that are fitted: which explains more, the noise decides as well.
const FORMS_FITTED: usize = 2;
/// A multiple of the effect's tried form beyond this is another effect: closed forms are not linear over
/// such a range. Chosen.
const MOST_BETA: f64 = 5.0;

/// One candidate's best form in a round.
#[derive(Clone, Debug)]
pub(super) struct Ranked {
    /// Index in the list of candidates.
    pub candidate: usize,
    /// Index of the candidate's best form.
    pub variant: usize,
    /// Gain, nats: with the noise fitted anew where [`Ranked::fitted`].
    pub gain: f64,
    /// Gain as a regressor alone, without what it does to the scatter between drones, nats.
    pub plain: f64,
    /// Coefficient on the form.
    pub beta: f64,
    /// Standard deviation over bins of what it does to the pulse, us.
    pub size_us: f64,
    /// Largest minus smallest of what it does to the pulse, us.
    pub range_us: f64,
    /// Noise with it in the model.
    pub noise: Start,
    /// Whether the noise was fitted anew.
    pub fitted: bool,
}

/// The best free shapes of a round.
#[derive(Clone, Debug)]
pub(super) struct RankedGeneric {
    /// Index in the list of free shapes.
    pub generic: usize,
    /// Gain less its penalty, nats.
    pub gain: f64,
    /// Gain as a regressor alone, without what it does to the scatter between drones, nats.
    pub plain: f64,
    /// Coefficients of the regressors.
    pub beta: Vec<f64>,
    /// Standard deviation over bins of what it does to the pulse, us.
    pub size_us: f64,
    /// Largest minus smallest of what it does to the pulse, us.
    pub range_us: f64,
    /// Noise with it in the model.
    pub noise: Start,
}

/// What a round found.
#[derive(Clone, Debug)]
pub(super) struct Round {
    /// The groups' patterns with the air that all shared.
    pub groups: Vec<GroupPattern>,
    /// The model so far with its noise.
    pub base: Solution,
    /// Candidates of the library, best first.
    pub library: Vec<Ranked>,
    /// Free shapes, best first; the best one of each signal.
    pub generics: Vec<RankedGeneric>,
}

impl Round {
    /// Largest gain of an effect that can be named.
    pub(super) fn best(&self) -> f64 {
        self.library.first().map_or(0.0, |best| best.gain)
    }

    /// Largest gain of a free shape.
    pub(super) fn best_generic(&self) -> f64 {
        self.generics.first().map_or(0.0, |best| best.gain)
    }
}

/// What is looked for.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sought<'a> {
    /// Effects and motions of the air.
    pub library: &'a [Candidate],
    /// Free shapes to try.
    pub generics: &'a [Generic],
    /// Number of drones in each group.
    pub drones: &'a [usize],
}

/// Looks once. Whether it `settles`, for each candidate, at which speed relative to the air that all share the
/// drones flew; otherwise that is what the groups know of it.
pub(super) fn round(
    problem: &Problem<'_>,
    start: impl Into<Start>,
    sought: Sought<'_>,
    settles: bool,
) -> Round {
    round_on(problem, based(problem, start, settles), sought, settles)
}

/// Looks once, where the noise without what is sought is known.
pub(super) fn round_on(
    problem: &Problem<'_>,
    mut first: Based,
    sought: Sought<'_>,
    settles: bool,
) -> Round {
    // What leads at once is asked first where the noise is likelier: all others are fitted once.
    for _ in 0..BETTER_STARTS {
        let there = problem.among(&first.0);
        let (effect, shape) = leaders(&there, &first.1, sought, settles);
        let Some(better) = better(&there, &first.1, (&effect, &shape), settles) else { break };
        first = better;
    }
    let mut found = round_from(problem, first, sought, settles);
    for _ in 0..BETTER_STARTS {
        let groups = found.groups.clone();
        let there = problem.among(&groups);
        let all = (&found.library[..], &found.generics[..]);
        let Some(again) = better(&there, &found.base, all, settles) else { break };
        found = round_from(&there, again, sought, settles);
    }
    found
}

/// The effect and the free shape that gain most in the noise as it is, fitted with their own.
fn leaders(
    problem: &Problem<'_>,
    base: &Solution,
    sought: Sought<'_>,
    settles: bool,
) -> (Vec<Ranked>, Vec<RankedGeneric>) {
    let before = base.log_posterior();
    rayon::join(
        || {
            let first =
                scan(base, sought).into_iter().next().filter(|one| one.gain > LEAST_GAIN_NATS);
            first
                .map(|one| refit(problem, base, before, &one, sought, settles))
                .into_iter()
                .collect()
        },
        || {
            let first = shapes_at_once(base, sought).into_iter().next();
            first
                .map(|one| refit_shape(problem, base, before, &one, sought, settles))
                .into_iter()
                .collect()
        },
    )
}

/// A likelier noise with nothing of what is sought, from the noise of what gains most: it has more than one likeliest place, and what
/// a candidate leads to may be better for none, too. `None`: that one is no better.
fn better(
    problem: &Problem<'_>,
    base: &Solution,
    (effects, shapes): (&[Ranked], &[RankedGeneric]),
    settles: bool,
) -> Option<Based> {
    let effects = effects.iter().map(|one| (one.gain, &one.noise));
    let all = effects.chain(shapes.iter().map(|one| (one.gain, &one.noise)));
    let (gain, noise) = all.max_by(|a, b| a.0.total_cmp(&b.0))?;
    if gain < FLOOR_NATS {
        return None;
    }
    let again = based(problem, noise, settles);
    (again.1.log_posterior() >= base.log_posterior() + BETTER_NATS).then_some(again)
}

/// How often a better place of the noise is taken up. Numerical.
const BETTER_STARTS: usize = 2;
/// A place that is better by less is the same, nats. Numerical: far below a threshold.
const BETTER_NATS: f64 = 0.2;

/// A model with its noise and nothing of what is sought; the patterns have the air that all shared.
pub(super) type Based = (Vec<GroupPattern>, Solution);

/// The noise by a start, with nothing of what is sought.
pub(super) fn based(problem: &Problem<'_>, start: impl Into<Start>, settles: bool) -> Based {
    let first = problem.fit(start, Likelihood::Profile);
    if settles {
        settled(problem, first, |_| problem.groups.to_vec())
    } else {
        (problem.groups.to_vec(), first)
    }
}

fn round_from(
    problem: &Problem<'_>,
    (groups, base): Based,
    sought: Sought<'_>,
    settles: bool,
) -> Round {
    let problem = &problem.among(&groups);
    let mut library = scan(&base, sought);
    let best = library.first().map_or(0.0, |best| best.gain);
    let near = |ranked: &Ranked| ranked.gain > LEAST_GAIN_NATS && ranked.gain > best - NEAR_NATS;
    let count = library.iter().take(MOST_FITTED).filter(|ranked| near(ranked)).count();
    let before = base.log_posterior();
    let fitted: Vec<Ranked> = library
        .par_iter()
        .take(count)
        .map(|ranked| refit(problem, &base, before, ranked, sought, settles))
        .collect();
    library.splice(..count, fitted);
    let library = best_of_each(library);
    let generics = free_shapes(problem, &base, before, sought, settles);
    Round { groups, base, library, generics }
}

/// Whether a coefficient makes a size that the effect can have.
pub(super) fn admissible(candidate: &Candidate, variant: &Variant, beta: f64) -> bool {
    let Some(size) = candidate.size else { return beta.abs() > 0.0 };
    if candidate.was_there {
        let moved = size.now + beta * (variant.size - size.now);
        return (size.low..=size.high).contains(&moved) && beta.is_finite();
    }
    beta > 0.0 && beta <= MOST_BETA
}

/// How much the best of what is sought gains in the noise as it is, nats.
pub(super) fn gains_at_once(base: &Solution, sought: Sought<'_>) -> f64 {
    scan(base, sought).first().map_or(0.0, |best| best.gain)
}

/// What each candidate gains, in its best size, in each of its two best forms.
fn scan(base: &Solution, sought: Sought<'_>) -> Vec<Ranked> {
    let mut ranked: Vec<Ranked> = Vec::new();
    for (index, candidate) in sought.library.iter().enumerate() {
        let mut forms: Vec<(Option<f64>, Ranked)> = Vec::new();
        for (place, variant) in candidate.variants.iter().enumerate() {
            let gain = base.gain(&variant.column);
            if !admissible(candidate, variant, gain.beta) {
                continue;
            }
            let one = Ranked {
                candidate: index,
                variant: place,
                gain: gain.nats - variant.price_nats,
                plain: gain.nats - variant.price_nats,
                beta: gain.beta,
                size_us: gain.beta.abs() * variant.column.spread(sought.drones),
                range_us: gain.beta.abs() * variant.column.range(),
                noise: Start::from(base),
                fitted: false,
            };
            match forms.iter_mut().find(|(form, _)| *form == variant.form) {
                Some((_, other)) if other.gain <= one.gain => *other = one,
                Some(_) => {}
                None => forms.push((variant.form, one)),
            }
        }
        forms.sort_by(|a, b| b.1.gain.total_cmp(&a.1.gain));
        ranked.extend(forms.into_iter().take(FORMS_FITTED).map(|(_, one)| one));
    }
    ranked.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    ranked
}

/// The best of each candidate, best first.
fn best_of_each(mut ranked: Vec<Ranked>) -> Vec<Ranked> {
    ranked.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    let mut best: Vec<Ranked> = Vec::new();
    for one in ranked {
        if best.iter().all(|other| other.candidate != one.candidate) {
            best.push(one);
        }
    }
    best
}

fn refit(
    problem: &Problem<'_>,
    base: &Solution,
    before: f64,
    ranked: &Ranked,
    sought: Sought<'_>,
    settles: bool,
) -> Ranked {
    let candidate = &sought.library[ranked.candidate];
    let variant = &candidate.variants[ranked.variant];
    let problem = problem.with([&variant.column]);
    let mut with = problem.fit(base, Likelihood::Profile);
    let before = before + variant.price_nats;
    let plain = ranked.plain.max(with.log_posterior() - before);
    // Who feels a climb feels the air as well: the scatter must fit what the effect makes of gusts.
    let feeling = |beta: &[f64]| {
        let beta = beta.last().copied().unwrap_or(0.0);
        feeling(problem.groups, &[variant.felt.get()], &[beta])
    };
    if settles && candidate.size.is_some() {
        with = settled(&problem, with, feeling).1;
    } else if variant.felt.is_some() {
        with = problem.among(&feeling(&with.beta)).fit(&with, Likelihood::Profile);
    }
    let beta = with.beta.last().copied().unwrap_or(0.0);
    let gain = with.log_posterior() - before;
    if !admissible(candidate, variant, beta) || gain < ranked.gain {
        // The noise at its start is a fit as well.
        return Ranked { plain, fitted: true, ..ranked.clone() };
    }
    Ranked {
        gain,
        plain,
        beta,
        size_us: beta.abs() * variant.column.spread(sought.drones),
        range_us: beta.abs() * variant.column.range(),
        noise: Start::from(&with),
        fitted: true,
        ..ranked.clone()
    }
}

/// Groups whose response to the air has some multiples of others.
pub(super) fn feeling(
    groups: &[GroupPattern],
    felt: &[&[Vec<Response>]],
    beta: &[f64],
) -> Vec<GroupPattern> {
    let mut groups = groups.to_vec();
    for (felt, beta) in felt.iter().zip(beta) {
        for (group, felt) in groups.iter_mut().zip(*felt) {
            add_to(&mut group.response, *beta, felt);
        }
    }
    groups
}

/// The best free shape of each kind in the noise as it is, best first.
fn shapes_at_once(base: &Solution, sought: Sought<'_>) -> Vec<RankedGeneric> {
    let mut best: Vec<RankedGeneric> = Vec::new();
    for (index, generic) in sought.generics.iter().enumerate() {
        let (beta, nats) = base.gain_of_all(&generic.columns);
        let gain = nats - generic.penalty;
        let noise = Start::from(base);
        let found = RankedGeneric {
            generic: index,
            gain,
            plain: gain,
            beta,
            size_us: 0.0,
            range_us: 0.0,
            noise,
        };
        let same =
            |other: &RankedGeneric| sought.generics[other.generic].depends_on == generic.depends_on;
        match best.iter_mut().find(|other| same(other)) {
            Some(other) if other.gain < gain => *other = found,
            Some(_) => {}
            None => best.push(found),
        }
    }
    best.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    best
}

fn refit_shape(
    problem: &Problem<'_>,
    base: &Solution,
    before: f64,
    found: &RankedGeneric,
    sought: Sought<'_>,
    settles: bool,
) -> RankedGeneric {
    if found.gain < LEAST_GAIN_NATS {
        return found.clone();
    }
    let generic = &sought.generics[found.generic];
    let problem = problem.with(&generic.columns);
    let mut with = problem.fit(base, Likelihood::Profile);
    let first = with.beta.len() - generic.columns.len();
    if settles {
        with = settled(&problem, with, |_| problem.groups.to_vec()).1;
    }
    let plain = found.plain.max(with.log_posterior() - before - generic.penalty);
    let felt: Vec<_> = generic.felt.iter().map(Vec::as_slice).collect();
    let feeling = |beta: &[f64]| feeling(problem.groups, &felt, &beta[first..]);
    if !felt.is_empty() {
        let numb = with.clone();
        with = if settles {
            settled(&problem, with, feeling).1
        } else {
            problem.among(&feeling(&with.beta)).fit(&with, Likelihood::Profile)
        };
        // What it does to the scatter is known by its size, which means alone may hardly tell.
        if numb.log_posterior() > with.log_posterior() {
            with = numb;
        }
    }
    let gain = with.log_posterior() - before - generic.penalty;
    if gain < found.gain {
        return RankedGeneric { plain, ..found.clone() };
    }
    RankedGeneric {
        gain,
        plain,
        beta: with.beta[first..].to_vec(),
        noise: Start::from(&with),
        ..found.clone()
    }
}

fn free_shapes(
    problem: &Problem<'_>,
    base: &Solution,
    before: f64,
    sought: Sought<'_>,
    settles: bool,
) -> Vec<RankedGeneric> {
    let mut best = shapes_at_once(base, sought);
    let refitted: Vec<RankedGeneric> = best
        .par_iter()
        .take(SHAPES_FITTED)
        .map(|found| refit_shape(problem, base, before, found, sought, settles))
        .collect();
    best.splice(..refitted.len(), refitted);
    for found in &mut best {
        let generic = &sought.generics[found.generic];
        if let Some(trace) = sum(&generic.columns, &found.beta) {
            found.size_us = trace.spread(sought.drones);
            found.range_us = trace.range();
        }
    }
    best.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    drop_idle_product(&mut best, sought);
    best
}

/// A product of climb and another comes with a line over the climb, and a change of the response from one moment on with a
/// step: where a curve over the climb, or a step, explains as much, that is what it is.
fn drop_idle_product(found: &mut Vec<RankedGeneric>, sought: Sought<'_>) {
    let depends_on = |one: &RankedGeneric| sought.generics[one.generic].depends_on;
    let is_simpler =
        |one: &&RankedGeneric| matches!(depends_on(one), Dependence::Climb | Dependence::Step);
    let simpler = found.iter().filter(is_simpler).map(|one| one.gain).reduce(f64::max);
    if let Some(simpler_nats) = simpler.filter(|nats| *nats > FREE_FLOOR_NATS) {
        let least = simpler_nats + FLOOR_NATS;
        let is_product = |one: &RankedGeneric| {
            matches!(depends_on(one), Dependence::ClimbTime | Dependence::ClimbHeight)
        };
        found.retain(|one| !is_product(one) || one.gain > least);
    }
}

/// What a free shape is told to depend on. A product of climb with time and one with height that explain the same leave
/// open which of them it is: told is what they have in common.
pub(super) fn told_of(round: &Round, sought: Sought<'_>, free: &RankedGeneric) -> Dependence {
    let depends_on = |one: &RankedGeneric| sought.generics[one.generic].depends_on;
    let own = depends_on(free);
    let products = [Dependence::ClimbTime, Dependence::ClimbHeight];
    let explains_the_same = |other: &RankedGeneric| {
        depends_on(other) != own
            && products.contains(&depends_on(other))
            && other.gain > free.gain - CLASS_NATS
    };
    let is_open = products.contains(&own) && round.generics.iter().any(explains_the_same);
    if is_open { Dependence::Climb } else { own }
}

/// A sum of regressors, us.
fn sum(columns: &[Column], beta: &[f64]) -> Option<Column> {
    Some(columns.first()?.each(|group, drone, bin| {
        columns.iter().zip(beta).map(|(c, b)| b * c.at(group, drone, bin)).sum()
    }))
}

/// Thresholds: gains that flights with nothing to find exceed with a small chance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Thresholds {
    /// For effects of the library, nats.
    pub library: f64,
    /// For free shapes, nats.
    pub generic: f64,
}

/// The least threshold, nats: z = 4 against a single alternative (docs/physics.md, 3.3). Half of it lies
/// within the 95 % quantile of the largest gain in flights with nothing missing (3.2 to 5.5 nats): one such
/// flight in twenty would yield a name. Twice as much (z = 5.7) would find 25 % of effects of z 5 instead of
/// 84 %.
pub(super) const FLOOR_NATS: f64 = 8.0;
/// The least threshold for free shapes, nats, of which there are dozens: z = 5.3. The largest gain of any
/// candidate in 440 flights with nothing missing was 13.6 (docs/physics.md, 3.3).
pub(super) const FREE_FLOOR_NATS: f64 = 14.0;
/// What explains so much less is no other view of the flight, nats, whatever it does to the raw gap, which has the air in
/// it. Chosen: more than wrong readings of the air have cost.
pub(super) const FAR_NATS: f64 = 100.0;
/// Share of the replicates whose gains determine the exponential tail. Chosen.
const TAIL: f64 = 0.25;

/// Thresholds from flights simulated from the fitted noise with the same pattern: a parametric
/// bootstrap, the same for any number of threads.
pub(super) fn thresholds(
    problem: &Problem<'_>,
    base: &Solution,
    sought: Sought<'_>,
    replicates: usize,
    alpha: f64,
    seed: u64,
) -> Thresholds {
    let gains: Vec<(f64, f64)> = (0..replicates)
        .into_par_iter()
        .map(|index| {
            let mut rng = stream(seed, index as u64, Purpose::Resampling);
            let pulses = base.simulate(|| StandardNormal.sample(&mut rng));
            let split = Split::of(&pulses);
            let null = Problem {
                groups: problem.groups,
                pulses: &split,
                columns: problem.columns.clone(),
            };
            let round = round(&null, base, sought, false);
            (round.best(), round.best_generic())
        })
        .collect();
    let tail = |of: fn(&(f64, f64)) -> f64| quantile(gains.iter().map(of).collect(), alpha);
    Thresholds {
        library: tail(|gain| gain.0).max(FLOOR_NATS),
        generic: tail(|gain| gain.1).max(FREE_FLOOR_NATS),
    }
}

/// What values exceed with the chance `alpha`, by an exponential tail through the largest of them.
fn quantile(mut values: Vec<f64>, alpha: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let tail = ((values.len() as f64 * TAIL) as usize).max(1);
    let Some(start) = values.len().checked_sub(tail + 1).and_then(|place| values.get(place)) else {
        return 0.0;
    };
    let share = tail as f64 / values.len() as f64;
    let excess =
        values.iter().rev().take(tail).map(|value| value - start).sum::<f64>() / tail as f64;
    start + excess * (share / alpha).ln().max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tail_of_an_exponential_is_found() {
        let values: Vec<f64> = (1..400).map(|index| -(f64::from(index) / 400.0).ln()).collect();
        let found = quantile(values, 0.005);
        assert!((found - 200_f64.ln()).abs() < 0.1, "{found}");
    }

    use super::super::trial::{patterns, pulses};

    #[test]
    fn thresholds_are_never_below_their_floors() {
        let groups = patterns();
        let split = Split::of(&pulses(&groups));
        let problem = Problem::new(&groups, &split);
        let base = problem.at(&Start::default().hyper);
        let sought = Sought { library: &[], generics: &[], drones: &[3, 2] };
        // Nothing is looked for, so that nothing is found; and not one flight says nothing.
        for replicates in [0, 3] {
            let found = thresholds(&problem, &base, sought, replicates, 0.005, 1);
            assert_eq!(found, Thresholds { library: 8.0, generic: 14.0 });
        }
    }

    /// A free shape without columns.
    fn free(depends_on: Dependence) -> Generic {
        Generic {
            depends_on,
            axis: "",
            columns: Vec::new(),
            felt: Vec::new(),
            along: Vec::new(),
            penalty: 0.0,
        }
    }

    /// A free shape by its number, with what it gains.
    fn ranked(generic: usize, gain: f64) -> RankedGeneric {
        RankedGeneric {
            generic,
            gain,
            plain: gain,
            beta: Vec::new(),
            size_us: 3.0,
            range_us: 3.0,
            noise: Start::default(),
        }
    }

    #[test]
    fn a_product_is_more_than_what_it_comes_with() {
        let pairs = [
            [Dependence::Climb, Dependence::ClimbTime],
            [Dependence::Step, Dependence::ClimbTime],
            [Dependence::Climb, Dependence::ClimbHeight],
        ];
        for pair in pairs {
            let generics = pair.map(free);
            let sought = Sought { library: &[], generics: &generics, drones: &[] };
            let is_left = |simple_nats: f64, product_nats: f64| {
                let mut found = vec![ranked(1, product_nats), ranked(0, simple_nats)];
                drop_idle_product(&mut found, sought);
                found.len() == 2
            };
            assert!(!is_left(30.0, 35.0) && !is_left(30.0, 38.0) && is_left(30.0, 38.0 + 1e-9));
            assert!(is_left(14.0, 15.0), "a shape that is none takes nothing away: {pair:?}");
        }
    }

    #[test]
    fn products_that_explain_the_same_tell_what_they_have_in_common() {
        let generics = [Dependence::ClimbTime, Dependence::ClimbHeight, Dependence::Climb];
        let generics = generics.map(free);
        let sought = Sought { library: &[], generics: &generics, drones: &[] };
        let groups = patterns();
        let split = Split::of(&pulses(&groups));
        let problem = Problem::new(&groups, &split);
        let told = |own: usize, other: (usize, f64)| {
            let own = ranked(own, 60.0);
            let generics = vec![own.clone(), ranked(other.0, other.1)];
            let base = problem.at(&Start::default().hyper);
            let round = Round { groups: groups.clone(), base, library: Vec::new(), generics };
            told_of(&round, sought, &own)
        };
        assert_eq!(told(0, (1, 54.0 + 1e-9)), Dependence::Climb);
        assert_eq!(told(1, (0, 61.0)), Dependence::Climb);
        assert_eq!(told(0, (1, 54.0)), Dependence::ClimbTime);
        assert_eq!(told(0, (2, 59.0)), Dependence::ClimbTime, "a curve is no other product");
    }

    #[test]
    fn a_size_that_an_effect_cannot_have_is_none() {
        use super::super::candidates::{Felt, Size};
        let column = Column::Shared(vec![]);
        let variant = Variant {
            vehicle: None,
            size: 0.2,
            form: None,
            price_nats: 0.0,
            column,
            updraft_mps: None,
            felt: Felt::default(),
        };
        let size = Size { name: "size", unit: "", low: 0.0, high: 0.5, now: 0.1, usual: 0.1 };
        let (was_there, by_lean) = (false, false);
        let new = Candidate { name: "", was_there, by_lean, size: Some(size), variants: vec![] };
        let is = |candidate: &Candidate, beta| admissible(candidate, &variant, beta);
        assert!(is(&new, 1e-9) && is(&new, 5.0));
        assert!(!is(&new, 0.0) && !is(&new, -0.1) && !is(&new, 5.0 + 1e-9));
        // A size that the model has may become any that it can be: here 0.1 + 0.1 beta.
        let there = Candidate { was_there: true, ..new.clone() };
        assert!(is(&there, -1.0) && is(&there, 3.9));
        assert!(!is(&there, -1.1) && !is(&there, 4.1) && !is(&there, f64::NAN));
        let air = Candidate { size: None, ..new };
        assert!(is(&air, -3.0) && !is(&air, 0.0));
    }
}
