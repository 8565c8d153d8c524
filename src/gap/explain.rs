//! The loop of the search: find, name, add, and again, until nothing passes.

mod form;
mod in_updraft;
mod telling;

use std::sync::OnceLock;

use telling::{along_its_signal, finding, lean_parameter, rest, rivals, told_once, with_alike};

use super::candidates::{
    Candidate, Updraft, axial_drag, drag_by_lean, library, of_the_air, read_otherwise,
};
use super::compare::{Comparison, Simulated, UPDRAFT_DOUBT_MPS};
use super::contest::{Contest, before};
use super::data::Data;
use super::decide::{What, decide};
use super::dependence::Dependence;
use super::error::GapError;
use super::generic::{Generic, all};
use super::gls::{Column, Likelihood, Problem, Split};
use super::lean::LEGS_DOUBT;
use super::model_flights::ModelFlights;
use super::noise::{GroupPattern, Hyper, WHITE};
use super::refine::{self, Parameter, fitted, half_interval, parameters_of, refine, slopes};
use super::response::{self, Response, gusts_mps, settled};
use super::search::{
    FLOOR_NATS, FREE_FLOOR_NATS, Ranked, RankedGeneric, Round, Sought, round, told_of,
};
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
    /// Noise with everything in the model.
    pub hyper: Hyper,
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
            hyper: Hyper::default(),
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
        let first = problem.fit(self.hyper, Likelihood::Profile);
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

/// Runs the loop on the drones that are to be fitted. `original` is the model before anything was repaired, `flights` are
/// those of the model in other searches of the same drones.
///
/// # Errors
/// See [`GapError`].
pub(super) fn search(
    data: &Data,
    [original, vehicle]: [&Vehicle; 2],
    simulated: &Simulated<'_>,
    plan: Option<&Plan>,
    options: &Options,
    flights: &ModelFlights,
) -> Result<Found, GapError> {
    let begin = || Comparison::new(data, vehicle, simulated, plan);
    let comparison = flights.flown(None, 0.0, begin)?;
    let found = Found::nothing(comparison.clone());
    let lacked_drag = lacked_drag([original, vehicle]);
    let (refused, last) = (Vec::new(), None);
    let mut search = Search {
        data,
        vehicle,
        lacked_drag,
        simulated,
        plan,
        options,
        flights,
        comparison,
        found,
        refused,
        last,
    };
    let mut step = 0;
    loop {
        let before = (search.comparison.clone(), search.found.clone());
        match search.takes_step(step) {
            Ok(true) => step += 1,
            Ok(false) => break,
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
    let mut found = search.found;
    told_once(&mut found.steps);
    settle(&mut found);
    single::review(&mut found)?;
    Ok(found)
}

/// Whether a model has a drag of the rotors, and had none before leans told it.
pub(super) fn lacked_drag([original, repaired]: [&Vehicle; 2]) -> bool {
    Role::RotorDrag.is_on(repaired) && !Role::RotorDrag.is_on(original)
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
}

/// The updraft in which is looked.
#[derive(Clone, Copy)]
enum In<'a> {
    /// The one that explains most.
    Settled,
    /// The present one; in noise of these patterns, if there are any.
    Present(Option<&'a [GroupPattern]>),
}

/// What is looked at in one round, and for what.
#[derive(Clone)]
struct Look {
    patterns: Vec<GroupPattern>,
    residual: Split,
    /// Regressors that are not judged: what was found before, whose size may change with what comes after.
    free: Vec<Column>,
    doubts: Vec<Column>,
    /// Noise and air before anything is sought.
    hyper: Hyper,
    candidates: Vec<Candidate>,
    generics: Vec<Generic>,
    drones: Vec<usize>,
    /// How unlikely the leans are, nats.
    lean_misfit_nats: f64,
    /// What explains how much, once it is computed.
    round: OnceLock<Round>,
}

/// How well a look's air and noise explain the flight, with the best effect.
struct Explained {
    /// Log-posterior, that of the leans as well, and what the best effect gains above its threshold, nats.
    nats: f64,
    /// Whether an effect gains more than its threshold.
    lacks_effect: bool,
    /// Whether a free shape does.
    lacks_shape: bool,
}

impl Look {
    fn explained(&self) -> Explained {
        let round = self.round();
        let by_effect = (round.best() - FLOOR_NATS).max(0.0);
        Explained {
            nats: round.base.log_posterior() - self.lean_misfit_nats + by_effect,
            lacks_effect: by_effect > 0.0,
            lacks_shape: round.best_generic() > FREE_FLOOR_NATS,
        }
    }

    fn round(&self) -> &Round {
        self.round.get_or_init(|| round(&self.problem(), self.hyper, self.sought(), true))
    }

    fn problem(&self) -> Problem<'_> {
        Problem::new(&self.patterns, &self.residual).doubting(&self.doubts).with(&self.free)
    }

    fn sought(&self) -> Sought<'_> {
        let Self { candidates, generics, drones, .. } = self;
        Sought { library: candidates, generics, drones }
    }
}

impl Search<'_> {
    /// Looks once and takes up what passes; whether the search goes on.
    fn takes_step(&mut self, step: usize) -> Result<bool, GapError> {
        let begins = self.found.steps.is_empty();
        let asked = self.options.only.filter(|_| begins && self.may_differ_in_updraft());
        let look = match asked {
            Some(only) => self.look_where_it_explains_most(only)?,
            None => self.look_in_likelier_updraft()?,
        };
        let look = if asked.is_some() || !self.may_differ_in_updraft() {
            look
        } else if begins {
            self.look_in_likeliest_flight(look)?
        } else if self.options.only.is_some() && self.goes_where_it_is_likelier(look.hyper)? {
            self.look(In::Present(None))?
        } else {
            look
        };
        if step == self.options.most_steps && !self.options.rest {
            self.found.hyper = look.hyper;
            self.found.comparison = self.comparison.clone();
            return Ok(false);
        }
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
            return Ok(false);
        }
        self.found.hyper = round.base.hyper;
        let wind_mps = self.comparison.wind.mean_mps;
        let material_us = material_us(&look.patterns, &round.base.hyper, wind_mps);
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
            return Ok(false);
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
        Ok(true)
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

    /// What is left, and everything that may explain it.
    fn look(&mut self, updraft: In<'_>) -> Result<Look, GapError> {
        let Self { comparison, found, .. } = self;
        let patterns = comparison.patterns(&found.vehicle, found.gusts_mps)?;
        let residual = Split::of(&comparison.residual(&found.vehicle, found.gusts_mps)?);
        // Gusts that the residual shows bend the model's curve: known physics first.
        let mut free = found.extras.clone();
        free.extend(slopes(comparison, &found.vehicle, &found.parameters)?);
        let doubts = refine::doubts(comparison, &found.vehicle, &found.parameters)?;
        let mut quick = Problem::new(&patterns, &residual)
            .doubting(&doubts)
            .with(&free)
            .fit(found.hyper, Likelihood::Profile);
        let may_differ = self.may_differ_in_updraft();
        if matches!(updraft, In::Settled) && may_differ {
            quick = self.settle_updraft(&free, quick)?;
        }
        let Self { comparison, found, refused, lacked_drag, .. } = self;
        let doubts = refine::doubts(comparison, &found.vehicle, &found.parameters)?;
        found.gusts_mps = gusts_mps(&quick.hyper).min(MOST_GUSTS_MPS);
        let patterns = match updraft {
            In::Present(Some(patterns)) => patterns.to_vec(),
            _ => comparison.patterns(&found.vehicle, found.gusts_mps)?,
        };
        let residual = Split::of(&comparison.residual(&found.vehicle, found.gusts_mps)?);
        let updraft = if may_differ { Updraft::MayDiffer } else { Updraft::Same };
        let mut candidates = library(&found.vehicle, comparison, updraft)?;
        let only = self.options.only.filter(|_| found.steps.is_empty());
        let is_asked = only.is_some_and(|only| Role::MomentumDrag.is_of(only.effect));
        candidates.extend(axial_drag(&found.vehicle, comparison, *lacked_drag, is_asked)?);
        if !comparison.is_in_other_wind() {
            candidates.extend(read_otherwise(comparison, &found.vehicle, updraft)?);
        }
        candidates.retain(|candidate| !refused.contains(&candidate.name));
        candidates.extend(of_the_air(&comparison.scene, &patterns, &quick.hyper));
        let mut generics = all(&comparison.scene, &comparison.headings());
        if let Some(only) = only {
            candidates.retain(|candidate| candidate.name == only.effect);
            generics.clear();
        }
        let drones = comparison.data.counts();
        let hyper = quick.hyper;
        Ok(Look {
            patterns,
            residual,
            free,
            doubts,
            hyper,
            candidates,
            generics,
            drones,
            lean_misfit_nats: comparison.lean_misfit_nats(),
            round: OnceLock::new(),
        })
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
                && let Some((drag, se)) =
                    drag_by_lean(&before_it, comparison, &found.vehicle, &round.base)?
            {
                Role::RotorDrag.set(&mut next, drag);
                by_lean = Some(lean_parameter(size, drag, se));
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
            found.hyper = best.hyper;
            found.refit(comparison)?;
        } else {
            found.extras.push(variant.column.clone());
            found.hyper = best.hyper;
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
        found.hyper = free.hyper;
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
            self.found.drop_effect(gone, self.vehicle);
            self.refused.push(gone);
            self.comparison = self.against_model()?;
            self.found.refit(&self.comparison)?;
        }
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
    let half = half_interval(&found.comparison, &found.hyper);
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
                self.hyper,
                self.gusts_mps,
                true,
            )?;
            self.vehicle = fit.vehicle;
            self.values = fit.values;
            self.hyper = fit.hyper;
            let before_mps = self.gusts_mps;
            self.gusts_mps = gusts_mps(&self.hyper).min(MOST_GUSTS_MPS);
            if (self.gusts_mps - before_mps).abs() < SAME_GUSTS_MPS {
                break;
            }
        }
        Ok(())
    }
}

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
        Search {
            data,
            vehicle,
            lacked_drag: false,
            simulated,
            plan: None,
            options,
            flights,
            found: Found::nothing(comparison.clone()),
            comparison,
            refused: Vec::new(),
            last: None,
        }
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
