//! Tiles, tables and the sections of steps on the page of a verdict.

use minijinja::context;
use minijinja::value::Value;

use crate::effects;
use crate::gap::Dependence;
use crate::gap::Verdict;
use crate::gap::verdict::{Detectable, Finding, Fitted, Shrink, Step};
use crate::gap::words::{member, phrase, quantity, with_symbol};

use super::figures::gap::map::ORDER;
use super::figures::gap::step;
use super::gap_words::{
    after_mps, in_field, kind, lost, micro, minus, number, or_none, per_thousand, percent,
    range_to, regime_title, with_unit,
};
use super::page::{Gallery, capitalised};
use super::text::{NONE, clean, count, fixed, reduced, sentence, signed, unit};

/// The gap that is told first: on held-out drones, else on held-out rungs.
pub(super) fn first_gap(verdict: &Verdict) -> Option<(&'static str, Shrink)> {
    let drones = verdict.gap.drones.map(|shrink| ("held-out drones", shrink));
    drones.or_else(|| verdict.gap.rungs.map(|shrink| ("held-out rungs", shrink)))
}

/// The numbers at the top.
pub(super) fn tiles(verdict: &Verdict) -> Vec<Value> {
    let tile = |label: &str, value: String, note: String| context! { label, value, note };
    let data = &verdict.data;
    let mut tiles = vec![tile(
        "drones used",
        data.drones.to_string(),
        match data.held_out.len() {
            0 => format!("of {}, none held out", count(data.logs, "log")),
            n => format!("of {}, {n} held out", count(data.logs, "log")),
        },
    )];
    if let Some((on, shrink)) = first_gap(verdict) {
        tiles.push(tile(
            &format!("gap on {on}, air included"),
            format!(
                "{} → {} µs",
                fixed(shrink.before_us.value, 1),
                fixed(shrink.after_us.value, 1)
            ),
            format!("{} → {} m/s", fixed(shrink.before_mps, 2), fixed(shrink.after_mps, 2)),
        ));
        tiles.push(tile(
            "without the shared air",
            format!(
                "{} → {} µs",
                fixed(shrink.before_without_air_us, 1),
                fixed(shrink.after_without_air_us, 1)
            ),
            format!("noise floor {} µs", fixed(shrink.floor_us, 1)),
        ));
        if !verdict.steps.is_empty() {
            let (value, range) = percent(shrink.excess_shrink);
            tiles.push(tile("of the excess over the floor gone", value, range));
        }
        tiles.push(tile(
            "reduced χ²",
            format!("{} → {}", reduced(shrink.chi2.0), reduced(shrink.chi2.1)),
            "1: air and noise explain all".to_owned(),
        ));
    }
    tiles
}

/// Every class of every regime.
pub(super) fn regime_rows(verdict: &Verdict) -> Vec<Value> {
    let place = |by: Dependence| ORDER.iter().position(|known| *known == by).unwrap_or(ORDER.len());
    let mut rows: Vec<_> = verdict.regimes.iter().collect();
    rows.sort_by_key(|row| place(row.by));
    rows.into_iter()
        .map(|row| {
            // The drones' own means are no chance of the air.
            let own = row.by.is_of_drones();
            context! {
                by => regime_title(row.by),
                label => minus(&clean(&row.label)),
                bins => row.bins,
                before => signed(row.before_us.0, 1),
                se => if own { NONE.to_owned() } else { fixed(row.before_us.1, 1) },
                after => signed(row.after_us, 1),
                before_mps => signed(row.before_mps, 3),
                after_mps => signed(after_mps(row), 3),
            }
        })
        .collect()
}

/// One thing that was found.
pub(super) fn step_section(found: &Step, number_of: usize, figures: &mut Gallery) -> Value {
    let figure = step::figure(found, number_of, figures.format).map(|figure| figures.show(figure));
    let effects: Vec<Value> = found.finding.effects().into_iter().map(described).collect();
    let parameters = match &found.finding {
        Finding::Name { parameters, .. } | Finding::Class { parameters, .. } => {
            parameters.iter().map(parameter).collect()
        }
        Finding::Unknown { .. } => Vec::new(),
    };
    context! {
        number => number_of,
        kind => kind(&found.finding),
        heading => heading(&found.finding),
        sentence => what_it_means(&found.finding),
        phrase => micro(&capitalised(&phrase(found))),
        effects,
        parameters => parameters,
        gain => fixed(found.gain_nats, 1),
        threshold => fixed(found.threshold_nats, 1),
        chance => per_thousand(found.alpha),
        size => (found.size_us > 0.0).then(|| fixed(found.size_us, 1)),
        in_field => found.in_field.as_ref().map(|size| micro(&in_field(size))),
        figure,
    }
}

fn heading(finding: &Finding) -> String {
    let title = |name: &str| {
        effects::find(name)
            .map_or_else(|| clean(&member(name)), |one| one.definition().title.to_owned())
    };
    match finding {
        Finding::Name { effect, .. } => title(effect),
        Finding::Class { effects, .. } => {
            effects.iter().map(|name| title(name)).collect::<Vec<_>>().join(" or ")
        }
        Finding::Unknown { depends_on: on, .. } => {
            format!("Something unknown that depends on {}", quantity(*on))
        }
    }
}

fn what_it_means(finding: &Finding) -> String {
    match finding {
        Finding::Name { was_there: true, .. } => {
            "The model had this effect, with another size.".to_owned()
        }
        Finding::Name { .. } => "The model did not have this effect.".to_owned(),
        Finding::Class { effects, parameters } => format!(
            "One of these {} is missing; in this flight they leave the same trace, so choosing \
             one would be a guess. {}",
            effects.len(),
            if parameters.is_empty() {
                "None of them is in the model."
            } else {
                "The first one represents them in the model."
            }
        ),
        Finding::Unknown { formula, depends_on } => {
            let formula = formula.as_ref().map_or_else(String::new, |text| {
                format!(" It is about {}.", micro(&with_symbol(text, *depends_on)))
            });
            format!(
                "No effect of the library explains this, but it is too regular for air and \
                 noise.{formula} It is not in the model file, because there is no effect to add."
            )
        }
    }
}

/// An effect in the library's own words.
fn described(name: &str) -> Value {
    effects::find(name).map_or_else(
        || context! { name => clean(name), title => clean(&member(name)), what => "", why => "", formula => "", source => "" },
        |effect| {
            let one = effect.definition();
            context! {
                name => one.name,
                title => one.title,
                what => sentence(one.what),
                why => sentence(one.explanation),
                formula => one.formula,
                source => sentence(one.source),
            }
        },
    )
}

fn parameter(fitted: &Fitted) -> Value {
    let name_of_none = "not in the model";
    context! {
        name => clean(&fitted.name),
        unit => unit(&fitted.unit),
        value => number(fitted.value.value),
        range => format!("{} to {}", number(fitted.value.low), number(fitted.value.high)),
        before => fitted.before.map_or_else(|| name_of_none.to_owned(), number),
    }
}

/// The gap on what was not fitted.
pub(super) fn gap_rows(verdict: &Verdict) -> Vec<Value> {
    [("held-out drones", verdict.gap.drones), ("held-out rungs", verdict.gap.rungs)]
        .into_iter()
        .filter_map(|(name, shrink)| Some((name, shrink?)))
        .map(|(name, shrink)| {
            let (gone, range) = percent(shrink.excess_shrink);
            context! {
                name,
                before => fixed(shrink.before_us.value, 1),
                before_range => range_to(shrink.before_us, 1),
                after => fixed(shrink.after_us.value, 1),
                after_range => range_to(shrink.after_us, 1),
                mean => format!("{} → {}", fixed(shrink.mean_us.0, 1), fixed(shrink.mean_us.1, 1)),
                mps => format!("{} → {}", fixed(shrink.before_mps, 2), fixed(shrink.after_mps, 2)),
                without => format!(
                    "{} → {}",
                    fixed(shrink.before_without_air_us, 1),
                    fixed(shrink.after_without_air_us, 1)
                ),
                floor => fixed(shrink.floor_us, 1),
                chi2 => format!("{} → {}", reduced(shrink.chi2.0), reduced(shrink.chi2.1)),
                shrink => if verdict.steps.is_empty() { NONE } else { &gone },
                shrink_range => if verdict.steps.is_empty() { "" } else { &range },
            }
        })
        .collect()
}

/// The channel of the vertical velocity.
pub(super) fn sensor(verdict: &Verdict) -> Value {
    let channel = &verdict.sensor;
    let biased: Vec<Value> = channel
        .biased_drones
        .iter()
        .map(|(slot, bias)| context! { slot => *slot, bias => signed(*bias, 3) })
        .collect();
    context! {
        known => channel.bias_mps.is_some() || channel.lag_s.is_some(),
        bias => or_none(channel.bias_mps, 4),
        lag => or_none(channel.lag_s, 3),
        named => channel.named,
        biased,
    }
}

/// What the flight could not have shown, what it would have, and what is not looked for.
pub(super) fn detectables(verdict: &Verdict) -> Value {
    let (sought, other): (Vec<&Detectable>, Vec<&Detectable>) =
        verdict.detectable.iter().partition(|one| !one.parameter.is_empty());
    let (mut seen, mut unseen): (Vec<&Detectable>, Vec<&Detectable>) =
        sought.into_iter().partition(|one| one.would_be_seen);
    let by_z = |a: &&Detectable, b: &&Detectable| a.usual_z.abs().total_cmp(&b.usual_z.abs());
    unseen.sort_by(by_z);
    seen.sort_by(|a, b| by_z(b, a));
    let row = |one: &&Detectable| {
        let title = effects::find(&one.effect).map_or("", |effect| effect.definition().title);
        context! {
            effect => clean(&one.effect),
            title,
            parameter => clean(&one.parameter),
            smallest => one.smallest.map_or_else(
                || NONE.to_owned(),
                |smallest| with_unit(smallest.copysign(one.usual), &one.unit),
            ),
            usual => with_unit(one.usual, &one.unit),
            z => fixed(one.usual_z.abs(), 1),
            like => if one.like.is_empty() { NONE.to_owned() } else { clean(&one.like.join(", ")) },
            why => if one.why.is_empty() && !one.would_be_seen {
                lost(one).to_owned()
            } else {
                micro(&one.why)
            },
        }
    };
    let rows = |list: &[&Detectable]| list.iter().map(row).collect::<Vec<_>>();
    context! { unseen => rows(&unseen), seen => rows(&seen), other => rows(&other) }
}

/// Air and noise: what, value, meaning.
pub(super) fn noise_rows(verdict: &Verdict) -> Vec<Value> {
    let noise = &verdict.noise;
    let rows = [
        (
            "updraft that all drones share",
            with_unit(noise.shared_air_mps, "m/s"),
            "standard deviation",
        ),
        ("its time scale", with_unit(noise.shared_air_s, "s"), "exponential"),
        (
            "slow updraft of each drone's own place",
            with_unit(noise.own_air_mps, "m/s"),
            "standard deviation",
        ),
        ("gusts of each drone", with_unit(noise.gusts_mps, "m/s"), "standard deviation"),
        ("their time scale", with_unit(noise.gusts_s, "s"), "exponential"),
        ("white noise of a bin", with_unit(noise.white_us, "us"), "standard deviation"),
        ("hover pulse from drone to drone", with_unit(noise.drones_us, "us"), "standard deviation"),
        (
            "response from drone to drone",
            format!("{} %", number(100.0 * noise.slopes)),
            "standard deviation",
        ),
        (
            "response to air where the model has none",
            with_unit(noise.least_response, "us/(m/s)"),
            "assumed on top of the model's own",
        ),
        (
            "change of the shared updraft over 50 m of height",
            with_unit(noise.gradient_mps, "m/s"),
            "standard deviation",
        ),
        (
            "horizontal gusts that the leans do not show",
            with_unit(noise.side_gusts_mps, "m/s"),
            "standard deviation along either axis",
        ),
        (
            "noise of each drone's pulse that some seconds remember",
            with_unit(noise.pulse_noise_us, "us"),
            "standard deviation",
        ),
        (
            "uniform updraft of the whole flight",
            noise.updraft_half_mps.map_or_else(
                || with_unit(noise.updraft_mps, "m/s"),
                |half| format!("{} ± {}", number(noise.updraft_mps), with_unit(half, "m/s")),
            ),
            "where the flight is explained best; 95 %",
        ),
    ];
    rows.into_iter().map(|(what, value, note)| context! { what, value, note }).collect()
}
