//! The door to the search that is tested.

use std::path::Path;

use super::scenario::Scenario;
use crate::gap::Verdict;

/// Why a search has no verdict.
pub type Cause = Box<dyn std::error::Error + Send + Sync>;

/// A search for missing physics. Every `Fn(&Path) -> Result<Verdict, Cause>` is one.
pub trait Explain: Sync {
    /// The verdict on a flight folder: template, vehicle, plan and logs.
    ///
    /// # Errors
    /// When the search finds nothing to work on, or fails.
    fn explain(&self, flight: &Path) -> Result<Verdict, Cause>;

    /// Fisher z of each hidden effect of the truth under that flight: its size over its error with
    /// air, intercepts and the other hidden effects free. Asked for after the verdict is on the disk
    /// and the seal is open. `None`: not known.
    fn fisher_z(&self, _flight: &Path, truth: &Scenario) -> Vec<Option<f64>> {
        vec![None; truth.hidden.len()]
    }
}

impl<F> Explain for F
where
    F: Fn(&Path) -> Result<Verdict, Cause> + Sync,
{
    fn explain(&self, flight: &Path) -> Result<Verdict, Cause> {
        self(flight)
    }
}
