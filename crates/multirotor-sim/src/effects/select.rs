//! Which effects a vehicle has, with which parameters.

use super::definition::{MAX_PARAMETERS, Signal, Values};
use super::error::EffectError;
use super::{Effect, LIBRARY, find};
use crate::vehicle::Vehicle;

/// The effects that are on, in the order of the library, with their parameters.
///
/// # Errors
/// An unknown effect or parameter, or a value out of bounds, also of effects that are off.
pub fn resolved(vehicle: &Vehicle) -> Result<Vec<(&'static dyn Effect, Values)>, EffectError> {
    for name in vehicle.effects.keys() {
        known(name)?;
    }
    let mut found = Vec::new();
    for effect in LIBRARY.iter().copied() {
        let Some(table) = vehicle.effects.get(effect.definition().name) else { continue };
        let values = values_of(effect, vehicle)?;
        if table.on {
            found.push((effect, values));
        }
    }
    Ok(found)
}

/// Value of one parameter of an effect that a vehicle has; `None`: it is off, or not valid.
pub fn value_of(vehicle: &Vehicle, effect: &str, parameter: &str) -> Option<f64> {
    let known = find(effect)?;
    vehicle.effects.get(effect).filter(|table| table.on)?;
    let place = known.definition().parameters.iter().position(|one| one.name == parameter)?;
    values_of(known, vehicle).ok()?.get(place).copied()
}

/// Parameters of an effect for a vehicle: its file's, else the defaults.
///
/// # Errors
/// An unknown parameter or a value out of bounds.
pub fn values_of(effect: &dyn Effect, vehicle: &Vehicle) -> Result<Values, EffectError> {
    let definition = effect.definition();
    let table = vehicle.effects.get(definition.name);
    if let Some(table) = table {
        for name in table.parameters.keys() {
            if !definition.parameters.iter().any(|parameter| parameter.name == name) {
                let known: Vec<_> = definition.parameters.iter().map(|known| known.name).collect();
                return Err(EffectError::Parameter {
                    effect: definition.name,
                    name: name.clone(),
                    known: if known.is_empty() { "none".to_owned() } else { known.join(", ") },
                });
            }
        }
    }
    let mut values = [0.0; MAX_PARAMETERS];
    for (value, parameter) in values.iter_mut().zip(definition.parameters) {
        let stated = table.and_then(|table| table.parameters.get(parameter.name));
        *value = stated.copied().unwrap_or_else(|| (parameter.default)(vehicle));
        if !(parameter.low..=parameter.high).contains(value) {
            return Err(EffectError::Bounds {
                effect: definition.name,
                name: parameter.name,
                value: *value,
                low: parameter.low,
                high: parameter.high,
                unit: parameter.unit,
            });
        }
    }
    if let Some((index, why)) = effect.refusal(&values, vehicle) {
        let name = definition.parameters.get(index).map_or("", |parameter| parameter.name);
        let value = values.get(index).copied().unwrap_or_default();
        return Err(EffectError::Nonsense { effect: definition.name, name, value, why });
    }
    Ok(values)
}

/// Switches an effect on and sets one of its parameters, whatever its bounds.
pub fn set(vehicle: &mut Vehicle, effect: &str, parameter: &str, value: f64) {
    let table = vehicle.effects.entry(effect.to_owned()).or_default();
    table.on = true;
    table.parameters.insert(parameter.to_owned(), value);
}

/// The effects that a vehicle's file switches on, in the order of the library; also such as have a
/// value out of bounds.
pub fn acting(vehicle: &Vehicle) -> impl Iterator<Item = &'static dyn Effect> {
    let is_on = |effect: &&dyn Effect| {
        vehicle.effects.get(effect.definition().name).is_some_and(|table| table.on)
    };
    LIBRARY.iter().copied().filter(is_on)
}

/// Whether an effect that acts on a vehicle looks at a signal.
pub fn looks_at(vehicle: &Vehicle, signal: Signal) -> bool {
    acting(vehicle).any(|effect| effect.definition().looks_at(signal))
}

/// Switches off the effects that look at a signal.
pub fn without(vehicle: &Vehicle, signal: Signal) -> Vehicle {
    let mut other = vehicle.clone();
    let blind = |name: &str| find(name).is_none_or(|effect| !effect.definition().looks_at(signal));
    other.effects.retain(|name, _| blind(name));
    other
}

/// Applies a choice from a command line to a vehicle: `NAME`, `NAME=on`, `NAME=off` or
/// `NAME.PARAMETER=NUMBER` (which also switches the effect on).
///
/// # Errors
/// Another form, an unknown effect or parameter, or a value out of bounds.
pub fn choose(vehicle: &mut Vehicle, choice: &str) -> Result<(), EffectError> {
    let syntax = || EffectError::Syntax(choice.to_owned());
    let (left, right) = match choice.split_once('=') {
        Some((left, right)) => (left.trim(), Some(right.trim())),
        None => (choice.trim(), None),
    };
    let (name, parameter) = match left.split_once('.') {
        Some((name, parameter)) => (name, Some(parameter)),
        None => (left, None),
    };
    let effect = known(name)?;
    let table = vehicle.effects.entry(name.to_owned()).or_default();
    match (parameter, right) {
        (None, None | Some("on")) => table.on = true,
        (None, Some("off")) => table.on = false,
        (Some(parameter), Some(number)) => {
            let number: f64 = number.parse().map_err(|_| syntax())?;
            table.on = true;
            table.parameters.insert(parameter.to_owned(), number);
        }
        _ => return Err(syntax()),
    }
    values_of(effect, vehicle).map(|_| ())
}

/// The effect of a name, or an error with the name that is nearest.
///
/// # Errors
/// [`EffectError::Unknown`].
pub fn known(name: &str) -> Result<&'static dyn Effect, EffectError> {
    find(name).ok_or_else(|| {
        let names = LIBRARY.iter().map(|effect| effect.definition().name);
        let nearest = names.map(|known| (distance(name, known), known)).min();
        let hint = nearest
            .filter(|(steps, _)| *steps <= 3)
            .map_or_else(String::new, |(_, known)| format!("; did you mean {known}?"));
        EffectError::Unknown { name: name.to_owned(), hint }
    })
}

/// Levenshtein's distance.
fn distance(left: &str, right: &str) -> usize {
    let right: Vec<char> = right.chars().take(64).collect();
    let mut row: Vec<usize> = (0..=right.len()).collect();
    for (i, a) in left.chars().take(64).enumerate() {
        let mut diagonal = i;
        let mut before = i + 1;
        for (b, cell) in right.iter().zip(row.iter_mut().skip(1)) {
            let replaced = diagonal + usize::from(a != *b);
            diagonal = *cell;
            *cell = replaced.min(*cell + 1).min(before + 1);
            before = *cell;
        }
        if let Some(first) = row.first_mut() {
            *first = i + 1;
        }
    }
    row.last().copied().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicle::library::builtin;

    #[test]
    fn choices_switch_and_set() {
        let mut vehicle = builtin("airsim-generic-quad").unwrap();
        choose(&mut vehicle, "rotor-inflow").unwrap();
        choose(&mut vehicle, "battery.initial_charge=0.8").unwrap();
        choose(&mut vehicle, "ground-effect=off").unwrap();
        let on: Vec<_> = resolved(&vehicle)
            .unwrap()
            .iter()
            .map(|(effect, _)| effect.definition().name)
            .collect();
        assert_eq!(on, ["battery", "rotor-inflow"]);
        choose(&mut vehicle, "rotor-inflow=off").unwrap();
        assert_eq!(resolved(&vehicle).unwrap().len(), 1);
    }

    #[test]
    fn wrong_choices_say_what_would_be_right() {
        let mut vehicle = builtin("airsim-generic-quad").unwrap();
        for (choice, part) in [
            ("rotor-inflw", "did you mean rotor-inflow?"),
            ("flux-capacitor", "updraft effects"),
            ("battery.volts=3", "initial_charge"),
            ("battery.initial_charge=1.5", "0 to 1"),
            ("battery.initial_charge=full", "NAME.PARAMETER=NUMBER"),
            ("battery.initial_charge=0", "lasts 0 s of hover"),
            ("battery.capacity_ah=0.01", "lasts"),
            ("battery.cells=1.5", "whole number"),
            ("battery.compensated=0.3", "0 or 1"),
            ("battery=maybe", "NAME=off"),
            ("battery.initial_charge", "NAME.PARAMETER=NUMBER"),
            ("battery.initial_charge=nan", "0 to 1"),
        ] {
            let error = choose(&mut vehicle.clone(), choice).unwrap_err().to_string();
            assert!(error.contains(part), "{choice}: {error}");
        }
        let error = choose(&mut vehicle.clone(), "vortex-ring.onset=9").unwrap_err().to_string();
        assert!(error.ends_with("0.25 to 1.5"), "no unit of a pure number: {error}");
        vehicle.effects.insert("x".to_owned(), crate::vehicle::EffectTable::default());
        assert!(resolved(&vehicle).is_err());
    }
}
