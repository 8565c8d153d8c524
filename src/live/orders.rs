//! Wishes of pages.

use serde::de::Error as _;
use serde::{Deserialize, Deserializer};
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
        /// Who, by identifiers as pages show them; absent: all.
        #[serde(default, deserialize_with = "by_names")]
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

/// Drones by their identifiers: `7`, or `1:7` in another network.
fn by_names<'de, D: Deserializer<'de>>(from: D) -> Result<Option<Vec<DroneId>>, D::Error> {
    let names = Option::<Vec<String>>::deserialize(from)?;
    let of = |name: &String| name.parse::<DroneId>().map_err(D::Error::custom);
    names.map(|names| names.iter().map(of).collect()).transpose()
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn drones_are_named_as_pages_show_them() {
        let read = |drones: &str| {
            let text = format!(r#"{{"wish": "order", "action": "land"{drones}}}"#);
            serde_json::from_str::<Wish>(&text)
        };
        let of = |drones: Option<Vec<DroneId>>| Wish::Order { action: Action::Land, drones };
        let ids = [(0, 4), (1, 12)].map(|(network, system)| DroneId { network, system });
        // What a page shows of a drone is its identifier.
        let shown = ids.map(|id| format!("\"{id}\"")).join(", ");
        let named = read(&format!(r#", "drones": [{shown}]"#)).unwrap();
        assert_eq!(named, of(Some(ids.to_vec())));
        assert_eq!(read("").unwrap(), of(None));
        let error = read(r#", "drones": ["0"]"#).unwrap_err().to_string();
        assert!(error.contains("is not a drone id"), "{error}");
        assert!(read(r#", "drones": [4]"#).is_err());
    }
}
