//! Known vehicles of foreign worlds: what a search is handed, right but for what is hidden.

use foreign_worlds::World;
use foreign_worlds::plant::{Plant, ThrustLaw};
use rand_pcg::Pcg64;

use super::identify::{Identified, identify};
use crate::blind::error::BlindError;
use crate::blind::hide::between;
use crate::blind::scenario::{Base, Cell};
use crate::blind::vehicles::KNOWN_THRUST_SPREAD;
use crate::effects::Role;
use crate::sim::plant::drag::Drag;
use crate::sim::plant::rotor::{ROTORS, Rotors};
use crate::vehicle::{Vehicle, library};

/// Step for which rotors are asked for their thrust, s; it does not matter.
const ANY_STEP_S: f64 = 0.0025;

/// Draws a thrust law: AirSim's vehicle with other thrust and drag.
///
/// # Errors
/// If a built-in vehicle is not valid.
pub(super) fn thrust_law(rng: &mut Pcg64) -> Result<Plant, BlindError> {
    let mut vehicle = airsim()?;
    let frame = &mut vehicle.airframe;
    frame.thrust_coefficient *= between(rng, (0.97, 1.15));
    frame.drag_coefficient *= between(rng, (0.8, 1.2));
    let full_thrust_n = ROTORS as f64 * Rotors::new(frame, ANY_STEP_S).max_thrust_n();
    Ok(Plant::ThrustLaw(ThrustLaw {
        mass_kg: frame.mass_kg,
        full_thrust_n,
        drag_m2: Drag::new(frame).factor_m2().into(),
        lag_s: 0.05,
    }))
}

fn airsim() -> Result<Vehicle, BlindError> {
    let mut vehicle = library::builtin(Base::Airsim.vehicle_name())?;
    vehicle.effects.clear();
    // A square body: the same drag from all sides.
    vehicle.airframe.body_m[1] = vehicle.airframe.body_m[0];
    Ok(vehicle)
}

/// The vehicle that a search is handed, and how far its mean response is from the plant's, us.
///
/// # Errors
/// If a built-in vehicle is not valid, or none can be identified.
pub fn vehicle(world: &World, cell: &Cell) -> Result<Identified, BlindError> {
    let mut found = match &world.plant {
        Plant::ThrustLaw(law) => Identified { vehicle: exact(law)?, largest_us: 0.0, rms_us: 0.0 },
        Plant::BladeElement(_) => identify(world, cell)?,
    };
    Role::ThrustSpread.set(&mut found.vehicle, KNOWN_THRUST_SPREAD);
    Ok(found)
}

/// The vehicle's file that is a thrust law.
fn exact(law: &ThrustLaw) -> Result<Vehicle, BlindError> {
    let mut vehicle = airsim()?;
    let frame = &mut vehicle.airframe;
    frame.mass_kg = law.mass_kg;
    frame.motor_time_constant_s = law.lag_s;
    let thrust_n = ROTORS as f64 * Rotors::new(frame, ANY_STEP_S).max_thrust_n();
    frame.thrust_coefficient *= law.full_thrust_n / thrust_n;
    frame.drag_coefficient *= law.drag_m2[2] / Drag::new(frame).factor_m2().z;
    Ok(vehicle)
}
