//! Wishes of pages.

use serde::Deserialize;
use thiserror::Error;

use crate::fleet::abort::Action;
use crate::link::id::DroneId;

/// Wish of a page.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(tag = "wish", rename_all = "snake_case", deny_unknown_fields)]
pub enum Wish {
    /// Drones are to return, or to land.
    Order {
        /// Action that ends their flight.
        action: Action,
        /// Who; absent: all.
        #[serde(default)]
        drones: Option<Vec<DroneId>>,
    },
    /// A question is answered.
    Answer {
        /// Number of the question.
        question: u64,
        /// Word of the answer.
        answer: String,
    },
    /// A replay goes on, stops or jumps.
    Replay {
        /// Times as fast as the flight.
        #[serde(default)]
        speed: Option<f64>,
        /// Whether it goes on.
        #[serde(default)]
        plays: Option<bool>,
        /// Moment to jump to, show time, s.
        #[serde(default)]
        at_s: Option<f64>,
    },
}

/// Reason why a wish is not carried out.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum Refused {
    /// The page may look only.
    #[error(
        "this page may look only: orders need the operator's address, which --live-orders prints"
    )]
    LooksOnly,
    /// There is nothing that the wish could be about.
    #[error("{0}")]
    Nothing(String),
    /// It was tried.
    #[error("{0}")]
    Failed(String),
}

/// Answer to a wish: words for people.
pub type Said = Result<String, Refused>;
