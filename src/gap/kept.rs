//! Which findings of a search are kept: those with which the model is nearer to drones that were not fitted.

use super::compare::{Comparison, Simulated};
use super::data::Data;
use super::error::GapError;
use super::explain::{Found, Options, Setting, lacked_drag, settle};
use super::heldout::Case;
use super::instead::{effect_after_all, fewer_instead};
use super::lean_channel::may_lack_drag;
use super::model_flights::ModelFlights;
use super::search::FAR_NATS;
use super::verdict::{Finding, Gap, Step};
use crate::mission::plan::Plan;
use crate::vehicle::Vehicle;

/// A raw gap that grows by less is the same: rounding, and air that the drones do not share. The benchmark counts as
/// worse what is more.
const WORSE: f64 = 1.01;

/// A raw gap that is smaller is a small one, us: what matters for the pulse, 0.1 m/s of air.
const SMALL_US: f64 = 2.5;
/// A raw gap below this is one in which something unknown that matters would show, us: what moves the pulse by
/// [`SMALL_US`] makes it larger by half of that.
const QUIET_US: f64 = 5.0;
/// What moves the pulse by less does not matter in the quietest flight, us (rms).
const HARDLY_US: f64 = 0.75;
/// A raw gap, without the air that drones share, below this multiple of what noise and air leave is all noise and air. Chosen:
/// where something unknown was there it was 1.14 times as large, or more.
const AT_FLOOR: f64 = 1.1;

/// What is searched for, and in what.
#[derive(Clone, Copy)]
pub(super) struct Question<'a> {
    /// Model before anything was repaired.
    pub original: &'a Vehicle,
    /// Model that the search begins with.
    pub repaired: &'a Vehicle,
    /// Simulation that the logs are compared with.
    pub simulated: &'a Simulated<'a>,
    /// The plan, if there is one.
    pub plan: Option<&'a Plan>,
    /// Options of the search.
    pub options: &'a Options,
    /// Flights of the model that were flown for it so far.
    pub flights: &'a ModelFlights,
}

impl Question<'_> {
    /// Searches in the drones to be fitted, and holds the findings against the others. An updraft that the search
    /// settled in before it knew what the model lacks can have stood for it: so what still air leaves to be found is
    /// kept if that explains more. Where findings make the raw gap larger, they stay in the verdict as what it looks
    /// like, never as a name, and the model stays as it was; what is unknown does not where the gap is at its floor.
    ///
    /// # Errors
    /// See [`GapError`].
    pub(super) fn answered(self, train: &Data, held: &Data) -> Result<(Found, Gap), GapError> {
        let still_air = Options { updraft: false, ..*self.options };
        let (mut found, mut gap) = match self.searched(train, held, *self.options) {
            // An updraft that the model cannot fly in is none that the flight was in.
            Err(error) if error.is_not_flown() && self.options.updraft => {
                self.searched(train, held, still_air)?
            }
            searched => searched?,
        };
        // Scanned by its steady states an updraft has the wind that was read in still air. In strong wind that hides
        // it: what is left is searched once more, with the model flown in each updraft.
        if self.options.updraft && gap.left_over().is_some() {
            let each_flown = Options { each_flown: true, ..*self.options };
            if let Ok((flown, there)) = self.searched(train, held, each_flown)
                && there.left_over().is_none()
                && flown.explains()? > found.explains()?
            {
                (found, gap) = (flown, there);
            }
        }
        let blown_off = found.updraft_mps != 0.0 && self.is_nearer_in_still_air(train, &found)?;
        if (blown_off || found.was_in_updraft && !found.steps.is_empty())
            && let Some((still, without)) = if_flown(self.searched(train, held, still_air))?
        {
            let (with_nats, still_nats) = (found.explains()?, still.explains()?);
            let left = |gap: &Gap| gap.left_over().is_some();
            let there = (blown_off || grows(&gap), left(&gap), -with_nats);
            let in_still_air = (grows(&without), left(&without), -still_nats);
            if with_nats < still_nats + FAR_NATS && in_still_air < there {
                (found, gap) = (still, without);
            }
        }
        let setting = self.setting(train);
        if found.steps.is_empty() {
            let flown = |options: &Options| setting.search(options);
            let rest = |options: &Options, left| setting.look_for_rest(options, left);
            found = effect_after_all(found, self.options, flown, rest)?;
            if !found.steps.is_empty() {
                gap = self.case(&found).gap(train, held)?;
            }
        }
        let before = found.steps.clone();
        if !found.steps.is_empty() {
            let by_leans = lacked_drag([self.original, self.repaired])
                || may_lack_drag(&found.comparison, self.repaired);
            found = fewer_instead(found, self.options, by_leans, setting)?;
            if found.steps != before {
                gap = self.case(&found).gap(train, held)?;
            }
        }
        if let Some(alone) = self.without_unknowns(train, held, &found, &gap)? {
            (found, gap) = alone;
        }
        if !grows(&gap) {
            return Ok((found, gap));
        }
        let mut found = self.withdrawn(train, found, &before)?;
        let gap = self.case(&found).gap(train, held)?;
        if is_at_floor(&gap) {
            // Nothing shows it but how drones scatter, of which a wrong noise makes as much.
            found.steps.retain(|step| !matches!(step.finding, Finding::Unknown { .. }));
        }
        Ok((found, gap))
    }

    /// What was found without anything unknown, if the gap is small and as small without: in still air two shapes that undo each
    /// other (of the charge, which falls with time, and of the time) explain the last tenths of a microsecond, and are told as
    /// tens.
    fn without_unknowns(
        self,
        train: &Data,
        held: &Data,
        found: &Found,
        gap: &Gap,
    ) -> Result<Option<(Found, Gap)>, GapError> {
        let is_unknown = |step: &Step| matches!(step.finding, Finding::Unknown { .. });
        let is_in_model = |step: &Step| {
            let first = step.finding.effects().first().copied();
            found.parameters.iter().any(|one| Some(one.effect) == first)
        };
        let all_in_model = found.steps.iter().all(|step| is_unknown(step) || is_in_model(step));
        if !found.steps.iter().any(is_unknown) || !all_in_model {
            return Ok(None);
        }
        let Self { repaired, simulated, plan, .. } = self;
        let (with, near) = (&found.vehicle, Some(&found.comparison));
        let Some(comparison) =
            if_flown(Comparison::of(train, with, simulated, plan, found.updraft_mps, near))?
        else {
            return Ok(None);
        };
        let mut known = found.clone();
        known.steps.retain(|step| !is_unknown(step));
        known.extras.clear();
        known.felt.clear();
        known.comparison = comparison.spread_as(repaired);
        let comparison = known.comparison.clone();
        known.refit(&comparison)?;
        settle(&mut known);
        let without = self.case(&known).gap(train, held)?;
        Ok(is_as_small(gap, &without).then_some((known, without)))
    }

    /// Whether the model as it was is nearer to the logs in still air than in the updraft of a search; the model as it
    /// is now, if its drones lean in another wind, because an updraft is relative to how a wind meets who leans in it.
    fn is_nearer_in_still_air(self, train: &Data, found: &Found) -> Result<bool, GapError> {
        let near = &found.comparison;
        let Self { repaired, simulated, plan, .. } = self;
        let vehicle = if near.leans_otherwise(repaired) { &found.vehicle } else { repaired };
        let in_air = |updraft_mps: f64| -> Result<f64, GapError> {
            let there = Comparison::of(train, vehicle, simulated, plan, updraft_mps, Some(near))?;
            Ok(there.raw_gap_us()?)
        };
        Ok(in_air(found.updraft_mps)? > WORSE * in_air(0.0)?)
    }

    fn setting<'a>(&'a self, data: &'a Data) -> Setting<'a> {
        let Self { original, repaired: vehicle, simulated, plan, flights, .. } = *self;
        Setting { data, original, vehicle, simulated, plan, flights }
    }

    fn searched(
        self,
        train: &Data,
        held: &Data,
        options: Options,
    ) -> Result<(Found, Gap), GapError> {
        let found = self.setting(train).search(&options)?.found;
        let gap = self.case(&found).gap(train, held)?;
        Ok((found, gap))
    }

    fn case<'a>(&'a self, found: &'a Found) -> Case<'a> {
        Case {
            original: self.original,
            simulated: self.simulated,
            plan: self.plan,
            found,
            seed: self.options.seed,
        }
    }

    /// The model as it was, with findings that name nothing alone; `before` are those of the search that had rivals.
    fn withdrawn(self, train: &Data, found: Found, before: &[Step]) -> Result<Found, GapError> {
        // The air stays as it is found, unless the model is nearer without it.
        let Self { repaired, simulated, plan, .. } = self;
        let is_still = found.updraft_mps == 0.0 || self.is_nearer_in_still_air(train, &found)?;
        let updraft_mps = if is_still { 0.0 } else { found.updraft_mps };
        let comparison = Comparison::of(train, repaired, simulated, plan, updraft_mps, None)?;
        let steps = found.steps.into_iter().filter_map(|step| withdrawn(step, before)).collect();
        let (noise, gusts_mps, rest) = (found.noise, found.gusts_mps, found.rest);
        Ok(Found { noise, gusts_mps, updraft_mps, steps, rest, ..Found::nothing(comparison) })
    }
}

/// Whether a gap is small, and hardly larger without what was taken away.
fn is_as_small(with: &Gap, without: &Gap) -> bool {
    let raw_us = |gap: &Gap| [gap.drones, gap.rungs].map(|one| one.map(|one| one.after_us.value));
    let is = |(with, without): (Option<f64>, Option<f64>)| match (with, without) {
        (Some(with), Some(without)) => {
            let is_hardly_larger = without * without < with * with + HARDLY_US * HARDLY_US;
            without < SMALL_US && is_hardly_larger || without < QUIET_US && without <= with
        }
        (None, None) => true,
        _ => false,
    };
    let [drones, rungs] = raw_us(with);
    let [drones_without, rungs_without] = raw_us(without);
    (drones.is_some() || rungs.is_some())
        && is((drones, drones_without))
        && is((rungs, rungs_without))
}

/// Whether the raw gap of drones that were not fitted, or of rungs where there are none, grows.
pub(super) fn grows(gap: &Gap) -> bool {
    gap.drones.or(gap.rungs).is_some_and(|shrink| {
        shrink.after_us.value > WORSE * shrink.before_us.value
            || shrink.after_without_air_us > WORSE * shrink.before_without_air_us
    })
}

/// Whether the model as it was is as near to drones and rungs that were not fitted as noise and air leave it.
fn is_at_floor(gap: &Gap) -> bool {
    let all = [&gap.drones, &gap.rungs];
    let mut all = all.into_iter().flatten().peekable();
    all.peek().is_some() && all.all(|one| one.before_without_air_us < AT_FLOOR * one.floor_us)
}

/// A finding that cannot be taken in: its effects with the rival that explains most, by its own search or by those of
/// `others` if nothing was searched for beside it. `None`: an effect without a rival, of which nothing can be said.
fn withdrawn(mut step: Step, others: &[Step]) -> Option<Step> {
    if let Finding::Unknown { .. } = step.finding {
        return Some(step);
    }
    let mut effects: Vec<String> = step.finding.effects().into_iter().map(str::to_owned).collect();
    let mut rivals = step.rivals.iter().chain(others.iter().flat_map(|other| &other.rivals));
    let near = rivals.find(|rival| !effects.contains(&rival.name)).map(|rival| rival.name.clone());
    effects.extend(near);
    step.finding = Finding::Class { effects, parameters: Vec::new() };
    (step.finding.effects().len() > 1).then_some(step)
}

/// What was made, unless the vehicle cannot fly so: with what was found in an air that the flight was not in, that is no
/// view of the flight.
fn if_flown<T>(made: Result<T, GapError>) -> Result<Option<T>, GapError> {
    match made {
        Err(error) if error.is_not_flown() => Ok(None),
        made => made.map(Some),
    }
}

#[cfg(test)]
mod tests {
    use super::super::dependence::Dependence;
    use super::super::trial::{self, name};
    use super::super::verdict::{Interval, Shrink};
    use super::*;

    fn step(finding: Finding, rivals: &[&str]) -> Step {
        let rivals: Vec<(&str, f64)> = rivals.iter().map(|name| (*name, 9.0)).collect();
        trial::step(finding, 10.0, &rivals)
    }

    #[test]
    fn what_is_withdrawn_is_never_a_name() {
        let effects = |step: Option<Step>| {
            step.map(|step| step.finding.effects().join(" ")).unwrap_or_default()
        };
        let alone = |step: Step| withdrawn(step, &[]);
        let beside = alone(step(name("one"), &["one", "another", "third"]));
        assert!(matches!(beside.as_ref().unwrap().finding, Finding::Class { .. }));
        assert_eq!(effects(beside), "one another");
        assert_eq!(alone(step(name("one"), &["one"])), None);
        // One effect that was searched for in place of all has no rivals of its own.
        let others = [step(name("other"), &["one", "second"])];
        assert_eq!(effects(withdrawn(step(name("one"), &["one"]), &others)), "one second");
        let unknown = Finding::Unknown { depends_on: Dependence::Climb, formula: None };
        let kept = alone(step(unknown.clone(), &["one"])).unwrap();
        assert_eq!(kept.finding, unknown);
    }

    #[test]
    fn a_gap_that_noise_and_air_leave_is_at_its_floor() {
        let gap = |drones_us: f64, rungs_us: f64| {
            let of = |before_without_air_us: f64| {
                Some(Shrink { before_without_air_us, floor_us: 10.0, ..Shrink::default() })
            };
            Gap { drones: of(drones_us), rungs: of(rungs_us) }
        };
        assert!(is_at_floor(&gap(9.0, 10.9)));
        assert!(!is_at_floor(&gap(9.0, 11.1)), "the rungs show more");
        assert!(!is_at_floor(&gap(11.1, 9.0)), "the drones show more");
        assert!(!is_at_floor(&Gap::default()), "nothing was held out");
    }

    #[test]
    fn what_cannot_be_flown_in_still_air_is_no_view_of_the_flight() {
        use crate::effects::EffectError;
        let not_flown = EffectError::NotFlown { climb_mps: 0.8, horizontal_mps: 14.3 };
        assert!(matches!(if_flown::<()>(Err(GapError::Effect(not_flown))), Ok(None)));
        assert!(if_flown::<()>(Err(GapError::NoSimulatedSide)).is_err());
        assert_eq!(if_flown(Ok(1)).ok().flatten(), Some(1));
    }

    #[test]
    fn a_small_gap_that_stays_small_needs_nothing_unknown() {
        let gap = |drones_us: f64, rungs_us: f64| {
            let of = |after_us: f64| {
                let after_us = Interval { value: after_us, low: after_us, high: after_us };
                Some(Shrink { after_us, ..Shrink::default() })
            };
            Gap { drones: of(drones_us), rungs: of(rungs_us) }
        };
        assert!(is_as_small(&gap(1.0, 1.1), &gap(1.0, 1.2)));
        assert!(!is_as_small(&gap(1.0, 1.1), &gap(1.0, 1.6)), "the rungs need it");
        assert!(!is_as_small(&gap(1.0, 1.1), &gap(1.6, 1.1)), "the drones need it");
        assert!(is_as_small(&gap(3.3, 3.8), &gap(2.9, 3.5)), "the drones are nearer without");
        assert!(!is_as_small(&gap(3.3, 3.8), &gap(2.9, 3.9)), "the rungs are not");
        assert!(!is_as_small(&gap(6.0, 6.0), &gap(6.0, 6.0)), "of much air nobody can tell");
        assert!(!is_as_small(&Gap::default(), &Gap::default()));
        assert!(!is_as_small(&gap(1.0, 1.0), &Gap::default()));
    }

    #[test]
    fn a_gap_grows_as_it_is_or_without_the_air() {
        let us = |value: f64| Interval { value, low: value, high: value };
        let gap = |before: f64, after: f64, clean: [f64; 2]| Gap {
            drones: Some(Shrink {
                before_us: us(before),
                after_us: us(after),
                before_without_air_us: clean[0],
                after_without_air_us: clean[1],
                ..Shrink::default()
            }),
            rungs: None,
        };
        assert!(!grows(&gap(10.0, 5.0, [8.0, 3.0])));
        assert!(!grows(&gap(10.0, 10.05, [8.0, 8.05])));
        assert!(grows(&gap(10.0, 10.2, [8.0, 3.0])));
        assert!(grows(&gap(10.0, 5.0, [8.0, 8.2])));
        let rungs = gap(10.0, 10.2, [8.0, 3.0]).drones;
        assert!(grows(&Gap { drones: None, rungs }), "without drones held out, by the rungs");
    }
}
