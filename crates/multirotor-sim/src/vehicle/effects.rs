//! Table of one effect in a vehicle's file: `[effects.NAME]`.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// One effect of a vehicle: whether it acts, and parameters that differ from the effect's defaults.
///
/// Names and bounds are the effects' own; they are checked where effects are resolved.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct EffectTable {
    /// Whether the effect acts; true when not stated.
    #[serde(default = "yes")]
    pub on: bool,
    /// Parameters by name.
    #[serde(flatten)]
    pub parameters: BTreeMap<String, f64>,
}

impl Default for EffectTable {
    fn default() -> Self {
        Self { on: true, parameters: BTreeMap::new() }
    }
}

fn yes() -> bool {
    true
}
