//! Findings, rivals and what is left at the end of a search, in the form of a verdict.

use super::super::candidates::{Candidate, Size, Variant};
use super::super::compare::Comparison;
use super::super::dependence::Dependence;
use super::super::generic::drawn;
use super::super::search::{Round, Sought, Thresholds};
use super::super::verdict::{Finding, Fitted, Interval, Rest, Rival, Shape, Step};
use crate::effects::{Role, Signals};

/// The end of the search, if this round is the last.
pub(super) fn rest(round: &Round, sought: Sought<'_>, thresholds: &Thresholds) -> Rest {
    let library = round.best() >= round.best_generic();
    Rest {
        gain_nats: round.best().max(round.best_generic()),
        candidate: best_name(round, sought),
        threshold_nats: if library { thresholds.library } else { thresholds.generic },
        reduced_chi2: round.base.chi2 / round.base.freedom.max(1.0),
    }
}

/// An effect that was found again, when it had been flown with its first size, is one finding.
pub(super) fn told_once(steps: &mut Vec<Step>) {
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

/// Something unknown that was found again, when the rest of the model had changed beside it, is one finding: that of the first
/// time.
pub(in super::super) fn unknowns_once(steps: &mut Vec<Step>) {
    let mut told: Vec<Dependence> = Vec::new();
    steps.retain(|step| {
        let Finding::Unknown { depends_on, .. } = step.finding else { return true };
        let is_new = !told.contains(&depends_on);
        told.push(depends_on);
        is_new
    });
}

/// Names of a step, with those that lean a drone alike where the lean told it.
pub(super) fn with_alike(mut names: Vec<String>, candidate: &Candidate) -> Vec<String> {
    if candidate.by_lean {
        let others = super::super::lean_channel::alike();
        names.extend(others.into_iter().filter(|one| !names.contains(one)).collect::<Vec<_>>());
    }
    names
}

pub(super) fn finding(names: Vec<String>, was_there: bool, known: Option<Fitted>) -> Finding {
    let parameters = known.into_iter().collect();
    match &names[..] {
        [effect] => Finding::Name { effect: effect.clone(), parameters, was_there },
        _ => Finding::Class { effects: names, parameters },
    }
}

/// The drag of the rotors as a fitted parameter.
pub(super) fn lean_parameter(size: Size, drag: Interval) -> Fitted {
    let Interval { value, low, high } = drag;
    let most = Role::RotorDrag.place().map_or(f64::INFINITY, |place| place.parameter.high);
    Fitted {
        name: size.name.to_owned(),
        unit: size.unit.to_owned(),
        value: Interval {
            value,
            low: (value - LEAN_DOUBT.hypot(value - low)).max(0.0),
            high: (value + LEAN_DOUBT.hypot(high - value)).min(most),
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
pub(super) fn along_its_signal(comparison: &Comparison, variant: &Variant, beta: f64) -> Shape {
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

pub(super) fn rivals(round: &Round, sought: Sought<'_>) -> Vec<Rival> {
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

#[cfg(test)]
mod tests {
    use super::super::super::trial;
    use super::*;

    #[test]
    fn the_same_unknown_is_told_once() {
        let unknown = |depends_on| Finding::Unknown { depends_on, formula: None };
        let told = |depends_on, nats| trial::step(unknown(depends_on), nats, &[]);
        let mut steps = vec![
            told(Dependence::Climb, 30.0),
            trial::step(trial::name("battery"), 25.0, &[]),
            told(Dependence::Time, 20.0),
            told(Dependence::Climb, 12.0),
        ];
        unknowns_once(&mut steps);
        let nats: Vec<f64> = steps.iter().map(|step| step.gain_nats).collect();
        assert_eq!(nats, [30.0, 25.0, 20.0], "the first of each");
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
