//! The model that stands for what another program's simulation flew.
//!
//! Its file need not describe that plant. How the plant answers climb is read from its logs ([`AsFlown`]), and so is the
//! part of that which goes with the square of the climb: it is drag of the body, and a body that has less of it in the
//! measured flight can be found only if the model has it to begin with.

use super::as_flown::AsFlown;
use super::bins::BinValues;
use super::compare::{amsl_m, flat, lean_law};
use super::data::Data;
use super::error::GapError;
use super::lean::{mean_wind, wind};
use super::lean_law::LeanLaw;
use super::refly::mean_drone;
use super::scene::Scene;
use super::verdict::{Finding, Step};
use crate::effects::role::Place;
use crate::effects::{EffectError, Role};
use crate::mission::plan::Plan;
use crate::vehicle::Vehicle;

/// A share of the body's own drag that is none: what the square of the climb has within the errors of a curve.
/// Chosen.
const SAME_DRAG: f64 = 0.1;

/// The model with as much drag of its body as the simulated logs show.
///
/// # Errors
/// Effects of the vehicle that are not valid.
pub(super) fn stand_in(
    data: &Data,
    values: &[Vec<Option<BinValues>>],
    flew: &Vehicle,
    plan: Option<&Plan>,
) -> Result<Vehicle, GapError> {
    let amsl_m = amsl_m(plan);
    let law = lean_law(&mean_drone(flew), amsl_m, 0.0);
    let [x_mps, y_mps] = own_wind(data, values, flew, amsl_m);
    let air = (law, [x_mps, y_mps, 0.0], amsl_m);
    let Some(place) = Role::FaceDragTop.place() else { return Ok(flew.clone()) };
    let of = |role: Role| role.value(flew).unwrap_or_default();
    let (top, sides) = (of(Role::FaceDragTop), of(Role::FaceDragSide));
    let mut dragged = mean_drone(flew);
    Role::FaceDragTop.set(&mut dragged, top + 1.0);
    Role::FaceDragSide.set(&mut dragged, sides);
    let own = as_flown(data, values, &mean_drone(flew), air)?;
    let with_more = as_flown(data, values, &dragged, air)?;
    let (Some(own), Some(with_more)) = (own, with_more) else { return Ok(flew.clone()) };
    let Some(share) = own.in_units_of(&with_more).filter(|share| share.abs() > SAME_DRAG) else {
        return Ok(flew.clone());
    };
    let mut found = flew.clone();
    let (low, high) = (place.parameter.low, place.parameter.high);
    Role::FaceDragTop.set(&mut found, (top + share).clamp(low, high));
    Role::FaceDragSide.set(&mut found, sides);
    Ok(found)
}

/// What a stand-in has by the logs, of which the file has something else, or nothing: effect, parameter, value.
pub(super) fn read_from_logs(stand_in: &Vehicle, file: &Vehicle) -> Option<(Place, f64)> {
    let place = Role::FaceDragTop.place()?;
    let value = Role::FaceDragTop.value(stand_in)?;
    (Role::FaceDragTop.value(file) != Some(value)).then_some((place, value))
}

/// What findings say of the model before is what its file says, never what a stand-in had by the simulated logs.
pub(super) fn as_in_file(steps: &mut [Step], stand_in: &Vehicle, file: &Vehicle) {
    let Some((place, _)) = read_from_logs(stand_in, file) else { return };
    let before = Role::FaceDragTop.value(file);
    for step in steps {
        let is_of = step.finding.effects().first() == Some(&place.name());
        let (Finding::Name { parameters, .. } | Finding::Class { parameters, .. }) =
            &mut step.finding
        else {
            continue;
        };
        for fitted in parameters.iter_mut().filter(|one| is_of && one.name == place.parameter.name)
        {
            fitted.before = before;
        }
        if let Finding::Name { was_there, .. } = &mut step.finding
            && is_of
        {
            *was_there = before.is_some();
        }
    }
}

/// The simulated side as data of one drone in each group.
fn as_data(data: &Data, values: &[Vec<Option<BinValues>>]) -> Data {
    let mut own = data.keep(|group, bin| values[group][bin].is_some());
    for (group, values) in own.groups.iter_mut().zip(flat(values)) {
        group.measured = vec![values];
    }
    own
}

/// The wind that another program simulated, by its own leans, m/s.
pub(super) fn own_wind(
    data: &Data,
    values: &[Vec<Option<BinValues>>],
    flew: &Vehicle,
    amsl_m: f64,
) -> [f64; 2] {
    mean_wind(&as_data(data, values), lean_law(&mean_drone(flew), amsl_m, 0.0), None)
}

/// How another program's simulation answers climb, where its logs tell it.
pub(super) fn as_flown(
    data: &Data,
    values: &[Vec<Option<BinValues>>],
    flew: &Vehicle,
    (law, air_mps, amsl_m): (LeanLaw, [f64; 3], f64),
) -> Result<Option<AsFlown>, EffectError> {
    let data = data.keep(|group, bin| values[group][bin].is_some());
    let side = flat(values);
    let blown = wind(&data, law, Some((&side, air_mps)));
    let scene = Scene::measured(&data, &side, &blown, amsl_m).simulated(&data, &side, air_mps);
    AsFlown::of(&data, &side, &scene, flew)
}

#[cfg(test)]
mod tests {
    use super::super::trial;
    use super::super::verdict::{Fitted, Interval};
    use super::*;

    #[test]
    fn the_model_before_is_the_file_s_and_not_what_was_read_from_logs() {
        let place = Role::FaceDragTop.place().unwrap();
        let us = Interval { value: 1.2, low: 1.0, high: 1.4 };
        let said = |stand_in: &Vehicle, file: &Vehicle| {
            let fitted = Fitted {
                name: place.parameter.name.to_owned(),
                unit: String::new(),
                value: us,
                before: Role::FaceDragTop.value(stand_in),
            };
            let effect = place.name().to_owned();
            let finding = Finding::Name { effect, parameters: vec![fitted], was_there: true };
            let mut steps = vec![trial::step(finding, 50.0, &[])];
            as_in_file(&mut steps, stand_in, file);
            match &steps[0].finding {
                Finding::Name { parameters, was_there, .. } => (parameters[0].before, *was_there),
                other => panic!("{other:?}"),
            }
        };
        let file = trial::vehicle();
        let mut stand_in = file.clone();
        Role::FaceDragTop.set(&mut stand_in, 3.0);
        assert_eq!(said(&stand_in, &file), (None, false));
        let mut other = file.clone();
        Role::FaceDragTop.set(&mut other, 0.5);
        assert_eq!(said(&stand_in, &other), (Some(0.5), true));
        assert_eq!(said(&other, &other), (Some(0.5), true), "nothing was read from logs");
        assert!(read_from_logs(&other, &other).is_none());
        assert_eq!(read_from_logs(&stand_in, &file).map(|(_, value)| value), Some(3.0));
    }
}
