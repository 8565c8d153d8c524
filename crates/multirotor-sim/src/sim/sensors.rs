//! State estimate of the autopilot: the truth with small, seeded errors, as an EKF leaves them.
//!
//! Errors of position, velocity and attitude wander (Ornstein-Uhlenbeck, unbiased); gyro and
//! accelerometer noise is white. Their size is set between that of the firmware's own simulator and
//! of a drone in the field; means over an analysis window stay within a few mm/s.

use nalgebra::{Matrix3, Vector3};
use rand::Rng as _;
use rand_distr::{Distribution as _, StandardNormal};
use rand_pcg::Pcg64;

use crate::rng::{Purpose, stream};

use super::plant::Motion;

/// (standard deviation, time constant s) of each wandering error.
const POSITION_XY_M: (f64, f64) = (0.02, 8.0);
const POSITION_Z_M: (f64, f64) = (0.01, 8.0);
const VELOCITY_MPS: (f64, f64) = (0.006, 0.3);
const TILT_RAD: (f64, f64) = (0.0008, 2.0);
const YAW_RAD: (f64, f64) = (0.005, 5.0);
/// White noise per step.
const RATE_RADPS: f64 = 0.003;
const ACCELERATION_MPS2: f64 = 0.05;

/// Wandering errors are drawn every so many steps and are straight lines in between.
const STEPS_PER_DRAW: u32 = 16;
const ERRORS: usize = 9;

/// State estimate of the autopilot, show frame.
#[derive(Clone, Copy, Debug)]
pub struct Estimate {
    /// Position, show frame, m.
    pub position_m: Vector3<f64>,
    /// Velocity, show frame, m/s.
    pub velocity_mps: Vector3<f64>,
    /// Acceleration without gravity's reaction (0 at rest), m/s².
    pub acceleration_mps2: Vector3<f64>,
    /// Rotation from body to show frame.
    pub rotation: Matrix3<f64>,
    /// Turn rates about the body's forward, left and up axes, rad/s.
    pub rate_radps: Vector3<f64>,
}

/// Sensors and state estimator of one drone.
#[derive(Clone, Debug)]
pub struct Sensors {
    rng: Pcg64,
    value: [f64; ERRORS],
    slope: [f64; ERRORS],
    decay: [f64; ERRORS],
    kick: [f64; ERRORS],
    countdown: u32,
}

impl Sensors {
    /// Sensors of one drone of a seeded fleet, for steps of `dt_s`.
    pub fn new(seed: u64, drone: u16, dt_s: f64) -> Self {
        let scales = [
            POSITION_XY_M,
            POSITION_XY_M,
            POSITION_Z_M,
            VELOCITY_MPS,
            VELOCITY_MPS,
            VELOCITY_MPS,
            TILT_RAD,
            TILT_RAD,
            YAW_RAD,
        ];
        let interval_s = dt_s * f64::from(STEPS_PER_DRAW);
        let decay = scales.map(|(_, constant_s)| (-interval_s / constant_s).exp());
        let mut kick = [0.0; ERRORS];
        for ((kick, decay), (deviation, _)) in kick.iter_mut().zip(decay).zip(scales) {
            *kick = deviation * (1.0 - decay * decay).sqrt();
        }
        let mut rng = stream(seed, u64::from(drone), Purpose::Sensors);
        let value = scales.map(|(deviation, _)| {
            let draw: f64 = StandardNormal.sample(&mut rng);
            deviation * draw
        });
        Self { rng, value, slope: [0.0; ERRORS], decay, kick, countdown: 0 }
    }

    /// Advances by one step; returns the estimate of the present motion.
    #[inline]
    pub fn sense(&mut self, truth: &Motion) -> Estimate {
        if self.countdown == 0 {
            self.countdown = STEPS_PER_DRAW;
            self.draw();
        }
        self.countdown -= 1;
        for (value, slope) in self.value.iter_mut().zip(&self.slope) {
            *value += slope;
        }
        let [x, y, z, vx, vy, vz, forward, left, up] = self.value;
        Estimate {
            position_m: truth.position_m + Vector3::new(x, y, z),
            velocity_mps: truth.velocity_mps + Vector3::new(vx, vy, vz),
            acceleration_mps2: truth.acceleration_mps2 + self.white(ACCELERATION_MPS2),
            rotation: slightly_turned(&truth.rotation, forward, left, up),
            rate_radps: truth.rate_radps + self.white(RATE_RADPS),
        }
    }

    #[inline(never)]
    fn draw(&mut self) {
        for i in 0..ERRORS {
            let draw: f64 = StandardNormal.sample(&mut self.rng);
            let next = self.value[i] * self.decay[i] + self.kick[i] * draw;
            self.slope[i] = (next - self.value[i]) / f64::from(STEPS_PER_DRAW);
        }
    }

    /// Three independent values near to normal: sums of uniform ones, all from one draw.
    #[inline]
    fn white(&mut self, deviation: f64) -> Vector3<f64> {
        // The sum of three uniform whole numbers below 2^7: mean 190.5, variance 3 (2^14 - 1) / 12.
        let scale = deviation / 63.998;
        let bits = self.rng.next_u64();
        let one = |shift: u32| {
            let part = bits >> shift;
            let sum = (part & 0x7F) + (part >> 7 & 0x7F) + (part >> 14 & 0x7F);
            (f64::from(sum as u32) - 190.5) * scale
        };
        Vector3::new(one(0), one(21), one(42))
    }
}

/// A rotation turned further by small angles about its own axes, to first order.
#[inline]
fn slightly_turned(rotation: &Matrix3<f64>, forward: f64, left: f64, up: f64) -> Matrix3<f64> {
    let [x, y, z] = [0, 1, 2].map(|axis| rotation.column(axis));
    Matrix3::from_columns(&[
        x + y * up - z * left,
        y - x * up + z * forward,
        z + x * left - y * forward,
    ])
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::UnitQuaternion;

    fn at_rest() -> Motion {
        Motion {
            position_m: Vector3::zeros(),
            velocity_mps: Vector3::zeros(),
            acceleration_mps2: Vector3::zeros(),
            attitude: UnitQuaternion::identity(),
            rotation: Matrix3::identity(),
            rate_radps: Vector3::zeros(),
            angular_acceleration: Vector3::zeros(),
        }
    }

    #[test]
    fn errors_are_unbiased_and_of_their_stated_size() {
        let mut sensors = Sensors::new(1, 1, 0.0025);
        let count = 2_000_000;
        let (mut sum, mut square, mut white) = (0.0, 0.0, 0.0);
        for _ in 0..count {
            let estimate = sensors.sense(&at_rest());
            sum += estimate.velocity_mps.z;
            square += estimate.velocity_mps.z.powi(2);
            white += estimate.rate_radps.x.powi(2);
        }
        let (mean, deviation) = (sum / f64::from(count), (square / f64::from(count)).sqrt());
        // 5000 s hold about 8000 independent values of this error.
        assert!(mean.abs() < 4.0 * 0.006 / 8_000.0_f64.sqrt(), "{mean}");
        assert!((deviation / 0.006 - 1.0).abs() < 0.05, "{deviation}");
        assert!(((white / f64::from(count)).sqrt() / RATE_RADPS - 1.0).abs() < 0.01);
    }

    #[test]
    fn drones_and_seeds_have_their_own_errors() {
        let first = |seed, drone| Sensors::new(seed, drone, 0.0025).sense(&at_rest()).position_m;
        assert_eq!(first(1, 1), first(1, 1));
        assert_ne!(first(1, 1), first(1, 2));
        assert_ne!(first(1, 1), first(2, 1));
    }
}
