//! From a mission template to a plan: who flies what, when, and where the analysis looks.
//!
//! [`template`] is the TOML as typed, [`resolve`] finds template files and applies overrides,
//! [`formation`] lays out the grid, [`steps`] expands the grammar into segments, [`build`] puts the
//! [`plan`] together.

pub mod build;
pub mod error;
pub mod formation;
mod keys;
pub mod measurable;
pub mod of_show;
pub mod plan;
pub mod resolve;
mod source;
pub mod steps;
pub mod template;
pub mod to_show;
pub mod too_fast;
pub mod window;

#[cfg(test)]
mod tests;

pub use error::TemplateError;
pub use plan::Plan;
