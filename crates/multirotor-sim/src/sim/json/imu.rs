//! Inertial sensor on the body: its readings over one frame.

use nalgebra::{UnitQuaternion, Vector3};

use crate::sim::plant::{GRAVITY, Motion};

/// Means over a frame, body axes (forward, left, up).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Imu {
    /// Turn rate, rad/s.
    pub(super) rate_radps: Vector3<f64>,
    /// Specific force, m/s²: at rest +g along up.
    pub(super) force_mps2: Vector3<f64>,
}

impl Imu {
    /// Standing level.
    pub(super) fn at_rest() -> Self {
        Self { rate_radps: Vector3::zeros(), force_mps2: Vector3::new(0.0, 0.0, GRAVITY) }
    }

    /// The means between two motions that lie `dt_s` apart.
    ///
    /// Means, not the values at the end: an estimator that integrates them arrives at the body's
    /// velocity and attitude, also over a touch-down, where both change within one step.
    pub(super) fn between(before: &Motion, after: &Motion, dt_s: f64) -> Self {
        let turn = (before.attitude.inverse() * after.attitude).scaled_axis();
        let middle = before.attitude * UnitQuaternion::from_scaled_axis(turn / 2.0);
        let mut force = (after.velocity_mps - before.velocity_mps) / dt_s;
        force.z += GRAVITY;
        Self { rate_radps: turn / dt_s, force_mps2: middle.inverse_transform_vector(&force) }
    }
}
