//! Outcome of a blind flight, in plain words and as one object.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::classes::equivalent;
use super::hide::{KINDS, ON_REQUEST};
use super::play::Played;
use super::scenario::Scenario;
use super::score::{Called, HiddenOutcome, Outcome};
use crate::effects::{Role, find};
use crate::gap::Verdict;
use crate::gap::verdict::{Finding, Shrink, Step};
use crate::gap::words::short;

/// Name and version of the format of `hidden.json`.
pub const HIDDEN_SCHEMA: &str = "updraft.hidden/1";

/// One flight with something hidden, from the seal to its opening: `hidden.json` of `updraft run --hide`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HiddenRun {
    /// Format name and version: `updraft.hidden/1`.
    pub schema: String,
    /// Program and version.
    pub made_by: String,
    /// Logs that the search was given.
    pub logs: usize,
    /// SHA-256 of the sealed truth, published before the flight.
    pub truth_sha256: String,
    /// SHA-256 of the verdict that was on the disk when the seal was opened.
    pub verdict_sha256: String,
    /// The verdict in one or two sentences.
    pub verdict: String,
    /// The gap on held-out drones (few drones: held-out rungs), before and after.
    pub gap: Option<Shrink>,
    /// What was hidden, in a few words.
    pub truth: String,
    /// Whether all that was hidden is named, or in a class that is given, and nothing else is.
    pub right: bool,
    /// The comparison in plain words.
    pub words: Vec<String>,
    /// The comparison.
    pub outcome: Outcome,
}

impl HiddenRun {
    /// Makes the object from a flight that was played.
    pub fn of(played: &Played, made_by: &str) -> Self {
        let Played { flown, verdict, opened, outcome } = played;
        Self {
            schema: HIDDEN_SCHEMA.to_owned(),
            made_by: made_by.to_owned(),
            logs: flown.logs,
            truth_sha256: opened.truth_sha256.clone(),
            verdict_sha256: opened.verdict_sha256.clone(),
            verdict: verdict.summary.clone(),
            gap: verdict.gap.drones.or(verdict.gap.rungs),
            truth: opened.truth.words(),
            right: is_right(outcome),
            words: words(outcome, verdict),
            outcome: outcome.clone(),
        }
    }
}

/// Whether every hidden effect was called by its name or class, and nothing else was named.
pub fn is_right(outcome: &Outcome) -> bool {
    let called = |one: &HiddenOutcome| matches!(one.called, Called::Named | Called::InClass);
    let others = outcome.wrong_names.len() - outcome.wrong_in_class
        + outcome.wrong_classes
        + outcome.wrong_unknowns;
    outcome.hidden.iter().all(called) && others == 0 && !outcome.is_false_alarm()
}

/// Comparison of verdict and truth, one sentence or two for each effect.
pub fn words(outcome: &Outcome, verdict: &Verdict) -> Vec<String> {
    let mut words: Vec<String> =
        outcome.hidden.iter().map(|one| of_one(one, outcome, verdict)).collect();
    if outcome.hidden.is_empty() {
        words.push(if outcome.found.is_empty() {
            "Right: nothing was hidden, and nothing was named.".to_owned()
        } else if verdict.is_unexplained() && !verdict.sensor.named {
            "Wrong: nothing was hidden, and the verdict says that something is missing.".to_owned()
        } else {
            format!("Wrong: nothing was hidden, and {} was named.", outcome.found.join(" and "))
        });
    } else {
        words.extend(no_shrink(verdict));
        let in_class = |name: &str| outcome.hidden.iter().any(|one| equivalent(&one.effect, name));
        let others: Vec<&str> =
            outcome.wrong_names.iter().map(String::as_str).filter(|name| !in_class(name)).collect();
        if !others.is_empty() {
            words.push(format!(
                "Wrong: {} was named as well, and it was not hidden.",
                others.join(" and ")
            ));
        }
        match outcome.wrong_classes {
            0 => {}
            1 => words
                .push("Wrong: a class was given that has nothing of what was hidden.".to_owned()),
            some => words.push(format!(
                "Wrong: {some} classes were given that have nothing of what was hidden."
            )),
        }
        if outcome.wrong_unknowns > 0
            && outcome.hidden.iter().any(|one| one.called != Called::Unknown)
        {
            words.push(
                "Wrong: something unknown was reported beside, and it was not hidden.".to_owned(),
            );
        }
    }
    words
}

/// Why a gap did not shrink though something was found.
fn no_shrink(verdict: &Verdict) -> Option<String> {
    let gap = verdict.gap.drones.or(verdict.gap.rungs).filter(|_| !verdict.steps.is_empty())?;
    if gap.after_us.value < gap.before_us.value {
        return None;
    }
    // The fleet's mean does not feel what drones differ by.
    let is_spread =
        |name: &str| find(name).is_some_and(|effect| effect.definition().is_difference());
    let effects: Vec<&str> = verdict.steps.iter().flat_map(|step| step.finding.effects()).collect();
    Some(if !effects.is_empty() && effects.into_iter().all(is_spread) {
        "The gap is as it was: what drones differ by from each other is no part of it.".to_owned()
    } else {
        format!(
            "The gap as it is did not shrink ({:.1} to {:.1} us): the air that all drones share is \
             larger than what was found. Without that air it goes from {:.1} to {:.1} us.",
            gap.before_us.value,
            gap.after_us.value,
            gap.before_without_air_us,
            gap.after_without_air_us
        )
    })
}

/// The unit of a hidden effect's size, after a space; empty: it has none.
fn unit(one: &HiddenOutcome) -> String {
    let kind = KINDS.iter().chain(ON_REQUEST).find(|kind| kind.name == one.kind);
    let (Some(effect), Some(kind)) = (find(&one.effect), kind) else { return String::new() };
    let size = effect.definition().parameters.iter().find(|parameter| parameter.name == kind.size);
    size.filter(|size| !size.unit.is_empty())
        .map_or_else(String::new, |size| format!(" {}", size.unit))
}

/// Whether a verdict itself has this size of an effect; else it has one of another form.
fn is_stated(effect: &str, size: f64, verdict: &Verdict) -> bool {
    verdict.steps.iter().all(|step| match &step.finding {
        Finding::Name { parameters, .. } | Finding::Class { parameters, .. } => {
            let is_first = step.finding.effects().first() == Some(&effect);
            let has_form = is_first && step.form.is_some();
            !has_form || parameters.iter().any(|fitted| fitted.value.value == size)
        }
        Finding::Unknown { .. } => true,
    })
}

/// A hidden effect as whoever hid it called it, and its own name where that is another.
fn name_of(one: &HiddenOutcome) -> String {
    if one.kind == one.effect {
        one.effect.clone()
    } else {
        format!("{} ({})", one.kind, one.effect)
    }
}

/// What of a verdict is of the class of an effect, in words.
fn of_its_class(effect: &str, verdict: &Verdict) -> String {
    let is_of_class =
        |step: &&Step| step.finding.effects().iter().any(|one| equivalent(one, effect));
    let classes = verdict.steps.iter().filter(is_of_class);
    let words: Vec<String> = classes.map(|step| step.finding.effects().join(" or ")).collect();
    words.join(" and ")
}

/// Whether a verdict has found something that is in no library.
fn says_unknown(verdict: &Verdict) -> bool {
    verdict.steps.iter().any(|step| matches!(step.finding, Finding::Unknown { .. }))
}

fn of_one(one: &HiddenOutcome, outcome: &Outcome, verdict: &Verdict) -> String {
    let of_all = if Role::WarmUpTime.is_of(&one.effect) && one.value != 0.0 {
        " in the fleet's mean (motors that were warm at take-off drift no more)"
    } else {
        ""
    };
    let (name, size) = (name_of(one), short(one.value));
    let what = format!("{name} was hidden, at {size}{}{of_all}", unit(one));
    let sizes = match (one.fitted, one.covered, one.relative_error) {
        (Some(fitted), covered, error) => {
            let off = error.map_or_else(String::new, |error| {
                format!(", {:+.0} % off in what was changed", 100.0 * error)
            });
            let interval = match covered {
                Some(true) => "; its 95 % interval covers the truth",
                Some(false) => "; its 95 % interval misses the truth",
                None => "",
            };
            let form = if is_stated(&one.effect, fitted, verdict) {
                ""
            } else {
                " in the form that was hidden"
            };
            format!(" Found: {}{form}{off}{interval}.", short(fitted))
        }
        (None, ..) => String::new(),
    };
    match one.called {
        Called::Named if one.foreign && says_unknown(verdict) => format!(
            "Right: {what} (it is in no library), and the verdict calls it unknown and says what it \
             depends on."
        ),
        Called::Named if one.foreign => format!(
            "Right: {what} (it is in no library), and the verdict names {}, which does the same to first order.",
            outcome.found.join(" and ")
        ),
        Called::Named => format!("Right: {what}, and the verdict names it.{sizes}"),
        Called::InClass => {
            let among = verdict.steps.iter().any(|step| {
                let effects = step.finding.effects();
                effects.len() > 1 && effects.contains(&one.effect.as_str())
            });
            if among {
                format!(
                    "Right as far as it goes: {what}, and the verdict has it among those that \
                         this flight cannot separate ({}).{sizes}",
                    outcome.found.join("; ")
                )
            } else {
                match of_its_class(&one.effect, verdict) {
                    none if none.is_empty() => format!(
                        "Near: {what}, and the verdict calls it unknown and says what it depends on ({}).",
                        outcome.found.join("; ")
                    ),
                    named => format!(
                        "Near: {what}, and the verdict names {named}, of the same class: this protocol cannot tell \
                         them apart."
                    ),
                }
            }
        }
        Called::Unknown => format!(
            "Not recognised: {what}, and the verdict has something unknown instead ({}).",
            outcome.found.join("; ")
        ),
        Called::Silent => {
            let why = match (one.said_visible, one.z) {
                (Some(false), _) => {
                    " The verdict says itself that this flight does not show so small a change."
                }
                (_, Some(z)) if z < 4.0 => " At this size it hardly rises above air and noise.",
                _ => "",
            };
            let z = one.z.map_or_else(String::new, |z| format!(" (z {z:.1})"));
            let found = if outcome.found.is_empty() && verdict.is_unexplained() {
                "says only that something is missing".to_owned()
            } else if outcome.found.is_empty() {
                "names nothing".to_owned()
            } else {
                format!("names {}", outcome.found.join(" and "))
            };
            format!("Missed: {what}{z}, and the verdict {found}.{why}")
        }
    }
}

/// The updraft and the wind that a whole flight was in, and what its verdict says of them, in words.
pub fn air_words(truth: &Scenario, verdict: &Verdict) -> String {
    let noise = &verdict.noise;
    let within = noise.updraft_half_mps.map_or_else(String::new, |half| format!(" ± {half:.2}"));
    let speed_mps = |[x, y]: [f64; 2]| x.hypot(y);
    format!(
        "updraft {:.2} m/s, the verdict has {:.2}{within}; wind {:.1} m/s, the verdict reads {:.1}",
        truth.updraft_mps(),
        noise.updraft_mps,
        speed_mps(truth.nuisance.air.wind_mps),
        speed_mps(verdict.wind.mean_mps)
    )
}

/// The held-out gap before and after, in words.
pub fn gap_words(shrink: &Shrink) -> String {
    format!(
        "{:.1} -> {:.1} us ({:.2} -> {:.2} m/s of air); without the air that all saw {:.1} -> {:.1}, noise \
         alone leaves {:.1} us",
        shrink.before_us.value,
        shrink.after_us.value,
        shrink.before_mps,
        shrink.after_mps,
        shrink.before_without_air_us,
        shrink.after_without_air_us,
        shrink.floor_us
    )
}
