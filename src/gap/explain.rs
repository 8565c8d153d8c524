//! The loop of the search: find, name, add, and again, until nothing passes.

mod bent;
pub(super) mod form;
mod in_updraft;
mod look;
pub(super) mod telling;

use bent::Bent;
pub(in crate::gap) use look::Seen;
use look::{In, Look};
use telling::{along_its_signal, finding, lean_parameter, rest, rivals, told_once, with_alike};

use super::candidates::{Candidate, drag_by_lean};
use super::compare::{Comparison, Simulated, UPDRAFT_DOUBT_MPS};
use super::contest::{Contest, before};
use super::data::Data;
use super::decide::{What, decide};
use super::dependence::Dependence;
use super::error::GapError;
use super::generic::Generic;
use super::gls::{Column, Likelihood, Problem, Split, Start};
use super::lean::LEGS_DOUBT;
use super::model_flights::ModelFlights;
use super::noise::{GroupPattern, Hyper, WHITE};
use super::refine::{self, Parameter, fitted, half_interval, parameters_of, refine};
use super::response::{self, Response, gusts_mps, settled};
use super::search::{FAR_NATS, FLOOR_NATS, FREE_FLOOR_NATS, Ranked, RankedGeneric, Round, told_of};
use super::single;
use super::together::joined;
use super::verdict::{Finding, Fitted, Rest, Rival, Step, is_strong_wind};
use crate::effects::Role;
use crate::mission::plan::Plan;
use crate::numeric::mean;
use crate::vehicle::Vehicle;

/// Options of the search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Probability of naming anything in a step when there is nothing to find.
    pub alpha: f64,
    /// Number of simulated flights for the thresholds.
    pub replicates: usize,
    /// Seed of all that is random.
    pub seed: u64,
    /// Largest number of effects that are named.
    pub most_steps: usize,
    /// Whether the whole flight may be in an updraft; else it is in still air but for what moves.
    pub updraft: bool,
    /// Whether the model is flown in each updraft even where no effect and no shape seems to be missing.
    pub each_flown: bool,
    /// The only effect that may come first; `None`: whatever explains most.
    pub only: Option<Only>,
    /// Whether to look, after the last finding, for what is left.
    pub rest: bool,
}

/// An effect that alone is searched for at first, in the updraft in which it explains most.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Only {
    /// Name of the effect.
    pub effect: &'static str,
    /// An updraft to look in beside the usual ones, m/s.
    pub updraft_mps: f64,
    /// How well the flight is explained without, nats.
    pub beaten_nats: f64,
    /// Whether it is looked for only where it bends the response as another updraft does.
    pub is_bent: bool,
}

impl Only {
    /// Whether an effect that explains so much in the best of some updrafts, nats, need not be flown in its own.
    fn is_out_of_reach(self, nats: f64) -> bool {
        nats < self.beaten_nats - HOPELESS_NATS
    }
}

impl Default for Options {
    fn default() -> Self {
        Self {
            alpha: 0.005,
            replicates: 60,
            seed: 1,
            most_steps: 4,
            updraft: true,
            each_flown: false,
            only: None,
            rest: true,
        }
    }
}

/// Effects smaller than this are not named in the field, us: 0.1 m/s at the 25 us/(m/s) of a show drone
/// (docs/physics.md, 3.3). In Monte-Carlo flights warming motors and density were missed mainly because of
/// it; with less noise than in the field, closed forms that are some microseconds off could be named below
/// it.
const MATERIAL_US: f64 = 2.5;

/// Smallest effect that is named, us: where air and noise are much smaller than in the field (a single
/// drone in a simulator's still air), smaller effects are real, but where a strong wind is not known so well.
fn material_us(groups: &[GroupPattern], hyper: &Hyper, wind_mps: [f64; 2]) -> f64 {
    if is_strong_wind(wind_mps) {
        return MATERIAL_US;
    }
    let responses = groups.iter().flat_map(|group| group.responses(hyper));
    let noise_us = hyper.get(WHITE) + mean(responses).unwrap_or_default() * gusts_mps(hyper);
    (2.0 * noise_us).clamp(0.75, MATERIAL_US)
}

/// Findings of the search at its end.
#[derive(Clone, Debug)]
pub struct Found {
    /// Model with the effects that were found.
    pub vehicle: Vehicle,
    /// Last comparison, against the model with the findings.
    pub comparison: Comparison,
    /// Regressors of findings that are not effects of the vehicle.
    pub extras: Vec<Column>,
    /// Contributions of `extras` to the response to vertical air speed, by group and bin; empty if
    /// there are none.
    pub felt: Vec<Vec<Response>>,
    /// Parameters that were fitted.
    pub parameters: Vec<Parameter>,
    /// Values of the parameters, with their standard errors.
    pub values: Vec<(f64, f64)>,
    /// Noise with everything in the model, as it was fitted.
    pub(in crate::gap) noise: Start,
    /// Strength of gusts that the rectification was computed with, m/s.
    pub gusts_mps: f64,
    /// Updraft that the whole flight is in, m/s.
    pub updraft_mps: f64,
    /// Whether any part of the search was in such an updraft.
    pub was_in_updraft: bool,
    /// Findings, in the order in which they were made.
    pub steps: Vec<Step>,
    /// The end of the search.
    pub rest: Rest,
}

impl Found {
    /// What is known before the search: the vehicle as it is.
    pub(super) fn nothing(comparison: Comparison) -> Self {
        Self {
            vehicle: comparison.vehicle.clone(),
            comparison,
            extras: Vec::new(),
            felt: Vec::new(),
            parameters: Vec::new(),
            values: Vec::new(),
            noise: Start::default(),
            gusts_mps: 0.0,
            updraft_mps: 0.0,
            was_in_updraft: false,
            steps: Vec::new(),
            rest: Rest::default(),
        }
    }

    /// How well the findings explain the flight, nats: its likelihood with them, that of the leans as well, less what each
    /// must explain to be found at all, and how rare the updraft is.
    ///
    /// # Errors
    /// Effects of the vehicle that are not valid.
    pub(super) fn explains(&self) -> Result<f64, GapError> {
        let Self { comparison, vehicle, gusts_mps, .. } = self;
        let patterns = comparison.patterns(vehicle, *gusts_mps)?;
        let residual = Split::of(&comparison.residual(vehicle, *gusts_mps)?);
        let doubts = refine::doubts(comparison, vehicle, &self.parameters)?;
        let known = doubts.get(1..).unwrap_or_default();
        let problem = Problem::new(&patterns, &residual).doubting(known).with(&self.extras);
        let first = problem.fit(&self.noise, Likelihood::Profile);
        // At the speed relative to the air that all share, as in the rounds that found it.
        let likely = settled(&problem, first, |_| patterns.clone()).1.log_posterior();
        let price = |step: &Step| match step.finding {
            Finding::Unknown { .. } => FREE_FLOOR_NATS,
            Finding::Name { .. } | Finding::Class { .. } => FLOOR_NATS,
        };
        let share = self.updraft_mps / UPDRAFT_DOUBT_MPS;
        let leans_nats = comparison.lean_misfit_nats();
        Ok(likely - leans_nats - self.steps.iter().map(price).sum::<f64>() - 0.5 * share * share)
    }
}

/// The drones that are to be fitted, with all that their flight is held against.
#[derive(Clone, Copy)]
pub(super) struct Setting<'a> {
    /// Drones to be fitted.
    pub data: &'a Data,
    /// Model before anything was repaired.
    pub original: &'a Vehicle,
    /// Model that the search begins with.
    pub vehicle: &'a Vehicle,
    /// Simulation that the logs are compared with.
    pub simulated: &'a Simulated<'a>,
    /// The plan, if there is one.
    pub plan: Option<&'a Plan>,
    /// Flights of the model in other searches of the same drones.
    pub flights: &'a ModelFlights,
}

/// A search that ended.
pub(super) struct Searched {
    /// Findings as they are told, with the model that they make.
    pub found: Found,
    /// The end of the search, if nobody asked for what is left there.
    pub left: Option<Left>,
}

/// Where a search ended without looking for what is left.
pub(super) struct Left {
    comparison: Comparison,
    found: Found,
    refused: Vec<&'static str>,
    look: Look,
}

impl<'a> Setting<'a> {
    /// Runs the loop: find, name, add, and again.
    ///
    /// # Errors
    /// See [`GapError`].
    pub(super) fn search(self, options: &'a Options) -> Result<Searched, GapError> {
        let Self { data, vehicle, simulated, plan, flights, .. } = self;
        let comparison =
            flights.flown(None, 0.0, || Comparison::new(data, vehicle, simulated, plan))?;
        let mut search = self.begun(options, comparison);
        let mut step = 0;
        let mut end = None;
        loop {
            let before = (search.comparison.clone(), search.found.clone());
            match search.takes_step(step) {
                Ok(Taken::Yes) => step += 1,
                Ok(Taken::No(look)) => {
                    end = look;
                    break;
                }
                Err(error) if error.is_not_flown() => {
                    // What is refused is no finding, and leaves room for as many.
                    if search.gives_up(before) {
                        continue;
                    }
                    if search.found.steps.is_empty() {
                        return Err(error);
                    }
                    break;
                }
                Err(error) => return Err(error),
            }
        }
        let Search { comparison, found, refused, .. } = search;
        let left = end.map(|look| Left { comparison, found: found.clone(), refused, look: *look });
        Ok(Searched { found: told(found)?, left })
    }

    /// Looks for what is left after a search that did not; what was found, with it.
    ///
    /// # Errors
    /// See [`GapError`].
    pub(super) fn look_for_rest(self, options: &'a Options, left: Left) -> Result<Found, GapError> {
        let Left { comparison, found, refused, look } = left;
        let search = self.begun(options, comparison);
        let mut search = Search { found, refused, ..search };
        match search.takes_what_explains(options.most_steps, &look) {
            Err(error) if !error.is_not_flown() => return Err(error),
            _ => {}
        }
        told(search.found)
    }

    fn begun(self, options: &'a Options, comparison: Comparison) -> Search<'a> {
        let Self { data, original, vehicle, simulated, plan, flights } = self;
        Search {
            data,
            vehicle,
            lacked_drag: lacked_drag([original, vehicle]),
            simulated,
            plan,
            options,
            flights,
            found: Found::nothing(comparison.clone()),
            comparison,
            refused: Vec::new(),
            last: None,
            bent: None,
        }
    }
}

/// What was found, as it is told.
fn told(mut found: Found) -> Result<Found, GapError> {
    told_once(&mut found.steps);
    settle(&mut found);
    single::review(&mut found)?;
    Ok(found)
}

/// Whether a model has a drag of the rotors, and had none before leans told it.
pub(super) fn lacked_drag([original, repaired]: [&Vehicle; 2]) -> bool {
    Role::RotorDrag.is_on(repaired) && !Role::RotorDrag.is_on(original)
}

/// Whether something was taken up.
enum Taken {
    /// The search goes on.
    Yes,
    /// It ends; before this look, if it was not asked for what is left.
    No(Option<Box<Look>>),
}

/// A search that goes on.
struct Search<'a> {
    data: &'a Data,
    /// The model that the search began with.
    vehicle: &'a Vehicle,
    /// Whether that has a drag of the rotors only because leans told it.
    lacked_drag: bool,
    simulated: &'a Simulated<'a>,
    plan: Option<&'a Plan>,
    options: &'a Options,
    flights: &'a ModelFlights,
    /// The data against the model with what was found so far.
    comparison: Comparison,
    found: Found,
    /// Effects that were taken back.
    refused: Vec<&'static str>,
    /// The state before the last free shape, and how probable that was.
    last: Option<(Found, f64)>,
    /// The effect that is looked for where it bends the response as another updraft does.
    bent: Option<Bent>,
}

impl Search<'_> {
    /// Looks once and takes up what passes.
    fn takes_step(&mut self, step: usize) -> Result<Taken, GapError> {
        let begins = self.found.steps.is_empty();
        if let Some(only) = self.options.only.filter(|_| !begins)
            && self.found.explains()? < only.beaten_nats - FLOWN_NATS
        {
            return Ok(Taken::No(None));
        }
        let asked = self.options.only.filter(|_| begins && self.may_differ_in_updraft());
        let look = match asked {
            Some(only) => self.look_where_it_explains_most(only)?,
            None => Some(self.look_in_likelier_updraft()?),
        };
        let Some(mut look) = look else { return Ok(Taken::No(None)) };
        if let Some(only) = asked.filter(|only| only.is_out_of_reach(look.explained().nats)) {
            look = self.at_fitted_size(look)?;
            if only.is_out_of_reach(look.explained().nats) {
                return Ok(Taken::No(None));
            }
        }
        let look = if asked.is_some() || !self.may_differ_in_updraft() {
            look
        } else if begins {
            self.look_in_likeliest_flight(look)?
        } else if self.options.only.is_some() && self.goes_where_it_is_likelier(&look.seen.start)? {
            self.look(In::Present(None))?
        } else {
            look
        };
        if step == self.options.most_steps && !self.options.rest {
            self.found.noise = look.seen.start.clone();
            self.found.comparison = self.comparison.clone();
            return Ok(Taken::No(Some(Box::new(look))));
        }
        self.takes_what_explains(step, &look)
    }

    /// Takes up what passes in a look.
    fn takes_what_explains(&mut self, step: usize, look: &Look) -> Result<Taken, GapError> {
        let (round, sought) = (look.round(), look.sought());
        let problem = look.problem();
        let problem = problem.among(&round.groups);
        let likely = round.base.log_posterior();
        if let Some((before, was)) = self.last.take()
            && likely < was - WORSE_NATS
        {
            // Fitted together with the rest it explains less than was explained without.
            let free = self.found.steps.pop();
            self.found = before;
            single::beside_what_was_taken_back(&mut self.found.steps, free.as_ref());
            return Ok(Taken::No(None));
        }
        self.found.noise = Start::from(&round.base);
        let wind_mps = self.comparison.wind.mean_mps;
        let material_us = material_us(&look.seen.patterns, &round.base.hyper, wind_mps);
        let mut decision = decide(&problem, round, sought, material_us, self.options, step);
        let (found, comparison) = (&self.found, &self.comparison);
        let contest = Contest { found, comparison, sought, round };
        decision.what = contest.settle(&problem, decision.what)?;
        if comparison.is_foreign() && found.steps.is_empty() {
            decision.what = contest.together(&problem, decision.what)?;
        }
        self.found.rest = rest(round, sought, &decision.thresholds);
        if step == self.options.most_steps || matches!(decision.what, What::Nothing) {
            self.found.comparison = self.comparison.clone();
            return Ok(Taken::No(None));
        }
        let rivals = rivals(round, sought);
        match decision.what {
            What::Nothing => {}
            What::Effects { members, or_else } => {
                let free = or_else.iter().map(|free| look.generics[free.generic].depends_on.name());
                let effects = members.iter().map(|one| look.candidates[one.candidate].name);
                let names: Vec<String> = effects.chain(free).map(str::to_owned).collect();
                let threshold_nats = decision.thresholds.library;
                let best = &members[0];
                let candidate = &look.candidates[best.candidate];
                self.take_effect(candidate, best, round, names, (threshold_nats, rivals))?;
            }
            What::Together { members, instead } => {
                let name = |candidate: usize| look.candidates[candidate].name.to_owned();
                for (member, instead) in members.iter().zip(instead) {
                    let of = member.candidate;
                    let names = std::iter::once(of).chain(instead).map(name).collect();
                    let told = (decision.thresholds.library, rivals.clone());
                    self.take_effect(&look.candidates[of], member, round, names, told)?;
                }
            }
            What::Free(free) => {
                let before = Found { comparison: self.comparison.clone(), ..self.found.clone() };
                self.last = Some((before, likely));
                let threshold_nats = decision.thresholds.generic;
                let depends_on = told_of(round, sought, &free);
                let told = (depends_on, threshold_nats, rivals);
                self.take_shape(&look.generics[free.generic], &free, told);
            }
        }
        self.fly_again()?;
        self.chooses_form()?;
        self.takes_back_the_same()?;
        Ok(Taken::Yes)
    }

    /// Goes back to before a step with which the model cannot fly this flight, and refuses what it took up; whether it
    /// had taken up anything.
    fn gives_up(&mut self, (comparison, found): (Comparison, Found)) -> bool {
        let is_known = |effect: &str| found.parameters.iter().any(|one| one.effect == effect);
        let taken = self.found.parameters.iter().map(|one| one.effect);
        let taken: Vec<&'static str> = taken.filter(|effect| !is_known(effect)).collect();
        let took_up = !taken.is_empty();
        self.refused.extend(taken);
        self.comparison = comparison;
        self.found = found;
        took_up
    }

    /// Whether the present model is the one that the search began with.
    fn has_model(&self) -> bool {
        self.found.steps.is_empty() && self.found.felt.is_empty()
    }

    /// Takes an effect into the model, or a motion of the air into the regressors. `names` are those of
    /// its class; the threshold that it passed and its rivals go into the step.
    fn take_effect(
        &mut self,
        candidate: &Candidate,
        best: &Ranked,
        round: &Round,
        names: Vec<String>,
        (threshold_nats, rivals): (f64, Vec<Rival>),
    ) -> Result<(), GapError> {
        let variant = &candidate.variants[best.variant];
        let before_it = self.comparison.clone();
        if let Some(updraft_mps) = variant.updraft_mps {
            self.found.updraft_mps = updraft_mps;
            self.found.was_in_updraft = true;
            self.comparison = before_it.clone().in_updraft(updraft_mps);
        }
        let Self { comparison, found, .. } = self;
        let mut by_lean = None;
        if candidate.variants[best.variant].vehicle.is_some() {
            let mut next = joined(found.vehicle.clone(), candidate, best);
            if let Some(size) = candidate.size.filter(|_| candidate.by_lean)
                && let Some(drag) =
                    drag_by_lean(&before_it, comparison, &found.vehicle, &round.base)?
            {
                Role::RotorDrag.set(&mut next, drag.value);
                by_lean = Some(lean_parameter(size, drag));
            }
            let known = found.parameters.iter().any(|p| p.effect == candidate.name);
            if !known {
                let before = before(candidate);
                let more = parameters_of(comparison, &next, candidate.name, before, &round.base)?;
                found.parameters.extend(more);
            }
            if self.lacked_drag && Role::MomentumDrag.is_of(candidate.name) {
                told_by_leans(&mut found.parameters, variant.size);
            }
            found.vehicle = next;
            found.noise = best.noise.clone();
            match self.bent.take().filter(|bent| bent.is_of(candidate.name)) {
                // The flight without it may be too far from that with it to fit it there.
                Some(bent) => bent.taken_by(found),
                None => found.refit(comparison)?,
            }
        } else {
            found.extras.push(variant.column.clone());
            found.noise = best.noise.clone();
        }
        // In what another program simulated, sets of effects were held against sets that do as well.
        let is_set = comparison.is_foreign();
        let form = single::form_of_what_was_found(&found.steps, candidate.name, best.plain);
        let mut names = with_alike(names, candidate);
        names.extend(form.filter(|form| !is_set && !names.contains(form)));
        found.steps.push(Step {
            finding: finding(names, candidate.was_there, by_lean),
            gain_nats: best.gain,
            threshold_nats,
            alpha: self.options.alpha,
            size_us: best.size_us,
            rivals,
            shape: Some(along_its_signal(comparison, variant, best.beta)),
            in_field: None,
            form: None,
        });
        Ok(())
    }

    /// Takes a free shape into the regressors. What it is told to depend on, the threshold that it passed and its rivals go
    /// into the step.
    fn take_shape(
        &mut self,
        generic: &Generic,
        free: &RankedGeneric,
        (depends_on, threshold_nats, rivals): (Dependence, f64, Vec<Rival>),
    ) {
        let found = &mut self.found;
        let shape = generic.shape(&free.beta);
        found.extras.extend(generic.columns.iter().cloned());
        found.felt = with_felt(&found.felt, &generic.felt, &free.beta);
        found.noise = free.noise.clone();
        found.steps.push(Step {
            finding: Finding::Unknown {
                depends_on,
                formula: super::formula::formula(generic.depends_on, &shape)
                    .filter(|_| depends_on == generic.depends_on),
            },
            gain_nats: free.gain,
            threshold_nats,
            alpha: self.options.alpha,
            size_us: free.size_us,
            rivals,
            shape: Some(shape),
            in_field: None,
            form: None,
        });
    }

    /// Flies the model with what was found, and takes back what is not needed with it.
    fn fly_again(&mut self) -> Result<(), GapError> {
        self.comparison = self.against_model()?;
        if !self.found.parameters.is_empty() {
            // Against the re-flown model: what closed forms leave is small, and taken up here.
            self.found.refit(&self.comparison)?;
        }
        if let Some(gone) = self.found.weakest(&self.comparison, self.vehicle)? {
            // Explained by what came after it, or a size of nothing.
            self.takes_back(gone)?;
        }
        self.found.comparison = self.comparison.clone();
        Ok(())
    }

    /// Takes an effect back for good, and flies and fits the model without it.
    fn takes_back(&mut self, effect: &'static str) -> Result<(), GapError> {
        self.found.drop_effect(effect, self.vehicle);
        self.refused.push(effect);
        self.comparison = self.against_model()?;
        self.found.refit(&self.comparison)
    }

    /// Takes back what was found last if the model had it in that size.
    fn takes_back_the_same(&mut self) -> Result<(), GapError> {
        let Some(same) = self.found.same_as_before() else { return Ok(()) };
        self.takes_back(same)?;
        self.found.comparison = self.comparison.clone();
        Ok(())
    }

    fn against_model(&self) -> Result<Comparison, GapError> {
        self.flown_in(self.found.updraft_mps)
    }

    fn flown_in(&self, updraft_mps: f64) -> Result<Comparison, GapError> {
        let Self { data, simulated, plan, found, .. } = self;
        let Found { vehicle, felt, .. } = found;
        let near = Some(&self.comparison);
        let fly = || Comparison::of(data, vehicle, simulated, *plan, updraft_mps, near);
        let comparison =
            if self.has_model() { self.flights.flown(near, updraft_mps, fly)? } else { fly()? };
        Ok(comparison.feeling(felt).spread_as(self.vehicle))
    }
}

/// Momentum drag has the size that the leans tell, within the error of their law.
fn told_by_leans(parameters: &mut [Parameter], per_s: f64) {
    for parameter in parameters.iter_mut().filter(|one| Role::MomentumDrag.is_of(one.effect)) {
        parameter.bounds = ((1.0 - LEGS_DOUBT) * per_s, (1.0 + LEGS_DOUBT) * per_s);
    }
}

/// Takes the last joint fit into the steps.
pub(super) fn settle(found: &mut Found) {
    let half = half_interval(&found.comparison, &found.noise.hyper);
    let Found { steps, parameters, values, .. } = found;
    for step in steps {
        let of = |effect: &str| -> Vec<Fitted> {
            let all = parameters.iter().zip(values.iter());
            let own = all.filter(|(parameter, _)| parameter.effect == effect);
            let (parameters, values): (Vec<_>, Vec<_>) = own.map(|(p, v)| (p.clone(), *v)).unzip();
            fitted(&parameters, &values, half)
        };
        let (effect, stated) = match &mut step.finding {
            Finding::Name { effect, parameters, .. } => (effect.clone(), parameters),
            Finding::Class { effects, parameters } => {
                (effects.first().cloned().unwrap_or_default(), parameters)
            }
            Finding::Unknown { .. } => continue,
        };
        // What another channel said stays.
        if !Role::RotorDrag.is_of(&effect) {
            *stated = of(&effect);
        }
    }
}

/// Responses with what a free shape adds to them.
pub(super) fn with_felt(
    sum: &[Vec<Response>],
    felt: &[Vec<Vec<Response>>],
    beta: &[f64],
) -> Vec<Vec<Response>> {
    let mut sum = sum.to_vec();
    for (felt, beta) in felt.iter().zip(beta) {
        if sum.is_empty() {
            sum = felt.iter().map(|group| vec![Response::default(); group.len()]).collect();
        }
        response::add(&mut sum, *beta, felt);
    }
    sum
}

impl Found {
    /// Fits all sizes and the noise anew; the gusts of that noise bend the model's curve, so twice.
    pub(super) fn refit(&mut self, comparison: &Comparison) -> Result<(), GapError> {
        for _ in 0..REFITS {
            let fit = refine(
                comparison,
                &self.vehicle,
                &self.parameters,
                &self.extras,
                &self.noise,
                self.gusts_mps,
                true,
            )?;
            self.vehicle = fit.vehicle;
            self.values = fit.values;
            self.noise = fit.noise;
            let before_mps = self.gusts_mps;
            self.gusts_mps = gusts_mps(&self.noise.hyper).min(MOST_GUSTS_MPS);
            if (self.gusts_mps - before_mps).abs() < SAME_GUSTS_MPS {
                break;
            }
        }
        Ok(())
    }
}

/// One effect that explains so much less than what was found, in the best of some updrafts, is not flown in its place, nats.
/// Chosen: flown in an updraft of its own, none of 29 gained more than 125, and none of 40 others more than 56.
const HOPELESS_NATS: f64 = 1.5 * FAR_NATS;
/// One effect with which the model, flown and fitted, explains so much less is not looked at further, nats. Chosen: of 40 that were
/// flown in foreign flights, those that explained less by this much stayed so by 110, and the others gained 66 at most.
const FLOWN_NATS: f64 = 80.0;
/// A free shape after which a flight is less likely by this much is taken back, nats. (With an effect the
/// model is flown again, and is another model.) Chosen, not measured.
const WORSE_NATS: f64 = 2.0;
/// Joint fits after each finding, at most. Chosen for time; they end earlier by [`SAME_GUSTS_MPS`].
const REFITS: usize = 4;
/// Gusts this near to those of the previous fit change nothing, m/s: 0.1 us on a curve of 8 us/(m/s)², in
/// gusts of 0.4 m/s (docs/physics.md, 2.5).
const SAME_GUSTS_MPS: f64 = 0.02;
/// Stronger gusts are not believed while the model still lacks its response to them, m/s: three times those
/// of a field day (docs/physics.md, 4.1). Chosen.
pub(super) const MOST_GUSTS_MPS: f64 = 1.5;

#[cfg(test)]
mod tests {
    use super::super::trial;
    use super::*;

    /// A search at its beginning.
    pub(super) fn begun<'a>(
        data: &'a Data,
        vehicle: &'a Vehicle,
        (simulated, options, flights): (&'a Simulated<'a>, &'a Options, &'a ModelFlights),
        comparison: Comparison,
    ) -> Search<'a> {
        let setting = Setting { data, original: vehicle, vehicle, simulated, plan: None, flights };
        setting.begun(options, comparison)
    }

    #[test]
    fn an_effect_that_explains_far_less_is_not_flown() {
        let only =
            Only { effect: "battery", updraft_mps: 0.0, beaten_nats: -1000.0, is_bent: false };
        assert!(only.is_out_of_reach(-1151.0) && !only.is_out_of_reach(-1150.0));
    }

    #[test]
    fn an_effect_that_is_beaten_once_it_is_flown_is_looked_at_no_further() {
        let data = trial::data(3, |_, bin| 4.0 * bin.climb_mps().abs());
        let (vehicle, simulated) = (trial::vehicle(), Simulated::Closed);
        let comparison = Comparison::new(&data, &vehicle, &simulated, None).unwrap();
        let flights = ModelFlights::default();
        let explained_nats = Found::nothing(comparison.clone()).explains().unwrap();
        let looks = |more_nats: f64| {
            let beaten_nats = explained_nats + more_nats;
            let only =
                Some(Only { effect: "battery", updraft_mps: 0.0, beaten_nats, is_bent: false });
            let options = Options { only, most_steps: 1, rest: false, ..Options::default() };
            let given = (&simulated, &options, &flights);
            let mut search = begun(&data, &vehicle, given, comparison.clone());
            search.found.steps.push(trial::step(trial::name("battery"), 20.0, &[]));
            matches!(search.takes_step(1).unwrap(), Taken::No(Some(_)))
        };
        // The step costs as much as it must explain.
        assert!(looks(0.0));
        assert!(!looks(FLOWN_NATS));
    }

    #[test]
    fn what_is_left_is_the_same_whenever_it_is_looked_for() {
        // A curve of the climb, and a drift that leaves it with something.
        let data = trial::data(3, |drone, bin| {
            let ripple_us = 0.3 * f64::from((5 * bin.segment as i32 + drone as i32) % 3 - 1);
            6.0 * bin.climb_mps().abs() + 0.05 * bin.middle_s() + ripple_us
        });
        let (vehicle, simulated) = (trial::vehicle(), Simulated::Closed);
        let flights = ModelFlights::default();
        let setting = Setting {
            data: &data,
            original: &vehicle,
            vehicle: &vehicle,
            simulated: &simulated,
            plan: None,
            flights: &flights,
        };
        let at_once = Options { most_steps: 1, replicates: 0, ..Options::default() };
        let later = Options { rest: false, ..at_once };
        let Searched { found, left } = setting.search(&at_once).unwrap();
        assert!(left.is_none(), "it was looked for");
        assert_eq!(found.steps.len(), 1, "{:?}", found.steps);
        let Searched { found: before, left } = setting.search(&later).unwrap();
        assert_ne!(before.rest, found.rest, "only that of the step before");
        let after = setting.look_for_rest(&at_once, left.unwrap()).unwrap();
        assert_eq!(after.rest, found.rest);
        let told = |found: &Found| format!("{:?}", found.steps);
        assert_eq!(told(&after), told(&found));
    }

    #[test]
    fn what_the_model_cannot_fly_with_is_refused_and_counts_as_no_step() {
        let data = trial::data(2, |_, _| 0.0);
        let vehicle = trial::vehicle();
        let (simulated, options) = (Simulated::Closed, Options::default());
        let comparison = Comparison::new(&data, &vehicle, &simulated, None).unwrap();
        let flights = ModelFlights::default();
        let mut search = begun(&data, &vehicle, (&simulated, &options, &flights), comparison);
        let found = |effect: &str, size: &str, search: &mut Search<'_>| {
            search.found.parameters.extend(refine::size_of(effect, size));
            search.found.steps.push(trial::step(trial::name(effect), 20.0, &[]));
        };
        found("thrust-curve", "expo", &mut search);
        let before = (search.comparison.clone(), search.found.clone());
        found("battery", "exponent", &mut search);
        assert!(search.gives_up(before.clone()));
        assert_eq!(search.refused, ["battery"], "not what was found before");
        assert_eq!(search.found.steps.len(), 1);
        assert!(!search.gives_up(before), "nothing was taken up: another reason");
        let look = search.look(In::Present(None)).unwrap();
        assert!(look.candidates.iter().all(|one| one.name != "battery"), "it is not tried again");
    }

    #[test]
    fn a_model_that_is_flown_again_still_doubts_the_mean_of_few_drones() {
        let data = trial::data(4, |_, _| 0.0);
        let mut vehicle = trial::vehicle();
        Role::ThrustSpread.set(&mut vehicle, 0.02);
        let (simulated, options) = (Simulated::Closed, Options::default());
        let comparison = Comparison::new(&data, &vehicle, &simulated, None).unwrap();
        let first = comparison.spread_doubts(&comparison.vehicle).unwrap();
        let flights = ModelFlights::default();
        let search = begun(&data, &vehicle, (&simulated, &options, &flights), comparison);
        let again = search.against_model().unwrap();
        assert!(!first.is_empty(), "four drones are not the fleet");
        assert_eq!(again.spread_doubts(&search.found.vehicle).unwrap(), first);
    }
}
