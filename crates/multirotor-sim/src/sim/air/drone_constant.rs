//! A constant vertical velocity for each drone, which differs from drone to drone.
//!
//! Not physics of the atmosphere: the simplest air in which drones differ, to test maps with.

use nalgebra::Vector3;
use rand_distr::{Distribution as _, StandardNormal};

use super::{AirSampler, Atmosphere, Uniform};
use crate::rng::{Purpose, stream};

/// Each drone's own constant updraft, normally distributed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DroneConstant {
    /// Standard deviation between drones, m/s.
    pub sd_mps: f64,
    /// Seed of the air.
    pub seed: u64,
    /// Index of this component among several of its kind, from 0.
    pub component: u16,
}

impl DroneConstant {
    /// Updraft of one drone, by its slot, m/s.
    pub fn updraft_mps(&self, drone: u16) -> f64 {
        let selector = u64::from(self.component) << 16 | u64::from(drone);
        let normal: f64 = StandardNormal.sample(&mut stream(self.seed, selector, Purpose::Air));
        self.sd_mps * normal
    }
}

impl Atmosphere for DroneConstant {
    /// Still: no drone is asked for.
    fn air_velocity(&self, _position_m: &Vector3<f64>, _time_s: f64) -> Vector3<f64> {
        Vector3::zeros()
    }

    fn sampler(&self, drone: u16) -> Box<dyn AirSampler + Send + '_> {
        Box::new(Constant(Uniform(Vector3::new(0.0, 0.0, self.updraft_mps(drone)))))
    }
}

struct Constant(Uniform);

impl AirSampler for Constant {
    fn air_velocity(&mut self, position_m: &Vector3<f64>, time_s: f64) -> Vector3<f64> {
        self.0.air_velocity(position_m, time_s)
    }
}
