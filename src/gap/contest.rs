//! The last word between effects that leave similar traces: each is taken into the model and fitted in full,
//! with all that was found before, the bend that gusts give to its curve, and the response to the air that
//! it brings along.

use rayon::prelude::*;

use super::candidates::{Candidate, set};
use super::compare::Comparison;
use super::decide::{ALIKE, CLASS_NATS, PRODUCT, What, form, margin_nats};
use super::error::GapError;
use super::explain::{Found, MOST_GUSTS_MPS, with_felt};
use super::gls::{Column, Problem, Split, Start};
use super::refine::{Parameter, doubts, parameters_of, refine, slopes};
use super::response::{Response, gusts_mps, settled};
use super::search::{FLOOR_NATS, FREE_FLOOR_NATS, Ranked, RankedGeneric, Round, Sought};
use crate::vehicle::Vehicle;

/// A product of climb and time is compared with at most this many effects. Chosen to bound the time.
const MOST: usize = 5;
/// Effects that gain less than this as regressors are not compared with the product, nats: half the
/// threshold of naming ([`super::search::FLOOR_NATS`]). Chosen.
const LEAST_NATS: f64 = 4.0;
/// By how much a product of climb and time must explain more than an effect, nats: it contains a line, and a
/// line is much of what any effect of the climb is (docs/physics.md, 3.5). The rule came after blind flights
/// in which such responses were taken for drag (4 of 10 wrong names); the value is chosen, not measured.
pub(super) const PRODUCT_NATS: f64 = 13.0;
/// Rounds in which a rival's gusts settle. Chosen for time.
const ROUNDS: usize = 2;

/// The vehicle with a candidate at its fitted size; `None`: it is a motion of the air.
pub(super) fn entered(candidate: &Candidate, ranked: &Ranked) -> Option<Vehicle> {
    let variant = candidate.variants.get(ranked.variant)?;
    let mut next = variant.vehicle.clone()?;
    if let Some(size) = candidate.size {
        let start = size.now + ranked.beta * (variant.size - size.now);
        set(&mut next, candidate.name, size.name, start.clamp(size.low, size.high));
    }
    Some(next)
}

/// The size of an effect that the model had.
pub(super) fn before(candidate: &Candidate) -> Option<f64> {
    candidate.was_there.then(|| candidate.size.map(|size| size.now)).flatten()
}

/// What is known where a round's rivals are held against each other.
pub(super) struct Contest<'a> {
    /// Findings before the round.
    pub found: &'a Found,
    /// Comparison of measurement and simulation, against the model with those findings.
    pub comparison: &'a Comparison,
    /// Candidates and free shapes of the round.
    pub sought: Sought<'a>,
    /// Result of the round.
    pub round: &'a Round,
}

impl Contest<'_> {
    /// Holds what a decision names against its rivals, and the product of climb and time against effects.
    ///
    /// # Errors
    /// Effects of a vehicle that are not valid.
    pub(super) fn settle(&self, problem: &Problem<'_>, what: What) -> Result<What, GapError> {
        let of = |free: &RankedGeneric| self.sought.generics[free.generic].depends_on == PRODUCT;
        let product =
            self.round.generics.iter().find(|free| of(free) && free.plain > FREE_FLOOR_NATS);
        let rivals = match &what {
            What::Nothing | What::Together { .. } => return Ok(what),
            What::Free(free) if !of(free) => return Ok(what),
            What::Free(_) => self.likely(),
            What::Effects { members, .. } if members.len() == 1 && product.is_none() => {
                return Ok(what);
            }
            What::Effects { members, .. } => members.clone(),
        };
        let (members, in_full) = rayon::join(
            || self.of_effects(problem, rivals),
            || product.map(|product| self.of_product(product)).transpose(),
        );
        let (members, in_full) = (members?, in_full?);
        let Some((best, first)) = members.first() else { return Ok(what) };
        let mut or_else = match &what {
            What::Effects { or_else, .. } => or_else.clone(),
            _ => None,
        };
        if let (Some(best), Some(product), Some(in_full)) = (best, product, in_full) {
            let more = in_full - best;
            if more > PRODUCT_NATS && product.gain > first.gain + CLASS_NATS {
                return Ok(What::Free(product.clone()));
            }
            if more > CLASS_NATS || product.gain > first.gain + CLASS_NATS {
                or_else = Some(product.clone());
            }
        }
        let members = members.into_iter().map(|(_, rival)| rival).collect();
        Ok(What::Effects { members, or_else })
    }

    /// Effects that a product may stand for.
    fn likely(&self) -> Vec<Ranked> {
        let effects = self.round.library.iter().take(MOST);
        effects
            .filter(|rival| {
                let candidate = &self.sought.library[rival.candidate];
                // Scatter may support a name, never make one.
                let in_means = rival.plain > FLOOR_NATS;
                rival.fitted && rival.gain > LEAST_NATS && in_means && is_felt(candidate)
            })
            .cloned()
            .collect()
    }

    /// Standings of the rivals that explain as well as the best of them, best first; `None`: such an effect
    /// stands by its gain as a regressor.
    fn of_effects(
        &self,
        problem: &Problem<'_>,
        rivals: Vec<Ranked>,
    ) -> Result<Vec<(Option<f64>, Ranked)>, GapError> {
        let standings: Vec<_> = rivals.par_iter().map(|rival| self.standing(rival)).collect();
        // Who cannot fly this flight, once sizes and gusts have settled, explains nothing of it.
        let (standings, rivals): (Vec<_>, Vec<_>) = standings
            .into_iter()
            .zip(rivals)
            .filter_map(|(standing, rival)| match standing {
                Err(error) if error.is_not_flown() => None,
                standing => Some(standing.map(|standing| (standing, rival))),
            })
            .collect::<Result<Vec<_>, GapError>>()?
            .into_iter()
            .unzip();
        let best = standings.iter().flatten().copied().reduce(f64::max);
        let most = rivals.iter().map(|rival| rival.gain).fold(0.0, f64::max);
        let leader =
            rivals.iter().max_by(|a, b| a.gain.total_cmp(&b.gain)).map(|one| one.candidate);
        let margin = margin_nats(most);
        let overruled = overruled(&standings, &rivals);
        let mut members: Vec<(f64, Option<f64>, Ranked)> = standings
            .into_iter()
            .zip(rivals)
            .map(|(standing, rival)| {
                let behind = match (standing, best) {
                    (Some(standing), Some(best)) => best - standing,
                    _ => most - rival.gain,
                };
                (behind, standing, rival)
            })
            .filter(|(behind, _, rival)| {
                // Who leads as a regressor must be beaten clearly.
                let leads = Some(rival.candidate) == leader;
                let is_overruled = Some(rival.candidate) == overruled;
                is_overruled || *behind < if leads { PRODUCT_NATS } else { margin }
            })
            .collect();
        members.sort_by(|a, b| a.0.total_cmp(&b.0));
        let Some((.., first)) = members.first().cloned() else { return Ok(Vec::new()) };
        let at = problem.at(&first.noise.hyper);
        let white = |rival: &Ranked| at.white(form(self.sought, rival));
        let own = white(&first);
        members.retain(|(.., rival)| {
            rival.candidate == first.candidate || at.likeness(&own, &white(rival)).abs() > ALIKE
        });
        Ok(members.into_iter().map(|(_, standing, rival)| (standing, rival)).collect())
    }

    /// Log-posterior of the flight with a product of climb and time.
    fn of_product(&self, product: &RankedGeneric) -> Result<f64, GapError> {
        let generic = &self.sought.generics[product.generic];
        let columns = &generic.columns;
        let found = self.found;
        let of = |felt: &[Vec<Vec<Response>>]| {
            let free = Free { columns, felt, beta: &product.beta };
            let vehicle = found.vehicle.clone();
            self.in_full(self.comparison, vehicle, &found.parameters, free, &product.noise)
        };
        // What it does to the scatter is known by its size, which means alone may hardly tell.
        let (felt, numb) = rayon::join(|| of(&generic.felt), || of(&[]));
        Ok(felt?.max(numb?) - generic.penalty)
    }

    /// Log-posterior of the flight with a rival in the model; `None`: that would say nothing.
    fn standing(&self, ranked: &Ranked) -> Result<Option<f64>, GapError> {
        let Self { found, comparison, .. } = self;
        let candidate = &self.sought.library[ranked.candidate];
        // Where scatter does not show it, or in no vehicle, it stands by its gain as a regressor.
        let Some(vehicle) = entered(candidate, ranked).filter(|_| is_felt(candidate)) else {
            return Ok(None);
        };
        let there = candidate.variants.get(ranked.variant).and_then(|form| form.updraft_mps);
        let there = there.map(|updraft_mps| Comparison::clone(comparison).in_updraft(updraft_mps));
        let comparison = there.as_ref().unwrap_or(comparison);
        let mut parameters: Vec<Parameter> = found.parameters.clone();
        if !parameters.iter().any(|known| known.effect == candidate.name) {
            let (before, base) = (before(candidate), &self.round.base);
            parameters.extend(parameters_of(comparison, &vehicle, candidate.name, before, base)?);
        }
        self.in_full(comparison, vehicle, &parameters, Free::default(), &ranked.noise).map(Some)
    }

    /// Log-posterior of the flight with a model whose sizes and gusts settle first, at the speed relative to
    /// the air that all share.
    pub(super) fn in_full(
        &self,
        comparison: &Comparison,
        mut vehicle: Vehicle,
        parameters: &[Parameter],
        free: Free<'_>,
        noise: &Start,
    ) -> Result<f64, GapError> {
        let found = self.found;
        let comparison =
            &Comparison::clone(comparison).feeling(&with_felt(&found.felt, free.felt, free.beta));
        let extras = [&found.extras[..], free.columns].concat();
        let (mut noise, mut gusts) = (noise.clone(), found.gusts_mps);
        for _ in 0..ROUNDS {
            let fit = refine(comparison, &vehicle, parameters, &extras, &noise, gusts, true)?;
            vehicle = fit.vehicle;
            noise = fit.noise;
            gusts = gusts_mps(&noise.hyper).min(MOST_GUSTS_MPS);
        }
        let patterns = comparison.patterns(&vehicle, gusts)?;
        let split = Split::of(&comparison.residual(&vehicle, gusts)?);
        let doubts = doubts(comparison, &vehicle, parameters)?;
        let slopes = slopes(comparison, &vehicle, parameters)?;
        let problem = Problem::new(&patterns, &split).doubting(&doubts).with(&extras).with(&slopes);
        let (_, solution) = settled(&problem, problem.as_fitted(&noise), |_| patterns.clone());
        Ok(solution.log_posterior())
    }
}

/// A free shape that is held against effects, with what it does to the response.
#[derive(Clone, Copy, Default)]
pub(super) struct Free<'a> {
    columns: &'a [Column],
    felt: &'a [Vec<Vec<Response>>],
    beta: &'a [f64],
}

/// The candidate that explains more of the means than the one that stands best, which scatter chose; `None`: they are
/// the same or nearly equal. It stays beside the other: in air in which drones scatter otherwise than assumed (a field
/// that stands still, through which they climb) scatter may choose wrongly.
fn overruled(standings: &[Option<f64>], rivals: &[Ranked]) -> Option<usize> {
    let stand = standings.iter().zip(rivals).filter_map(|(nats, rival)| Some(((*nats)?, rival)));
    let (_, best) = stand.max_by(|a, b| a.0.total_cmp(&b.0))?;
    let by_means = rivals.iter().max_by(|a, b| a.plain.total_cmp(&b.plain))?;
    (by_means.plain > best.plain + CLASS_NATS).then_some(by_means.candidate)
}

/// Whether the scatter between drones shows an effect.
fn is_felt(candidate: &Candidate) -> bool {
    candidate.variants.iter().any(|variant| variant.felt.is_some())
}

#[cfg(test)]
mod tests {
    use super::super::candidates::{Felt, Updraft, Variant, library};
    use super::super::data::Data;
    use super::super::search::round;
    use super::super::trial::{self, ranked};
    use super::*;

    fn found(data: &Data) -> (Found, Comparison) {
        let comparison = trial::comparison(data);
        (Found::nothing(comparison.clone()), comparison)
    }

    #[test]
    fn what_scatter_alone_supports_does_not_stand_for_a_product() {
        let data = trial::data(3, |_, _| 0.0);
        let (found, comparison) = found(&data);
        let patterns = comparison.patterns(&found.vehicle, 0.0).unwrap();
        let split = Split::of(&comparison.residual(&found.vehicle, 0.0).unwrap());
        let problem = Problem::new(&patterns, &split);
        let library = library(&found.vehicle, &comparison, Updraft::Same).unwrap();
        let inflow = library.iter().position(|one| one.name == "rotor-inflow").unwrap();
        let sought = Sought { library: &library, generics: &[], drones: &[3] };
        let mut round = round(&problem, Start::default(), sought, false);
        let mut likely = |plain: f64| {
            round.library = vec![Ranked { plain, ..ranked(inflow, 60.0) }];
            let round = &round;
            let contest = Contest { found: &found, comparison: &comparison, sought, round };
            contest.likely().len()
        };
        assert_eq!((likely(FLOOR_NATS), likely(FLOOR_NATS + 1e-9)), (0, 1));
    }

    #[test]
    fn what_scatter_chose_stands_beside_what_the_means_say() {
        let rivals = |less: f64| {
            let of = |candidate, plain| Ranked { plain, ..ranked(candidate, 60.0) };
            [of(3, 50.0), of(7, 50.0 + less)]
        };
        let of = |standings: [Option<f64>; 2], less: f64| overruled(&standings, &rivals(less));
        assert_eq!(of([Some(-900.0), Some(-990.0)], CLASS_NATS + 1e-9), Some(7));
        assert_eq!(of([Some(-900.0), Some(-990.0)], CLASS_NATS), None);
        assert_eq!(of([Some(-990.0), Some(-900.0)], 20.0), None, "scatter and means agree");
        assert_eq!(of([None, None], 20.0), None, "scatter says nothing");
    }

    #[test]
    fn rivals_within_the_margin_stay_a_class_and_others_are_beaten() {
        let data = trial::data(3, |_, _| 0.0);
        let (found, comparison) = found(&data);
        let patterns = comparison.patterns(&found.vehicle, 0.0).unwrap();
        let split = Split::of(&comparison.residual(&found.vehicle, 0.0).unwrap());
        let problem = Problem::new(&patterns, &split);
        let bins = data.groups[0].bins.len();
        let line =
            |slope: f64| Column::Shared(vec![(0..bins).map(|bin| slope * bin as f64).collect()]);
        let wave = Column::Shared(vec![(0..bins).map(|bin| (bin as f64 * 1.9).sin()).collect()]);
        // Motions of the air: they stand by their gains as regressors.
        let air = |name, column| Candidate {
            name,
            was_there: false,
            by_lean: false,
            size: None,
            variants: vec![Variant {
                vehicle: None,
                size: 0.0,
                form: None,
                price_nats: 0.0,
                column,
                updraft_mps: None,
                felt: Felt::default(),
            }],
        };
        let library = [air("one", line(1.0)), air("its like", line(2.0)), air("another", wave)];
        let sought = Sought { library: &library, generics: &[], drones: &[3] };
        let round = round(&problem, Start::default(), sought, false);
        let contest = Contest { found: &found, comparison: &comparison, sought, round: &round };
        let settled = |members: Vec<Ranked>| {
            let what = What::Effects { members, or_else: None };
            match contest.settle(&problem, what).unwrap() {
                What::Effects { members, .. } => {
                    members.iter().map(|member| member.candidate).collect::<Vec<_>>()
                }
                _ => panic!("effects were held against each other"),
            }
        };
        assert_eq!(settled(vec![ranked(0, 30.0), ranked(1, 24.0 + 1e-9)]), [0, 1]);
        assert_eq!(settled(vec![ranked(0, 30.0), ranked(1, 24.0)]), [0]);
        assert_eq!(settled(vec![ranked(0, 100.0), ranked(1, 90.0 + 1e-9)]), [0, 1]);
        assert_eq!(settled(vec![ranked(0, 100.0), ranked(1, 90.0)]), [0]);
        assert_eq!(settled(vec![ranked(1, 29.0), ranked(0, 30.0)]), [0, 1], "the best is first");
        assert_eq!(settled(vec![ranked(0, 30.0), ranked(2, 29.0)]), [0], "another trace");
    }
}
