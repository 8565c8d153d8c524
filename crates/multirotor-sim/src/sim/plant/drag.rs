//! Drag on the six faces of the body box, as AirSim computes it.
//!
//! MultiRotorPhysicsBody::createDragVertices and FastPhysicsEngine::getDragWrench: each face feels
//! the air only from the front, quadratically, and not below 0.1 m/s. AirSim's "propeller area" is
//! pi D², four times the disc: it is kept, because it is what the paper's simulations flew in.
//! A face's force goes through the centre, so the drag has no torque.

use std::f64::consts::PI;

use nalgebra::Vector3;

use super::Loads;
use super::rotor::ROTORS;
use crate::sim::air::SEA_LEVEL_DENSITY;
use crate::vehicle::Airframe;

/// Speed below which a face feels no air, m/s.
pub const DEAD_BAND_MPS: f64 = 0.1;

/// Drag factors of the three pairs of faces.
#[derive(Clone, Copy, Debug)]
pub struct Drag {
    /// Force per density and squared speed along forward, left and up, m².
    factor_m2: Vector3<f64>,
}

impl Drag {
    /// Drag of an airframe.
    pub fn new(airframe: &Airframe) -> Self {
        let [x, y, z] = airframe.body_m;
        let rotors = ROTORS as f64;
        let diameter = airframe.rotor_diameter_m;
        let rotor_side_m2 = PI * diameter * airframe.rotor_height_m;
        let rotor_top_m2 = PI * diameter * diameter;
        let area_m2 = Vector3::new(
            y * z + rotors * rotor_side_m2,
            x * z + rotors * rotor_side_m2,
            x * y + rotors * rotor_top_m2,
        );
        Self { factor_m2: area_m2 * (airframe.drag_coefficient / 2.0) }
    }

    /// Drag factors along forward, left and up: force / (density · speed²), m².
    pub fn factor_m2(&self) -> Vector3<f64> {
        self.factor_m2
    }

    /// Adds the drag at a velocity of the body relative to the air, body axes, m/s; `share` has what
    /// effects make of it along forward, left and up.
    #[inline]
    pub fn add_loads(
        &self,
        relative_mps: &Vector3<f64>,
        density_ratio: f64,
        share: &Vector3<f64>,
        loads: &mut Loads,
    ) {
        let density = density_ratio * SEA_LEVEL_DENSITY;
        let drag_n = relative_mps.zip_map(&self.factor_m2, |speed, factor| {
            if speed.abs() > DEAD_BAND_MPS { factor * density * speed * speed.abs() } else { 0.0 }
        });
        loads.force_n -= drag_n.component_mul(share);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicle::library::builtin;

    fn drag() -> Drag {
        Drag::new(&builtin("airsim-generic-quad").unwrap().airframe)
    }

    #[test]
    fn factors_are_airsims() {
        let expected = Vector3::new(0.005383, 0.005838, 0.109930);
        assert!((drag().factor_m2 - expected).norm() < 1e-6, "{}", drag().factor_m2);
    }

    #[test]
    fn acts_against_the_motion_and_is_dead_in_the_band() {
        let mut loads = Loads::default();
        let as_it_is = Vector3::repeat(1.0);
        drag().add_loads(&Vector3::new(0.1, -0.1, 0.099), 1.0, &as_it_is, &mut loads);
        assert_eq!(loads.force_n, Vector3::zeros());
        drag().add_loads(&Vector3::new(0.2, 0.0, -3.0), 1.0, &as_it_is, &mut loads);
        assert!((loads.force_n.z - 0.109930 * 1.225 * 9.0).abs() < 1e-4);
        assert!(loads.force_n.x < 0.0 && loads.force_n.y == 0.0);
    }
}
