//! Several effects that together explain what a free shape does.
//!
//! Who holds logs against another program's simulation compares two plants, and these may differ in several things at
//! once: none of them alone explains what all of them do.

use rayon::prelude::*;

use super::candidates::Candidate;
use super::contest::{Contest, Free, before, entered};
use super::decide::{CLASS_NATS, What};
use super::dependence::signals_of;
use super::error::GapError;
use super::gls::{Column, Problem, Start};
use super::refine::{Parameter, parameters_of};
use super::search::{FLOOR_NATS, FREE_FLOOR_NATS, Ranked, RankedGeneric, admissible};
use crate::effects::{Role, Signal};
use crate::vehicle::Vehicle;

/// As many effects are tried together at most. Chosen: with more, smooth curves explain anything.
const MOST: usize = 3;
/// As many sets are fitted in full. Chosen for time.
const MOST_FITTED: usize = 8;

/// Several effects, each at its size beside the others.
#[derive(Clone, Debug)]
struct Set {
    members: Vec<Ranked>,
    /// What they explain less what each must, nats.
    nats: f64,
}

impl Contest<'_> {
    /// Effects that explain together what a free shape does, as names; what a decision says otherwise.
    ///
    /// # Errors
    /// Effects of a vehicle that are not valid.
    pub(super) fn together(&self, problem: &Problem<'_>, what: What) -> Result<What, GapError> {
        let What::Free(free) = &what else { return Ok(what) };
        let sets = self.sets(problem, free);
        let in_full: Result<Vec<Option<Set>>, GapError> =
            sets.par_iter().map(|set| self.fitted(set)).collect();
        let mut in_full: Vec<Set> = in_full?.into_iter().flatten().collect();
        in_full.sort_by(|a, b| b.nats.total_cmp(&a.nats));
        let Some(best) = in_full.first() else { return Ok(what) };
        let free_nats = self.round.base.log_posterior() + free.gain - FREE_FLOOR_NATS;
        if best.nats < free_nats {
            return Ok(what);
        }
        let names = |set: &Set| -> Vec<usize> { set.members.iter().map(|m| m.candidate).collect() };
        let own = names(best);
        // A set that explains as well with another effect instead of one makes a class of the two.
        let near = in_full.iter().filter(|set| set.nats > best.nats - CLASS_NATS).map(names);
        let instead_of = |of: usize, set: &Vec<usize>| -> Option<usize> {
            let others = own.iter().filter(|one| **one != of);
            let new: Vec<usize> = set.iter().filter(|one| !own.contains(one)).copied().collect();
            let is_one = others.clone().all(|one| set.contains(one)) && !set.contains(&of);
            new.first().copied().filter(|_| is_one && new.len() == 1)
        };
        let near: Vec<Vec<usize>> = near.collect();
        let classes = own.iter().map(|of| {
            let mut rivals: Vec<usize> =
                near.iter().filter_map(|set| instead_of(*of, set)).collect();
            rivals.dedup();
            rivals
        });
        let classes: Vec<Vec<usize>> = classes.collect();
        Ok(What::Together { members: best.members.clone(), instead: classes })
    }

    /// Sets of effects that look at what the free shape depends on, best first, by their regressors.
    fn sets(&self, problem: &Problem<'_>, free: &RankedGeneric) -> Vec<Set> {
        let depends_on = self.sought.generics[free.generic].depends_on;
        let looks = |candidate: &Candidate| {
            let signals = signals_of(candidate.name);
            signals.iter().any(|one| depends_on.is_of(*one) || *one == Signal::ModelIncrement)
        };
        let is_plain = |candidate: &Candidate| candidate.size.is_some() && !candidate.by_lean;
        let candidates = self.sought.library.iter().enumerate();
        let candidates = candidates.filter(|(_, one)| is_plain(one) && looks(one));
        let forms: Vec<(usize, usize)> = candidates
            .flat_map(|(index, one)| (0..one.variants.len()).map(move |variant| (index, variant)))
            .filter(|(index, variant)| {
                self.sought.library[*index].variants[*variant].updraft_mps.is_none()
            })
            .collect();
        let at = problem.at(&free.noise.hyper);
        let mut sets: Vec<Set> = subsets(&forms)
            .par_iter()
            .filter_map(|chosen| {
                let column = |(index, variant): &(usize, usize)| -> Column {
                    self.sought.library[*index].variants[*variant].column.clone()
                };
                let columns: Vec<Column> = chosen.iter().map(column).collect();
                let (betas, nats) = at.gain_of_all(&columns);
                let members: Option<Vec<Ranked>> = chosen
                    .iter()
                    .zip(&columns)
                    .zip(betas)
                    .map(|((place, column), beta)| self.ranked(*place, column, beta, &free.noise))
                    .collect();
                let nats = nats - FLOOR_NATS * chosen.len() as f64;
                Some(Set { members: members?, nats })
            })
            .collect();
        sets.sort_by(|a, b| b.nats.total_cmp(&a.nats));
        // The best form of each set of effects.
        let mut seen: Vec<Vec<usize>> = Vec::new();
        sets.retain(|set| {
            let names: Vec<usize> = set.members.iter().map(|one| one.candidate).collect();
            let is_new = !seen.contains(&names);
            seen.push(names);
            is_new
        });
        sets.truncate(MOST_FITTED);
        sets
    }

    fn ranked(
        &self,
        (candidate, variant): (usize, usize),
        column: &Column,
        beta: f64,
        noise: &Start,
    ) -> Option<Ranked> {
        let of = &self.sought.library[candidate];
        admissible(of, &of.variants[variant], beta).then(|| Ranked {
            candidate,
            variant,
            gain: 0.0,
            plain: 0.0,
            beta,
            size_us: beta.abs() * column.spread(self.sought.drones),
            range_us: beta.abs() * column.range(),
            noise: noise.clone(),
            fitted: true,
        })
    }

    /// A set fitted in full, with what each of its members adds to the others; `None`: one adds too little.
    fn fitted(&self, set: &Set) -> Result<Option<Set>, GapError> {
        let all = self.of_members(&set.members)?;
        let mut members = set.members.clone();
        for (place, member) in members.iter_mut().enumerate() {
            let mut others = set.members.clone();
            others.remove(place);
            member.gain = all - self.of_members(&others)?;
            member.plain = member.gain;
            if member.gain < FLOOR_NATS {
                return Ok(None);
            }
        }
        let nats = all - FLOOR_NATS * members.len() as f64;
        Ok(Some(Set { members, nats }))
    }

    /// Log-posterior of the flight with some effects in the model.
    fn of_members(&self, members: &[Ranked]) -> Result<f64, GapError> {
        let Self { found, comparison, sought, round, .. } = self;
        let mut vehicle = found.vehicle.clone();
        let mut parameters: Vec<Parameter> = found.parameters.clone();
        let mut noise = &found.noise;
        for member in members {
            let candidate = &sought.library[member.candidate];
            vehicle = joined(vehicle, candidate, member);
            noise = &member.noise;
            if !parameters.iter().any(|known| known.effect == candidate.name) {
                let of = before(candidate);
                let more = parameters_of(comparison, &vehicle, candidate.name, of, &round.base)?;
                parameters.extend(more);
            }
        }
        self.in_full(comparison, vehicle, &parameters, Free::default(), noise)
    }
}

/// A vehicle with a candidate beside what it has, or instead of a drag of the rotors that the candidate has not.
pub(super) fn joined(mut vehicle: Vehicle, candidate: &Candidate, ranked: &Ranked) -> Vehicle {
    let Some(mut with) = entered(candidate, ranked) else { return vehicle };
    if let Some(drag) = Role::RotorDrag.place().filter(|_| !Role::RotorDrag.is_on(&with)) {
        vehicle.effects.remove(drag.name());
    }
    let table = with.effects.remove(candidate.name);
    vehicle.effects.extend(table.map(|table| (candidate.name.to_owned(), table)));
    vehicle
}

/// Sets of two or more forms of different candidates.
fn subsets(forms: &[(usize, usize)]) -> Vec<Vec<(usize, usize)>> {
    let mut sets: Vec<Vec<(usize, usize)>> = forms.iter().map(|form| vec![*form]).collect();
    let mut first = 0;
    for _ in 1..MOST {
        let last = sets.len();
        for place in first..last {
            let highest = sets[place].last().map_or(0, |form| form.0);
            for form in forms.iter().filter(|form| form.0 > highest) {
                let larger = [&sets[place][..], &[*form]].concat();
                sets.push(larger);
            }
        }
        first = last;
    }
    sets.retain(|set| set.len() > 1);
    sets
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sets_have_no_effect_twice() {
        let forms = [(0, 0), (0, 1), (2, 0), (5, 1)];
        let sets = subsets(&forms);
        // Pairs: 2 with each of the others, and those two; triples: 2.
        assert_eq!(sets.len(), 2 * 2 + 1 + 2, "{sets:?}");
        for set in sets {
            assert!(set.windows(2).all(|pair| pair[0].0 < pair[1].0), "{set:?}");
        }
    }
}
