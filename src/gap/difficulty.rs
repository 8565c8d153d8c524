//! Difficulty of finding an effect that is known to be there.

use super::candidates::set;
use super::compare::{Comparison, Simulated, thrust_exponent};
use super::data::Data;
use super::error::GapError;
use super::gls::Column;
use super::make::Input;
use super::refine::{Parameter, size_of, slopes, trace_errors};
use crate::effects::select::value_of;
use crate::effects::{EffectError, Signals};
use crate::vehicle::Vehicle;

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
    let (data, _) = Data::of_plan(plan, input.flown, exponent).settled().split();
    let simulated = Simulated::Refly(plan);
    let comparison =
        Comparison::of(&data, input.vehicle, &simulated, input.plan, updraft_mps, None)?;
    let vehicle = &comparison.vehicle;
    let parameter = |one: &There<'_>| match one {
        There::Effect { effect, size, .. } => size_of(effect, size),
        There::Pulse(_) => None,
    };
    let known: Vec<Parameter> = there.iter().filter_map(parameter).collect();
    let column = |one: &There<'_>| match one {
        There::Effect { change, .. } => {
            parameter(one).map(|size| of_effect(&comparison, vehicle, &size, *change)).transpose()
        }
        There::Pulse(pulse_us) => Ok(Some(column(&comparison, pulse_us))),
    };
    let columns = there.iter().map(column).collect::<Result<Vec<Option<Column>>, GapError>>()?;
    let traces: Vec<Column> = columns.iter().flatten().cloned().collect();
    let mut errors = trace_errors(&comparison, vehicle, &known, &traces)?.into_iter();
    let z = |column: &Option<Column>| {
        let se = column.as_ref().and_then(|_| errors.next())?;
        (se > 0.0).then(|| 1.0 / se).filter(|z| z.is_finite())
    };
    Ok(columns.iter().map(z).collect())
}

/// A size before that is a smaller share of what it is now was none. Numerical.
const NONE_SHARE: f64 = 1e-6;

/// All that an effect does to the pulse, from the size it would have without `change`: not its derivative, which for what goes
/// with the square of its size is twice as much.
fn of_effect(
    comparison: &Comparison,
    vehicle: &Vehicle,
    size: &Parameter,
    change: f64,
) -> Result<Column, GapError> {
    let now = value_of(vehicle, size.effect, size.name).unwrap_or(change);
    let mut without = vehicle.clone();
    let before = now - change;
    if before.abs() > NONE_SHARE * now.abs() {
        set(&mut without, size.effect, size.name, before);
    } else {
        without.effects.remove(size.effect);
    }
    match comparison.change(&without, vehicle) {
        Err(EffectError::NotFlown { .. }) => {
            let slopes = slopes(comparison, vehicle, std::slice::from_ref(size))?;
            let slope = slopes.first().ok_or(GapError::NothingCommon)?;
            Ok(slope.each(|group, drone, bin| change * slope.at(group, drone, bin)))
        }
        column => Ok(column?),
    }
}

fn column(comparison: &Comparison, pulse_us: &SteadyPulse<'_>) -> Column {
    let headings = comparison.headings();
    let groups = comparison.scene.signals.iter().zip(&headings);
    let group = |(signals, headings): (&Vec<Signals>, &Vec<f64>)| {
        signals.iter().zip(headings).map(|(signals, heading)| pulse_us(signals, *heading)).collect()
    };
    Column::Shared(groups.map(group).collect())
}

#[cfg(test)]
mod tests {
    use super::super::trial;
    use super::*;
    use crate::effects::Role;

    /// The trace of an effect is the difference of flights with and without it, however it bends on the way.
    #[test]
    fn what_is_there_is_all_that_the_effect_does() {
        let comparison = trial::comparison(&trial::data(2, |_, _| 0.0));
        let size = size_of("thrust-curve", "expo").unwrap();
        let with = |expo: f64| {
            let mut vehicle = trial::vehicle();
            set(&mut vehicle, "thrust-curve", "expo", expo);
            vehicle
        };
        let trace = of_effect(&comparison, &with(0.6), &size, 0.6).unwrap();
        let expected = comparison.change(&with(0.0), &with(0.6)).unwrap();
        let bins = 0..comparison.data.groups[0].bins.len();
        for bin in bins {
            let (found, expected) = (trace.at(0, 0, bin), expected.at(0, 0, bin));
            assert!((found - expected).abs() < 1e-9, "{bin}: {found} {expected}");
        }
        assert!(trace.range() > 1.0, "{}", trace.range());
        // A body that was smaller was so from all sides: leans, by which the wind is read, knew it.
        let size = size_of("parasitic-drag", "vertical_m2").unwrap();
        let mut comparison = comparison;
        comparison.scene.blow(0, 5.0);
        let mut vehicle = trial::vehicle();
        set(&mut vehicle, "parasitic-drag", "vertical_m2", 0.04);
        let whole = of_effect(&comparison, &vehicle, &size, 0.02).unwrap();
        let mut half = vehicle.clone();
        set(&mut half, "parasitic-drag", "vertical_m2", 0.02);
        let sides = [&half, &vehicle].map(|one| Role::BodyDragSide.value(one).unwrap());
        assert!((2.0 * sides[0] - sides[1]).abs() < 1e-9, "{sides:?}");
        let expected = comparison.change(&half, &vehicle).unwrap();
        assert!((whole.at(0, 0, 0) - expected.at(0, 0, 0)).abs() < 1e-12);
        // An effect whose size may not be zero is not there at all.
        let size = size_of("ground-effect", "radius_m").unwrap();
        let mut vehicle = trial::vehicle();
        set(&mut vehicle, "ground-effect", "radius_m", 0.2);
        assert!(of_effect(&comparison, &vehicle, &size, 0.2).is_ok());
    }
}
