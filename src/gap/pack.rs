//! The pack that the logs tell, where a battery is tried: cells, voltage at which the hover is stated, and what the
//! voltage falls by under load.

use super::scene::Scene;
use crate::effects::{Definition, Role};
use crate::numeric::mean;
use crate::vehicle::Vehicle;

/// Voltage of a lithium polymer cell at which a vehicle's hover is stated, V: the middle of its plateau.
/// With another reference the sizes of `battery` came out a tenth low.
const NOMINAL_V: f64 = 3.85;
/// A voltage per cell this far from [`NOMINAL_V`] belongs to another number of cells, V: full and empty
/// cells are within 0.35 V (4.2 and 3.5 V). Convention.
const OTHER_V: f64 = 0.4;
/// A power that differs by more than this factor from the model's is not believed: an uncalibrated sensor. Chosen.
const MOST_OTHER_POWER: f64 = 4.0;
/// Least share of the logged power that goes with the model's: below it the two have nothing to do with each other.
/// Chosen.
const LEAST_WITH_MODEL: f64 = 0.1;
/// What the voltage falls by under load may be wrong by this share where no power was logged: a resistance that the
/// autopilot estimates, and a current that goes with another power of the thrust than the model's. It steepens the
/// response, as a larger exponent does. Chosen.
const LOAD_DOUBT: f64 = 0.5;
/// The same where it was: voltages at rest and under load differ by the product of resistance and current that the log
/// has, whatever each of them is worth. Chosen.
const LOGGED_LOAD_DOUBT: f64 = 0.1;

/// Share by which the fall of the voltage under load may be wrong.
pub(super) fn load_doubt(scene: &Scene) -> f64 {
    let is_logged = scene.flown_w.iter().flatten().any(|power_w| power_w.is_finite());
    if is_logged { LOGGED_LOAD_DOUBT } else { LOAD_DOUBT }
}

/// Sets what the logs say of an effect that is to be tried.
pub(super) fn prepare(vehicle: &mut Vehicle, definition: &Definition, scene: &Scene) {
    let is_battery = definition.with_role(Role::BatteryCells).is_some();
    if !is_battery || Role::BatteryCells.is_on(vehicle) || scene.resting_v <= 0.0 {
        return;
    }
    Role::BatteryCells.set(vehicle, scene.cells);
    Role::BatteryCharge.set(vehicle, 1.0);
    // The model's hover is stated for its own nominal voltage, unless its battery is another.
    if Role::BatteryReference
        .value(vehicle)
        .is_none_or(|volts| (volts / scene.cells - NOMINAL_V).abs() > OTHER_V)
    {
        Role::BatteryReference.set(vehicle, scene.cells * NOMINAL_V);
    }
    let Some(resistance_ohm) = scene.resistance_ohm else { return };
    let Some(load) = Load::of(scene, vehicle) else {
        Role::BatteryResistance.set(vehicle, resistance_ohm);
        return;
    };
    // The voltage falls by what was flown with, whatever power the model's motors take there: a part of that falls
    // it, and something constant.
    Role::BatteryResistance.set(vehicle, (resistance_ohm * load.share).clamp(0.0, 1.0));
    Role::BatteryAvionics.set(vehicle, load.constant_w);
    if let Some(capacity_ah) = Role::BatteryCapacity.value(vehicle) {
        Role::BatteryCapacity.set(vehicle, capacity_ah * load.times);
    }
}

/// Logged power by the model's: `share` of what its motors and a constant take.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Load {
    share: f64,
    /// Power that the model's motors do not take, before the share is taken, W.
    constant_w: f64,
    /// Power with the constant over that of the motors: the pack lasts as long as before.
    times: f64,
}

impl Load {
    /// By a straight line through the bins. `None`: no power was logged, or the vehicle cannot fly all of it.
    fn of(scene: &Scene, vehicle: &Vehicle) -> Option<Self> {
        let model_w = scene.power_w(vehicle).ok()?;
        let both = scene.flown_w.iter().flatten().zip(model_w.iter().flatten());
        let both: Vec<(f64, f64)> = both
            .map(|(flown_w, model_w)| (*flown_w, *model_w))
            .filter(|(flown_w, _)| flown_w.is_finite())
            .collect();
        let flown_w = mean(both.iter().map(|(flown_w, _)| flown_w))?;
        let motors_w =
            mean(both.iter().map(|(_, model_w)| model_w)).filter(|watts| *watts > 0.0)?;
        let product: f64 =
            both.iter().map(|(flown, model)| (flown - flown_w) * (model - motors_w)).sum();
        let squares: f64 = both.iter().map(|(_, model)| (model - motors_w).powi(2)).sum();
        let ratio = (flown_w / motors_w).clamp(1.0 / MOST_OTHER_POWER, MOST_OTHER_POWER);
        let steepness = if squares > 0.0 { product / squares } else { ratio };
        let share = steepness.clamp(LEAST_WITH_MODEL * ratio, ratio);
        let times = ratio / share;
        Some(Self { share, constant_w: (times - 1.0) * motors_w, times })
    }
}

#[cfg(test)]
mod tests {
    use super::super::trial;
    use super::*;
    use crate::effects::find;

    /// Resistance and constant power of a battery that is tried, and the power of the model's motors by bin, for drones
    /// that take a share of that and something constant.
    fn tried(share: f64, constant_w: f64) -> (f64, f64, Vec<f64>) {
        let mut comparison = trial::comparison(&trial::data(2, |_, _| 0.0));
        let scene = &mut comparison.scene;
        (scene.cells, scene.resting_v, scene.resistance_ohm) = (3.0, 11.5, Some(0.03));
        let mut vehicle = trial::vehicle();
        let model_w = scene.power_w(&vehicle).unwrap().remove(0);
        scene.flown_w = vec![model_w.iter().map(|watts| share * watts + constant_w).collect()];
        prepare(&mut vehicle, find("battery").unwrap().definition(), scene);
        let of = |role: Role| role.value(&vehicle).unwrap();
        (of(Role::BatteryResistance), of(Role::BatteryAvionics), model_w)
    }

    #[test]
    fn a_load_that_was_logged_is_known_better() {
        let mut scene = trial::comparison(&trial::data(2, |_, _| 0.0)).scene;
        assert_eq!(load_doubt(&scene), LOAD_DOUBT, "{:?}", scene.flown_w);
        scene.flown_w[0][0] = 50.0;
        assert_eq!(load_doubt(&scene), LOGGED_LOAD_DOUBT);
    }

    /// The model's motors may take another power, and it may rise otherwise with the climb; what the voltage falls by is
    /// the product of resistance and logged current.
    #[test]
    fn a_battery_that_is_tried_falls_by_what_was_flown_with() {
        for (share, constant_w) in [(1.5, 0.0), (0.4, 30.0)] {
            let (ohm, watts, model_w) = tried(share, constant_w);
            for model_w in model_w {
                let (falls, flown) =
                    (ohm * (model_w + watts), 0.03 * (share * model_w + constant_w));
                assert!((falls - flown).abs() < 1e-9 * flown, "{falls} {flown}");
            }
        }
        let (ohm, watts, _) = tried(100.0, 0.0);
        assert!((ohm - 0.12).abs() < 1e-9 && watts == 0.0, "no such sensor: {ohm} {watts}");
        let (ohm, watts, model_w) = tried(-0.5, 400.0);
        let falls = ohm * (mean(model_w.iter()).unwrap() + watts);
        let flown = 0.03 * (400.0 - 0.5 * mean(model_w.iter()).unwrap());
        assert!((falls - flown).abs() < 1e-9, "what falls with the model's is nothing: {falls}");
        let (ohm, watts, _) = tried(f64::NAN, 0.0);
        assert!((ohm - 0.03).abs() < 1e-12 && (watts - 3.0).abs() < 1e-12, "{ohm} {watts}");
    }
}
