//! Meaning of a round's gains: nothing, an effect, a class, or a free shape.

use super::dependence::Dependence;
use super::explain::Options;
use super::generic::Generic;
use super::gls::{Column, Likelihood, Problem};
use super::search::{
    FLOOR_NATS, FREE_FLOOR_NATS, Ranked, RankedGeneric, Round, Sought, Thresholds, thresholds,
};

/// Rivals within this many nats of the best form a class with it (docs/physics.md, 3.5). At first 4, with
/// which 3.7 % of 190 blind flights had a wrong single name; with 6, [`CLASS_SHARE`] and further changes it
/// is 1.6 % of 308 (docs/blind.md). With 4 nats and without the scatter between drones, 20 of 26 flights
/// with inflow on the paper's ladder ended in a class; larger values make more of these. Chosen between the
/// two.
pub(super) const CLASS_NATS: f64 = 6.0;
/// So do those within this share of the gain: closed forms are approximations of the effects, and what they
/// leave out counts the more the larger an effect is. Introduced with the 6 of [`CLASS_NATS`]; the value is
/// chosen.
const CLASS_SHARE: f64 = 0.1;
/// Rivals within this many margins, as regressors, are compared in full. Chosen; fixed margins of 8 and 12
/// nats came before it. Costs time only, unless the full comparison turns round more than a margin.
const CONTEST_MARGINS: f64 = 2.0;
/// Rivals must leave a similar trace: correlation with everything else partialled out. The confounded pairs
/// of docs/physics.md, 3.5 correlate above 0.7; the value below that is chosen.
pub(super) const ALIKE: f64 = 0.6;
/// A free shape is something else than the best effect when it gains this many times as much
/// (docs/physics.md, 3.5). Chosen for the first version of the search and kept; not measured by itself.
const FREE_BETTER: f64 = 1.25;
/// And when this share of its gain is left with the effect in the model. 0.35 at first, lowered together
/// with changes of the noise; the value is chosen.
const FREE_LEFT: f64 = 0.25;

/// What the air itself may depend on: such shapes need [`FREE_BETTER`] times the threshold, and matter by
/// what they do over the whole flight. Since this was introduced none of 546 flights with nothing hidden led
/// to a finding (docs/blind.md).
const OF_THE_AIR: [Dependence; 2] = [Dependence::Height, Dependence::Time];

/// The product of climb and time: a response that grows during the flight (docs/physics.md, 3.5).
pub(super) const PRODUCT: Dependence = Dependence::ClimbTime;
/// Free shapes with only a number or two, and by how much they must be better than an effect to be believed,
/// nats. A product of climb and time contains a line, and a line is much of what any effect of the climb is;
/// a step resembles motors that warm up. Introduced with 2.5 after blind flights in which products were
/// taken for drag; 6 since the scatter between drones takes part. The values are chosen.
const SIMPLE: [(Dependence, f64); 2] = [(PRODUCT, 6.0), (Dependence::Step, 2.5)];

/// An effect this near to a size that matters is named before a free shape that looks like it. Chosen.
const NEARLY: f64 = 0.6;

/// By how much a rival must be worse than what gains so much, nats.
pub(super) fn margin_nats(gain: f64) -> f64 {
    CLASS_NATS.max(CLASS_SHARE * gain)
}

/// What is to be done.
pub(super) enum What {
    /// The search has ended.
    Nothing,
    /// Effects.
    Effects {
        /// Best first; more than one: rivals that must be held against each other.
        members: Vec<Ranked>,
        /// A free shape that explains as well.
        or_else: Option<RankedGeneric>,
    },
    /// No effect that is known.
    Free(RankedGeneric),
}

/// A decision with the thresholds that it was taken by.
pub(super) struct Decision {
    /// Conclusion of the round.
    pub what: What,
    /// Gains that chance does not reach.
    pub thresholds: Thresholds,
}

/// Decides what a round found; `material_us` is the smallest effect that matters.
pub(super) fn decide(
    problem: &Problem<'_>,
    round: &Round,
    sought: Sought<'_>,
    material_us: f64,
    options: &Options,
    step: usize,
) -> Decision {
    let floor = FLOOR_NATS;
    let mut limits = Thresholds { library: floor, generic: FREE_FLOOR_NATS };
    let nothing = |limits| Decision { what: What::Nothing, thresholds: limits };
    // What has so much freedom must show in the means, whatever it does to the scatter.
    let free = round.generics.iter().find(|free| {
        let is_plain = free.gain > FREE_BETTER * FREE_FLOOR_NATS;
        let matters = if OF_THE_AIR.contains(&sought.generics[free.generic].depends_on) {
            free.size_us >= material_us && is_plain
        } else {
            free.size_us >= material_us
                || (free.range_us >= material_us
                    && is_plain
                    && sought.generics[free.generic].is_shared())
        };
        matters && free.plain >= FREE_FLOOR_NATS.min(free.gain)
    });
    let is_named = |ranked: &&Ranked| {
        // A known effect that explains more than a free shape of a size that matters is named first.
        let matters = ranked.size_us >= material_us
            || (ranked.size_us >= NEARLY * material_us
                && free.is_some_and(|free| free.gain > FLOOR_NATS && ranked.gain > free.gain))
            // What is short, or plain in calm air, matters by what it does where it is largest.
            || (ranked.range_us >= material_us
                && ranked.gain > FREE_FLOOR_NATS
                && matches!(form(sought, ranked), Column::Shared(_)));
        let candidate = &sought.library[ranked.candidate];
        // That the shared air drifted is what it does: a rival, never a finding. That it grew with
        // height is no lack of the vehicle: it must say as much as a free shape.
        // So must another reading of the wind.
        let is_plain = candidate.size.is_some() && !candidate.by_lean;
        let is_effect = is_plain || ranked.gain > FREE_FLOOR_NATS;
        candidate.name != "updraft-drift" && is_effect && ranked.fitted && matters
    };
    let best = round.library.iter().find(is_named);
    let best_gain = best.map_or(0.0, |best| best.gain);
    let free_gain = free.map_or(0.0, |free| free.gain);
    if best_gain < limits.library && free_gain < limits.generic {
        return nothing(limits);
    }
    let seed = options.seed.wrapping_add(1000 * step as u64);
    // Far above any threshold there is nothing to find out about it.
    if best_gain.max(free_gain) < SURE_NATS {
        limits = thresholds(problem, &round.base, sought, options.replicates, options.alpha, seed);
    }
    if let Some(free) =
        free.filter(|free| free.gain > limits.generic && free.gain > FREE_BETTER * best_gain)
    {
        let left = match best.filter(|best| best.gain > limits.library) {
            None => free.gain,
            Some(best) => left_with(problem, sought, best, free),
        };
        if left > FLOOR_NATS.max(FREE_LEFT * free.gain) {
            return Decision { what: What::Free(free.clone()), thresholds: limits };
        }
    }
    // A ladder whose rungs grow makes a response that grows with time look like drag, and a step early in
    // the flight looks like motors that warm up: what has hardly more numbers than an effect must not be
    // better.
    let simple = round.generics.iter().find(|free| {
        let simple = SIMPLE.iter().find(|one| one.0 == sought.generics[free.generic].depends_on);
        free.size_us >= material_us
            && free.plain > FREE_FLOOR_NATS
            && simple.is_some_and(|(_, more)| free.gain > limits.generic.max(best_gain + more))
    });
    if let Some(simple) = simple {
        return Decision { what: What::Free(simple.clone()), thresholds: limits };
    }
    let Some(best) = best.filter(|best| best.gain > limits.library) else {
        return nothing(limits);
    };
    let column = |ranked: &Ranked| form(sought, ranked);
    let at = problem.at(&best.hyper);
    let own = at.white(column(best));
    let contested = best.gain - CONTEST_MARGINS * margin_nats(best.gain);
    let alike = |ranked: &&Ranked| {
        let is_alike = || at.likeness(&own, &at.white(column(ranked))).abs() > ALIKE;
        ranked.candidate != best.candidate
            // What is better though too small to be named alone is not passed over.
            && (ranked.gain > best.gain || ranked.gain > contested && is_alike())
    };
    let mut members = vec![best.clone()];
    members.extend(round.library.iter().filter(alike).cloned());
    Decision { what: What::Effects { members, or_else: None }, thresholds: limits }
}

/// Gains above this need no bootstrap of the threshold, nats: the largest gain in 440 flights with nothing
/// missing was 13.6 (docs/physics.md, 3.3). Saves time only.
const SURE_NATS: f64 = 40.0;

/// What an effect in its best form adds to the pulse.
pub(super) fn form<'a>(sought: Sought<'a>, ranked: &Ranked) -> &'a Column {
    &sought.library[ranked.candidate].variants[ranked.variant].column
}

/// What a free shape still gains with an effect in the model, nats.
fn left_with(
    problem: &Problem<'_>,
    sought: Sought<'_>,
    best: &Ranked,
    free: &RankedGeneric,
) -> f64 {
    let column = form(sought, best);
    let generic: &Generic = &sought.generics[free.generic];
    let with = problem.with([column]);
    let before = with.fit(best.hyper, Likelihood::Profile);
    let both = with.with(&generic.columns).fit(free.hyper, Likelihood::Profile);
    both.log_posterior() - before.log_posterior() - generic.penalty
}
