//! A study: one ladder of vertical speeds flown in many airs, to see how well the updraft is found.
//!
//! [`StudyPlan`] reads what is to be flown, [`Work`] flies what is not there yet, one drone for each
//! [`Cell`] (a wind condition and an updraft), and keeps each finished flight as a whole file;
//! [`evaluate()`] makes the paper's Table I, the fitted updraft of every flight and Pearson's rho of
//! each wind condition out of them.
//!
//! A study of another kind flies whole campaigns that differ in some factors: [`sensitivity`]. [`AnyStudy`] tells
//! the kinds apart.

mod cell;
mod error;
mod evaluate;
mod fly;
mod kind;
pub mod paper;
pub mod regression;
pub mod result;
pub mod sensitivity;
mod template;
mod work;

pub use cell::{Cell, Condition};
pub use error::StudyError;
pub use evaluate::evaluate;
pub use fly::{CELL_SCHEMA, CellLog, CellRecord};
pub use kind::AnyStudy;
pub use template::{STUDY_TEMPLATE_SCHEMA, StudyPlan};
pub use work::{Flown, Lost, Settings, Work, cells_folder, logs_folder, study_sha256};
