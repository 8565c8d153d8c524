//! Interface to the search that is tested.

use std::path::Path;

use super::foreign;
use super::hide::Hidden;
use super::scenario::Scenario;
use super::worlds;
use crate::effects::Reference;
use crate::gap::{SteadyPulse, There, Verdict};
use crate::vehicle::Vehicle;

/// Error of a search for missing physics.
pub type Cause = Box<dyn std::error::Error + Send + Sync>;

/// A search for missing physics. Every `Fn(&Path) -> Result<Verdict, Cause>` is one.
pub trait Explain: Sync {
    /// Searches a flight folder (template, vehicle, plan and logs) and returns the verdict.
    ///
    /// # Errors
    /// When the search finds nothing to work on, or fails.
    fn explain(&self, flight: &Path) -> Result<Verdict, Cause>;

    /// Fisher z of each hidden effect of the truth in that flight: the ratio of its size to its
    /// standard error with air, intercepts and the other hidden effects free. Asked for after the
    /// verdict is on disk and the seal is open. `None` where it is not known.
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

/// Hidden effects of a truth, in the form that the calculation of their Fisher z takes; `vehicle`
/// is the true one.
pub fn there<'a>(truth: &'a Scenario, vehicle: &Vehicle) -> Vec<There<'a>> {
    if let Some(world) = &truth.world {
        return worlds::steady::there(world);
    }
    let foreign = |hidden: &Hidden| -> Option<SteadyPulse<'a>> {
        let found = foreign::find(&hidden.effect)?;
        let of = |name: &str| hidden.parameters.get(name).copied();
        let values = foreign::values(found.effect.definition(), of);
        let at = Reference::of(vehicle);
        Some(Box::new(move |signals, heading_rad| {
            found.steady_us(&values, &at, signals, heading_rad)
        }))
    };
    let one = |hidden: &'a Hidden| match foreign(hidden).filter(|_| hidden.foreign) {
        Some(pulse_us) => There::Pulse(pulse_us),
        None => There::Effect {
            effect: &hidden.effect,
            size: &hidden.size,
            change: truth.fleet_value(hidden) - hidden.before.unwrap_or(0.0),
        },
    };
    truth.hidden.iter().map(one).collect()
}
