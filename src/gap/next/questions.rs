//! Questions that a verdict left open.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::gap::dependence::Dependence;
use crate::gap::verdict::{Detectable, Finding, Shape, Verdict};
use crate::gap::words::member;

/// One thing that the flight did not tell.
#[derive(Clone, Debug, PartialEq)]
pub struct Question {
    /// Question in words, for people.
    pub words: String,
    /// Explanations that a flight must separate to answer it.
    pub sought: Sought,
}

/// Explanations that a flight must separate.
#[derive(Clone, Debug, PartialEq)]
pub enum Sought {
    /// Rivals of a class, the one in the model first, with the name and value of its size in the model
    /// and the value before (`None`: the model lacked it).
    Apart {
        /// Names of the effects.
        effects: Vec<String>,
        /// Size of the first: name, value, value before.
        size: Option<(String, f64, Option<f64>)>,
    },
    /// Something unknown: its shape, and the signal it was found along, from the other signals.
    Shape {
        /// Signal, as in the verdict.
        depends_on: Dependence,
        /// Shape as in the verdict.
        shape: Shape,
    },
    /// An effect at its usual size, from nothing.
    Seen {
        /// Name of the effect.
        effect: String,
    },
}

/// What kind of question it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// Rivals of a class.
    Class,
    /// Something unknown.
    Unknown,
    /// An effect that is too small for the flight.
    TooSmall,
}

impl Question {
    /// Kind of the question.
    pub fn kind(&self) -> Kind {
        match self.sought {
            Sought::Apart { .. } => Kind::Class,
            Sought::Shape { .. } => Kind::Unknown,
            Sought::Seen { .. } => Kind::TooSmall,
        }
    }
}

/// The questions of a verdict, in the order of its findings; then what was too small to see. Whether an
/// effect that was too small matters for the pulse is only known when its trace is computed
/// ([`super::predict::matters`]).
pub fn ask(verdict: &Verdict) -> Vec<Question> {
    let found = verdict.steps.iter().filter_map(|step| match &step.finding {
        Finding::Name { .. } => None,
        Finding::Class { effects, parameters } => Some(Question {
            words: {
                let members: Vec<_> = effects.iter().map(|name| member(name)).collect();
                format!("is it {}?", members.join(" or "))
            },
            sought: Sought::Apart {
                effects: effects.clone(),
                size: parameters
                    .first()
                    .map(|fitted| (fitted.name.clone(), fitted.value.value, fitted.before)),
            },
        }),
        Finding::Unknown { depends_on, .. } => Some(Question {
            words: format!("does the unknown depend on {depends_on}, and on nothing else?"),
            sought: Sought::Shape {
                depends_on: *depends_on,
                shape: step.shape.clone().unwrap_or_default(),
            },
        }),
    });
    let named: Vec<&str> = verdict.steps.iter().flat_map(|step| step.finding.effects()).collect();
    let too_small = |one: &&Detectable| {
        !one.parameter.is_empty()
            && !named.contains(&one.effect.as_str())
            && one.smallest.is_none_or(|smallest| smallest.abs() > one.usual.abs())
    };
    let unseen = verdict.detectable.iter().filter(too_small).map(|one| Question {
        words: format!("is there {} of the usual size?", one.effect),
        sought: Sought::Seen { effect: one.effect.clone() },
    });
    found.chain(unseen).collect()
}
