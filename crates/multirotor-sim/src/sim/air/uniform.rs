//! A constant wind, equal everywhere, as in AirSim.

use nalgebra::Vector3;

use super::Atmosphere;

/// One constant wind vector, show frame, m/s; z is the updraft.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Uniform(pub Vector3<f64>);

impl Atmosphere for Uniform {
    fn air_velocity(&self, _position_m: &Vector3<f64>, _time_s: f64) -> Vector3<f64> {
        self.0
    }
}
