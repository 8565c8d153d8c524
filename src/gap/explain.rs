//! The loop of the search: find, name, add, and again, until nothing passes.

use std::sync::OnceLock;

use rayon::prelude::*;

use super::candidates::{
    Candidate, Size, Updraft, Variant, axial_drag, drag_by_lean, library, of_the_air,
    read_otherwise,
};
use super::compare::{Comparison, Simulated, UPDRAFT_DOUBT_MPS};
use super::contest::{Contest, before};
use super::data::Data;
use super::decide::{What, decide};
use super::error::GapError;
use super::generic::{Generic, all, drawn};
use super::gls::{Column, Likelihood, Problem, Solution, Split};
use super::lean::LEGS_DOUBT;
use super::model_flights::ModelFlights;
use super::noise::{GroupPattern, Hyper, WHITE};
use super::refine::{self, Parameter, fitted, half_interval, parameters_of, refine, slopes};
use super::response::{self, Response, gusts_mps};
use super::search::{
    FLOOR_NATS, FREE_FLOOR_NATS, Ranked, RankedGeneric, Round, Sought, Thresholds, round,
};
use super::single;
use super::together::joined;
use super::verdict::{Finding, Fitted, Interval, Rest, Rival, Shape, Step, is_strong_wind};
use crate::effects::{Role, Signals};
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

    /// How well the findings explain the flight, nats: its likelihood with them, less what each must explain to be
    /// found at all, and how rare the updraft is.
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
        let likely = problem.fit(self.hyper, Likelihood::Profile).log_posterior();
        let price = |step: &Step| match step.finding {
            Finding::Unknown { .. } => FREE_FLOOR_NATS,
            Finding::Name { .. } | Finding::Class { .. } => FLOOR_NATS,
        };
        let share = self.updraft_mps / UPDRAFT_DOUBT_MPS;
        Ok(likely - self.steps.iter().map(price).sum::<f64>() - 0.5 * share * share)
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
    let lacked_drag = Role::RotorDrag.is_on(vehicle) && !Role::RotorDrag.is_on(original);
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
    for step in 0..=options.most_steps {
        let before = (search.comparison.clone(), search.found.clone());
        match search.takes_step(step) {
            Ok(true) => {}
            Ok(false) => break,
            Err(error) if error.is_not_flown() => {
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
    /// What explains how much, once it is computed.
    round: OnceLock<Round>,
}

/// How well a look's air and noise explain the flight, with the best effect.
struct Explained {
    /// Log-posterior, and what the best effect gains above its threshold, nats.
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
            nats: round.base.log_posterior() + by_effect,
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
                self.take_shape(&look.generics[free.generic], &free, (threshold_nats, rivals));
            }
        }
        self.fly_again()?;
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

    /// What is left in the updraft in which one effect explains the flight best: an updraft that was settled in without
    /// it can have stood for it.
    fn look_where_it_explains_most(&mut self, only: Only) -> Result<Look, GapError> {
        let (first, begin) = (self.comparison.clone(), self.found.clone());
        let bins = first.data.bins_of_groups();
        let mut best: Option<(f64, Look, Comparison, Found)> = None;
        let mut starts = [&[0.0, only.updraft_mps], &UPDRAFTS_MPS[..]].concat();
        starts.dedup();
        for updraft_mps in starts {
            (self.comparison, self.found) = (first.clone(), begin.clone());
            self.found.updraft_mps = updraft_mps;
            self.found.was_in_updraft = updraft_mps != 0.0;
            match self.against_model() {
                Ok(there) if there.data.bins_of_groups() == bins => self.comparison = there,
                _ => continue,
            }
            let look = self.look(In::Present(None))?;
            let share = updraft_mps / UPDRAFT_DOUBT_MPS;
            let nats = look.explained().nats - 0.5 * share * share;
            if best.as_ref().is_none_or(|(most, ..)| nats > *most) {
                best = Some((nats, look, self.comparison.clone(), self.found.clone()));
            }
        }
        let Some((_, look, comparison, found)) = best else {
            (self.comparison, self.found) = (first, begin);
            return self.look(In::Present(None));
        };
        (self.comparison, self.found) = (comparison, found);
        Ok(look)
    }

    /// What is left in the updraft that explains most, or in still air with the effect that explains most: what
    /// a model lacks can look like an updraft, and the other way round.
    fn look_in_likelier_updraft(&mut self) -> Result<Look, GapError> {
        let begins = self.found.steps.is_empty();
        let look = self.look(In::Settled)?;
        if self.found.updraft_mps.abs() < STILL_MPS {
            return Ok(look);
        }
        self.found.was_in_updraft = true;
        if !begins {
            return Ok(look);
        }
        let there = (self.comparison.clone(), self.found.clone());
        self.found.updraft_mps = 0.0;
        self.comparison = self.against_model()?;
        // In the same noise: how drones scatter must not choose an updraft.
        let still = self.look(In::Present(Some(&look.patterns)))?;
        let (with, without) = (look.explained(), still.explained());
        // Where the updraft leaves nothing to be found, an effect instead of it must explain clearly more.
        let is_instead = without.lacks_effect && !with.lacks_effect;
        let needed_nats = if is_instead { FLOOR_NATS } else { 0.0 };
        if without.nats > with.nats + needed_nats {
            return self.look(In::Present(None));
        }
        (self.comparison, self.found) = there;
        Ok(look)
    }

    /// What is left in the updraft in which the whole flight is likeliest, each flown by the model and with drones that
    /// answer gusts as they do there, if that explains clearly more. Elsewhere the updraft was chosen by what the drones
    /// have in common: with a curve that is flat in hover, drones that answer gusts as in still air hide where they are.
    fn look_in_likeliest_flight(&mut self, look: Look) -> Result<Look, GapError> {
        let here = look.explained();
        if !here.lacks_effect && !here.lacks_shape && !self.options.each_flown {
            return Ok(look);
        }
        let starts = [&[0.0], &UPDRAFTS_MPS[..]].concat();
        let nearest = self.nearest_flight_mps(&starts);
        let of = |starts: &[f64], steps: &[f64]| self.likeliest_flight(look.hyper, starts, steps);
        // In calm air few hundredths of a metre per second are the likeliest, and steps from afar miss them.
        let beside = nearest.and_then(|mps| of(&[mps], &FLIGHT_STEPS_MPS[3..]));
        let likeliest = of(&starts, &FLIGHT_STEPS_MPS).into_iter().chain(beside);
        let best = likeliest.reduce(|one, other| if other.0 > one.0 { other } else { one });
        let Some((_, updraft_mps)) = best else { return Ok(look) };
        let is_asked = self.options.most_steps == 0 && self.options.each_flown;
        if (updraft_mps - self.found.updraft_mps).abs() < FLIGHT_STEPS_MPS[0] / 2.0 && !is_asked {
            return Ok(look);
        }
        let before = (self.comparison.clone(), self.found.clone());
        self.found.updraft_mps = updraft_mps;
        self.found.was_in_updraft = true;
        self.comparison = self.against_model()?;
        let there = self.look(In::Present(None))?;
        // What is unknown of the wind can make up for a wrong updraft, on paper: the model itself must be as near there.
        let is_near = self.comparison.raw_gap_us()? < NEAR * before.0.raw_gap_us()?;
        let is_likelier = there.explained().nats > here.nats + FREE_FLOOR_NATS;
        if is_near && (is_asked || is_likelier) {
            return Ok(there);
        }
        (self.comparison, self.found) = before;
        Ok(look)
    }

    /// Goes into the updraft in which the flight of the present model is likeliest, with sizes that are fitted there, if
    /// that explains more; whether it did. A size that was fitted in another updraft keeps the search there.
    fn goes_where_it_is_likelier(&mut self, hyper: Hyper) -> Result<bool, GapError> {
        let (mut went, mut hyper) = (false, hyper);
        for steps_mps in [&FLIGHT_STEPS_MPS[..], &FLIGHT_STEPS_MPS[2..]] {
            let start = [self.found.updraft_mps];
            let Some((_, updraft_mps)) = self.likeliest_flight(hyper, &start, steps_mps) else {
                break;
            };
            if updraft_mps == self.found.updraft_mps {
                break;
            }
            let before = (self.comparison.clone(), self.found.clone());
            self.found.updraft_mps = updraft_mps;
            self.comparison = self.against_model()?;
            self.found.refit(&self.comparison)?;
            self.comparison = self.against_model()?;
            self.found.comparison = self.comparison.clone();
            let is_near = self.comparison.raw_gap_us()? < NEAR * before.0.raw_gap_us()?;
            if !is_near || self.found.explains()? <= before.1.explains()? {
                (self.comparison, self.found) = before;
                break;
            }
            self.found.was_in_updraft = true;
            (went, hyper) = (true, self.found.hyper);
        }
        Ok(went)
    }

    /// How likely the flight of the present model is in the updraft in which it is likeliest, nats, and that updraft, m/s,
    /// from the best of some starts by steps to either side; `None`: it can fly in none.
    fn likeliest_flight(
        &self,
        hyper: Hyper,
        starts_mps: &[f64],
        steps_mps: &[f64],
    ) -> Option<(f64, f64)> {
        most_beside(|updraft_mps| self.likely_in(updraft_mps, hyper), starts_mps, steps_mps)
    }

    /// The updraft in which the present model, flown, is nearest to the logs, m/s, from the best of some starts.
    fn nearest_flight_mps(&self, starts_mps: &[f64]) -> Option<f64> {
        let bins = self.comparison.data.bins_of_groups();
        let nearness = |updraft_mps: f64| {
            let there = self.flown_in(updraft_mps).ok()?;
            let is_alike = there.data.bins_of_groups() == bins;
            there.raw_gap_us().ok().filter(|_| is_alike).map(|gap_us| -gap_us)
        };
        Some(most_beside(nearness, starts_mps, &FLIGHT_STEPS_MPS[..4])?.1)
    }

    /// Whether the present model is the one that the search began with.
    fn has_model(&self) -> bool {
        self.found.steps.is_empty() && self.found.felt.is_empty()
    }

    /// How likely the flight of the present model is in an updraft, nats; `None`: it cannot fly the same bins there.
    fn likely_in(&self, updraft_mps: f64, hyper: Hyper) -> Option<f64> {
        let fit = || self.fitted_in(updraft_mps, hyper);
        if !self.has_model() {
            return fit();
        }
        self.flights.likely((&self.comparison, updraft_mps), (hyper, self.found.gusts_mps), fit)
    }

    fn fitted_in(&self, updraft_mps: f64, hyper: Hyper) -> Option<f64> {
        let Found { vehicle, parameters, .. } = &self.found;
        let there = self.flown_in(updraft_mps).ok()?;
        if there.data.bins_of_groups() != self.comparison.data.bins_of_groups() {
            return None;
        }
        let doubts = refine::doubts(&there, vehicle, parameters).ok()?;
        let known = doubts.get(1..).unwrap_or_default();
        let (mut likely, mut hyper, mut gusts) = (None, hyper, self.found.gusts_mps);
        for _ in 0..2 {
            let patterns = there.patterns(vehicle, gusts).ok()?;
            let residual = Split::of(&there.residual(vehicle, gusts).ok()?);
            let problem = Problem::new(&patterns, &residual).doubting(known);
            let fit = problem.fit(hyper, Likelihood::Profile);
            likely = Some(fit.log_posterior());
            hyper = fit.hyper;
            gusts = gusts_mps(&hyper).min(MOST_GUSTS_MPS);
        }
        let share = updraft_mps / UPDRAFT_DOUBT_MPS;
        likely.filter(|likely| likely.is_finite()).map(|likely| likely - 0.5 * share * share)
    }

    /// Whether the flight may have been in another updraft. A table has the climb that was flown, not the one
    /// commanded: nothing flies it again in another air.
    fn may_differ_in_updraft(&self) -> bool {
        self.options.updraft && !matches!(self.simulated, Simulated::Closed)
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
            round: OnceLock::new(),
        })
    }

    /// Goes into the updraft that the whole flight most probably is in: where the response is curved, that
    /// changes how the pulse goes with climb. With what explains most there.
    fn settle_updraft(&mut self, free: &[Column], start: Solution) -> Result<Solution, GapError> {
        let mut solution = start;
        let mut starts = vec![self.found.updraft_mps];
        if self.found.steps.is_empty() {
            starts.extend(UPDRAFTS_MPS);
        }
        for _ in 0..FLOWN_ROUNDS {
            let Self { comparison, found, .. } = self;
            // How drones answer gusts stays as it is meanwhile: their scatter must not choose an updraft.
            let patterns = comparison.patterns(&found.vehicle, found.gusts_mps)?;
            let fit = |hyper: Hyper, updraft_mps: f64| {
                InUpdraft::fitted(comparison, &patterns, found, free, hyper, updraft_mps)
            };
            let Some(here) = fit(solution.hyper, found.updraft_mps) else { break };
            let here_nats = here.likely;
            let modes = likeliest(fit, &starts, solution.hyper);
            let Some(best) = self.likelier(modes, here)? else { break };
            let found = &mut self.found;
            let before_mps = std::mem::replace(&mut found.updraft_mps, best.updraft_mps);
            starts = vec![best.updraft_mps];
            if (best.updraft_mps - before_mps).abs() < UPDRAFT_SETTLED_MPS {
                solution = best.solution;
                break;
            }
            let flown = match self.against_model() {
                Err(error) if error.is_not_flown() => {
                    self.found.updraft_mps = before_mps;
                    break;
                }
                flown => flown?,
            };
            // Where the model cannot follow the command in that updraft, regressors would lose their bins.
            let (there, patterns) =
                if flown.data.bins_of_groups() == self.comparison.data.bins_of_groups() {
                    (flown, patterns)
                } else if free.is_empty() {
                    let patterns = flown.patterns(&self.found.vehicle, self.found.gusts_mps)?;
                    (flown, patterns)
                } else {
                    (self.comparison.clone().in_updraft(best.updraft_mps), patterns)
                };
            // What its steady states seemed to explain the model must explain when it is flown.
            let (hyper, updraft_mps) = (best.solution.hyper, best.updraft_mps);
            let again = InUpdraft::fitted(&there, &patterns, &self.found, free, hyper, updraft_mps);
            if again.is_none_or(|again| again.likely < here_nats - SAME_NATS) {
                self.found.updraft_mps = before_mps;
                break;
            }
            solution = best.solution;
            self.comparison = there;
        }
        Ok(solution)
    }

    /// Of updrafts that explain the means equally well, the one in which the drones answer their gusts as they
    /// scatter, or the present one: on a ladder that is flown up and down at once, with a curve that is flat in hover,
    /// air that rises and air that sinks look alike to who does not know how drones answer there.
    fn likelier(
        &mut self,
        mut modes: Vec<InUpdraft>,
        here: InUpdraft,
    ) -> Result<Option<InUpdraft>, GapError> {
        if modes.len() < 2 {
            return Ok(modes.pop());
        }
        let before_mps = self.found.updraft_mps;
        let (mut best, mut most) = (None, here.likely);
        modes.retain(|mode| (mode.updraft_mps - before_mps).abs() > STILL_MPS);
        for mode in modes {
            self.found.updraft_mps = mode.updraft_mps;
            let there = match self.against_model() {
                Err(error) if error.is_not_flown() => continue,
                there => there?,
            };
            let found = &self.found;
            let patterns = there.patterns(&found.vehicle, found.gusts_mps)?;
            let (hyper, at_mps) = (mode.solution.hyper, mode.updraft_mps);
            let again = InUpdraft::fitted(&there, &patterns, found, &[], hyper, at_mps);
            if let Some(again) = again.filter(|again| again.likely > most) {
                (best, most) = (Some(mode), again.likely);
            }
        }
        self.found.updraft_mps = before_mps;
        Ok(Some(best.unwrap_or(here)))
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
        found.steps.push(Step {
            finding: finding(with_alike(names, candidate), candidate.was_there, by_lean),
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

    /// Takes a free shape into the regressors.
    fn take_shape(
        &mut self,
        generic: &Generic,
        free: &RankedGeneric,
        (threshold_nats, rivals): (f64, Vec<Rival>),
    ) {
        let found = &mut self.found;
        let shape = generic.shape(&free.beta);
        found.extras.extend(generic.columns.iter().cloned());
        found.felt = with_felt(&found.felt, &generic.felt, &free.beta);
        found.hyper = free.hyper;
        found.steps.push(Step {
            finding: Finding::Unknown {
                depends_on: generic.depends_on,
                formula: super::formula::formula(generic.depends_on, &shape),
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

/// The most that something is, and where: from the best of some starts by steps to either side; `None`: it is nowhere.
fn most_beside(
    of: impl Fn(f64) -> Option<f64> + Sync,
    starts: &[f64],
    steps: &[f64],
) -> Option<(f64, f64)> {
    let best_of = |places: &[f64]| {
        let each = places.par_iter().filter_map(|place| Some((of(*place)?, *place)));
        each.reduce_with(|one, other| if other.0 > one.0 { other } else { one })
    };
    let mut best = best_of(starts)?;
    for step in steps {
        let beside = best_of(&[best.1 - step, best.1 + step]);
        best = beside.filter(|beside| beside.0 > best.0).unwrap_or(best);
    }
    Some(best)
}

/// The updrafts that explain most, best first, by Gauss and Newton from the first of some starts and the best of the
/// others to either side; none: the vehicle can fly in none of them.
fn likeliest(
    fit: impl Fn(Hyper, f64) -> Option<InUpdraft> + Sync,
    starts_mps: &[f64],
    hyper: Hyper,
) -> Vec<InUpdraft> {
    let there: Vec<Option<InUpdraft>> =
        starts_mps.par_iter().map(|start_mps| fit(hyper, *start_mps)).collect();
    // The present one, and the best to either side of it.
    let mut there = there.into_iter();
    let present = there.next().flatten();
    let (up, down): (Vec<_>, Vec<_>) = there.flatten().partition(|one| one.updraft_mps > 0.0);
    let best = |of: Vec<InUpdraft>| of.into_iter().reduce(better);
    let mut sides: Vec<InUpdraft> = [present, best(up), best(down)].into_iter().flatten().collect();
    let most = sides.iter().map(|one| one.likely).fold(f64::NEG_INFINITY, f64::max);
    sides.retain(|one| one.likely > most - OTHER_SIDE_NATS);
    let mut found: Vec<InUpdraft> =
        sides.into_par_iter().map(|start| climbed(&fit, start)).collect();
    found.sort_by(|a, b| b.likely.total_cmp(&a.likely));
    found.dedup_by(|one, best| (one.updraft_mps - best.updraft_mps).abs() < STILL_MPS);
    let most = found.first().map_or(0.0, |best| best.likely);
    found.retain(|one| one.likely > most - SAME_NATS);
    found
}

/// The updraft that explains most, from one that explains less.
fn climbed(fit: &impl Fn(Hyper, f64) -> Option<InUpdraft>, start: InUpdraft) -> InUpdraft {
    let mut best = start;
    for _ in 0..UPDRAFT_ROUNDS {
        let (at_mps, hyper, likely) = (best.updraft_mps, best.solution.hyper, best.likely);
        let step_mps = (best.most_mps - at_mps).clamp(-UPDRAFT_STEP_MPS, UPDRAFT_STEP_MPS);
        if step_mps.abs() < UPDRAFT_SETTLED_MPS {
            break;
        }
        for share in [1.0, 0.5] {
            if let Some(there) = fit(hyper, at_mps + share * step_mps) {
                best = better(best, there);
            }
            if best.likely > likely {
                break;
            }
        }
        if best.likely <= likely {
            break;
        }
    }
    best
}

/// A flight taken in an updraft, and what explains most of it there.
struct InUpdraft {
    updraft_mps: f64,
    solution: Solution,
    likely: f64,
    /// Updraft that explains most, as far as the slopes at this one tell, m/s.
    most_mps: f64,
}

impl InUpdraft {
    /// `None`: the vehicle cannot fly so.
    fn fitted(
        comparison: &Comparison,
        patterns: &[GroupPattern],
        found: &Found,
        free: &[Column],
        hyper: Hyper,
        updraft_mps: f64,
    ) -> Option<Self> {
        let comparison = comparison.clone().in_updraft(updraft_mps);
        let residual = comparison.residual(&found.vehicle, found.gusts_mps).ok()?;
        let doubts = refine::doubts(&comparison, &found.vehicle, &found.parameters).ok()?;
        let doubt = doubts.first()?;
        // The doubt counts from still air, and the residual from the updraft that it is taken in.
        let share = updraft_mps / UPDRAFT_DOUBT_MPS;
        let here = Split::of(&residual);
        let mut from_still = residual;
        for (group, drones) in from_still.iter_mut().enumerate() {
            for (drone, bins) in drones.iter_mut().enumerate() {
                for (bin, value) in bins.iter_mut().enumerate() {
                    *value += share * doubt.at(group, drone, bin);
                }
            }
        }
        let split = Split::of(&from_still);
        let problem = Problem::new(patterns, &split).doubting(&doubts).with(free);
        let solution = problem.fit(hyper, Likelihood::Profile);
        // How likely this updraft is, not the one that the doubt's line would lead to.
        let known = doubts.get(1..).unwrap_or_default();
        let fixed = Problem::new(patterns, &here).doubting(known).with(free).at(&solution.hyper);
        let likely = fixed.log_posterior() - 0.5 * share * share;
        let most_mps = UPDRAFT_DOUBT_MPS * problem.first_doubt(&solution).unwrap_or_default();
        likely.is_finite().then_some(Self { updraft_mps, solution, likely, most_mps })
    }
}

/// Whichever explains more.
fn better(one: InUpdraft, other: InUpdraft) -> InUpdraft {
    if other.likely > one.likely { other } else { one }
}

/// An updraft that is none, m/s: what a flight of a quarter of an hour tells of it at best. Chosen.
const STILL_MPS: f64 = 0.05;
/// Updrafts from which the search for a flight's own begins, m/s: a curve that is flat in hover has no slope
/// there that would tell the way. Half of what [`UPDRAFT_DOUBT_MPS`] allows to either side, and between.
const UPDRAFTS_MPS: [f64; 4] = [-1.0, 1.0, -2.0, 2.0];
/// Steps to either side by which the updraft of the likeliest flight is found, m/s: by halves, down to half of what a
/// flight tells of it at best. Numerical.
const FLIGHT_STEPS_MPS: [f64; 5] = [0.5, 0.25, 0.12, 0.06, 0.03];
/// A raw gap that is larger by this factor is that of a model in the wrong updraft. Chosen: the air that all drones share
/// makes more or less of it by chance.
const NEAR: f64 = 1.1;
/// A side of still air whose best start explains less by this much is left alone, nats. Chosen: far more than
/// [`SAME_NATS`], as starts are no tops.
const OTHER_SIDE_NATS: f64 = 100.0;
/// Rounds in which the model is flown, and drones' answers to gusts are taken, in the updraft of the round before.
/// Numerical.
const FLOWN_ROUNDS: usize = 2;
/// Rounds in which the updraft settles, at most. Numerical.
const UPDRAFT_ROUNDS: usize = 6;
/// Longest step of the updraft in one round, m/s: a slope is no more than a hint. Chosen.
const UPDRAFT_STEP_MPS: f64 = 1.0;
/// By how much less likely a flight may become where its updraft is flown, nats: what the drones' answers to gusts
/// make of it there. Chosen, three times [`WORSE_NATS`].
const SAME_NATS: f64 = 6.0;
/// A step of the updraft that is none, m/s: far below what a flight tells of it.
const UPDRAFT_SETTLED_MPS: f64 = 0.01;

/// Momentum drag has the size that the leans tell, within the error of their law.
fn told_by_leans(parameters: &mut [Parameter], per_s: f64) {
    for parameter in parameters.iter_mut().filter(|one| Role::MomentumDrag.is_of(one.effect)) {
        parameter.bounds = ((1.0 - LEGS_DOUBT) * per_s, (1.0 + LEGS_DOUBT) * per_s);
    }
}

/// The end of the search, if this round is the last.
fn rest(round: &Round, sought: Sought<'_>, thresholds: &Thresholds) -> Rest {
    let library = round.best() >= round.best_generic();
    Rest {
        gain_nats: round.best().max(round.best_generic()),
        candidate: best_name(round, sought),
        threshold_nats: if library { thresholds.library } else { thresholds.generic },
        reduced_chi2: round.base.chi2 / round.base.freedom.max(1.0),
    }
}

/// An effect that was found again, when it had been flown with its first size, is one finding.
fn told_once(steps: &mut Vec<Step>) {
    let mut told: Vec<String> = Vec::new();
    steps.retain(|step| match &step.finding {
        Finding::Name { effect, .. } if told.contains(effect) => false,
        Finding::Name { effect, .. } => {
            told.push(effect.clone());
            true
        }
        Finding::Class { .. } | Finding::Unknown { .. } => true,
    });
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

/// Names of a step, with those that lean a drone alike where the lean told it.
fn with_alike(mut names: Vec<String>, candidate: &Candidate) -> Vec<String> {
    if candidate.by_lean {
        let others = super::lean_channel::alike();
        names.extend(others.into_iter().filter(|one| !names.contains(one)).collect::<Vec<_>>());
    }
    names
}

fn finding(names: Vec<String>, was_there: bool, known: Option<Fitted>) -> Finding {
    let parameters = known.into_iter().collect();
    match &names[..] {
        [effect] => Finding::Name { effect: effect.clone(), parameters, was_there },
        _ => Finding::Class { effects: names, parameters },
    }
}

/// The drag of the rotors as a fitted parameter.
fn lean_parameter(size: Size, drag: f64, se: f64) -> Fitted {
    Fitted {
        name: size.name.to_owned(),
        unit: size.unit.to_owned(),
        value: Interval {
            value: drag,
            low: (drag - LEAN_DOUBT.hypot(2.0 * se)).max(0.0),
            high: drag + LEAN_DOUBT.hypot(2.0 * se),
        },
        before: None,
    }
}

/// Standard error of the rotors' drag from a lean, because it depends on the body's drag, which is known to
/// some tenths, s/m: a quarter of a usual size. Chosen.
const LEAN_DOUBT: f64 = 0.005;

/// A signal with its label.
type Axis = (&'static str, fn(&Signals) -> f64);

/// What the form of an effect may be drawn along.
const AXES: [Axis; 4] = [
    ("vertical velocity (m/s)", |signals| signals.climb_mps),
    ("time since arming (s)", |signals| signals.time_s),
    ("height (m)", |signals| signals.height_m),
    ("horizontal air speed (m/s)", |signals| signals.horizontal_mps),
];

/// What one form of an effect does, along that on which it depends most plainly.
fn along_its_signal(comparison: &Comparison, variant: &Variant, beta: f64) -> Shape {
    let along = |of: fn(&Signals) -> f64| -> Vec<(f64, f64)> {
        let groups = comparison.scene.signals.iter().enumerate();
        let points = groups.flat_map(|(group, signals)| {
            let value = move |bin: usize| beta * variant.column.at(group, 0, bin);
            signals.iter().enumerate().map(move |(bin, signals)| (of(signals), value(bin)))
        });
        points.collect()
    };
    let all = AXES.iter().map(|(axis, of)| (*axis, along(*of)));
    let plainest = all.min_by(|a, b| roughness(&a.1).total_cmp(&roughness(&b.1)));
    plainest.map_or_else(Shape::default, |(axis, points)| drawn(axis, points))
}

/// Sum of the squared steps from each point to the next: small where a curve goes through them.
fn roughness(points: &[(f64, f64)]) -> f64 {
    let mut points = points.to_vec();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    points.windows(2).map(|pair| (pair[1].1 - pair[0].1).powi(2)).sum()
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

fn rivals(round: &Round, sought: Sought<'_>) -> Vec<Rival> {
    let effects = round.library.iter().map(|ranked| Rival {
        name: sought.library[ranked.candidate].name.to_owned(),
        generic: false,
        gain_nats: ranked.gain,
    });
    let free = round.generics.iter().map(|free| Rival {
        name: sought.generics[free.generic].depends_on.to_string(),
        generic: true,
        gain_nats: free.gain,
    });
    let mut all: Vec<Rival> = effects.chain(free).filter(|rival| rival.gain_nats > 0.5).collect();
    all.sort_by(|a, b| b.gain_nats.total_cmp(&a.gain_nats));
    all.truncate(10);
    all
}

fn best_name(round: &Round, sought: Sought<'_>) -> String {
    if round.best() >= round.best_generic() {
        let best = round.library.first();
        best.map_or_else(String::new, |one| sought.library[one.candidate].name.to_owned())
    } else {
        let best = round.generics.first();
        best.map_or_else(String::new, |one| sought.generics[one.generic].depends_on.to_string())
    }
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

    #[test]
    fn the_most_is_climbed_to_from_the_best_of_the_starts() {
        let hill = |place: f64| (place > -2.0).then_some(-(place - 1.3).abs());
        let near =
            |starts: &[f64]| most_beside(hill, starts, &[0.5, 0.25, 0.12]).map(|best| best.1);
        assert_eq!(near(&[0.0, -1.0, 1.0]), Some(1.25));
        assert_eq!(near(&[-1.5]), Some(-1.5 + 0.5 + 0.25 + 0.12));
        assert_eq!(near(&[-3.0]), None);
    }

    #[test]
    fn a_model_that_is_flown_again_still_doubts_the_mean_of_few_drones() {
        let data = trial::data(4, |_, _| 0.0);
        let mut vehicle = trial::vehicle();
        Role::ThrustSpread.set(&mut vehicle, 0.02);
        let (simulated, options) = (Simulated::Closed, Options::default());
        let comparison = Comparison::new(&data, &vehicle, &simulated, None).unwrap();
        let first = comparison.spread_doubts(&comparison.vehicle).unwrap();
        let search = Search {
            data: &data,
            vehicle: &vehicle,
            lacked_drag: false,
            simulated: &simulated,
            plan: None,
            options: &options,
            flights: &ModelFlights::default(),
            found: Found::nothing(comparison.clone()),
            comparison,
            refused: Vec::new(),
            last: None,
        };
        let again = search.against_model().unwrap();
        assert!(!first.is_empty(), "four drones are not the fleet");
        assert_eq!(again.spread_doubts(&search.found.vehicle).unwrap(), first);
    }

    #[test]
    fn a_curve_is_smoother_along_what_it_depends_on() {
        let curve: Vec<(f64, f64)> = (0..50).map(|i| (f64::from(i), f64::from(i).sqrt())).collect();
        let shuffled: Vec<(f64, f64)> =
            curve.iter().map(|(x, y)| ((x * 17.0) % 50.0, *y)).collect();
        assert!(roughness(&curve) < 0.1 * roughness(&shuffled));
        let backwards: Vec<(f64, f64)> = curve.iter().rev().copied().collect();
        assert!((roughness(&curve) - roughness(&backwards)).abs() < 1e-9);
    }
}
