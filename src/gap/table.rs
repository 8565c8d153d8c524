//! Flights of tables. Rotor speeds become the pulses of motors that follow their command without loss, so
//! that everything that is said of pulses can be said of them; and heights, which count from the first row,
//! are put where no ground is felt.

use crate::effects::Reference;
use crate::flight::{Flight, Indicator};
use crate::numeric::{least, upper_median};
use crate::vehicle::{RotorLaw, Vehicle};

/// Slower is a hover, m/s. As in the analysis of tables; chosen.
const HOVER_MPS: f64 = 0.3;

/// Height above the ground of a table's lowest row, m: tables do not say where the ground is. Chosen so that
/// the ground has no effect.
const ALOFT_M: f64 = 30.0;

/// A table's flight far above the ground.
#[must_use]
pub fn aloft(flight: &Flight) -> Flight {
    let mut flight = flight.clone();
    let lowest_m = least(&flight.height_m.value).unwrap_or(f64::INFINITY);
    if lowest_m < ALOFT_M {
        flight.height_m.value.iter_mut().for_each(|height_m| *height_m += ALOFT_M - lowest_m);
    }
    flight
}

/// A vehicle whose motors have no resistance: its pulse says the rotor speed, whatever the torque.
#[must_use]
pub fn lossless(vehicle: &Vehicle) -> Vehicle {
    let mut vehicle = vehicle.clone();
    if let RotorLaw::Motor(motor) = &mut vehicle.airframe.rotor {
        motor.resistance_ohm = 0.0;
        motor.no_load_a = 0.0;
    }
    vehicle
}

/// A flight logged as rotor speeds (rpm) in the pulses of a [`lossless`] vehicle, us. The vehicle's hover is
/// put where the flight's is: only changes of rotor speed count.
#[must_use]
pub fn as_pulses(flight: &Flight, lossless: &Vehicle) -> Flight {
    let mut flight = flight.clone();
    let hovers = |time_s: &f64| {
        let climb_mps = flight.velocity_up_mps.at(*time_s, 1.0);
        climb_mps.is_none_or(|climb_mps| climb_mps.abs() < HOVER_MPS)
    };
    let seen = flight.effort.values.time_s.iter().zip(&flight.effort.values.value);
    let mut speeds: Vec<f64> =
        seen.filter(|(time_s, _)| hovers(time_s)).map(|(_, rpm)| *rpm).collect();
    if speeds.is_empty() {
        speeds.clone_from(&flight.effort.values.value);
    }
    let hover_rpm = upper_median(speeds).unwrap_or(1.0).max(1.0);
    let at = Reference::of(lossless);
    let pulses = |rpm: &mut f64| *rpm = at.pulse_us(*rpm / hover_rpm, 1.0);
    flight.effort.values.value.iter_mut().for_each(pulses);
    flight.effort.indicator = Indicator::Pulse;
    // Limits of pulses say nothing of rotor speeds.
    flight.pulse_max_us = crate::flight::Series::default();
    flight.pulse_min_us = crate::flight::Series::default();
    flight
}
