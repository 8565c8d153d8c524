//! Sizes of what was found, in units of the field: what it does to the response to vertical air speed, the drag area
//! that would do the same, and the error that who leaves it out makes in the air.

use super::compare::Comparison;
use super::explain::Found;
use super::response::Response;
use super::steady::{Moment, Steady};
use super::verdict::{Finding, Fitted, InField, Interval};
use crate::base::air::SEA_LEVEL_DENSITY;
use crate::effects::{EffectError, Hook, Signal, Signals, Supply, find};
use crate::numeric::mean;
use crate::vehicle::Vehicle;

/// Half of the step of the derivative by the vertical speed in hover, m/s: gusts of a field day (docs/physics.md, 4.1).
const HOVER_STEP_MPS: f64 = 0.5;
/// Climb at which a drag is compared with that of a plate, m/s: a fast rung of the ladders.
const DRAG_CLIMB_MPS: f64 = 3.0;
/// Half of the step of the derivative by an acceleration, m/s². Numerical.
const NUDGE_MPS2: f64 = 0.1;

/// Tells the size of each finding that is an effect in the model.
///
/// # Errors
/// Effects of a vehicle that are not valid.
pub(super) fn tell(found: &mut Found, original: &Vehicle) -> Result<(), EffectError> {
    let mut steps = std::mem::take(&mut found.steps);
    for step in &mut steps {
        let (Finding::Name { parameters, .. } | Finding::Class { parameters, .. }) = &step.finding
        else {
            continue;
        };
        let (Some(effect), Some(size)) =
            (step.finding.effects().first().copied(), parameters.first())
        else {
            continue;
        };
        step.in_field = match of(found, original, effect, size, step.size_us) {
            // In a wind that the model cannot fly in, nothing can be told.
            Err(EffectError::NotFlown { .. }) => None,
            told => told?,
        };
    }
    found.steps = steps;
    Ok(())
}

fn of(
    found: &Found,
    original: &Vehicle,
    effect: &str,
    size: &Fitted,
    size_us: f64,
) -> Result<Option<InField>, EffectError> {
    let with = &found.vehicle;
    if with.effects.get(effect) == original.effects.get(effect) {
        return Ok(None);
    }
    let mut without = with.clone();
    without.effects.remove(effect);
    without
        .effects
        .extend(original.effects.get(effect).map(|own| (effect.to_owned(), own.clone())));
    let at = middle(&found.comparison);
    let (mut with, mut without) = (Steady::of(with)?, Steady::of(&without)?);
    let mut change_us = |climb_mps: f64| -> Result<f64, EffectError> {
        let there = at.climbing(climb_mps);
        let of = |steady: &mut Steady| steady.pulse_us(&there, Supply::Used(0.0), 0.0);
        Ok(of(&mut with)? - of(&mut without)?)
    };
    let response =
        (change_us(HOVER_STEP_MPS)? - change_us(-HOVER_STEP_MPS)?) / (2.0 * HOVER_STEP_MPS);
    let (up_us, down_us) = (change_us(DRAG_CLIMB_MPS)?, change_us(-DRAG_CLIMB_MPS)?);
    let drags = find(effect).is_some_and(|effect| {
        let definition = effect.definition();
        definition.hooks.contains(&Hook::Loads) && definition.signals.contains(&Signal::Climb)
    });
    let mut force_n = |climb_mps: f64, change_us: f64| -> Result<f64, EffectError> {
        let there = at.climbing(climb_mps);
        let mut pushed = |acceleration_mps2: f64| {
            let signals = Signals { acceleration_mps2, ..there.signals };
            without.pulse_us(&Moment { signals, ..there }, Supply::Used(0.0), 0.0)
        };
        let us_per_mps2 = (pushed(NUDGE_MPS2)? - pushed(-NUDGE_MPS2)?) / (2.0 * NUDGE_MPS2);
        Ok(original.airframe.mass_kg * change_us / us_per_mps2)
    };
    let drag_m2 = if drags {
        let apart_n = force_n(DRAG_CLIMB_MPS, up_us)? - force_n(-DRAG_CLIMB_MPS, down_us)?;
        let density = SEA_LEVEL_DENSITY * at.signals.density_ratio;
        Some(apart_n / (density * DRAG_CLIMB_MPS * DRAG_CLIMB_MPS))
    } else {
        None
    };
    let scaled = |value: f64| scaled(value, size);
    let air_mps =
        response_of(found)?.filter(|per_mps| *per_mps > 0.0).map(|per_mps| size_us / per_mps);
    Ok(Some(InField {
        response_us_per_mps: scaled(response),
        drag_m2: drag_m2.map(scaled),
        air_mps,
    }))
}

/// A value that goes with a size, with the size's interval.
fn scaled(value: f64, size: &Fitted) -> Interval {
    let before = size.before.unwrap_or(0.0);
    let whole = size.value.value - before;
    let share = |end: f64| if whole == 0.0 { 1.0 } else { (end - before) / whole };
    let (one, other) = (value * share(size.value.low), value * share(size.value.high));
    Interval { value, low: one.min(other), high: one.max(other) }
}

/// Mean response of the model with what was found, over all bins, us/(m/s).
fn response_of(found: &Found) -> Result<Option<f64>, EffectError> {
    let responses = found.comparison.scene_of(&found.vehicle).response(&found.vehicle)?;
    let each = responses.iter().flatten();
    Ok(mean(each.map(|response: &Response| response.over(HOVER_STEP_MPS).abs())))
}

/// The middle of the flight, in its mean wind.
fn middle(comparison: &Comparison) -> Moment {
    let scene = &comparison.scene;
    let of = |value: fn(&Signals) -> f64| {
        mean(scene.signals.iter().flatten().map(value)).unwrap_or_default()
    };
    let [x_mps, y_mps] = comparison.wind.mean_mps;
    let signals = Signals {
        height_m: of(|signals| signals.height_m),
        time_s: of(|signals| signals.time_s),
        density_ratio: of(|signals| signals.density_ratio),
        horizontal_mps: x_mps.hypot(y_mps),
        ..Signals::default()
    };
    Moment { signals, relative_mps: [-x_mps, -y_mps] }
}

#[cfg(test)]
mod tests {
    use super::super::trial;
    use super::super::verdict::Step;
    use super::*;
    use crate::effects::Role;

    #[test]
    fn a_drag_has_its_area_and_flat_hover_and_its_interval() {
        let data = trial::data(2, |_, _| 0.0);
        let mut found = Found::nothing(trial::comparison(&data));
        let original = found.vehicle.clone();
        Role::BodyDragTop.set(&mut found.vehicle, 0.1);
        Role::BodyDragSide.set(&mut found.vehicle, 0.05);
        let place = Role::BodyDragTop.place().unwrap();
        let value = Interval { value: 0.1, low: 0.08, high: 0.13 };
        let (name, unit) = (place.parameter.name.to_owned(), "m²".to_owned());
        let parameters = vec![Fitted { name, unit, value, before: None }];
        let effect = place.name().to_owned();
        let finding = Finding::Name { effect, parameters, was_there: false };
        found.steps = vec![Step {
            finding,
            gain_nats: 50.0,
            threshold_nats: 8.0,
            alpha: 0.005,
            size_us: 10.0,
            rivals: Vec::new(),
            shape: None,
            in_field: None,
            form: None,
        }];
        tell(&mut found, &original).unwrap();
        let told = found.steps[0].in_field.unwrap();
        let drag = told.drag_m2.unwrap();
        assert!((drag.value - 0.1).abs() < 0.01, "{drag:?}");
        assert!(
            (drag.low / drag.value - 0.8).abs() < 1e-9
                && (drag.high / drag.value - 1.3).abs() < 1e-9
        );
        // Half a metre a second meets hardly any drag.
        assert!((0.0..2.0).contains(&told.response_us_per_mps.value), "{told:?}");
        assert!(told.air_mps.unwrap() > 0.1, "{told:?}");
    }
}
