//! Horizontal control: position to velocity to acceleration (AC_PosControl).

use nalgebra::Vector2;

use super::params as p;
use super::shaping::{Approach, Kinematics, RootLaw, limited};
use crate::sim::plant::GRAVITY;
use crate::sim::sensors::Estimate;

/// Horizontal controller, show frame. Fields that are logged are public.
#[derive(Clone, Copy, Debug)]
pub struct Horizontal {
    /// Shaped target of position, velocity and acceleration, show frame.
    pub target: Kinematics<2>,
    /// Target of the velocity loop, m/s.
    pub velocity_target: Vector2<f64>,
    /// Acceleration demanded of the attitude, m/s².
    pub acceleration_target: Vector2<f64>,
    fresh: bool,
    position_error: Vector2<f64>,
    error: Vector2<f64>,
    derivative: Vector2<f64>,
    integral: Vector2<f64>,
    /// What was wanted when the lean was limited, else zero.
    stuck: Vector2<f64>,
    smoothing: f64,
    smoothing_per_dt: f64,
    limits: Approach,
    to_position: RootLaw,
    limit_mps2: f64,
    dt_s: f64,
}

impl Horizontal {
    /// A controller at rest at a position, for steps of `dt_s`.
    pub fn new(position_m: Vector2<f64>, dt_s: f64) -> Self {
        let constant_s = 1.0 / (std::f64::consts::TAU * p::PSC_VEL_FLT);
        // A change of lean takes turning: the firmware limits the jerk to half of what the greatest
        // angular acceleration could do.
        let snap_mps4 = p::ATC_ACCEL_RP_MAX_DEG.to_radians() * GRAVITY;
        let jerk_mps3 = p::PSC_JERK.min(0.5 * (p::WPNAV_ACCEL * snap_mps4).sqrt());
        Self {
            target: Kinematics::at(position_m),
            velocity_target: Vector2::zeros(),
            acceleration_target: Vector2::zeros(),
            fresh: true,
            position_error: Vector2::zeros(),
            error: Vector2::zeros(),
            derivative: Vector2::zeros(),
            integral: Vector2::zeros(),
            stuck: Vector2::zeros(),
            smoothing: dt_s / (dt_s + constant_s),
            smoothing_per_dt: 1.0 / (dt_s + constant_s),
            limits: Approach::new(p::WPNAV_SPEED, p::WPNAV_ACCEL, jerk_mps3, dt_s),
            // Without a step: the firmware does not guard this one against overshoot.
            to_position: RootLaw::new(p::PSC_POSXY_P, p::WPNAV_ACCEL, 0.0),
            limit_mps2: GRAVITY * p::ANGLE_MAX_DEG.to_radians().tan(),
            dt_s,
        }
    }

    /// Starts anew from the present motion, keeping the present lean.
    pub fn restart(&mut self, estimate: &Estimate) {
        self.target = Kinematics::at(estimate.position_m.xy());
        self.target.velocity = estimate.velocity_mps.xy();
        self.integral = limited(self.acceleration_target, p::PSC_VELXY_IMAX);
        self.fresh = true;
    }

    /// Advances by one step; returns the acceleration demanded, show frame, m/s². Without a goal
    /// the vehicle comes to a stop.
    #[inline]
    pub fn update(&mut self, goal: Option<&Kinematics<2>>, estimate: &Estimate) -> Vector2<f64> {
        self.target.advance_within(self.dt_s, &self.stuck, &self.position_error, &self.error);
        let none = Vector2::zeros();
        match goal {
            Some(goal) => self.target.approach(goal, &self.limits, self.dt_s),
            None => self.target.approach_velocity(&none, &none, &self.limits.swing, self.dt_s),
        }

        self.position_error = self.target.position - estimate.position_m.xy();
        self.velocity_target =
            self.target.velocity + self.to_position.rate(self.position_error, f64::INFINITY);
        let raw = self.velocity_target - estimate.velocity_mps.xy();
        if self.fresh {
            self.fresh = false;
            self.error = raw;
            self.derivative = none;
        } else {
            let before = self.error;
            let keep = 1.0 - self.smoothing;
            self.error = raw * self.smoothing + before * keep;
            self.derivative =
                (self.error - before) * self.smoothing_per_dt + self.derivative * keep;
        }
        self.integrate();
        let wanted = (self.target.acceleration + self.integral)
            + (self.error * p::PSC_VELXY_P + self.derivative * p::PSC_VELXY_D);
        self.acceleration_target = limited(wanted, self.limit_mps2);
        self.stuck = if self.acceleration_target == wanted { none } else { wanted };
        self.acceleration_target
    }

    #[inline]
    fn integrate(&mut self) {
        let step = self.error * (p::PSC_VELXY_I * self.dt_s);
        let before = self.integral;
        self.integral += step;
        // Into a limit that holds the lean it may turn, but not grow.
        if step.dot(&self.stuck) > 0.0 {
            self.integral = limited(self.integral, before.norm());
        }
        self.integral = limited(self.integral, p::PSC_VELXY_IMAX);
    }
}
