//! Cautions that a reader needs where a battery's voltage was not logged.

use std::fmt::Write as _;

use super::battery;
use super::budget::Quality;
use super::result::{DroneAnalysis, DroneUpdraft, FlightAnalysis, UpdraftMap};
use super::stats::mean_sd;

/// Drones that are named one by one; the rest is counted.
const NAMED: usize = 8;

/// About drones whose pulses in the map are not corrected for the battery, and those whose law could
/// not be used because their calibration has no voltage.
pub(super) fn battery_caution(map: &UpdraftMap, calibration: &FlightAnalysis) -> Option<String> {
    let is_without =
        |drone: &&DroneUpdraft| drone.quality.iter().any(|one| one.flag == Quality::NoVoltage);
    let without: Vec<&DroneUpdraft> = map.drones.iter().filter(is_without).collect();
    let errors: Vec<f64> = without.iter().map(|drone| drone.errors.battery_mps).collect();
    let error = mean_sd(&errors).0;
    let uncalibrated = drones_without_law(map, calibration);
    let mut said = Vec::new();
    if map.battery.is_none() && !without.is_empty() {
        said.push(format!(
            "no battery voltage is in the calibration's logs, and pulses are not corrected for it. \
             What the pack may have done is in the errors: {error:.2} m/s (standard error)"
        ));
    } else if !without.is_empty() {
        said.push(format!(
            "no voltage in the hover's log of {}: pulses without one are not corrected for it. What \
             the pack may have done is in the error: {error:.2} m/s (standard error). Set \
             BATT_MONITOR, and LOG_BITMASK bit 9 (CURRENT, +512)",
            listed(without.iter().map(|drone| drone.name.as_str())),
        ));
    }
    if !uncalibrated.is_empty() {
        said.push(format!(
            "no voltage in the calibration's log of {}: the map takes the law of the average of the \
             drones for them",
            listed(uncalibrated.into_iter()),
        ));
    }
    (!said.is_empty()).then(|| format!("battery: {}", said.join("; ")))
}

/// Drones of the map with a law, but no voltage to refer it by.
fn drones_without_law<'a>(map: &UpdraftMap, calibration: &'a FlightAnalysis) -> Vec<&'a str> {
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
    drones.filter(lacks).filter(is_mapped).map(|drone| drone.name.as_str()).collect()
}

/// Names in one line; the first ones of many.
fn listed<'a>(names: impl ExactSizeIterator<Item = &'a str>) -> String {
    let more = names.len().saturating_sub(NAMED);
    let mut text = names.take(NAMED).collect::<Vec<_>>().join(", ");
    if more > 0 {
        let _ = write!(text, " and {more} more");
    }
    text
}
