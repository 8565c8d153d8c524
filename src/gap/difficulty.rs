//! Difficulty of finding an effect that is known to be there.

use super::compare::{Comparison, Simulated, thrust_exponent};
use super::data::Data;
use super::error::GapError;
use super::gls::Column;
use super::make::Input;
use super::refine::{Parameter, size_errors, size_of};
use crate::effects::Signals;

/// Pulse of steady flight by its signals and by the direction of the air from the nose, rad, us.
pub type SteadyPulse<'a> = Box<dyn Fn(&Signals, f64) -> f64 + 'a>;

/// Something that is known to be there.
pub enum There<'a> {
    /// An effect of the library.
    Effect {
        /// Name of the effect in the library.
        effect: &'a str,
        /// The parameter that says how large it is.
        size: &'a str,
        /// By how much that was changed.
        change: f64,
    },
    /// An effect of no library, by its contribution to the pulse.
    Pulse(SteadyPulse<'a>),
}

/// Fisher z of what is known to be there: its size over its error, with the air, offsets and everything
/// else that is there free. `input.vehicle` is the true one, `updraft_mps` what the whole flight was in: a fast
/// descent in air that sinks as fast is none for the rotors. `None`: the pulse of steady flight does not show it.
///
/// # Errors
/// See [`GapError`].
pub fn fisher_z(
    input: &Input<'_>,
    updraft_mps: f64,
    there: &[There<'_>],
) -> Result<Vec<Option<f64>>, GapError> {
    let plan = input.plan.ok_or(GapError::NoSimulatedSide)?;
    let exponent = thrust_exponent(input.vehicle);
    let (data, _) = Data::of_plan(plan, input.flown, exponent).split();
    let simulated = Simulated::Refly(plan);
    let comparison =
        Comparison::of(&data, input.vehicle, &simulated, input.plan, updraft_mps, None)?;
    let parameter = |one: &There<'_>| match one {
        There::Effect { effect, size, .. } => size_of(effect, size),
        There::Pulse(_) => None,
    };
    let parameters: Vec<Option<Parameter>> = there.iter().map(parameter).collect();
    let known: Vec<Parameter> = parameters.iter().flatten().cloned().collect();
    let pulses: Vec<Column> = there
        .iter()
        .filter_map(|one| match one {
            There::Effect { .. } => None,
            There::Pulse(pulse_us) => Some(column(&comparison, pulse_us)),
        })
        .collect();
    let vehicle = comparison.vehicle.clone();
    let (of_sizes, of_pulses) = size_errors(&comparison, &vehicle, &known, &pulses)?;
    let (mut of_sizes, mut of_pulses) = (of_sizes.into_iter(), of_pulses.into_iter());
    Ok(there
        .iter()
        .zip(&parameters)
        .map(|(one, parameter)| {
            let (change, se) = match one {
                There::Effect { change, .. } => {
                    (*change, parameter.as_ref().and_then(|_| of_sizes.next())?)
                }
                There::Pulse(_) => (1.0, of_pulses.next()?),
            };
            (se > 0.0).then(|| (change / se).abs()).filter(|z| z.is_finite())
        })
        .collect())
}

fn column(comparison: &Comparison, pulse_us: &SteadyPulse<'_>) -> Column {
    let headings = comparison.headings();
    let groups = comparison.scene.signals.iter().zip(&headings);
    let group = |(signals, headings): (&Vec<Signals>, &Vec<f64>)| {
        signals.iter().zip(headings).map(|(signals, heading)| pulse_us(signals, *heading)).collect()
    };
    Column::Shared(groups.map(group).collect())
}
