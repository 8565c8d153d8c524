//! One look at a flight: what the model with the present findings leaves, in its air and noise, and what may explain it.

use std::sync::{Arc, OnceLock};

use super::super::candidates::{
    Candidate, Updraft, Variant, axial_drag, form_of, library, of_the_air, one, read_otherwise, set,
};
use super::super::error::GapError;
use super::super::generic::{Generic, all};
use super::super::gls::{Column, Likelihood, Problem, Split, Start};
use super::super::model_flights::View;
use super::super::noise::GroupPattern;
use super::super::refine::{self, slopes};
use super::super::response::gusts_mps;
use super::super::search::{
    Based, FLOOR_NATS, FREE_FLOOR_NATS, Ranked, Round, Sought, based, gains_at_once, round_on,
};
use super::{MOST_GUSTS_MPS, Search};
use crate::effects::Role;

/// The updraft in which is looked.
#[derive(Clone, Copy)]
pub(super) enum In<'a> {
    /// The one that explains most.
    Settled,
    /// The present one; in noise of these patterns, if there are any.
    Present(Option<&'a [GroupPattern]>),
}

/// In its own noise an effect gains more than at once, in the noise without it, which is larger: by no more than this, nats, beside
/// [`MOST_TIMES`] as much. Chosen: of 40 looks two gained more, by 26 nats at most, in updrafts that were out of reach by 600.
const MOST_NATS: f64 = 300.0;
/// See [`MOST_NATS`].
const MOST_TIMES: f64 = 4.0;

/// How often a size is fitted. Numerical: the sizes that are tried are within some times the right one, and each fit is much nearer.
const SIZES: usize = 3;
/// Sizes that differ by less are the same, as a share of what is new in one. Numerical.
const SAME_SIZE: f64 = 0.01;

/// A flight as it is seen before anything is sought in it.
#[derive(Clone, Debug)]
pub(in crate::gap) struct Seen {
    pub(super) patterns: Vec<GroupPattern>,
    residual: Split,
    /// Regressors that are not judged: what was found before, whose size may change with what comes after.
    free: Vec<Column>,
    doubts: Vec<Column>,
    /// Noise and air.
    pub(super) start: Start,
    /// Gusts of that noise, with which the model's curve was bent, m/s.
    gusts_mps: f64,
    /// How unlikely the leans are, nats.
    lean_misfit_nats: f64,
    /// The model with its noise, if that was fitted already.
    based: Option<Based>,
}

impl Seen {
    fn problem(&self) -> Problem<'_> {
        Problem::new(&self.patterns, &self.residual).doubting(&self.doubts).with(&self.free)
    }
}

/// A flight as it is seen, and all that is sought in it in one round.
#[derive(Clone)]
pub(super) struct Look {
    pub seen: Arc<Seen>,
    pub candidates: Vec<Candidate>,
    pub generics: Vec<Generic>,
    drones: Vec<usize>,
    /// How well the flight is explained, nats above the threshold, where that is known of what is sought already.
    pub by_form_nats: Option<f64>,
    /// What explains how much, once it is computed.
    round: OnceLock<Round>,
}

/// How well a look's air and noise explain the flight, with the best effect.
pub(super) struct Explained {
    /// Log-posterior, that of the leans as well, and what the best effect gains above its threshold, nats.
    pub nats: f64,
    /// Whether an effect gains more than its threshold.
    pub lacks_effect: bool,
    /// Whether a free shape does.
    pub lacks_shape: bool,
}

impl Look {
    pub(super) fn explained(&self) -> Explained {
        let round = self.round();
        let by_effect = (round.best() - FLOOR_NATS).max(0.0);
        let nats = round.base.log_posterior() - self.seen.lean_misfit_nats + by_effect;
        Explained {
            nats: self.by_form_nats.map_or(nats, |by_form| nats.max(by_form)),
            lacks_effect: by_effect > 0.0,
            lacks_shape: round.best_generic() > FREE_FLOOR_NATS,
        }
    }

    /// How well the flight is explained here at most, nats, once the noise is fitted to what is sought.
    pub(super) fn at_most_nats(&self) -> f64 {
        let Some((_, base)) = &self.seen.based else { return f64::INFINITY };
        let at_once = gains_at_once(base, self.sought());
        base.log_posterior() - self.seen.lean_misfit_nats + MOST_NATS + MOST_TIMES * at_once
    }

    /// Gives the last form of the only effect that is sought what it is known to explain, in this noise, where it explains too little on
    /// top of a model that flew without: near its limits that flew elsewhere.
    pub(super) fn fitted_as(&mut self, noise: &Start) {
        let Some(nats) = self.by_form_nats else { return };
        let round = self.round();
        let [candidate] = &self.candidates[..] else { return };
        let Some(form) = candidate.variants.last() else { return };
        let is_found = |one: &Ranked| one.gain.min(one.plain) > FLOOR_NATS;
        if round.library.iter().any(is_found) {
            return;
        }
        let without_nats = round.base.log_posterior() - self.seen.lean_misfit_nats;
        let gain = nats + FLOOR_NATS - without_nats;
        let ranked = Ranked {
            candidate: 0,
            variant: candidate.variants.len() - 1,
            gain,
            plain: gain,
            beta: 1.0,
            size_us: form.column.spread(&self.drones),
            range_us: form.column.range(),
            noise: noise.clone(),
            fitted: true,
        };
        self.round = OnceLock::from(Round { library: vec![ranked], ..round.clone() });
    }

    pub(super) fn round(&self) -> &Round {
        self.round.get_or_init(|| {
            let (problem, seen) = (self.problem(), &self.seen);
            let first = seen.based.clone().unwrap_or_else(|| based(&problem, &seen.start, true));
            round_on(&problem, first, self.sought(), true)
        })
    }

    pub(super) fn problem(&self) -> Problem<'_> {
        self.seen.problem()
    }

    pub(super) fn sought(&self) -> Sought<'_> {
        let Self { candidates, generics, drones, .. } = self;
        Sought { library: candidates, generics, drones }
    }
}

impl Search<'_> {
    /// The rest that the model leaves, and everything that may explain it.
    pub(super) fn look(&mut self, updraft: In<'_>) -> Result<Look, GapError> {
        let seen = self.seen(updraft)?;
        self.look_at(Arc::new(seen))
    }

    /// The rest in the present updraft, before anything was found: to each effect that alone is searched for it looks the
    /// same.
    pub(super) fn look_at_beginning(&mut self) -> Result<Look, GapError> {
        let (found, flights) = (&self.found, self.flights);
        let noise = (&found.noise, found.gusts_mps);
        let view = View::of(&self.comparison, found.updraft_mps, noise);
        let seen = flights.seen(view, || {
            let mut seen = self.seen(In::Present(None))?;
            seen.based = Some(based(&seen.problem(), &seen.start, true));
            Ok(seen)
        })?;
        self.found.gusts_mps = seen.gusts_mps;
        self.look_at(seen)
    }

    /// A look with the effect that explains most in the size that does so: those that are tried are far apart, and where air and
    /// noise are small a multiple of one is no other.
    pub(super) fn at_fitted_size(&self, mut look: Look) -> Result<Look, GapError> {
        for _ in 0..SIZES {
            let Some((candidate, form)) = self.fitted_form(&look)? else { break };
            let mut there = Look { round: OnceLock::new(), ..look.clone() };
            there.candidates[candidate].variants = vec![form];
            if there.explained().nats <= look.explained().nats {
                break;
            }
            look = there;
        }
        Ok(look)
    }

    /// The form of the effect that explains most in the size that its best form says, and that effect's place; `None`: it has that size,
    /// explains too little to be found, leans tell its size, or the vehicle cannot fly so.
    fn fitted_form(&self, look: &Look) -> Result<Option<(usize, Variant)>, GapError> {
        let is_much = |best: &&Ranked| best.gain.max(best.plain) > FLOOR_NATS;
        let Some(best) = look.round().library.first().filter(is_much) else { return Ok(None) };
        let candidate = &look.candidates[best.candidate];
        let variant = &candidate.variants[best.variant];
        let is_told = self.lacked_drag && Role::MomentumDrag.is_of(candidate.name);
        if candidate.by_lean || is_told {
            return Ok(None);
        }
        let (Some(size), Some(vehicle), None) =
            (candidate.size, &variant.vehicle, variant.updraft_mps)
        else {
            return Ok(None);
        };
        let by = variant.size - size.now;
        let fitted = (size.now + best.beta * by).clamp(size.low, size.high);
        if (fitted - variant.size).abs() < SAME_SIZE * by.abs() {
            return Ok(None);
        }
        let mut with = vehicle.clone();
        set(&mut with, candidate.name, size.name, fitted);
        let there = form_of(&with, fitted, (&self.found.vehicle, &self.comparison))?;
        let Variant { form, price_nats, .. } = *variant;
        Ok(there.map(|there| (best.candidate, Variant { form, price_nats, ..there })))
    }

    fn seen(&mut self, updraft: In<'_>) -> Result<Seen, GapError> {
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
            .fit(&found.noise, Likelihood::Profile);
        if matches!(updraft, In::Settled) && self.may_differ_in_updraft() {
            quick = self.settle_updraft(&free, quick)?;
        }
        let Self { comparison, found, .. } = self;
        let doubts = refine::doubts(comparison, &found.vehicle, &found.parameters)?;
        found.gusts_mps = gusts_mps(&quick.hyper).min(MOST_GUSTS_MPS);
        let patterns = match updraft {
            In::Present(Some(patterns)) => patterns.to_vec(),
            _ => comparison.patterns(&found.vehicle, found.gusts_mps)?,
        };
        let residual = Split::of(&comparison.residual(&found.vehicle, found.gusts_mps)?);
        Ok(Seen {
            patterns,
            residual,
            free,
            doubts,
            start: Start::from(&quick),
            gusts_mps: found.gusts_mps,
            lean_misfit_nats: comparison.lean_misfit_nats(),
            based: None,
        })
    }

    fn look_at(&self, seen: Arc<Seen>) -> Result<Look, GapError> {
        let Self { comparison, found, refused, lacked_drag, .. } = self;
        let updraft = if self.may_differ_in_updraft() { Updraft::MayDiffer } else { Updraft::Same };
        let only = self.options.only.filter(|_| found.steps.is_empty());
        let is_wanted = |name: &str| only.is_none_or(|only| only.effect == name);
        let mut candidates = match only {
            Some(only) => {
                one(&found.vehicle, comparison, updraft, only.effect)?.into_iter().collect()
            }
            None => library(&found.vehicle, comparison, updraft)?,
        };
        let is_asked = only.is_some_and(|only| Role::MomentumDrag.is_of(only.effect));
        if only.is_none() || is_asked {
            candidates.extend(axial_drag(&found.vehicle, comparison, *lacked_drag, is_asked)?);
        }
        let reads_otherwise = Role::RotorDrag.place().is_some_and(|place| is_wanted(place.name()));
        if reads_otherwise && !comparison.is_in_other_wind() {
            candidates.extend(read_otherwise(comparison, &found.vehicle, updraft)?);
        }
        candidates.retain(|candidate| !refused.contains(&candidate.name));
        let mut generics = Vec::new();
        if only.is_none() {
            candidates.extend(of_the_air(&comparison.scene, &seen.patterns, &seen.start.hyper));
            generics = all(&comparison.scene, &comparison.headings());
        }
        let drones = comparison.data.counts();
        Ok(Look { seen, candidates, generics, drones, by_form_nats: None, round: OnceLock::new() })
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::compare::{Comparison, Simulated};
    use super::super::super::model_flights::ModelFlights;
    use super::super::super::trial;
    use super::super::tests::begun;
    use super::super::{Only, Options};
    use super::*;
    use crate::effects::{Model, Signals};

    #[test]
    fn effects_that_are_each_searched_for_alone_see_the_same_flight() {
        let data = trial::data(3, |_, bin| 4.0 * bin.climb_mps().abs());
        let (vehicle, simulated) = (trial::vehicle(), Simulated::Closed);
        let comparison = Comparison::new(&data, &vehicle, &simulated, None).unwrap();
        let flights = ModelFlights::default();
        let look = |effect: &'static str, gusts_mps: f64| {
            let only = Some(Only { effect, updraft_mps: 0.0, beaten_nats: 0.0, is_bent: false });
            let options = Options { only, ..Options::default() };
            let given = (&simulated, &options, &flights);
            let mut search = begun(&data, &vehicle, given, comparison.clone());
            search.found.gusts_mps = gusts_mps;
            let look = search.look_at_beginning().unwrap();
            assert_eq!(search.found.gusts_mps, look.seen.gusts_mps);
            assert!(look.generics.is_empty());
            look
        };
        let effects = ["thrust-curve", "battery", "parasitic-drag"];
        let looks = effects.map(|effect| look(effect, 0.0));
        for (effect, there) in effects.iter().zip(&looks) {
            assert!(Arc::ptr_eq(&there.seen, &looks[0].seen), "{effect} looks again");
            assert!(!there.candidates.is_empty(), "{effect}");
            assert!(there.candidates.iter().all(|one| one.name == *effect), "{effect}");
        }
        assert!(!Arc::ptr_eq(&look("battery", 0.3).seen, &looks[0].seen), "in other gusts");
        // What was fitted already is what would be fitted.
        let round = looks[0].round();
        let seen = Seen { based: None, ..looks[0].seen.as_ref().clone() };
        let anew = Look { seen: Arc::new(seen), round: OnceLock::new(), ..looks[0].clone() };
        assert_eq!(anew.round().best().to_bits(), round.best().to_bits());
    }

    #[test]
    fn an_effect_is_looked_at_in_the_size_that_explains_most() {
        let (vehicle, simulated) = (trial::vehicle(), Simulated::Closed);
        let drag = Role::BodyDragTop.place().unwrap().name();
        let mut with = vehicle.clone();
        set(&mut with, drag, Role::BodyDragTop.place().unwrap().parameter.name, 0.4);
        let [plain, with] = [&vehicle, &with].map(|one| Model::of(one).unwrap());
        let data = trial::data(4, |drone, bin| {
            let here = Signals { height_m: 30.0, density_ratio: 1.0, ..Signals::default() };
            let signals = Signals { climb_mps: bin.climb_mps(), ..here };
            let ripple_us = 0.1 * f64::from((7 * bin.segment as i32 + 3 * drone as i32) % 5 - 2);
            with.pulse_us(&signals) - plain.pulse_us(&signals) + ripple_us
        });
        let comparison = Comparison::new(&data, &vehicle, &simulated, None).unwrap();
        let flights = ModelFlights::default();
        let look = |effect| {
            let only = Some(Only { effect, updraft_mps: 0.0, beaten_nats: 0.0, is_bent: false });
            let options = Options { only, ..Options::default() };
            let given = (&simulated, &options, &flights);
            let mut search = begun(&data, &vehicle, given, comparison.clone());
            let before = search.look_at_beginning().unwrap();
            let after = search.at_fitted_size(before.clone()).unwrap();
            (before, after)
        };
        let (before, after) = look(drag);
        let nats = [&before, &after].map(|look| look.explained().nats);
        assert!(nats[1] >= nats[0], "{nats:?}");
        assert!(before.round().library[0].beta > 2.0, "none of the sizes that are tried is near");
        let best = &after.round().library[0];
        let Candidate { size, variants, .. } = &after.candidates[best.candidate];
        let fitted = variants[best.variant].size;
        assert!((fitted - 0.4).abs() < 0.02, "{fitted}");
        assert!((best.beta - 1.0).abs() < 0.05 && fitted < size.unwrap().high, "{}", best.beta);
        // What explains too little keeps the sizes that are tried.
        let (before, after) = look("battery");
        assert_eq!(after.candidates[0].variants.len(), before.candidates[0].variants.len());
        // What is known to explain more, flown, than on top of a flight without has what it explains flown.
        let flown = |look: &Look| {
            let mut look = look.clone();
            look.by_form_nats = Some(look.explained().nats + 30.0);
            look.fitted_as(&Start::from(&look.round().base));
            look.round().library[0].gain
        };
        assert_eq!(flown(&look(drag).0), look(drag).0.round().library[0].gain, "it does there");
        assert!((flown(&before) - 30.0 - FLOOR_NATS).abs() < 1.0, "{}", flown(&before));
    }
}
