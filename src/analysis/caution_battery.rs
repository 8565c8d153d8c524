//! Cautions that a reader needs where a battery's voltage was not logged.

use super::battery;
use super::budget::Quality;
use super::result::{DroneAnalysis, DroneUpdraft, FlightAnalysis, UpdraftMap};
use super::stats::mean_sd;
use super::warning::Warning;

/// About drones whose pulses in the map are not corrected for the battery, and those whose law could
/// not be used because their calibration has no voltage.
pub(super) fn battery_caution(map: &UpdraftMap, calibration: &FlightAnalysis) -> Option<Warning> {
    let is_without =
        |drone: &&DroneUpdraft| drone.quality.iter().any(|one| one.flag == Quality::NoVoltage);
    let without: Vec<&DroneUpdraft> = map.drones.iter().filter(is_without).collect();
    let errors: Vec<f64> = without.iter().map(|drone| drone.errors.battery_mps).collect();
    let error = mean_sd(&errors).0;
    let in_calibration = drones_without_law(map, calibration);
    let (mut uncorrected_mps, mut in_hover) = (None, None);
    if map.battery.is_none() && !without.is_empty() {
        uncorrected_mps = Some(error);
    } else if !without.is_empty() {
        in_hover = Some((without.iter().map(|drone| drone.name.clone()).collect(), error));
    }
    let any = uncorrected_mps.is_some() || in_hover.is_some() || !in_calibration.is_empty();
    any.then_some(Warning::Battery { uncorrected_mps, in_hover, in_calibration })
}

/// Drones of the map with a law, but no voltage to refer it by.
fn drones_without_law(map: &UpdraftMap, calibration: &FlightAnalysis) -> Vec<String> {
    let is_mapped = |drone: &&DroneAnalysis| {
        map.drones.iter().any(|other| match (other.slot, drone.slot) {
            (Some(slot), Some(own)) => slot == own,
            _ => other.name == drone.name,
        })
    };
    let lacks = |drone: &&DroneAnalysis| {
        drone.laws.is_some() && battery::of_hovers(&drone.windows).is_empty()
    };
    let drones = calibration.drones.iter().filter(|_| map.battery.is_some());
    drones.filter(lacks).filter(is_mapped).map(|drone| drone.name.clone()).collect()
}
