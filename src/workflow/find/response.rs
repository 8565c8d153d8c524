//! The response of a vehicle's rotor effort to climb and wind, from the equilibrium of its own plant.

use nalgebra::Vector3;

use crate::analysis::response::Response;
use crate::effects::select::without;
use crate::effects::{Role, Signal};
use crate::flight::Indicator;
use crate::sim::plant::trim::{Condition, Trim};
use crate::vehicle::Vehicle;
use crate::workflow::error::WorkflowError;

/// Winds of the table: 0 to 15 m/s.
const WINDS: usize = 61;
const WIND_STEP_MPS: f64 = 0.25;
/// Climbs of the table: -6 to 6 m/s.
const CLIMBS: usize = 25;
const FIRST_CLIMB_MPS: f64 = -6.0;
const CLIMB_STEP_MPS: f64 = 0.5;
/// Standard error of the drag that tells the wind from the lean, relative: the file is that of a kind of vehicle, not of
/// the one that flew. Chosen; of the rotors' drag alone less is known (`workflow/wind_forms.rs`).
const DRAG_ERROR: f64 = 0.3;
/// Standard error of the lift that rotors gain in wind, relative: it comes from the share lost to the inflow, which is
/// known as well as the slope.
const LIFT_ERROR: f64 = SLOPE_ERROR;
/// Standard error of the change with the climb, relative: 11 of 87 rev/min per m/s (Phantom 4, from the flights of
/// Meier et al., Atmosphere 13:551, 2022).
const SLOPE_ERROR: f64 = 0.13;

/// The response of a vehicle, with its doubts.
///
/// # Errors
///
/// If the vehicle cannot hover.
pub(super) fn response(vehicle: &Vehicle, indicator: Indicator) -> Result<Response, WorkflowError> {
    let known = table(vehicle, indicator)?;
    let other = |role: Role, error: f64| {
        let mut vehicle = vehicle.clone();
        let value = role.value(&vehicle).filter(|value| *value > 0.0)? * (1.0 + error);
        role.set(&mut vehicle, value);
        table(&vehicle, indicator).ok()
    };
    let doubts = [other(Role::RotorDrag, DRAG_ERROR), other(Role::WindLift, LIFT_ERROR)];
    Ok(Response { doubts: doubts.into_iter().flatten().collect(), ..known })
}

fn table(vehicle: &Vehicle, indicator: Indicator) -> Result<Response, WorkflowError> {
    // Tables have no voltage; what it does is part of the level.
    let mut trim = Trim::of(&without(vehicle, Signal::ChargeUsed))?;
    let (mut lean_deg, mut effort) = (Vec::new(), Vec::new());
    for wind in 0..WINDS {
        let air_mps = Vector3::new(wind as f64 * WIND_STEP_MPS, 0.0, 0.0);
        let mut at = |climb_mps: f64| {
            let velocity_mps = Vector3::new(0.0, 0.0, climb_mps);
            trim.at(&Condition { velocity_mps, air_mps, ..Condition::default() })
        };
        let Some(hover) = at(0.0) else { break };
        let lean = hover.lean.norm().min(1.0).asin().to_degrees();
        // Beyond the wind in which it leans most, a lean says nothing.
        if lean_deg.last().is_some_and(|before| lean <= *before) {
            break;
        }
        lean_deg.push(lean);
        let of = |step: usize| {
            at(FIRST_CLIMB_MPS + step as f64 * CLIMB_STEP_MPS).map_or(f64::NAN, |steady| {
                match indicator {
                    Indicator::Pulse => steady.pulse_us,
                    Indicator::RotorSpeed => steady.rotor_radps * 60.0 / std::f64::consts::TAU,
                    Indicator::Power => steady.power_w,
                }
            })
        };
        effort.push((0..CLIMBS).map(of).collect());
    }
    if effort.is_empty() {
        return Err(WorkflowError::Usage(format!(
            "vehicle {} cannot hover in its own model: give another --vehicle",
            vehicle.name
        )));
    }
    Ok(Response {
        of: format!("vehicle {}", vehicle.name),
        wind_step_mps: WIND_STEP_MPS,
        lean_deg,
        first_climb_mps: FIRST_CLIMB_MPS,
        climb_step_mps: CLIMB_STEP_MPS,
        effort,
        slope_share: SLOPE_ERROR,
        doubts: Vec::new(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicle::library::builtin;

    #[test]
    fn the_phantom_answers_as_was_published() {
        let found = response(&builtin("phantom4").unwrap(), Indicator::RotorSpeed).unwrap();
        let calm = found.slope(0.0, 0.0).unwrap();
        assert!((calm - 87.0).abs() < 5.0, "87 +- 11 rev/min per m/s: {calm}");
        let windy = found.slope(4.0, 0.0).unwrap();
        assert!(windy > 1.2 * calm, "fresh air makes rotors steeper: {windy}");
        let hover = |wind| found.effort(wind, 0.0).unwrap();
        assert!(hover(4.0) < hover(0.0) - 50.0, "translational lift");
        assert!((found.wind_mps(found.lean_deg[8]) - 2.0).abs() < 1e-9);
        assert_eq!(found.doubts.len(), 2);
        let more_drag = found.doubts[0].wind_mps(3.0);
        assert!(more_drag < found.wind_mps(3.0), "{more_drag}");
    }

    #[test]
    fn every_indicator_of_every_vehicle_rises_with_the_climb() {
        for vehicle in ["phantom4", "pixel", "airsim-generic-quad", "arducopter-sitl"] {
            for indicator in [Indicator::Pulse, Indicator::RotorSpeed, Indicator::Power] {
                let found = response(&builtin(vehicle).unwrap(), indicator).unwrap();
                let slope = found.slope(0.0, 1.0).unwrap();
                assert!(slope > 0.0, "{vehicle} {indicator:?}: {slope}");
            }
        }
    }
}
