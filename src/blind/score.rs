//! Score of one verdict against the truth.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::classes::{equivalent, is_single};
use super::foreign;
use super::hide::{Hidden, kind_of};
use super::scenario::{Cell, Scenario};
use super::tables::ALIKE;
use crate::effects::{Effect, Role, find};
use crate::gap::verdict::{Finding, Fitted, Form, Interval};
use crate::gap::{Dependence, Verdict};
use crate::vehicle::Vehicle;

/// A gap that grows by less is the same: a bias of the velocity shifts a straight response as a whole, and
/// its repair leaves the gap as it was but for rounding.
pub(super) const WORSE: f64 = 1.01;

/// What a verdict makes of one hidden effect.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum Called {
    /// It is named, alone. Off-library: it is called unknown, with what it depends on.
    Named,
    /// It is in a class that is given, or another of its class is named.
    InClass,
    /// Something unknown is reported, but not this. Off-library: it depends on another thing.
    Unknown,
    /// Nothing is said of it.
    Silent,
}

/// One hidden effect and what the verdict says of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HiddenOutcome {
    /// What was hidden, as in `--effects`.
    pub kind: String,
    /// The effect.
    pub effect: String,
    /// Whether no library lists it.
    pub foreign: bool,
    /// Whether it is alone in its class.
    pub single: bool,
    /// Fisher z under this flight; absent: not known.
    pub z: Option<f64>,
    /// What the verdict makes of it.
    pub called: Called,
    /// True value of the parameter that says how large it is.
    pub value: f64,
    /// The fitted one, in the form of the effect that was hidden.
    pub fitted: Option<f64>,
    /// Error of the fitted change over the true change, signed.
    pub relative_error: Option<f64>,
    /// Whether the 95 % interval covers the truth.
    pub covered: Option<bool>,
    /// Whether the verdict says that this flight would have shown it at its true size; absent: it says
    /// nothing of it.
    pub said_visible: Option<bool>,
}

/// One flight's verdict against the truth.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Outcome {
    /// The flight's seed.
    pub seed: u64,
    /// What kind of flight it was.
    pub cell: Cell,
    /// Each hidden effect.
    pub hidden: Vec<HiddenOutcome>,
    /// What the verdict found, in words, in its order.
    pub found: Vec<String>,
    /// Effects named alone that are not hidden.
    pub wrong_names: Vec<String>,
    /// How many of them are of the class of a hidden one.
    pub wrong_in_class: usize,
    /// Classes given that have nothing to do with what is hidden.
    pub wrong_classes: usize,
    /// Unknowns reported that are no off-library effect.
    pub wrong_unknowns: usize,
    /// Share of the held-out gap that is gone.
    pub raw_shrink: Option<f64>,
    /// The same of the drones' mean.
    #[serde(default)]
    pub mean_shrink: Option<f64>,
    /// Share of its excess over the floor that is gone.
    pub excess_shrink: Option<f64>,
    /// Whether something was found, and the held-out gap is larger for it.
    pub made_worse: bool,
}

impl Outcome {
    /// Whether something was found although nothing was hidden.
    pub fn is_false_alarm(&self) -> bool {
        self.hidden.is_empty() && !self.found.is_empty()
    }
}

/// Scores a verdict against the truth; `fisher_z` has the Fisher z of each hidden effect in this
/// flight, in the truth's order (unknown where it is shorter).
pub fn score(truth: &Scenario, verdict: &Verdict, fisher_z: &[Option<f64>]) -> Outcome {
    let hidden = truth.hidden.iter().enumerate().map(|(index, hidden)| {
        let z = fisher_z.get(index).copied().flatten();
        let known = truth.cell.base.known().ok();
        compare(hidden, truth.fleet_value(hidden), known.as_ref(), verdict, z)
    });
    let mut outcome = Outcome {
        seed: truth.seed,
        cell: truth.cell.clone(),
        hidden: hidden.collect(),
        found: Vec::new(),
        wrong_names: Vec::new(),
        wrong_in_class: 0,
        wrong_classes: 0,
        wrong_unknowns: 0,
        raw_shrink: None,
        mean_shrink: None,
        excess_shrink: None,
        made_worse: false,
    };
    // The sensor channel is named without any look at the pulse.
    if let Some(sensor) = Role::SensorBias.place().filter(|_| verdict.sensor.named) {
        outcome.note_name(truth, sensor.name());
    }
    for step in &verdict.steps {
        match &step.finding {
            Finding::Name { effect, .. } => outcome.note_name(truth, effect),
            Finding::Class { effects, .. } => {
                let fits = |effect: &String| {
                    library(truth).any(|hidden| equivalent(&hidden.effect, effect))
                        || truth.hidden.iter().any(|hidden| accepts_name(hidden, effect))
                };
                outcome.wrong_classes += usize::from(!effects.iter().any(fits));
                outcome.found.push(effects.join(" or "));
            }
            Finding::Unknown { depends_on, .. } => {
                let right = truth.hidden.iter().any(|hidden| accepts(hidden, *depends_on));
                outcome.wrong_unknowns += usize::from(!right);
                outcome.found.push(format!("unknown, depends on {depends_on}"));
            }
        }
    }
    if outcome.hidden.is_empty() && outcome.found.is_empty() && verdict.is_unexplained() {
        outcome.found.push("something that is not named".to_owned());
    }
    if let Some(shrink) = &verdict.gap.drones {
        let (before, after) = (shrink.before_us.value, shrink.after_us.value);
        outcome.raw_shrink = (before > 0.0).then(|| 1.0 - after / before);
        let (before, after) = shrink.mean_us;
        outcome.mean_shrink = (before > 0.0).then(|| 1.0 - after / before);
        outcome.excess_shrink = Some(shrink.excess_shrink.value);
        // Without the air, which is the same before and after and only blurs the difference.
        outcome.made_worse = !outcome.found.is_empty()
            && shrink.after_without_air_us > WORSE * shrink.before_without_air_us;
    }
    outcome
}

impl Outcome {
    fn note_name(&mut self, truth: &Scenario, effect: &str) {
        self.found.push(effect.to_owned());
        let is_it = |hidden: &Hidden| !hidden.foreign && hidden.effect == effect;
        if truth.hidden.iter().any(|hidden| is_it(hidden) || is_alike(hidden, effect)) {
            return;
        }
        self.wrong_names.push(effect.to_owned());
        let near = library(truth).any(|hidden| equivalent(&hidden.effect, effect));
        self.wrong_in_class += usize::from(near);
    }
}

fn library(truth: &Scenario) -> impl Iterator<Item = &Hidden> {
    truth.hidden.iter().filter(|hidden| !hidden.foreign)
}

/// Whether a hidden effect may be called unknown with this dependence.
fn accepts(hidden: &Hidden, depends_on: Dependence) -> bool {
    if hidden.depends_on.contains(&depends_on) {
        return true;
    }
    let foreign = foreign::find(&hidden.effect).filter(|_| hidden.foreign);
    foreign.is_some_and(|foreign| foreign.depends_on.contains(&depends_on))
}

/// As [`accepts`], of a member of a class.
fn accepts_name(hidden: &Hidden, name: &str) -> bool {
    is_alike(hidden, name)
        || Dependence::of(name).is_some_and(|depends_on| accepts(hidden, depends_on))
}

/// Whether an effect of the library is to first order what a foreign one does.
fn is_alike(hidden: &Hidden, effect: &str) -> bool {
    hidden.foreign && ALIKE.contains(&(hidden.effect.as_str(), effect))
}

fn compare(
    hidden: &Hidden,
    value: f64,
    known: Option<&Vehicle>,
    verdict: &Verdict,
    z: Option<f64>,
) -> HiddenOutcome {
    let called = called(hidden, verdict);
    let fitted = fitted(hidden, known, verdict);
    // What is estimated is the change against the model that was held against the logs.
    let before = hidden.before.unwrap_or(0.0);
    let change = value - before;
    HiddenOutcome {
        kind: hidden.kind.clone(),
        effect: hidden.effect.clone(),
        foreign: hidden.foreign,
        single: is_single(&hidden.effect),
        z,
        called,
        value,
        fitted: fitted.map(|fitted| fitted.value),
        relative_error: fitted
            .filter(|_| change != 0.0)
            .map(|fitted| (fitted.value - before) / change - 1.0),
        covered: fitted.map(|fitted| (fitted.low..=fitted.high).contains(&value)),
        said_visible: said_visible(hidden, value, verdict),
    }
}

fn called(hidden: &Hidden, verdict: &Verdict) -> Called {
    let mut best = Called::Silent;
    if !hidden.foreign && verdict.sensor.named && Role::SensorBias.is_of(&hidden.effect) {
        return Called::Named;
    }
    for step in &verdict.steps {
        let this = match &step.finding {
            // In foreign worlds the library's effects have other forms: what is told of them is right.
            Finding::Unknown { depends_on, .. } if accepts(hidden, *depends_on) => {
                if hidden.foreign { Called::Named } else { Called::InClass }
            }
            Finding::Unknown { .. } => Called::Unknown,
            // What the library has come to have for it is no longer unknown.
            Finding::Name { effect, .. } if is_alike(hidden, effect) => Called::Named,
            _ if hidden.foreign => {
                let fits = step.finding.effects().iter().any(|one| accepts_name(hidden, one));
                if fits { Called::InClass } else { Called::Silent }
            }
            Finding::Name { effect, .. } if *effect == hidden.effect => Called::Named,
            Finding::Name { .. } | Finding::Class { .. } => {
                let fits = step.finding.effects().iter().any(|one| equivalent(one, &hidden.effect));
                if fits { Called::InClass } else { Called::Silent }
            }
        };
        best = best.min(this);
    }
    best
}

/// The fitted value of the parameter that says how large a hidden effect is: where it was found in another of its forms, the
/// size that does as much in the true one.
fn fitted(hidden: &Hidden, known: Option<&Vehicle>, verdict: &Verdict) -> Option<Interval> {
    if hidden.foreign {
        return None;
    }
    let parameter = |effect: &dyn Effect| effect.definition().parameter(&hidden.size);
    let sensor = match find(&hidden.effect).and_then(parameter)?.role {
        Some(Role::SensorBias) => verdict.sensor.bias_mps,
        Some(Role::SensorLag) => verdict.sensor.lag_s,
        _ => None,
    };
    if verdict.sensor.named && sensor.is_some() {
        return sensor;
    }
    let of = |parameters: &[Fitted]| {
        let found = parameters.iter().find(|fitted| fitted.name == hidden.size);
        found.map(|fitted| fitted.value)
    };
    // The last step that has it: later steps fit everything again.
    verdict.steps.iter().rev().find_map(|step| {
        let found = match &step.finding {
            Finding::Name { effect, parameters, .. } if *effect == hidden.effect => of(parameters),
            Finding::Class { effects, parameters } if effects.first() == Some(&hidden.effect) => {
                of(parameters)
            }
            _ => None,
        }?;
        Some(step.form.as_ref().map_or(found, |form| in_true_form(found, form, hidden, known)))
    })
}

/// A size that was found with a form, as that which does as much in the form that was hidden.
fn in_true_form(
    found: Interval,
    form: &Form,
    hidden: &Hidden,
    known: Option<&Vehicle>,
) -> Interval {
    let (Some(known), Ok(kind)) = (known, kind_of(&hidden.kind)) else { return found };
    let as_true = |size| kind.as_large(known, (&form.name, form.value), hidden, size);
    match (as_true(found.value), as_true(found.low), as_true(found.high)) {
        (Some(value), Some(low), Some(high)) => Interval { value, low, high },
        _ => found,
    }
}

/// Whether a verdict says that the flight shows a hidden effect at its true size.
fn said_visible(hidden: &Hidden, value: f64, verdict: &Verdict) -> Option<bool> {
    let entry = verdict
        .detectable
        .iter()
        .find(|entry| entry.effect == hidden.effect && entry.parameter == hidden.size)?;
    let change = (value - hidden.before.unwrap_or(0.0)).abs();
    Some(entry.smallest.is_some_and(|smallest| smallest.abs() <= change))
}
