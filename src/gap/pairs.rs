//! Two effects at once, where the simulated side is another program's.
//!
//! The plants of two programs differ in several things, and one effect alone may explain little of what two explain
//! together: a drag that the model lacks and a response that is too large take away much of each other. Before such a
//! difference is called unknown, pairs of effects are held against the free shape.

use rayon::prelude::*;

use super::candidates::Candidate;
use super::decide::margin_nats;
use super::gls::{Likelihood, Problem, Solution};
use super::search::{FLOOR_NATS, Ranked, RankedGeneric, Round, Sought, admissible};
use crate::effects::{Signal, find};

/// A free shape must gain this many times as much to be something else, as against a single effect.
const FREE_BETTER: f64 = 1.25;
/// Pairs that are fitted with their own noise. Chosen for time.
const MOST_FITTED: usize = 8;

/// Two effects, each with the names that may stand for it, its own first.
pub(super) struct Pair {
    pub(super) members: [Ranked; 2],
    pub(super) names: [Vec<&'static str>; 2],
    /// What both explain, nats.
    pub(super) gain: f64,
}

/// One pair in its best forms.
struct Tried {
    /// Places of candidate and form.
    forms: [(usize, usize); 2],
    solution: Solution,
    gain: f64,
}

impl Tried {
    fn candidates(&self) -> [usize; 2] {
        self.forms.map(|(candidate, _)| candidate)
    }

    fn beta(&self) -> [f64; 2] {
        let beta = &self.solution.beta;
        [beta[beta.len() - 2], beta[beta.len() - 1]]
    }
}

/// The two effects that explain as much as a free shape does; `None`: no two do, or others do as well.
pub(super) fn instead_of(
    problem: &Problem<'_>,
    round: &Round,
    sought: Sought<'_>,
    free: &RankedGeneric,
) -> Option<Pair> {
    let library = sought.library;
    // On a ladder whose rungs grow, a response that grows with time is a square.
    let goes_with_time = |candidate: &Candidate| {
        let effect = find(candidate.name);
        effect.is_some_and(|effect| effect.definition().signals.contains(&Signal::Time))
    };
    let is_effect = |place: &usize| {
        let candidate = &library[*place];
        candidate.size.is_some() && !candidate.by_lean && !goes_with_time(candidate)
    };
    let effects: Vec<usize> = (0..library.len()).filter(is_effect).collect();
    let before = round.base.log_posterior();
    let mut tried: Vec<Tried> = effects
        .par_iter()
        .enumerate()
        .flat_map_iter(|(place, one)| effects[place + 1..].iter().map(move |other| [*one, *other]))
        .filter_map(|pair| {
            let forms = forms(library, pair).into_iter();
            let each = forms.filter_map(|forms| {
                let with = problem.with(forms.map(|form| column(library, form)));
                tried(library, forms, with.at(&free.hyper), before)
            });
            each.max_by(|a, b| a.gain.total_cmp(&b.gain))
        })
        .collect();
    let by_gain = |tried: &mut Vec<Tried>| tried.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    by_gain(&mut tried);
    tried.truncate(MOST_FITTED);
    let mut tried: Vec<Tried> = tried
        .into_par_iter()
        .map(|quick| {
            let with = problem.with(quick.forms.map(|form| column(library, form)));
            let fitted = with.fit(quick.solution.hyper, Likelihood::Profile);
            let fitted = self::tried(library, quick.forms, fitted, before);
            fitted.filter(|fitted| fitted.gain > quick.gain).unwrap_or(quick)
        })
        .collect();
    by_gain(&mut tried);
    let best = tried.first()?;
    if best.gain * FREE_BETTER < free.gain {
        return None;
    }
    let mut names = best.candidates().map(|candidate| vec![library[candidate].name]);
    let least = best.gain - margin_nats(best.gain);
    for rival in tried[1..].iter().filter(|rival| rival.gain > least) {
        let [one, other] = best.candidates();
        match rival.candidates() {
            // What the two have in common stands, and the others stand for each other.
            [a, b] if a == one => names[1].push(library[b].name),
            [a, b] if b == one => names[1].push(library[a].name),
            [a, b] if a == other => names[0].push(library[b].name),
            [a, b] if b == other => names[0].push(library[a].name),
            _ => return None,
        }
    }
    let alone = |place: usize| {
        let with = problem.with([column(library, best.forms[1 - place])]);
        with.fit(best.solution.hyper, Likelihood::Profile).log_posterior() - before
    };
    let member = |place: usize| {
        let (candidate, variant) = best.forms[place];
        let (beta, column) = (best.beta()[place], column(library, best.forms[place]));
        Ranked {
            candidate,
            variant,
            gain: best.gain - alone(place),
            plain: best.gain - alone(place),
            beta,
            size_us: beta.abs() * column.spread(sought.drones),
            range_us: beta.abs() * column.range(),
            hyper: best.solution.hyper,
            fitted: true,
        }
    };
    let members = [member(0), member(1)];
    let both = members.iter().all(|member| member.gain > FLOOR_NATS);
    both.then_some(Pair { members, names, gain: best.gain })
}

fn column(library: &[Candidate], (candidate, variant): (usize, usize)) -> &super::gls::Column {
    &library[candidate].variants[variant].column
}

/// All forms of a pair.
fn forms(library: &[Candidate], [one, other]: [usize; 2]) -> Vec<[(usize, usize); 2]> {
    let variants = |place: usize| 0..library[place].variants.len();
    let pairs = variants(one).flat_map(|a| variants(other).map(move |b| [(one, a), (other, b)]));
    pairs.collect()
}

/// A pair if both have sizes that they can have.
fn tried(
    library: &[Candidate],
    forms: [(usize, usize); 2],
    solution: Solution,
    before: f64,
) -> Option<Tried> {
    let gain = solution.log_posterior() - before;
    let tried = Tried { forms, solution, gain };
    let can = |((candidate, variant), beta): ((usize, usize), f64)| {
        admissible(&library[candidate], &library[candidate].variants[variant], beta)
    };
    (gain.is_finite() && forms.into_iter().zip(tried.beta()).all(can)).then_some(tried)
}

#[cfg(test)]
mod tests {
    use super::super::candidates::{Size, Variant};
    use super::super::gls::{Column, Split};
    use super::super::noise::{GroupPattern, Hyper};
    use super::super::trial::{patterns, pulses};
    use super::*;

    type Form = fn(f64) -> f64;
    const WAVE: Form = |time| 20.0 * (0.07 * time).sin();
    const LINE: Form = |time| 0.4 * time;
    const SQUARE: Form = |time| 0.008 * (time - 60.0) * (time - 60.0);

    fn column(groups: &[GroupPattern], form: Form) -> Column {
        let bins = |group: &GroupPattern| group.time_s.iter().map(|time| form(*time)).collect();
        Column::Shared(groups.iter().map(bins).collect())
    }

    /// What stands for what in pulses that have the first two forms.
    fn found(library: &[(&'static str, Form)], free_gain: f64) -> Option<[Vec<&'static str>; 2]> {
        let groups = patterns();
        let candidate = |(name, form): &(&'static str, Form)| {
            let column = column(&groups, *form);
            let size = Size { name: "size", unit: "", low: 0.0, high: 9.0, now: 0.0, usual: 1.0 };
            let variant = Variant { vehicle: None, size: 1.0, column, felt: Vec::new() };
            let size = Some(size);
            Candidate { name, was_there: false, by_lean: false, size, variants: vec![variant] }
        };
        let library: Vec<Candidate> = library.iter().map(candidate).collect();
        let (wave, line) = (column(&groups, WAVE), column(&groups, LINE));
        let mut pulses = pulses(&groups);
        for (group, drones) in pulses.iter_mut().enumerate() {
            for (bin, value) in drones.iter_mut().flat_map(|bins| bins.iter_mut().enumerate()) {
                *value += 2.0 * wave.at(group, 0, bin) + 3.0 * line.at(group, 0, bin);
            }
        }
        let split = Split::of(&pulses);
        let problem = Problem::new(&groups, &split);
        let hyper = Hyper::default();
        let base = problem.fit(hyper, Likelihood::Profile);
        let round = Round { groups: groups.clone(), base, library: vec![], generics: vec![] };
        let sought = Sought { library: &library, generics: &[], drones: &[3, 2] };
        let (beta, size_us, range_us) = (Vec::new(), 9.0, 9.0);
        let free = RankedGeneric {
            generic: 0,
            gain: free_gain,
            plain: free_gain,
            beta,
            size_us,
            range_us,
            hyper,
        };
        instead_of(&problem, &round, sought, &free).map(|pair| pair.names)
    }

    #[test]
    fn two_effects_that_explain_together_what_a_free_shape_does_are_named() {
        let library = [("wave", WAVE), ("line", LINE), ("square", SQUARE)];
        assert_eq!(found(&library, 1.0), Some([vec!["wave"], vec!["line"]]));
        assert_eq!(found(&library, 1000.0), None, "a free shape is better");
        assert_eq!(found(&library[1..], 1.0), None, "and these two do not explain it");
    }

    #[test]
    fn what_leaves_the_same_trace_as_one_of_them_stands_for_it() {
        let library = [("wave", WAVE), ("line", LINE), ("its like", LINE)];
        assert_eq!(found(&library, 1.0), Some([vec!["wave"], vec!["line", "its like"]]));
    }
}
