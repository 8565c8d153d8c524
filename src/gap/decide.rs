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
pub(super) const CONTEST_MARGINS: f64 = 2.0;
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

/// An effect that is held against what was found must gain so much, nats: half of what finds it, since what is as good as the
/// least of findings may gain less than its threshold. Chosen.
const HELD_NATS: f64 = 0.5 * FLOOR_NATS;

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
    /// Several effects, none of which explains it alone.
    Together {
        /// The effects, each with what it adds to the others.
        members: Vec<Ranked>,
        /// For each of them, candidates that would do as well instead of it.
        instead: Vec<Vec<usize>>,
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
    // Who is held against others alone is flown when it may be as good: how well it does is compared then.
    let is_held = options.only.is_some();
    let floor = if is_held { HELD_NATS } else { FLOOR_NATS };
    let mut limits = Thresholds { library: FLOOR_NATS, generic: FREE_FLOOR_NATS };
    let needed = |limits: &Thresholds| if is_held { floor } else { limits.library };
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
            || ranked.gain > FREE_FLOOR_NATS && range_us(sought, ranked) >= material_us;
        let candidate = &sought.library[ranked.candidate];
        // That the shared air drifted is what it does: a rival, never a finding. That it grew with
        // height is no lack of the vehicle: it must say as much as a free shape.
        // So must another reading of the wind.
        let is_plain = candidate.size.is_some() && !candidate.by_lean;
        let is_effect = is_plain || ranked.gain > FREE_FLOOR_NATS;
        // Scatter between drones has many causes: it may support a name, never make one.
        let in_means = ranked.plain > floor;
        candidate.name != "updraft-drift" && is_effect && in_means && ranked.fitted && matters
    };
    let best = round.library.iter().find(is_named);
    let best_gain = best.map_or(0.0, |best| best.gain);
    let free_gain = free.map_or(0.0, |free| free.gain);
    if best_gain < needed(&limits) && free_gain < limits.generic {
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
        let left = match best.filter(|best| best.gain > needed(&limits)) {
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
    let simple = |share_of_more: f64| {
        round.generics.iter().find(|free| {
            let depends_on = sought.generics[free.generic].depends_on;
            let simple = SIMPLE.iter().find(|one| one.0 == depends_on);
            let least = |more: f64| limits.generic.max(best_gain + share_of_more * more);
            free.size_us >= material_us
                && free.plain > FREE_FLOOR_NATS
                && simple.is_some_and(|(_, more)| free.gain > least(*more))
        })
    };
    if let Some(simple) = simple(1.0) {
        return Decision { what: What::Free(simple.clone()), thresholds: limits };
    }
    let Some(best) = best.filter(|best| best.gain > needed(&limits)) else {
        return nothing(limits);
    };
    let column = |ranked: &Ranked| form(sought, ranked);
    let at = problem.at(&best.noise.hyper);
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
    // A step that is better, though not by as much, is a doubt; the product has a contest of its own.
    let is_step = |free: &&RankedGeneric| sought.generics[free.generic].depends_on != PRODUCT;
    let or_else = simple(0.0).filter(is_step).cloned();
    Decision { what: What::Effects { members, or_else }, thresholds: limits }
}

/// Gains above this need no bootstrap of the threshold, nats: the largest gain in 440 flights with nothing
/// missing was 13.6 (docs/physics.md, 3.3). Saves time only.
const SURE_NATS: f64 = 40.0;

/// What an effect in its best form adds to the pulse.
pub(super) fn form<'a>(sought: Sought<'a>, ranked: &Ranked) -> &'a Column {
    &sought.library[ranked.candidate].variants[ranked.variant].column
}

/// Largest minus smallest of what a candidate does to the fleet's mean pulse, us; none where only the scatter between drones
/// is plain.
fn range_us(sought: Sought<'_>, ranked: &Ranked) -> f64 {
    match form(sought, ranked) {
        Column::Shared(_) => ranked.range_us,
        Column::Own(_) if ranked.plain < FREE_FLOOR_NATS => 0.0,
        own @ Column::Own(_) => ranked.beta.abs() * Column::Shared(own.means()).range(),
    }
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
    let before = with.fit(&best.noise, Likelihood::Profile);
    let both = with.with(&generic.columns).fit(&free.noise, Likelihood::Profile);
    both.log_posterior() - before.log_posterior() - generic.penalty
}

#[cfg(test)]
mod tests {
    use super::super::candidates::{Candidate, Felt, Size, Variant};
    use super::super::explain::Only;
    use super::super::gls::{Pulses, Split, Start};
    use super::super::noise::{GroupPattern, Hyper};
    use super::super::trial::{patterns, pulses, ranked};
    use super::*;

    const MATERIAL_US: f64 = 2.5;
    /// No simulated flights: the thresholds are the floors.
    const BY_FLOORS: Options = Options {
        alpha: 0.005,
        replicates: 0,
        seed: 1,
        most_steps: 4,
        updraft: true,
        each_flown: false,
        only: None,
        rest: true,
    };

    /// Two effects that look alike, one that looks like neither, and free shapes.
    struct Case {
        groups: Vec<GroupPattern>,
        pulses: Pulses,
        library: Vec<Candidate>,
        generics: Vec<Generic>,
    }

    fn effect(name: &'static str, column: Column, is_of_the_vehicle: bool) -> Candidate {
        let size = Size { name: "size", unit: "", low: 0.0, high: 1.0, now: 0.0, usual: 0.1 };
        let variant = Variant {
            vehicle: None,
            size: 0.1,
            form: None,
            price_nats: 0.0,
            column,
            updraft_mps: None,
            felt: Felt::default(),
        };
        Candidate {
            name,
            was_there: false,
            by_lean: false,
            size: is_of_the_vehicle.then_some(size),
            variants: vec![variant],
        }
    }

    fn case() -> Case {
        let groups = patterns();
        let column = |value: fn(f64) -> f64| {
            let bins =
                |group: &GroupPattern| group.time_s.iter().map(|time| value(*time)).collect();
            Column::Shared(groups.iter().map(bins).collect())
        };
        let (line, wave) = (column(|time| 0.1 * time), column(|time| 9.0 * (0.7 * time).sin()));
        let library = vec![
            effect("one", line.clone(), true),
            effect("its like", line, true),
            effect("another", wave.clone(), true),
            effect("of the air", wave.clone(), false),
        ];
        let free = |depends_on| Generic {
            depends_on,
            axis: "",
            columns: vec![wave.clone()],
            felt: Vec::new(),
            along: Vec::new(),
            penalty: 0.0,
        };
        let generics = [Dependence::Climb, Dependence::Height, Dependence::Step, PRODUCT];
        let generics = generics.map(free).to_vec();
        let mut pulses = pulses(&groups);
        for (group, drones) in pulses.iter_mut().enumerate() {
            for drone in drones {
                for (bin, value) in drone.iter_mut().enumerate() {
                    *value += 4.0 * wave.at(group, 0, bin);
                }
            }
        }
        Case { groups, pulses, library, generics }
    }

    fn free(generic: usize, gain: f64) -> RankedGeneric {
        let noise = Start::default();
        let beta = vec![4.0];
        RankedGeneric { generic, gain, plain: gain, beta, size_us: 3.0, range_us: 3.0, noise }
    }

    impl Case {
        fn decision(
            &self,
            library: &[Ranked],
            generics: &[RankedGeneric],
            options: &Options,
        ) -> Decision {
            let split = Split::of(&self.pulses);
            let problem = Problem::new(&self.groups, &split);
            let (mut library, mut generics) = (library.to_vec(), generics.to_vec());
            library.sort_by(|a, b| b.gain.total_cmp(&a.gain));
            generics.sort_by(|a, b| b.gain.total_cmp(&a.gain));
            let base = problem.at(&Hyper::default());
            let round = Round { groups: self.groups.clone(), base, library, generics };
            let drones = [3, 2];
            let sought =
                Sought { library: &self.library, generics: &self.generics, drones: &drones };
            decide(&problem, &round, sought, MATERIAL_US, options, 0)
        }

        /// What is decided, as a word and the members of the class.
        fn decided(
            &self,
            library: &[Ranked],
            generics: &[RankedGeneric],
        ) -> (&'static str, Vec<usize>) {
            let decision = self.decision(library, generics, &BY_FLOORS);
            let limits = Thresholds { library: 8.0, generic: 14.0 };
            assert_eq!(decision.thresholds, limits, "the floors");
            match decision.what {
                What::Nothing => ("nothing", vec![]),
                What::Free(free) => ("free", vec![free.generic]),
                What::Together { .. } => panic!("not decided here"),
                What::Effects { members, or_else } => {
                    let what = if or_else.is_some() { "effects or a step" } else { "effects" };
                    (what, members.iter().map(|member| member.candidate).collect())
                }
            }
        }
    }

    #[test]
    fn an_effect_is_named_above_its_threshold_and_not_at_it() {
        let case = case();
        let gains = |gain, plain| Ranked { plain, ..ranked(0, gain) };
        assert_eq!(case.decided(&[gains(7.9, 9.0)], &[]).0, "nothing");
        assert_eq!(case.decided(&[gains(8.0, 9.0)], &[]).0, "nothing");
        assert_eq!(case.decided(&[gains(8.0 + 1e-9, 9.0)], &[]), ("effects", vec![0]));
    }

    #[test]
    fn scatter_alone_names_nothing() {
        let case = case();
        let in_means = |plain| Ranked { plain, ..ranked(0, 30.0) };
        assert_eq!(case.decided(&[in_means(8.0)], &[]).0, "nothing");
        assert_eq!(case.decided(&[in_means(8.0 + 1e-9)], &[]), ("effects", vec![0]));
    }

    #[test]
    fn so_is_a_free_shape() {
        let case = case();
        assert_eq!(case.decided(&[], &[free(0, 13.9)]).0, "nothing");
        assert_eq!(case.decided(&[], &[free(0, 14.0)]).0, "nothing");
        assert_eq!(case.decided(&[], &[free(0, 14.0 + 1e-9)]), ("free", vec![0]));
        // What the air may depend on as well must say a quarter more.
        assert_eq!(case.decided(&[], &[free(1, 17.5)]).0, "nothing");
        assert_eq!(case.decided(&[], &[free(1, 17.5 + 1e-9)]), ("free", vec![1]));
    }

    #[test]
    fn what_is_too_small_to_matter_is_not_named() {
        let case = case();
        let small = |size_us| Ranked { size_us, range_us: 0.0, ..ranked(0, 30.0) };
        assert_eq!(case.decided(&[small(MATERIAL_US)], &[]).0, "effects");
        assert_eq!(case.decided(&[small(MATERIAL_US - 1e-9)], &[]).0, "nothing");
        let small = |size_us| RankedGeneric { size_us, range_us: 0.0, ..free(0, 30.0) };
        assert_eq!(case.decided(&[], &[small(MATERIAL_US)]).0, "free");
        assert_eq!(case.decided(&[], &[small(MATERIAL_US - 1e-9)]).0, "nothing");
        // What is plain matters by what it does where it is largest.
        let short = |gain| Ranked { size_us: 0.1, range_us: MATERIAL_US, ..ranked(0, gain) };
        assert_eq!(case.decided(&[short(14.0)], &[]).0, "nothing");
        assert_eq!(case.decided(&[short(14.0 + 1e-9)], &[]).0, "effects");
    }

    #[test]
    fn a_wake_that_is_plain_in_the_means_matters_by_what_it_does_there() {
        let mut case = case();
        let own = |value: fn(usize, usize) -> f64| {
            let drones = |group: &GroupPattern| {
                let bins = 0..group.time_s.len();
                (0..group.drones)
                    .map(move |drone| bins.clone().map(|bin| value(drone, bin)).collect())
            };
            Column::Own(case.groups.iter().map(|group| drones(group).collect()).collect())
        };
        let of_all = own(|drone, bin| 0.1 * (drone + 10 * bin) as f64);
        // Three drones in the first group, two in the second: what one has more, another has less.
        let of_each = own(|drone, bin| match drone {
            0 => bin as f64,
            1 => -(bin as f64),
            _ => 0.0,
        });
        case.library[0] = effect("one", of_all, true);
        case.library[2] = effect("another", of_each, true);
        let short = |candidate, plain| {
            let whole = Ranked { size_us: 0.1, range_us: 9.0, ..ranked(candidate, 20.0) };
            case.decided(&[Ranked { plain, ..whole }], &[]).0
        };
        assert_eq!(short(0, 20.0), "effects", "5 us from the first bin to the last");
        assert_eq!(short(0, 13.9), "nothing", "only the scatter shows it so plainly");
        assert_eq!(short(2, 20.0), "nothing", "the means have nothing of it");
    }

    #[test]
    fn who_is_held_against_others_needs_half_of_what_finds_it() {
        let case = case();
        let alone = Options {
            only: Some(Only { effect: "one", updraft_mps: 0.0, beaten_nats: 0.0, is_bent: false }),
            ..BY_FLOORS
        };
        let is_taken = |gain| {
            let decision = case.decision(&[ranked(0, gain)], &[], &alone);
            matches!(decision.what, What::Effects { .. })
        };
        assert!(!is_taken(4.0) && is_taken(4.0 + 1e-9));
    }

    #[test]
    fn what_is_no_effect_of_the_vehicle_must_say_as_much_as_a_free_shape() {
        let case = case();
        assert_eq!(case.decided(&[ranked(3, 14.0)], &[]).0, "nothing");
        assert_eq!(case.decided(&[ranked(3, 14.0 + 1e-9)], &[]).0, "effects");
        let unfitted = Ranked { fitted: false, ..ranked(0, 30.0) };
        assert_eq!(case.decided(&[unfitted], &[]).0, "nothing");
    }

    #[test]
    fn a_free_shape_must_be_a_quarter_better_than_an_effect() {
        let case = case();
        assert_eq!(case.decided(&[ranked(0, 20.0)], &[free(0, 25.0)]).0, "effects");
        assert_eq!(case.decided(&[ranked(0, 20.0)], &[free(0, 25.0 + 1e-9)]).0, "free");
        // A shape of a number or two by some nats.
        assert_eq!(case.decided(&[ranked(0, 20.0)], &[free(2, 20.0)]).0, "effects");
        let little_more = case.decided(&[ranked(0, 20.0)], &[free(2, 20.0 + 1e-9)]).0;
        assert_eq!(little_more, "effects or a step");
        assert_eq!(case.decided(&[ranked(0, 20.0)], &[free(2, 22.5)]).0, "effects or a step");
        assert_eq!(case.decided(&[ranked(0, 20.0)], &[free(2, 22.5 + 1e-9)]).0, "free");
        assert_eq!(case.decided(&[ranked(0, 30.0)], &[free(3, 36.0)]).0, "effects");
        assert_eq!(case.decided(&[ranked(0, 30.0)], &[free(3, 36.0 + 1e-9)]).0, "free");
    }

    #[test]
    fn effects_that_look_alike_and_explain_nearly_as_well_are_a_class() {
        let case = case();
        let members =
            |best: f64, rival: f64| case.decided(&[ranked(0, best), ranked(1, rival)], &[]).1;
        // Twice the margin of 6 nats are held against each other in full.
        assert_eq!(members(30.0, 29.9), [0, 1]);
        assert_eq!(members(30.0, 18.0 + 1e-9), [0, 1]);
        assert_eq!(members(30.0, 18.0), [0]);
        // Of a large gain, twice a tenth.
        assert_eq!(members(100.0, 80.0 + 1e-9), [0, 1]);
        assert_eq!(members(100.0, 80.0), [0]);
        let other = case.decided(&[ranked(0, 30.0), ranked(2, 29.9)], &[]);
        assert_eq!(other.1, [0], "it leaves another trace");
        let better = Ranked { size_us: 0.1, range_us: 0.1, ..ranked(2, 31.0) };
        let passed_over = case.decided(&[ranked(0, 30.0), better], &[]);
        assert_eq!(passed_over.1, [0, 2], "what is better though too small is not passed over");
    }

    #[test]
    fn the_margin_of_a_class_is_six_nats_or_a_tenth() {
        assert_eq!([0.0, 10.0, 60.0, 200.0].map(margin_nats), [6.0, 6.0, 6.0, 20.0]);
    }

    #[test]
    fn what_chance_reaches_is_asked_unless_a_gain_is_far_above_it() {
        let case = case();
        let strict = Options { alpha: 1e-12, replicates: 20, ..BY_FLOORS };
        let thresholds = |gain| case.decision(&[ranked(0, gain)], &[], &strict).thresholds;
        let found = thresholds(SURE_NATS - 0.1);
        assert!(found.library > 8.0, "once in so many flights chance gains more: {found:?}");
        assert_eq!(thresholds(SURE_NATS), Thresholds { library: 8.0, generic: 14.0 });
    }
}
