//! Sensitivity studies: whole campaigns that differ in some factors, and which of these decide the map's error.
//!
//! [`SensitivityPlan`] reads what differs, [`Drawn`] draws the campaigns, [`SensitivityWork`] flies what is not
//! there yet and keeps each outcome as a whole file, and [`evaluate()`] says how much of each outcome's variance
//! comes from which factor.

mod blocks;
mod design;
mod evaluate;
mod factor;
mod item;
mod key;
mod outcome;
mod ranks;
mod result;
mod saltelli;
mod setup;
pub mod table;
mod template;
mod work;

pub use design::{Design, Drawn, Item, Seeds};
pub use evaluate::evaluate;
pub use factor::{AirTarget, Factor, Level, Levels, Range, Target};
pub use item::{ITEM_SCHEMA, ItemRecord, Row, item_path, items_folder};
pub use outcome::{Called, Naming, OUTCOMES, Outcome, OutcomeColumn, outcome_column};
pub use result::{
    FactorResult, Influence, LostReason, OutcomeResult, SENSITIVITY_RESULT_SCHEMA,
    SensitivityResult, Uncertain,
};
pub use setup::{Airs, Setup};
pub(super) use template::BUILTIN;
pub use template::{SENSITIVITY_TEMPLATE_SCHEMA, SensitivityPlan};
pub use work::{Done, Fly, Gathered, NotDone, SensitivityWork, sensitivity_sha256};
