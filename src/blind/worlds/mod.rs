//! Foreign worlds: flights of a plant that shares no physics with the simulator of the search.
//!
//! The crate `foreign-worlds` flies them. Here a world is drawn ([`draw`]), its known vehicle is made
//! ([`known`], by [`identify`] where no vehicle's file is the plant), and a plan is flown in it ([`fly`]);
//! [`maps`] flies campaigns for maps of the air; [`steady`] says what a hidden effect does to the pulse, for Fisher's z.

pub mod draw;
pub mod fly;
pub mod identify;
pub mod known;
pub mod maps;
pub mod steady;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::scenario::Base;
use super::tables::{FOREIGN_KINDS, ForeignKind};

/// Whose physics a blind flight is flown with.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum Worlds {
    /// That of the simulator.
    #[default]
    Home,
    /// That of the crate `foreign-worlds`.
    Foreign,
}

impl Worlds {
    /// Name of the worlds in files and options.
    pub fn name(self) -> &'static str {
        match self {
            Self::Home => "home",
            Self::Foreign => "foreign",
        }
    }

    /// Whether they are the simulator's.
    pub fn is_home(&self) -> bool {
        *self == Self::Home
    }
}

/// Kind of hidden effect in foreign worlds by its name; `None` if nothing is called so.
pub fn kind_of(name: &str) -> Option<&'static ForeignKind> {
    FOREIGN_KINDS.iter().find(|kind| kind.name == name)
}

/// Whether a base stands for a plant of foreign worlds, and takes a set of hidden effects.
pub fn takes(base: Base, hidden: &[String]) -> bool {
    base != Base::Inflow
        && hidden.iter().all(|name| kind_of(name).is_some_and(|kind| kind.bases.contains(&base)))
}
