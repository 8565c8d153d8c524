//! The updraft that the whole flight is in: what a model lacks can look like an updraft, and the other way round.

use rayon::prelude::*;

use super::super::compare::{Comparison, Simulated, UPDRAFT_DOUBT_MPS};
use super::super::error::GapError;
use super::super::gls::{Column, Likelihood, Problem, Solution, Split, Start};
use super::super::model_flights::View;
use super::super::noise::GroupPattern;
use super::super::refine::{self, slopes};
use super::super::response::{gusts_mps, settled};
use super::super::search::{FLOOR_NATS, FREE_FLOOR_NATS};
use super::bent::Bent;
use super::{Found, In, Look, MOST_GUSTS_MPS, Only, SAME_GUSTS_MPS, Search};
use crate::vehicle::Vehicle;

impl Search<'_> {
    /// What is left in the updraft in which one effect explains the flight best: an updraft that was settled in without
    /// it can have stood for it. `None`: that is out of reach in all of them.
    pub(super) fn look_where_it_explains_most(
        &mut self,
        only: Only,
    ) -> Result<Option<Look>, GapError> {
        let (first, begin) = (self.comparison.clone(), self.found.clone());
        let bins = first.data.bins_of_groups();
        // Without the effect, an updraft in which it is none may explain more than any in which it is one does at first.
        let mut best: Option<((bool, f64), Look, Comparison, Found)> = None;
        let mut is_far = false;
        let bent = self.bends_most(only.effect, only.updraft_mps);
        let mut starts = [&[0.0, only.updraft_mps], &UPDRAFTS_MPS[..]].concat();
        starts.dedup();
        if only.is_bent {
            starts.clear();
        }
        for updraft_mps in starts {
            (self.comparison, self.found) = (first.clone(), begin.clone());
            self.found.updraft_mps = updraft_mps;
            self.found.was_in_updraft = updraft_mps != 0.0;
            match self.against_model() {
                Ok(there) if there.data.bins_of_groups() == bins => self.comparison = there,
                _ => continue,
            }
            let look = self.look_at_beginning()?;
            if only.is_out_of_reach(look.at_most_nats()) {
                is_far = true;
                continue;
            }
            let share = updraft_mps / UPDRAFT_DOUBT_MPS;
            let explained = look.explained();
            let by = (explained.lacks_effect, explained.nats - 0.5 * share * share);
            if best.as_ref().is_none_or(|(most, ..)| by > *most) {
                best = Some((by, look, self.comparison.clone(), self.found.clone()));
            }
        }
        let most = best.as_ref().map_or(f64::NEG_INFINITY, |((_, most), ..)| *most);
        // It was flown, and the others are not yet.
        let is_more = |bent: &Bent| bent.nats > (most - FLOOR_NATS).max(only.beaten_nats);
        if let Some(bent) = bent.filter(is_more) {
            (self.comparison, self.found) = (first.clone(), begin.clone());
            if let Some(look) = self.look_where_it_bends(bent)? {
                return Ok(Some(look));
            }
        }
        if only.is_bent {
            (self.comparison, self.found) = (first, begin);
            return Ok(None);
        }
        let Some((_, look, comparison, found)) = best else {
            (self.comparison, self.found) = (first, begin);
            return if is_far { Ok(None) } else { self.look(In::Present(None)).map(Some) };
        };
        (self.comparison, self.found) = (comparison, found);
        Ok(Some(look))
    }

    /// What is left in the updraft that explains most, or in still air with the effect that explains most: what
    /// a model lacks can look like an updraft, and the other way round.
    pub(super) fn look_in_likelier_updraft(&mut self) -> Result<Look, GapError> {
        if !self.found.steps.is_empty() {
            return self.look_in_updraft_of_findings();
        }
        let look = self.look(In::Settled)?;
        if self.found.updraft_mps.abs() < STILL_MPS {
            return Ok(look);
        }
        let was_in_updraft = std::mem::replace(&mut self.found.was_in_updraft, true);
        let there = (self.comparison.clone(), self.found.clone());
        (self.found.updraft_mps, self.found.was_in_updraft) = (0.0, was_in_updraft);
        self.comparison = self.against_model()?;
        // In the same noise: how drones scatter must not choose an updraft.
        let still = self.look(In::Present(Some(&look.seen.patterns)))?;
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

    /// What is left in the updraft that explains most with what was found, if that, fitted there, explains more than
    /// it did where it was found.
    fn look_in_updraft_of_findings(&mut self) -> Result<Look, GapError> {
        let before = (self.comparison.clone(), self.found.clone());
        let look = self.look(In::Settled)?;
        if self.found.updraft_mps == before.1.updraft_mps {
            return Ok(look);
        }
        let is_more = self.is_fitted_here()? && self.found.explains()? > before.1.explains()?;
        if is_more {
            self.found.was_in_updraft |= self.found.updraft_mps.abs() >= STILL_MPS;
        } else {
            (self.comparison, self.found) = before;
        }
        self.look(In::Present(None))
    }

    /// Fits what was found in the present updraft, and flies the model there; whether it flies the same bins.
    pub(super) fn is_fitted_here(&mut self) -> Result<bool, GapError> {
        let bins = self.found.comparison.data.bins_of_groups();
        for is_refitted in [false, true] {
            if is_refitted {
                if self.found.parameters.is_empty() {
                    break;
                }
                self.found.refit(&self.comparison)?;
            }
            match self.against_model() {
                Err(error) if error.is_not_flown() => return Ok(false),
                flown => self.comparison = flown?,
            }
            if self.comparison.data.bins_of_groups() != bins {
                return Ok(false);
            }
        }
        self.found.comparison = self.comparison.clone();
        Ok(true)
    }

    /// What is left in the updraft in which the whole flight is likeliest, each flown by the model and with drones that
    /// answer gusts as they do there, if that explains clearly more. Elsewhere the updraft was chosen by what the drones
    /// have in common: with a curve that is flat in hover, drones that answer gusts as in still air hide where they are.
    pub(super) fn look_in_likeliest_flight(&mut self, look: Look) -> Result<Look, GapError> {
        let here = look.explained();
        if !here.lacks_effect && !here.lacks_shape && !self.options.each_flown {
            return Ok(look);
        }
        let starts = [&[0.0], &UPDRAFTS_MPS[..]].concat();
        let nearest = self.nearest_flight_mps(&starts);
        let of = |starts: &[f64], step| self.likeliest_flight(&look.seen.start, starts, step);
        // In calm air few hundredths of a metre per second are the likeliest, and steps from afar miss them.
        let beside = nearest.and_then(|mps| of(&[mps], NEAR_STEP));
        let likeliest = of(&starts, FAR_STEP).into_iter().chain(beside);
        let best = likeliest.reduce(|one, other| if other.0 > one.0 { other } else { one });
        let Some((_, updraft_mps)) = best else { return Ok(look) };
        let is_asked = self.options.most_steps == 0 && self.options.each_flown;
        if (updraft_mps - self.found.updraft_mps).abs() < SAME_FLIGHT_MPS && !is_asked {
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
    pub(super) fn goes_where_it_is_likelier(&mut self, start: &Start) -> Result<bool, GapError> {
        let before_nats = self.found.explains()?;
        let beaten_nats = self.options.only.map_or(f64::NEG_INFINITY, |only| only.beaten_nats);
        if before_nats < beaten_nats - BEATEN_NATS {
            return Ok(false);
        }
        let nats = self.climbs(before_nats)?;
        let went = nats > before_nats;
        let noise = if went { self.found.noise.clone() } else { start.clone() };
        let of = |updraft_mps: f64| self.likely_in(updraft_mps, &noise);
        let here = all_of(of, &[self.found.updraft_mps]);
        let here_nats = here.first().map_or(NOWHERE, |here| here.0);
        let likeliest = most_beside(of, here, ROUGH_STEP);
        let elsewhere = likeliest.filter(|(nats, _)| *nats > here_nats + SAME_FLIGHT_NATS);
        if let Some((_, updraft_mps)) = elsewhere
            && let Some(nats) = self.goes_to(updraft_mps, nats)?
        {
            self.climbs(nats)?;
            return Ok(true);
        }
        Ok(went)
    }

    /// Goes into the updrafts that the slopes lead to, with all sizes free, as long as that explains more than the present
    /// one, nats; what is explained at the end, nats.
    fn climbs(&mut self, mut nats: f64) -> Result<f64, GapError> {
        for _ in 0..UPDRAFT_ROUNDS {
            let Self { comparison, found, .. } = &*self;
            let patterns = comparison.patterns(&found.vehicle, found.gusts_mps)?;
            let mut free = found.extras.clone();
            free.extend(slopes(comparison, &found.vehicle, &found.parameters)?);
            let at_mps = found.updraft_mps;
            let Some(here) =
                InUpdraft::fitted(comparison, &patterns, found, &free, &found.noise, at_mps)
            else {
                break;
            };
            let step_mps = (here.most_mps - at_mps).clamp(-UPDRAFT_STEP_MPS, UPDRAFT_STEP_MPS);
            if step_mps.abs() < HARDLY_TOLD_MPS {
                break;
            }
            let gone = match self.goes_to(at_mps + step_mps, nats)? {
                None => self.goes_to(at_mps + 0.5 * step_mps, nats)?,
                gone => gone,
            };
            let Some(there_nats) = gone else { break };
            nats = there_nats;
        }
        Ok(nats)
    }

    /// Goes into an updraft, with sizes that are fitted there, if that explains more than the present one, nats; how much,
    /// nats, if it went.
    fn goes_to(&mut self, updraft_mps: f64, here_nats: f64) -> Result<Option<f64>, GapError> {
        let before = (self.comparison.clone(), self.found.clone());
        self.found.updraft_mps = updraft_mps;
        if self.is_fitted_here()?
            && self.comparison.raw_gap_us()? < NEAR * before.0.raw_gap_us()?
            && let nats = self.found.explains()?
            && nats > here_nats
        {
            self.found.was_in_updraft = true;
            return Ok(Some(nats));
        }
        (self.comparison, self.found) = before;
        Ok(None)
    }

    /// How likely the flight of the present model is in the updraft in which it is likeliest, nats, and that updraft, m/s,
    /// near the best of some starts; `None`: it can fly in none.
    fn likeliest_flight(
        &self,
        noise: &Start,
        starts_mps: &[f64],
        step: StepMps,
    ) -> Option<(f64, f64)> {
        let of = |updraft_mps: f64| self.likely_in(updraft_mps, noise);
        most_beside(of, all_of(of, starts_mps), step)
    }

    /// The updraft in which the present model, flown, is nearest to the logs, m/s, from the best of some starts.
    fn nearest_flight_mps(&self, starts_mps: &[f64]) -> Option<f64> {
        let bins = self.comparison.data.bins_of_groups();
        let nearness = |updraft_mps: f64| {
            let there = self.flown_in(updraft_mps).ok()?;
            let is_alike = there.data.bins_of_groups() == bins;
            there.raw_gap_us().ok().filter(|_| is_alike).map(|gap_us| -gap_us * gap_us)
        };
        let step = StepMps { ends_mps: 0.06, ..FAR_STEP };
        Some(most_beside(nearness, all_of(nearness, starts_mps), step)?.1)
    }

    /// How likely the flight of the present model is in an updraft, nats; `None`: it cannot fly the same bins there.
    fn likely_in(&self, updraft_mps: f64, noise: &Start) -> Option<f64> {
        let fit = || self.fitted_in(updraft_mps, noise.clone());
        if !self.has_model() {
            return fit();
        }
        let view = View::of(&self.comparison, updraft_mps, (noise, self.found.gusts_mps));
        self.flights.likely(view, fit)
    }

    fn fitted_in(&self, updraft_mps: f64, noise: Start) -> Option<f64> {
        let Found { vehicle, parameters, gusts_mps, .. } = &self.found;
        let there = self.flown_in(updraft_mps).ok()?;
        if there.data.bins_of_groups() != self.comparison.data.bins_of_groups() {
            return None;
        }
        let doubts = refine::doubts(&there, vehicle, parameters).ok()?;
        likely_if(&there, vehicle, &doubts, (noise, *gusts_mps))
    }

    /// Whether the flight may have been in another updraft. A table has the climb that was flown, not the one
    /// commanded: nothing flies it again in another air.
    pub(super) fn may_differ_in_updraft(&self) -> bool {
        self.options.updraft && !matches!(self.simulated, Simulated::Closed)
    }

    /// Goes into the updraft that the whole flight most probably is in: where the response is curved, that
    /// changes how the pulse goes with climb. With what explains most there.
    pub(super) fn settle_updraft(
        &mut self,
        free: &[Column],
        start: Solution,
    ) -> Result<Solution, GapError> {
        let mut solution = start;
        let mut starts = vec![self.found.updraft_mps];
        if self.found.steps.is_empty() {
            starts.extend(UPDRAFTS_MPS);
        }
        for _ in 0..FLOWN_ROUNDS {
            let Self { comparison, found, .. } = self;
            // How drones answer gusts stays as it is meanwhile: their scatter must not choose an updraft.
            let patterns = comparison.patterns(&found.vehicle, found.gusts_mps)?;
            let fit = |noise: &Start, updraft_mps: f64| {
                InUpdraft::fitted(comparison, &patterns, found, free, noise, updraft_mps)
            };
            let noise = Start::from(&solution);
            let Some(here) = fit(&noise, found.updraft_mps) else { break };
            let here_nats = here.likely;
            let modes = likeliest(fit, &starts, &noise);
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
            let (noise, updraft_mps) = (Start::from(&best.solution), best.updraft_mps);
            let again =
                InUpdraft::fitted(&there, &patterns, &self.found, free, &noise, updraft_mps);
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
            let (noise, at_mps) = (Start::from(&mode.solution), mode.updraft_mps);
            let again = InUpdraft::fitted(&there, &patterns, found, &[], &noise, at_mps);
            if let Some(again) = again.filter(|again| again.likely > most) {
                (best, most) = (Some(mode), again.likely);
            }
        }
        self.found.updraft_mps = before_mps;
        Ok(Some(best.unwrap_or(here)))
    }
}

/// How likely a flight is if a vehicle flew it in just the updraft of a comparison, nats, beside what else is doubted, from a noise
/// and its gusts (m/s); `None`: the vehicle cannot fly so.
pub(super) fn likely_if(
    comparison: &Comparison,
    vehicle: &Vehicle,
    doubts: &[Column],
    (mut noise, mut gusts): (Start, f64),
) -> Option<f64> {
    let known = doubts.get(1..).unwrap_or_default();
    let share = comparison.scene.updraft_mps / UPDRAFT_DOUBT_MPS;
    let known_nats = comparison.lean_misfit_nats() + 0.5 * share * share;
    // The gusts of a noise bend the model's curve, so twice.
    for is_last in [false, true] {
        let patterns = comparison.patterns(vehicle, gusts).ok()?;
        let residual = Split::of(&comparison.residual(vehicle, gusts).ok()?);
        let problem = Problem::new(&patterns, &residual).doubting(known);
        let fit = problem.fit(noise, Likelihood::Profile);
        let next = gusts_mps(&fit.hyper).min(MOST_GUSTS_MPS);
        if is_last || (next - gusts).abs() < SAME_GUSTS_MPS {
            let likely = settled(&problem, fit, |_| patterns.clone()).1.log_posterior();
            return likely.is_finite().then_some(likely - known_nats);
        }
        (noise, gusts) = (Start::from(&fit), next);
    }
    None
}

/// How the most of something is looked for beside a start, m/s.
#[derive(Clone, Copy, Debug)]
struct StepMps {
    /// First step to either side.
    begins_mps: f64,
    /// Steps that are shorter are none.
    ends_mps: f64,
    /// Places by parabolas, at most.
    parabolas: usize,
}

/// How much something is at some places.
fn all_of(of: impl Fn(f64) -> Option<f64> + Sync, places: &[f64]) -> Vec<(f64, f64)> {
    places.par_iter().map(|place| (of(*place).unwrap_or(NOWHERE), *place)).collect()
}

/// The most that something is, and where: from the best of the places that were tried by parabolas through them, of which it
/// is nearly one; `None`: it is nowhere.
fn most_beside(
    of: impl Fn(f64) -> Option<f64> + Sync,
    mut tried: Vec<(f64, f64)>,
    StepMps { begins_mps, ends_mps, parabolas }: StepMps,
) -> Option<(f64, f64)> {
    for _ in 0..parabolas {
        let best = most_of(&tried)?;
        let side = |sign: f64| {
            let beyond = tried.iter().filter(|one| sign * (one.1 - best.1) > 0.0);
            beyond.min_by(|a, b| (sign * a.1).total_cmp(&(sign * b.1))).copied()
        };
        let next = match (side(-1.0), side(1.0)) {
            (Some(below), Some(above)) => {
                let place = beside_top([below, best, above]);
                let is_new =
                    [below, best, above].iter().all(|one| (one.1 - place).abs() >= 0.5 * ends_mps);
                if !is_new {
                    break;
                }
                vec![place]
            }
            (below, above) => {
                let sides = [(below, -begins_mps), (above, begins_mps)];
                let open = sides.into_iter().filter(|(known, _)| known.is_none());
                open.map(|(_, step_mps)| best.1 + step_mps).collect()
            }
        };
        tried.extend(all_of(&of, &next));
    }
    most_of(&tried)
}

/// The most of what was tried, where it was anything.
fn most_of(tried: &[(f64, f64)]) -> Option<(f64, f64)> {
    let somewhere = tried.iter().copied().filter(|one| one.0 > NOWHERE);
    somewhere.reduce(|one, other| if other.0 > one.0 { other } else { one })
}

/// Where a parabola through three places, the middle one with the most, has its top; between the outer ones, and not at either of
/// them.
fn beside_top([below, best, above]: [(f64, f64); 3]) -> f64 {
    let [back, ahead] = [best.1 - below.1, above.1 - best.1];
    let [fallen, falls] = [best.0 - below.0, best.0 - above.0];
    if !(fallen + falls).is_finite() {
        // Nothing flies on one side: halfway to it.
        return if fallen.is_finite() { best.1 + 0.5 * ahead } else { best.1 - 0.5 * back };
    }
    let steep = fallen * ahead + falls * back;
    let top = if steep > 0.0 {
        0.5 * (fallen * ahead * ahead - falls * back * back) / steep
    } else {
        0.0
    };
    best.1 + top.clamp(-0.8 * back, 0.8 * ahead)
}

/// The updrafts that explain most, best first, by Gauss and Newton from the first of some starts and the best of the
/// others to either side; none: the vehicle can fly in none of them.
fn likeliest(
    fit: impl Fn(&Start, f64) -> Option<InUpdraft> + Sync,
    starts_mps: &[f64],
    noise: &Start,
) -> Vec<InUpdraft> {
    let there: Vec<Option<InUpdraft>> =
        starts_mps.par_iter().map(|start_mps| fit(noise, *start_mps)).collect();
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
fn climbed(fit: &impl Fn(&Start, f64) -> Option<InUpdraft>, start: InUpdraft) -> InUpdraft {
    let mut best = start;
    for _ in 0..UPDRAFT_ROUNDS {
        let (at_mps, likely) = (best.updraft_mps, best.likely);
        let noise = Start::from(&best.solution);
        let step_mps = (best.most_mps - at_mps).clamp(-UPDRAFT_STEP_MPS, UPDRAFT_STEP_MPS);
        if step_mps.abs() < UPDRAFT_SETTLED_MPS {
            break;
        }
        for share in [1.0, 0.5] {
            if let Some(there) = fit(&noise, at_mps + share * step_mps) {
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
pub(super) struct InUpdraft {
    updraft_mps: f64,
    solution: Solution,
    /// How likely the flight is there, nats but for a constant.
    pub(super) likely: f64,
    /// Updraft that explains most, as far as the slopes at this one tell, m/s.
    pub(super) most_mps: f64,
}

impl InUpdraft {
    /// `None`: the vehicle cannot fly so.
    pub(super) fn fitted(
        comparison: &Comparison,
        patterns: &[GroupPattern],
        found: &Found,
        free: &[Column],
        noise: &Start,
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
        let solution = problem.fit(noise, Likelihood::Profile);
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
pub(super) const UPDRAFTS_MPS: [f64; 4] = [-1.0, 1.0, -2.0, 2.0];
/// Half of what a flight tells of its updraft at best, m/s. Chosen.
const HARDLY_TOLD_MPS: f64 = 0.03;
/// How the updraft of the likeliest flight is found. Numerical.
const FAR_STEP: StepMps = StepMps { begins_mps: 0.5, ends_mps: HARDLY_TOLD_MPS, parabolas: 6 };
/// The same with what was found already: rougher, as all sizes are fitted anew where it leads to.
const ROUGH_STEP: StepMps = StepMps { begins_mps: 0.5, ends_mps: 0.12, parabolas: 6 };
/// The same where the model itself is nearest: what is likeliest farther away than two steps is found from afar.
const NEAR_STEP: StepMps = StepMps { begins_mps: 0.06, ends_mps: HARDLY_TOLD_MPS, parabolas: 3 };
/// What cannot be flown is as unlikely as this.
const NOWHERE: f64 = f64::NEG_INFINITY;
/// A flight that is less likely than what was found by this much is not looked for elsewhere, nats. Chosen: of 27 that were in
/// foreign flights none gained more than 10.
const BEATEN_NATS: f64 = 40.0;
/// A flight elsewhere that is likelier by less is the same, nats.
const SAME_FLIGHT_NATS: f64 = 1.0;
/// The likeliest flight in an updraft this near to that of a search is no other, m/s. Chosen: from there its own steps lead on.
const SAME_FLIGHT_MPS: f64 = 0.25;
/// A raw gap that is larger by this factor is that of a model in the wrong updraft. Chosen: the air that all drones share
/// makes more or less of it by chance.
pub(super) const NEAR: f64 = 1.1;
/// A side of still air whose best start explains less by this much is left alone, nats. Chosen: far more than
/// [`SAME_NATS`], as starts are no tops.
const OTHER_SIDE_NATS: f64 = 100.0;
/// Rounds in which the model is flown, and drones' answers to gusts are taken, in the updraft of the round before.
/// Numerical.
const FLOWN_ROUNDS: usize = 2;
/// Rounds in which the updraft settles, at most. Numerical.
pub(super) const UPDRAFT_ROUNDS: usize = 6;
/// Longest step of the updraft in one round, m/s: a slope is no more than a hint. Chosen.
const UPDRAFT_STEP_MPS: f64 = 1.0;
/// By how much less likely a flight may become where its updraft is flown, nats: what the drones' answers to gusts
/// make of it there. Chosen, three times [`super::WORSE_NATS`].
const SAME_NATS: f64 = 6.0;
/// A step of the updraft that is none, m/s: far below what a flight tells of it.
const UPDRAFT_SETTLED_MPS: f64 = 0.01;

#[cfg(test)]
mod tests {
    use super::super::super::model_flights::ModelFlights;
    use super::super::super::trial;
    use super::super::Options;
    use super::super::tests::begun;
    use super::*;
    use crate::effects::{Model, Signals};

    /// A search, begun on drones that flew in an updraft, with what it makes of it.
    fn in_air<T>(updraft_mps: f64, of: impl FnOnce(&mut Search<'_>) -> T) -> (T, f64) {
        let (vehicle, simulated) = (trial::vehicle(), Simulated::Closed);
        let model = Model::of(&vehicle).unwrap();
        let pulse_us = |climb_mps: f64| {
            let here = Signals { height_m: 30.0, density_ratio: 1.0, ..Signals::default() };
            model.pulse_us(&Signals { climb_mps, ..here })
        };
        let data = trial::data(4, |drone, bin| {
            let climb_mps = bin.climb_mps();
            let ripple_us = 0.1 * f64::from((7 * bin.segment as i32 + 3 * drone as i32) % 5 - 2);
            pulse_us(climb_mps - updraft_mps) - pulse_us(climb_mps) + ripple_us
        });
        let comparison = Comparison::new(&data, &vehicle, &simulated, None).unwrap();
        let (options, flights) = (Options::default(), ModelFlights::default());
        let mut search = begun(&data, &vehicle, (&simulated, &options, &flights), comparison);
        let made = of(&mut search);
        (made, search.found.updraft_mps)
    }

    #[test]
    fn an_updraft_is_gone_into_only_where_the_flight_is_explained_better_there() {
        let went = |search: &mut Search<'_>, to_mps: f64| {
            let here_nats = search.found.explains().unwrap();
            search.goes_to(to_mps, here_nats).unwrap().is_some()
        };
        let goes = |to_mps: f64| in_air(1.0, |search| went(search, to_mps));
        assert_eq!(goes(1.0), (true, 1.0));
        assert_eq!(goes(-1.0), (false, 0.0), "and otherwise everything is as before");
        let (went, _) = in_air(0.0, |search| went(search, -0.002));
        assert!(!went, "as near to the logs, and nothing is gained");
    }

    #[test]
    fn slopes_lead_to_the_updraft_of_the_flight() {
        let climbs = |search: &mut Search<'_>| {
            let before_nats = search.found.explains().unwrap();
            search.climbs(before_nats).unwrap() > before_nats
        };
        let (went, updraft_mps) = in_air(0.6, climbs);
        assert!(went && (updraft_mps - 0.6).abs() < 0.1, "{updraft_mps}");
        let (went, updraft_mps) = in_air(0.0, climbs);
        assert!(!went && updraft_mps == 0.0, "{updraft_mps}");
    }

    #[test]
    fn the_most_is_climbed_to_from_the_best_of_the_starts() {
        let hill = |place: f64| (place > -2.0).then_some(-(place - 1.3).abs());
        let near =
            |starts: &[f64]| most_beside(hill, all_of(hill, starts), FAR_STEP).map(|best| best.1);
        let found = |starts: &[f64]| near(starts).map(|place| (10.0 * place).round() / 10.0);
        assert_eq!(found(&[0.0, -1.0, 1.0]), Some(1.3));
        assert_eq!(found(&[0.6]), Some(1.3));
        assert_eq!(near(&[-3.0]), None);
        // Beside the nearest flight it is not climbed far.
        let (_, beside) = most_beside(hill, all_of(hill, &[0.0]), NEAR_STEP).unwrap();
        assert!((beside - 3.0 * NEAR_STEP.begins_mps).abs() < 1e-9, "{beside}");
    }

    #[test]
    fn an_updraft_in_which_an_effect_is_out_of_reach_is_left_out() {
        let looks = |beaten_nats: f64| {
            let only = Only { effect: "battery", updraft_mps: 0.0, beaten_nats, is_bent: false };
            let (seen, _) = in_air(0.6, |search| {
                search.look_where_it_explains_most(only).unwrap().map(|look| look.explained().nats)
            });
            seen
        };
        let near = looks(f64::NEG_INFINITY).unwrap();
        assert_eq!(looks(near), Some(near), "as well explained as what was found");
        assert_eq!(looks(near + 1e4), None);
    }
}
