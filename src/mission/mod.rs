//! From a mission template to a plan: who flies what, when, and where the analysis looks.

pub mod plan;
