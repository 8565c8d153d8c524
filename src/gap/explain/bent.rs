//! An effect that bends the response beside the updraft of the whole flight, which bends it, too: a curve of the thrust, inflow, or, in a
//! strong wind that only leans tell, a drag of the body.
//!
//! Without the effect, another updraft can stand for it, and from there no line leads to both: the noise without it is larger, and
//! another size no multiple of one. So size and updraft are fitted together, by the closed forms, from afar.

use rayon::prelude::*;

use super::super::candidates::{Candidate, Updraft, Variant, form_of, one};
use super::super::compare::Comparison;
use super::super::error::GapError;
use super::super::gls::Start;
use super::super::refine::{self, Parameter, slopes};
use super::super::search::FLOOR_NATS;
use super::super::verdict::is_strong_wind;
use super::in_updraft::{InUpdraft, NEAR, UPDRAFT_ROUNDS, UPDRAFTS_MPS, likely_if};
use super::{Found, Look, Search};
use crate::effects::Role;
use crate::vehicle::Vehicle;

/// A step of the updraft that needs no further round, m/s. Numerical.
const SETTLED_MPS: f64 = 0.02;
/// Updrafts in which the effect explains less by this much than in the best of them are not begun from, nats. Chosen: in five
/// flights of 9 and 25 drones in calm air, with a curve in an updraft of -2 m/s, the best led to it.
const OTHER_START_NATS: f64 = 100.0;
/// What is fitted together with the updraft, where the model has none.
const BENDING: [Role; 2] = [Role::ThrustExpo, Role::InflowShare];
/// So is this one in a strong wind that no leg told: the drag says, too, how strong it is.
const BENDING_IN_WIND: Role = Role::BodyDragTop;
/// To which sides of still air a fit begins.
const SIDES: [f64; 2] = [-1.0, 1.0];
/// How often the model with the effect is flown where closed forms lead to, at most. Numerical: they are off by some tenths of a metre per second
/// from afar.
const FLIGHTS: usize = 4;
/// How far from the updraft of a flight closed forms are followed, m/s. Chosen: where a downdraft and a wind bring AirSim's quad with twice its
/// drag to its limits, they led from -1 and from -2 m/s to -2.4 and -2.8 with half the size or twice it, and the next flights elsewhere.
const REACH_MPS: f64 = 0.5;

/// An effect in one of its forms, fitted where its search begins.
struct Begun {
    found: Found,
    form: Form,
    /// How likely the flight is, nats but for a constant.
    likely: f64,
    /// Updraft that it was fitted in, m/s.
    start_mps: f64,
    /// Updraft that explains most, as far as the slopes at that one tell, m/s.
    most_mps: f64,
}

/// Which form of an effect it is, and what that costs.
#[derive(Clone, Copy, Debug)]
struct Form {
    value: Option<f64>,
    price_nats: f64,
}

/// An effect fitted together with the updraft.
#[derive(Clone, Debug)]
pub(super) struct Bent {
    effect: &'static str,
    vehicle: Vehicle,
    size: f64,
    form: Form,
    updraft_mps: f64,
    noise: Start,
    gusts_mps: f64,
    /// What the model with the effect, flown, leaves, us.
    raw_us: f64,
    /// How well the flight is explained, nats above the threshold.
    pub nats: f64,
}

impl Bent {
    /// Whether it is this effect.
    pub(super) fn is_of(&self, effect: &str) -> bool {
        effect == self.effect
    }

    /// Gives findings the effect as it was fitted together with the updraft.
    pub(super) fn taken_by(self, found: &mut Found) {
        found.vehicle = self.vehicle;
        found.noise = self.noise;
        found.gusts_mps = self.gusts_mps;
    }
}

impl Search<'_> {
    /// The size and the updraft that explain the flight best, from some updrafts; `None`: the effect does not bend the response, the
    /// model has it, it can fly in none of them, or without it is as near to the logs in one of them or in another, m/s.
    pub(super) fn bends_most(&self, effect: &'static str, other_mps: f64) -> Option<Bent> {
        if !self.may_bend(effect) {
            return None;
        }
        let begun: Vec<Begun> =
            SIDES.par_iter().flat_map(|sign| self.begins_on_a_side(effect, *sign)).collect();
        let most = begun.iter().map(|one| one.likely).fold(f64::NEG_INFINITY, f64::max);
        let near = begun.into_par_iter().filter(|one| one.likely > most - OTHER_START_NATS);
        let found: Vec<Bent> = near.filter_map(|one| self.bent_from(effect, one)).collect();
        let best =
            found.into_iter().reduce(|best, one| if one.nats > best.nats { one } else { best })?;
        let without_us = |mps: &f64| self.flown_in(*mps).ok()?.raw_gap_us().ok();
        let mut updrafts_mps = [&[0.0, other_mps], &UPDRAFTS_MPS[..]].concat();
        updrafts_mps.dedup();
        let each_us: Vec<f64> = updrafts_mps.par_iter().filter_map(without_us).collect();
        let nearest_us = each_us.into_iter().fold(f64::INFINITY, f64::min);
        (best.raw_us * NEAR < nearest_us).then_some(best)
    }

    /// Whether an effect is one that is fitted together with the updraft, and the model has none.
    fn may_bend(&self, effect: &str) -> bool {
        let wind = &self.comparison.wind;
        let is_misread = wind.measured.is_none() && is_strong_wind(wind.mean_mps);
        let in_wind = is_misread.then_some(BENDING_IN_WIND);
        let role = BENDING.into_iter().chain(in_wind).find(|role| role.is_of(effect));
        role.is_some_and(|role| !role.is_on(&self.found.vehicle))
    }

    /// Each form of the effect fitted in updrafts of one sign: in a farther one only where the slopes at the nearer one lead away from
    /// still air, or where nothing flies in that.
    fn begins_on_a_side(&self, effect: &'static str, sign: f64) -> Vec<Begun> {
        let mut begun: Vec<Begun> = Vec::new();
        for start_mps in UPDRAFTS_MPS.into_iter().filter(|mps| sign * mps > 0.0) {
            let leads_on = |one: &Begun| sign * (one.most_mps - one.start_mps) > 0.0;
            if !begun.is_empty() && !begun.iter().any(leads_on) {
                break;
            }
            let noise = begun.first().map(|one| one.found.noise.clone()).unwrap_or_default();
            begun.extend(self.begins_bent(effect, start_mps, noise));
        }
        begun
    }

    /// Each form of the effect fitted in one of the updrafts that are begun from, with a noise to begin with; empty: the vehicle
    /// cannot fly so.
    fn begins_bent(&self, effect: &'static str, start_mps: f64, mut noise: Start) -> Vec<Begun> {
        let Ok(flown) = self.flown_in(start_mps) else { return Vec::new() };
        if flown.data.bins_of_groups() != self.comparison.data.bins_of_groups() {
            return Vec::new();
        }
        let candidate = one(&self.found.vehicle, &flown, Updraft::Same, effect);
        let Ok(Some(Candidate { size: Some(size), variants, .. })) = candidate else {
            return Vec::new();
        };
        let mut nearest: Vec<&Variant> = Vec::new();
        let off = |one: &Variant| (one.size - size.usual).abs();
        for variant in &variants {
            match nearest.iter_mut().find(|other| other.form == variant.form) {
                Some(other) if off(variant) < off(other) => *other = variant,
                Some(_) => (),
                None => nearest.push(variant),
            }
        }
        let parameter = Parameter {
            effect,
            name: size.name,
            unit: size.unit,
            bounds: (size.low, size.high),
            before: None,
        };
        // Without the effect the noise is larger, so the first form begins from the usual one, and others with that of the first.
        let begun = |variant: &Variant| {
            let vehicle = variant.vehicle.clone()?;
            let parameters = vec![parameter.clone()];
            let mut found =
                Found { vehicle, parameters, noise: noise.clone(), ..self.found.clone() };
            let form = Form { value: variant.form, price_nats: variant.price_nats };
            let InUpdraft { likely, most_mps, .. } = fits(&mut found, &flown)?;
            noise.clone_from(&found.noise);
            Some(Begun { found, form, likely: likely - form.price_nats, start_mps, most_mps })
        };
        nearest.into_iter().filter_map(begun).collect()
    }

    fn bent_from(&self, effect: &'static str, begun: Begun) -> Option<Bent> {
        let Begun { mut found, form, start_mps, .. } = begun;
        let mut flown = self.flown_in(start_mps).ok()?;
        for flight in 0..FLIGHTS {
            let updraft_mps = settles(&mut found, &flown)?;
            if flight > 0 && (updraft_mps - flown.scene.updraft_mps).abs() < SETTLED_MPS {
                break;
            }
            if flight == 0 {
                let nats = explains(&found, &flown.in_updraft(updraft_mps))? - form.price_nats;
                if self.options.only.is_some_and(|only| only.is_out_of_reach(nats)) {
                    return None;
                }
            }
            flown = self.flown_with(&found.vehicle, updraft_mps)?;
        }
        let (size, _) = *found.values.first()?;
        Some(Bent {
            effect,
            size,
            form,
            updraft_mps: flown.scene.updraft_mps,
            raw_us: flown.raw_gap_us().ok()?,
            nats: explains(&found, &flown)? - form.price_nats,
            vehicle: found.vehicle,
            noise: found.noise,
            gusts_mps: found.gusts_mps,
        })
    }

    /// The comparison with another vehicle, flown in an updraft, m/s; `None`: it cannot fly the same bins there.
    fn flown_with(&self, vehicle: &Vehicle, updraft_mps: f64) -> Option<Comparison> {
        let Self { data, simulated, plan, comparison, .. } = self;
        let there =
            Comparison::of(data, vehicle, simulated, *plan, updraft_mps, Some(comparison)).ok()?;
        let is_alike = there.data.bins_of_groups() == comparison.data.bins_of_groups();
        is_alike.then(|| there.spread_as(self.vehicle))
    }

    /// What is left in the updraft of an effect, with that effect among what may explain it; `None`: the model without it cannot
    /// fly the same flight there.
    pub(super) fn look_where_it_bends(&mut self, bent: Bent) -> Result<Option<Look>, GapError> {
        let bins = self.comparison.data.bins_of_groups();
        self.found.updraft_mps = bent.updraft_mps;
        self.found.was_in_updraft = true;
        match self.against_model() {
            Ok(there) if there.data.bins_of_groups() == bins => self.comparison = there,
            _ => return Ok(None),
        }
        let mut look = self.look_at_beginning()?;
        let form = form_of(&bent.vehicle, bent.size, (&self.found.vehicle, &self.comparison))?;
        for candidate in look.candidates.iter_mut().filter(|one| one.name == bent.effect) {
            let Form { value, price_nats } = bent.form;
            candidate.variants.retain(|one| one.form == value);
            let of_form = |one: Variant| Variant { form: value, price_nats, ..one };
            candidate.variants.extend(form.clone().map(of_form));
        }
        look.by_form_nats = Some(bent.nats);
        look.fitted_as(&bent.noise);
        self.bent = Some(bent);
        Ok(Some(look))
    }
}

/// How well a flight is explained, nats above the threshold.
fn explains(found: &Found, flown: &Comparison) -> Option<f64> {
    let doubts = refine::doubts(flown, &found.vehicle, &found.parameters).ok()?;
    let noise = (found.noise.clone(), found.gusts_mps);
    Some(likely_if(flown, &found.vehicle, &doubts, noise)? - FLOOR_NATS)
}

/// Fits an effect's size and the noise in the updraft of a comparison, by closed forms.
fn fits(found: &mut Found, there: &Comparison) -> Option<InUpdraft> {
    found.refit(there).ok()?;
    most_beside(found, there)
}

/// Fits an effect's size there in the noise that is known.
fn fits_size(found: &mut Found, there: &Comparison) -> Option<InUpdraft> {
    let Found { vehicle, parameters, noise, gusts_mps, .. } = &*found;
    let fit = refine::refine(there, vehicle, parameters, &[], noise, *gusts_mps, false).ok()?;
    (found.vehicle, found.values) = (fit.vehicle, fit.values);
    most_beside(found, there)
}

/// The updraft that explains most beside that of a comparison.
fn most_beside(found: &Found, there: &Comparison) -> Option<InUpdraft> {
    let patterns = there.patterns(&found.vehicle, found.gusts_mps).ok()?;
    let free = slopes(there, &found.vehicle, &found.parameters).ok()?;
    let updraft_mps = there.scene.updraft_mps;
    InUpdraft::fitted(there, &patterns, found, &free, &found.noise, updraft_mps)
}

/// Fits an effect's size and the updraft beside a flight, by closed forms, as far as these reach: that updraft, m/s; `None`: the
/// vehicle cannot fly so.
fn settles(found: &mut Found, flown: &Comparison) -> Option<f64> {
    let flown_mps = flown.scene.updraft_mps;
    let mut updraft_mps = flown_mps;
    for round in 0..UPDRAFT_ROUNDS {
        let there = flown.clone().in_updraft(updraft_mps);
        // The noise is what the model leaves, which changes less than the updraft.
        let here = if round == 0 { fits(found, &there)? } else { fits_size(found, &there)? };
        let before_mps = updraft_mps;
        updraft_mps = here.most_mps.clamp(flown_mps - REACH_MPS, flown_mps + REACH_MPS);
        if (updraft_mps - before_mps).abs() < SETTLED_MPS {
            break;
        }
    }
    Some(updraft_mps)
}

#[cfg(test)]
mod tests {
    use super::super::super::compare::Simulated;
    use super::super::super::lean::Measured;
    use super::super::super::lean_law::LeanLaw;
    use super::super::super::model_flights::ModelFlights;
    use super::super::super::trial;
    use super::super::Options;
    use super::super::tests::begun;
    use super::*;
    use crate::base::air::SEA_LEVEL_DENSITY;
    use crate::effects::{Model, Signals};

    /// What is found of an effect in a flight in an updraft of -1.6 m/s with it, and whether the look there explains as much.
    fn found_together(role: Role, size: f64) -> (f64, f64, bool) {
        let (vehicle, simulated) = (trial::vehicle(), Simulated::Closed);
        let effect = role.place().unwrap().name();
        let mut known = vehicle.clone();
        role.set(&mut known, size);
        let [plain, with] = [&vehicle, &known].map(|one| Model::of(one).unwrap());
        let pulse_us = |model: &Model, climb_mps: f64| {
            let here = Signals { height_m: 30.0, density_ratio: 1.0, ..Signals::default() };
            model.pulse_us(&Signals { climb_mps, ..here })
        };
        let data = trial::data(4, |drone, bin| {
            let climb_mps = bin.climb_mps();
            let ripple_us = 0.1 * f64::from((7 * bin.segment as i32 + 3 * drone as i32) % 5 - 2);
            pulse_us(&with, climb_mps + 1.6) - pulse_us(&plain, climb_mps) + ripple_us
        });
        let (options, flights) = (Options::default(), ModelFlights::default());
        let given = (&simulated, &options, &flights);
        let comparison = Comparison::new(&data, &known, &simulated, None).unwrap();
        let has_it = begun(&data, &known, given, comparison);
        assert!(has_it.bends_most(effect, 0.0).is_none(), "a model is held against its own");
        let flights = ModelFlights::default();
        let given = (&simulated, &options, &flights);
        let comparison = Comparison::new(&data, &vehicle, &simulated, None).unwrap();
        let mut search = begun(&data, &vehicle, given, comparison);
        assert!(search.bends_most("battery", 0.0).is_none(), "it does not bend the response");
        let found = search.bends_most(effect, 0.0).unwrap();
        let (size, updraft_mps, nats) = (found.size, found.updraft_mps, found.nats);
        let look = search.look_where_it_bends(found).unwrap().unwrap();
        (size, updraft_mps, look.explained().nats >= nats)
    }

    #[test]
    fn a_drag_is_fitted_together_with_the_updraft_where_it_says_how_strong_the_wind_is() {
        let (vehicle, simulated) = (trial::vehicle(), Simulated::Closed);
        let data = trial::data(4, |_, _| 0.0);
        let drag = Role::BodyDragTop.place().unwrap().name();
        let may_bend = |known: &Vehicle, wind_mps: f64, is_told: bool| {
            let (options, flights) = (Options::default(), ModelFlights::default());
            let given = (&simulated, &options, &flights);
            let mut comparison = Comparison::new(&data, known, &simulated, None).unwrap();
            comparison.wind.mean_mps = [wind_mps, 0.0];
            let law = LeanLaw::of(known, SEA_LEVEL_DENSITY, 0.0);
            let told = Measured { law, linear_se: 0.001, misfit_nats: 0.0 };
            comparison.wind.measured = is_told.then_some(told);
            begun(&data, known, given, comparison).may_bend(drag)
        };
        assert!(may_bend(&vehicle, 8.0, false));
        assert!(!may_bend(&vehicle, 3.0, false), "the wind is hardly misread");
        assert!(!may_bend(&vehicle, 8.0, true), "legs tell the wind");
        let mut known = vehicle.clone();
        Role::BodyDragTop.set(&mut known, 0.1);
        assert!(!may_bend(&known, 8.0, false), "the model has it");
    }

    #[test]
    fn closed_forms_are_followed_no_farther_than_they_reach() {
        let (vehicle, simulated) = (trial::vehicle(), Simulated::Closed);
        let model = Model::of(&vehicle).unwrap();
        let pulse_us = |climb_mps: f64| {
            let here = Signals { height_m: 30.0, density_ratio: 1.0, ..Signals::default() };
            model.pulse_us(&Signals { climb_mps, ..here })
        };
        // In sinking air of 1.6 m/s.
        let data =
            trial::data(4, |_, bin| pulse_us(bin.climb_mps() + 1.6) - pulse_us(bin.climb_mps()));
        let flown = Comparison::new(&data, &vehicle, &simulated, None).unwrap();
        let updraft_mps = settles(&mut Found::nothing(flown.clone()), &flown).unwrap();
        assert!((updraft_mps + REACH_MPS).abs() < 1e-9, "{updraft_mps}");
    }

    #[test]
    fn what_bends_the_response_is_found_together_with_its_updraft() {
        for (role, wanted) in [(Role::ThrustExpo, 0.4), (Role::InflowShare, 0.26)] {
            let (size, updraft_mps, explains) = found_together(role, wanted);
            assert!((size - wanted).abs() < 0.05, "{role:?} {size}");
            assert!((updraft_mps + 1.6).abs() < 0.15, "{role:?} {updraft_mps}");
            assert!(explains, "{role:?}");
        }
    }
}
