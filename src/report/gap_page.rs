//! The HTML page of a verdict.

use super::text::clean;
use crate::gap::Verdict;

/// The page.
pub fn page(verdict: &Verdict) -> String {
    format!(
        "<!doctype html><meta charset=utf-8><pre>{}</pre>",
        clean(&super::gap_terminal::text(verdict))
    )
}
