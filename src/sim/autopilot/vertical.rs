//! Vertical control: height to velocity to acceleration to throttle (AC_PosControl).

use nalgebra::Vector1;

use super::filter::LowPass;
use super::params as p;
use super::shaping::{Approach, Kinematics};
use crate::sim::sensors::Estimate;
use crate::vehicle;

/// Largest downward acceleration that the firmware shapes a target with, m/s².
const MAX_ACCELERATION: f64 = 7.5;

/// What the vertical axis is asked to do.
#[derive(Clone, Copy, Debug)]
pub enum Goal {
    /// Follow a height with its velocity and acceleration, m, up.
    Follow(Kinematics<1>),
    /// Move at a vertical speed, m/s, up positive.
    Move(f64),
}

/// Whether the motors can give no more, or no less.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ThrottleLimits {
    /// At the upper limit.
    pub upper: bool,
    /// At the lower limit.
    pub lower: bool,
}

/// The vertical controller. Fields that are logged are public; up is positive.
#[derive(Clone, Copy, Debug)]
pub struct Vertical {
    /// The shaped target.
    pub target: Kinematics<1>,
    /// Target of the velocity loop, m/s.
    pub velocity_target: f64,
    /// Target of the acceleration loop, m/s².
    pub acceleration_target: f64,
    /// Learned hover throttle (MOT_THST_HOVER), 0..1.
    pub hover_throttle: f64,
    gains: vehicle::Autopilot,
    velocity_error: LowPass,
    acceleration_error: LowPass,
    integral: f64,
    limits: Approach,
    learning: f64,
    dt_s: f64,
}

impl Vertical {
    /// At rest at a height.
    pub fn new(gains: &vehicle::Autopilot, height_m: f64, dt_s: f64) -> Self {
        Self {
            target: Kinematics::at(Vector1::new(height_m)),
            velocity_target: 0.0,
            acceleration_target: 0.0,
            hover_throttle: gains.mot_thst_hover,
            gains: *gains,
            velocity_error: LowPass::new(p::PSC_VEL_FLT, dt_s),
            acceleration_error: LowPass::new(p::PSC_ACCZ_FLTE, dt_s),
            integral: 0.0,
            limits: Approach::new(p::WPNAV_SPEED_DN, p::WPNAV_ACCEL_Z, p::PSC_JERK, dt_s),
            learning: dt_s / (dt_s + p::HOVER_LEARN_S),
            dt_s,
        }
    }

    /// One step: throttle before the boost for tilt, not limited.
    pub fn update(&mut self, goal: &Goal, estimate: &Estimate, limits: ThrottleLimits) -> f64 {
        let height_m = estimate.position_m.z;
        let climb_mps = estimate.velocity_mps.z;
        self.shape(goal, height_m, limits);

        let error_m = self.target.position.x - height_m;
        self.velocity_target =
            self.target.velocity.x + bounded_rate(error_m, self.gains.psc_posz_p);
        let velocity_error = self.velocity_error.apply(self.velocity_target - climb_mps);
        self.acceleration_target =
            self.target.acceleration.x + self.gains.psc_velz_p * velocity_error;

        let error =
            self.acceleration_error.apply(self.acceleration_target - estimate.acceleration_mps2.z);
        // ArduPilot states these gains for cm/s² and thousandths of throttle.
        let saturated = (limits.upper && error > 0.0) || (limits.lower && error < 0.0);
        if !saturated {
            self.integral = (self.integral + self.gains.psc_accz_i * 0.1 * error * self.dt_s)
                .clamp(-p::PSC_ACCZ_IMAX, p::PSC_ACCZ_IMAX);
        }
        self.hover_throttle + self.gains.psc_accz_p * 0.1 * error + self.integral
    }

    /// Learns the hover throttle from the present one, when it hovers.
    pub fn learn_hover(&mut self, throttle: f64, estimate: &Estimate) {
        let level = estimate.rotation[(2, 2)] > 0.996;
        if level && estimate.velocity_mps.z.abs() < 0.6 && throttle > 0.0 {
            let step = self.learning * (throttle - self.hover_throttle);
            self.hover_throttle =
                (self.hover_throttle + step).clamp(p::HOVER_RANGE.0, p::HOVER_RANGE.1);
        }
    }

    fn shape(&mut self, goal: &Goal, height_m: f64, limits: ThrottleLimits) {
        let target = &mut self.target;
        // A target must not run away from a vehicle that can give no more.
        let ahead = target.position.x - height_m;
        let stuck = (limits.upper && ahead > 0.0 && target.velocity.x > 0.0)
            || (limits.lower && ahead < 0.0 && target.velocity.x < 0.0);
        let held = target.position;
        target.advance(self.dt_s);
        if stuck {
            target.position = held;
        }
        match goal {
            Goal::Follow(wanted) => {
                let up = wanted.position.x > target.position.x;
                let speed = if up { self.gains.wpnav_speed_up_mps } else { p::WPNAV_SPEED_DN };
                if target.velocity.x.abs() > speed {
                    // Beyond its nominal speed the firmware allows proportionally more.
                    let over = target.velocity.x.abs() / speed;
                    let acceleration = (p::WPNAV_ACCEL_Z * over).min(MAX_ACCELERATION);
                    let limits = Approach::new(speed, acceleration, p::PSC_JERK, self.dt_s);
                    target.approach(wanted, &limits, self.dt_s);
                } else {
                    self.limits.speed = speed;
                    target.approach(wanted, &self.limits, self.dt_s);
                }
            }
            Goal::Move(speed) => {
                let none = Vector1::zeros();
                target.approach_velocity(&Vector1::new(*speed), &none, &self.limits, self.dt_s);
            }
        }
    }
}

/// Speed for a height error: proportional, and further out what half the acceleration can brake.
fn bounded_rate(error_m: f64, gain: f64) -> f64 {
    let brake = p::WPNAV_ACCEL_Z / 2.0;
    let linear_to = brake / (gain * gain);
    if error_m.abs() <= linear_to {
        error_m * gain
    } else {
        (2.0 * brake * (error_m.abs() - linear_to / 2.0)).sqrt().copysign(error_m)
    }
}
