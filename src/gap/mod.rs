//! Where simulation and measurement disagree, which physics is missing, and what cannot be known.

pub mod verdict;

pub use verdict::Verdict;
