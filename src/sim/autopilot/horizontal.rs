//! Horizontal control: position to velocity to acceleration (AC_PosControl).

use nalgebra::Vector2;

use super::params as p;
use super::shaping::{Approach, Kinematics, limited};
use crate::sim::plant::GRAVITY;
use crate::sim::sensors::Estimate;

/// The horizontal controller, show frame. Fields that are logged are public.
#[derive(Clone, Copy, Debug)]
pub struct Horizontal {
    /// The shaped target.
    pub target: Kinematics<2>,
    /// Target of the velocity loop, m/s.
    pub velocity_target: Vector2<f64>,
    /// Acceleration asked of the attitude, m/s².
    pub acceleration_target: Vector2<f64>,
    error: Vector2<f64>,
    derivative: Vector2<f64>,
    integral: Vector2<f64>,
    smoothing: f64,
    limits: Approach,
    limit_mps2: f64,
    dt_s: f64,
    per_dt: f64,
}

impl Horizontal {
    /// At rest at a place.
    pub fn new(position_m: Vector2<f64>, dt_s: f64) -> Self {
        let constant_s = 1.0 / (std::f64::consts::TAU * p::PSC_VEL_FLT);
        Self {
            target: Kinematics::at(position_m),
            velocity_target: Vector2::zeros(),
            acceleration_target: Vector2::zeros(),
            error: Vector2::zeros(),
            derivative: Vector2::zeros(),
            integral: Vector2::zeros(),
            smoothing: dt_s / (dt_s + constant_s),
            limits: Approach::new(p::WPNAV_SPEED, p::WPNAV_ACCEL, p::PSC_JERK, dt_s),
            limit_mps2: GRAVITY * p::ANGLE_MAX_DEG.to_radians().tan(),
            dt_s,
            per_dt: 1.0 / dt_s,
        }
    }

    /// One step: the acceleration wanted, show frame, m/s².
    pub fn update(&mut self, goal: &Kinematics<2>, estimate: &Estimate) -> Vector2<f64> {
        self.target.advance(self.dt_s);
        self.target.approach(goal, &self.limits, self.dt_s);

        let position = estimate.position_m.xy();
        self.velocity_target =
            self.target.velocity + (self.target.position - position) * p::PSC_POSXY_P;
        let raw = self.velocity_target - estimate.velocity_mps.xy();
        let before = self.error;
        self.error += (raw - self.error) * self.smoothing;
        let slope = (self.error - before) * self.per_dt;
        self.derivative += (slope - self.derivative) * self.smoothing;
        self.integral += self.error * (p::PSC_VELXY_I * self.dt_s);
        self.integral = limited(self.integral, p::PSC_VELXY_IMAX);
        let wanted = self.target.acceleration
            + self.error * p::PSC_VELXY_P
            + self.integral
            + self.derivative * p::PSC_VELXY_D;
        self.acceleration_target = limited(wanted, self.limit_mps2);
        self.acceleration_target
    }
}
