//! Search for the physics that a campaign's drones have and its model lacks, held against what was hidden.

use std::path::Path;

use crate::blind::classes::equivalent;
use crate::effects::Role;
use crate::effects::select::value_of;
use crate::gap::Verdict;
use crate::gap::verdict::{Finding, Fitted};
use crate::study::sensitivity::{Called, Naming};
use crate::vehicle::Vehicle;
use crate::workflow::error::WorkflowError;
use crate::workflow::gap::search::searched;

/// Searches a campaign for what `flown` has and `model` lacks; `effect` is what should be named.
pub(super) fn named(
    campaign: &Path,
    effect: &str,
    model: &Vehicle,
    flown: &Vehicle,
) -> Result<Naming, WorkflowError> {
    let verdict = searched(campaign, model)?;
    Ok(naming(&verdict, effect, flown))
}

fn naming(verdict: &Verdict, effect: &str, flown: &Vehicle) -> Naming {
    let mut found = Vec::new();
    let mut best = Called::Nothing;
    let mut call = |called: Called, words: String| {
        found.push(words);
        if rank(called) < rank(best) {
            best = called;
        }
    };
    // The sensor channel is named without any look at the pulse.
    if let Some(sensor) = Role::SensorBias.place().filter(|_| verdict.sensor.named) {
        call(of_name(sensor.name(), effect), sensor.name().to_owned());
    }
    for step in &verdict.steps {
        match &step.finding {
            Finding::Name { effect: name, .. } => call(of_name(name, effect), name.clone()),
            Finding::Class { effects, .. } => {
                let fits = effects.iter().any(|one| equivalent(one, effect));
                let called = if fits { Called::Class } else { Called::Wrong };
                call(called, effects.join(" or "));
            }
            Finding::Unknown { depends_on, .. } => {
                call(Called::Unknown, format!("unknown, depends on {depends_on}"));
            }
        }
    }
    Naming { called: best, found, size_error: size_error(verdict, effect, flown) }
}

fn of_name(name: &str, hidden: &str) -> Called {
    if name == hidden {
        Called::Named
    } else if equivalent(name, hidden) {
        Called::Class
    } else {
        Called::Wrong
    }
}

/// The better, the smaller.
fn rank(called: Called) -> u8 {
    match called {
        Called::Named => 0,
        Called::Class => 1,
        Called::Unknown => 2,
        Called::Wrong => 3,
        Called::Nothing => 4,
    }
}

/// Fitted change of the effect's size over the true change, less 1; the last step that has it, as later steps fit
/// everything again.
fn size_error(verdict: &Verdict, effect: &str, flown: &Vehicle) -> Option<f64> {
    let size = &verdict.detectable.iter().find(|entry| entry.effect == effect)?.parameter;
    let of = |parameters: &[Fitted]| {
        parameters.iter().find(|fitted| fitted.name == *size).map(|fitted| {
            let before = fitted.before.unwrap_or(0.0);
            (fitted.value.value - before, before)
        })
    };
    let (fitted, before) = verdict.steps.iter().rev().find_map(|step| match &step.finding {
        Finding::Name { effect: name, parameters, .. } if name == effect => of(parameters),
        Finding::Class { effects, parameters } if effects.first().is_some_and(|e| e == effect) => {
            of(parameters)
        }
        _ => None,
    })?;
    let change = value_of(flown, effect, size).unwrap_or(0.0) - before;
    (change != 0.0).then_some(fitted / change - 1.0)
}
