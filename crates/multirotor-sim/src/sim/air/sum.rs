//! Several atmospheres at once: their velocities add up.

use std::sync::Arc;

use nalgebra::Vector3;

use super::{AirSampler, Atmosphere};

/// The sum of any number of atmospheres; still air when there are none.
#[derive(Default)]
pub struct Sum(pub Vec<Box<dyn Atmosphere + Send>>);

impl Atmosphere for Sum {
    fn air_velocity(&self, position_m: &Vector3<f64>, time_s: f64) -> Vector3<f64> {
        self.0.iter().map(|part| part.air_velocity(position_m, time_s)).sum()
    }

    fn sampler(&self, drone: u16) -> Box<dyn AirSampler + Send + '_> {
        Box::new(Samplers(self.0.iter().map(|part| part.sampler(drone)).collect()))
    }
}

/// Air that somebody else looks at as well.
impl<T: Atmosphere + Send + ?Sized> Atmosphere for Arc<T> {
    fn air_velocity(&self, position_m: &Vector3<f64>, time_s: f64) -> Vector3<f64> {
        (**self).air_velocity(position_m, time_s)
    }

    fn sampler(&self, drone: u16) -> Box<dyn AirSampler + Send + '_> {
        (**self).sampler(drone)
    }
}

struct Samplers<'a>(Vec<Box<dyn AirSampler + Send + 'a>>);

impl AirSampler for Samplers<'_> {
    fn air_velocity(&mut self, position_m: &Vector3<f64>, time_s: f64) -> Vector3<f64> {
        self.0.iter_mut().map(|part| part.air_velocity(position_m, time_s)).sum()
    }
}
