//! Metrics of a table of blind flights, and the demands on them.

use super::interval::{clopper_pearson, median};
use super::scenario::{AirClass, Base, Protocol};
use super::score::{Called, HiddenOutcome, Outcome, WORSE};
use super::table::{Demand, Metric};
use crate::effects::Role;

/// Whether it is named, alone or in its class.
pub(super) fn is_named(hidden: &HiddenOutcome) -> bool {
    matches!(hidden.called, Called::Named | Called::InClass)
}

/// Whether its Fisher z is known and in this range.
pub(super) fn has_z(hidden: &HiddenOutcome, from: f64, to: f64) -> bool {
    hidden.z.is_some_and(|z| (from..to).contains(&z.abs()))
}

/// Inflow of the paper's own case, us/(m/s) at hover, and how much the whole of it is to AirSim's quad.
const PAPER_INFLOW_US: (f64, f64) = (15.0, 28.0);
const AIRSIM_US_PER_SHARE: f64 = 72.0;

/// What is measured, in the order of the table.
pub(super) fn metrics(outcomes: &[&Outcome]) -> Vec<Metric> {
    let (none, some): (Vec<&Outcome>, Vec<&Outcome>) =
        outcomes.iter().copied().partition(|one| one.hidden.is_empty());
    let hidden: Vec<&HiddenOutcome> = outcomes.iter().flat_map(|one| &one.hidden).collect();
    let mut metrics = false_alarms(&none);
    metrics.extend(names(&some, &hidden));
    metrics.push(rate(
        "a wrong single name, of all flights",
        outcomes.iter().map(|one| !one.wrong_names.is_empty()),
        [at_most(0.03), at_most(0.005)],
    ));
    metrics.extend(sizes(&some, &hidden));
    metrics.push(said_invisible(&hidden));
    metrics.extend(the_papers_own(&some));
    metrics
}

fn at_least(bound: f64) -> Demand {
    Demand::AtLeast { bound }
}

fn at_most(bound: f64) -> Demand {
    Demand::AtMost { bound }
}

/// How often something is found where nothing is hidden.
fn false_alarms(none: &[&Outcome]) -> Vec<Metric> {
    let alarms = || none.iter().map(|one| one.is_false_alarm());
    let upper = |bound| Demand::UpperAtMost { bound };
    vec![
        rate("false alarms, nothing hidden (upper end)", alarms(), [upper(0.05), upper(0.025)]),
        rate("false alarms, nothing hidden (observed)", alarms(), [at_most(0.05), at_most(0.01)]),
    ]
}

/// How often what is hidden is called by its name.
fn names(some: &[&Outcome], hidden: &[&HiddenOutcome]) -> Vec<Metric> {
    let library = |from: f64, to: f64| {
        hidden.iter().copied().filter(move |one| !one.foreign && has_z(one, from, to))
    };
    let foreign = || hidden.iter().copied().filter(|one| one.foreign);
    let together = |count: usize| {
        let of = some.iter().filter(move |one| one.hidden.len() == count);
        of.filter(|one| one.hidden.iter().all(|hidden| has_z(hidden, 6.0, f64::INFINITY)))
    };
    let all_named = |one: &Outcome| one.hidden.iter().all(is_named);
    vec![
        rate(
            "named or in class, z >= 6",
            library(6.0, f64::INFINITY).map(is_named),
            [at_least(0.9), at_least(0.98)],
        ),
        rate(
            "named or in class, z 4 to 6",
            library(4.0, 6.0).map(is_named),
            [at_least(0.4), at_least(0.75)],
        ),
        rate(
            "named alone, z >= 6, alone in class",
            library(6.0, f64::INFINITY)
                .filter(|one| one.single)
                .map(|one| one.called == Called::Named),
            [at_least(0.85), at_least(0.97)],
        ),
        rate(
            "a wrong single name, any z",
            some.iter().map(|one| !one.wrong_names.is_empty()),
            [at_most(0.03), at_most(0.005)],
        ),
        rate(
            "unknown recognised, right dependence, z >= 8",
            foreign()
                .filter(|one| has_z(one, 8.0, f64::INFINITY))
                .map(|one| one.called == Called::Named),
            [at_least(0.75), at_least(0.95)],
        ),
        rate(
            "two effects, both named, each z >= 6",
            together(2).map(|one| all_named(one)),
            [at_least(0.75), at_least(0.93)],
        ),
        rate(
            "three effects, all named, each z >= 6",
            together(3).map(|one| all_named(one)),
            [at_least(0.0), at_least(0.8)],
        ),
    ]
}

/// How well sizes are found, and what of the gap they take away.
fn sizes(some: &[&Outcome], hidden: &[&HiddenOutcome]) -> Vec<Metric> {
    let errors: Vec<f64> =
        hidden.iter().filter_map(|one| one.relative_error).map(f64::abs).collect();
    let found = || some.iter().filter(|one| !one.found.is_empty());
    let shrinks: Vec<f64> = found().filter_map(|one| one.excess_shrink).collect();
    let raw: Vec<f64> = found().filter_map(|one| one.raw_shrink).collect();
    let within = |low, high| Demand::Within { low, high };
    vec![
        middle("median error of the parameter", &errors, [at_most(0.1), at_most(0.03)]),
        rate(
            "95 % interval covers",
            hidden.iter().filter_map(|one| one.covered),
            [within(0.90, 0.98), within(0.94, 0.96)],
        ),
        middle("held-out excess that is gone, median", &shrinks, [at_least(0.8), at_least(0.95)]),
        middle("held-out gap that is gone, median", &raw, [at_least(0.0), at_least(0.0)]),
        rate(
            "flights made worse",
            some.iter().map(|one| one.made_worse),
            [at_most(0.03), at_most(0.0)],
        ),
        rate(
            "raw held-out gap made worse",
            found().filter_map(|one| one.raw_shrink).map(|shrink| shrink < 1.0 - WORSE),
            [at_most(0.03), at_most(0.0)],
        ),
    ]
}

/// How often what is called invisible is.
fn said_invisible(hidden: &[&HiddenOutcome]) -> Metric {
    let unseen = hidden
        .iter()
        .filter(|one| !one.foreign && one.said_visible == Some(false) && one.z.is_some());
    rate(
        "said invisible, and z < 4",
        unseen.map(|one| one.z.is_some_and(|z| z.abs() < 4.0)),
        [at_least(0.9), at_least(0.95)],
    )
}

/// The paper's own case: AirSim's law against a field flight of drones with usual rotors.
fn the_papers_own(some: &[&Outcome]) -> Vec<Metric> {
    let paper_like = || {
        some.iter().copied().filter(|one| {
            let cell = (one.cell.protocol, one.cell.air, one.cell.base);
            cell == (Protocol::Paper, AirClass::Field, Base::Airsim)
                && one.hidden.len() == 1
                && one.hidden.iter().all(|hidden| {
                    let (low, high) = PAPER_INFLOW_US;
                    Role::InflowShare.is_of(&hidden.effect)
                        && (low..high).contains(&(AIRSIM_US_PER_SHARE * hidden.value))
                })
        })
    };
    let means: Vec<f64> = paper_like().filter_map(|one| one.mean_shrink).collect();
    vec![
        rate(
            "the paper's own case: inflow named",
            paper_like().map(|one| one.hidden.iter().all(|hidden| hidden.called == Called::Named)),
            [at_least(0.95), at_least(1.0)],
        ),
        middle(
            "the same: gap of the drones' mean that is gone",
            &means,
            [at_least(0.55), at_least(0.0)],
        ),
    ]
}

fn rate(
    name: &str,
    cases: impl Iterator<Item = bool>,
    [acceptance, moonshot]: [Demand; 2],
) -> Metric {
    let (mut count, mut total) = (0, 0);
    for case in cases {
        count += usize::from(case);
        total += 1;
    }
    Metric {
        name: name.to_owned(),
        value: (total > 0).then(|| count as f64 / total as f64),
        interval: (total > 0).then(|| clopper_pearson(count, total)),
        counts: (count, total),
        acceptance,
        moonshot,
    }
}

fn middle(name: &str, values: &[f64], [acceptance, moonshot]: [Demand; 2]) -> Metric {
    Metric {
        name: name.to_owned(),
        value: median(values),
        interval: None,
        counts: (values.len(), values.len()),
        acceptance,
        moonshot,
    }
}
