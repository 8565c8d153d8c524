//! Vertical control: height to velocity to acceleration to throttle (AC_PosControl).

use nalgebra::Vector1;

use super::filter::LowPass;
use super::params as p;
use super::shaping::{Approach, Kinematics, RootLaw};
use crate::sim::sensors::Estimate;
use crate::vehicle;

/// Largest downward acceleration that the firmware shapes a target with, m/s².
const MAX_ACCELERATION: f64 = 7.5;
/// What a target beyond its nominal speed gets more of acceleration and jerk
/// (POSCONTROL_OVERSPEED_GAIN_Z).
const OVERSPEED_GAIN: f64 = 2.0;
/// ArduPilot states the gains of acceleration for cm/s² and thousandths of throttle.
const THROTTLE_PER_MPS2: f64 = 0.1;

/// Goal of the vertical axis.
#[derive(Clone, Copy, Debug)]
pub enum Goal {
    /// Follow a height with its velocity and acceleration, m, m/s and m/s², up positive.
    Follow(Kinematics<1>),
    /// Descend at a speed (m/s, positive) until the ground is detected.
    Land(f64),
}

/// Limits of the throttle that the motors have reached.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ThrottleLimits {
    /// Whether the upper limit is reached: the motors can give no more.
    pub upper: bool,
    /// Whether the lower limit is reached: the motors can give no less.
    pub lower: bool,
}

/// Vertical controller; up is positive. Fields that are logged are public.
#[derive(Clone, Copy, Debug)]
pub struct Vertical {
    /// Shaped target of height, climb and acceleration, up positive.
    pub target: Kinematics<1>,
    /// Target of the velocity loop, m/s.
    pub velocity_target: f64,
    /// Target of the acceleration loop, m/s².
    pub acceleration_target: f64,
    /// Learned hover throttle (MOT_THST_HOVER), 0 to 1.
    pub hover_throttle: f64,
    gains: vehicle::Autopilot,
    position_error: f64,
    velocity_error: LowPass,
    acceleration_error: LowPass,
    integral: f64,
    limits: Approach,
    to_position: RootLaw,
    /// Largest errors of height that are made up for, down and up, m.
    reach_m: (f64, f64),
    learning: f64,
    dt_s: f64,
}

impl Vertical {
    /// A controller at rest at a height, for steps of `dt_s`.
    pub fn new(gains: &vehicle::Autopilot, height_m: f64, dt_s: f64) -> Self {
        let reach = |speed_mps: f64| {
            let linear_mps = p::WPNAV_ACCEL_Z / gains.psc_posz_p;
            if speed_mps < linear_mps {
                speed_mps / gains.psc_posz_p
            } else {
                (linear_mps.powi(2) + speed_mps.powi(2)) / (2.0 * p::WPNAV_ACCEL_Z)
            }
        };
        Self {
            target: Kinematics::at(Vector1::new(height_m)),
            velocity_target: 0.0,
            acceleration_target: 0.0,
            hover_throttle: gains.mot_thst_hover,
            gains: *gains,
            position_error: 0.0,
            velocity_error: LowPass::new(p::PSC_VEL_FLT, dt_s),
            acceleration_error: LowPass::new(p::PSC_ACCZ_FLTE, dt_s),
            integral: 0.0,
            limits: Approach::new(p::WPNAV_SPEED_DN, p::WPNAV_ACCEL_Z, p::PSC_JERK, dt_s),
            // Without a step: the firmware does not guard this one against overshoot.
            to_position: RootLaw::new(gains.psc_posz_p, p::WPNAV_ACCEL_Z, 0.0),
            reach_m: (reach(p::WPNAV_SPEED_DN), reach(gains.wpnav_speed_up_mps)),
            learning: dt_s / (dt_s + p::HOVER_LEARN_S),
            dt_s,
        }
    }

    /// Starts anew from the present motion and throttle (before the boost for tilt).
    pub fn restart(&mut self, estimate: &Estimate, throttle: f64) {
        let acceleration = estimate.acceleration_mps2.z;
        let wanted = acceleration.clamp(-p::WPNAV_ACCEL_Z, p::WPNAV_ACCEL_Z);
        self.target = Kinematics {
            position: Vector1::new(estimate.position_m.z),
            velocity: Vector1::new(estimate.velocity_mps.z),
            acceleration: Vector1::new(wanted),
        };
        self.position_error = 0.0;
        self.velocity_error.reset();
        self.acceleration_error.reset();
        self.acceleration_target = wanted;
        self.integral = throttle
            - self.hover_throttle
            - self.gains.psc_accz_p * THROTTLE_PER_MPS2 * (wanted - acceleration);
    }

    /// Advances by one step on the ground: relaxes the throttle and returns it.
    pub fn relax(&mut self, estimate: &Estimate, throttle: f64) -> f64 {
        self.restart(estimate, throttle);
        let share = self.dt_s / (self.dt_s + p::RELAX_S);
        self.integral += share * (-self.hover_throttle - self.integral);
        self.throttle(estimate, ThrottleLimits::default())
    }

    /// Advances by one step; returns the throttle before the boost for tilt, not limited.
    #[inline]
    pub fn update(&mut self, goal: &Goal, estimate: &Estimate, limits: ThrottleLimits) -> f64 {
        self.shape(goal, limits);
        self.throttle(estimate, limits)
    }

    #[inline]
    fn throttle(&mut self, estimate: &Estimate, limits: ThrottleLimits) -> f64 {
        let height_m = estimate.position_m.z;
        let (below, above) = self.reach_m;
        self.position_error = (self.target.position.x - height_m).clamp(-below, above);
        self.target.position.x = height_m + self.position_error;
        let catch_up = self.to_position.rate(Vector1::new(self.position_error), f64::INFINITY);
        self.velocity_target = self.target.velocity.x + catch_up.x;
        let velocity_error =
            self.velocity_error.apply(self.velocity_target - estimate.velocity_mps.z);
        self.acceleration_target =
            self.target.acceleration.x + self.gains.psc_velz_p * velocity_error;

        let error =
            self.acceleration_error.apply(self.acceleration_target - estimate.acceleration_mps2.z);
        // At a limit the integral may only shrink.
        let limited = limits.upper || limits.lower;
        if !limited || self.integral * error < 0.0 {
            let step = self.gains.psc_accz_i * THROTTLE_PER_MPS2 * error * self.dt_s;
            self.integral = (self.integral + step).clamp(-p::PSC_ACCZ_IMAX, p::PSC_ACCZ_IMAX);
        }
        self.hover_throttle + self.gains.psc_accz_p * THROTTLE_PER_MPS2 * error + self.integral
    }

    /// Learns the hover throttle from the present one, when it hovers.
    ///
    /// The firmware asks for a wanted speed of exactly 0, which its single precision next to never
    /// leaves after a show has moved: its logs keep one hover throttle throughout.
    #[inline]
    pub fn learn_hover(&mut self, throttle: f64, estimate: &Estimate) {
        let level = estimate.rotation[(2, 2)] > 0.996;
        let still = self.target.velocity.x == 0.0 && estimate.velocity_mps.z.abs() < 0.6;
        if level && still && throttle > 0.0 {
            let step = self.learning * (throttle - self.hover_throttle);
            self.hover_throttle =
                (self.hover_throttle + step).clamp(p::HOVER_RANGE.0, p::HOVER_RANGE.1);
        }
    }

    #[inline]
    fn shape(&mut self, goal: &Goal, limits: ThrottleLimits) {
        let descending = matches!(goal, Goal::Land(_));
        let stuck = Vector1::new(match limits {
            ThrottleLimits { upper: true, .. } => 1.0,
            // A landing goes on against the ground, so that it is noticed.
            ThrottleLimits { lower: true, .. } if !descending => -1.0,
            _ => 0.0,
        });
        self.target.advance_within(
            self.dt_s,
            &stuck,
            &Vector1::new(self.position_error),
            &Vector1::new(self.velocity_error.value),
        );
        let (target, none) = (&mut self.target, Vector1::zeros());
        let rising = target.velocity.x > 0.0;
        let speed = if rising { self.gains.wpnav_speed_up_mps } else { p::WPNAV_SPEED_DN };
        // Beyond its nominal speed the firmware allows more.
        let over = if target.velocity.x.abs() > speed {
            OVERSPEED_GAIN * target.velocity.x.abs() / speed
        } else {
            1.0
        };
        match goal {
            Goal::Follow(wanted) => {
                let ahead = wanted.position.x > target.position.x;
                self.limits.speed =
                    if ahead { self.gains.wpnav_speed_up_mps } else { p::WPNAV_SPEED_DN };
                if over > 1.0 {
                    let limit = p::WPNAV_ACCEL_Z * over;
                    let (speed, jerk) = (self.limits.speed, p::PSC_JERK * over);
                    let up = Approach::new(speed, limit, jerk, self.dt_s);
                    let down = Approach::new(speed, limit.min(MAX_ACCELERATION), jerk, self.dt_s);
                    if self.gains.show_vel_ff_gain < 1.0 {
                        // Not as the firmware has it, which makes up for position errors faster
                        // too: a target that lags steadily would have two lags at its nominal
                        // speed, and swing between them for the whole leg.
                        let (up, down) = (&up.swing, &down.swing);
                        target.approach_with(wanted, &self.limits, up, down, self.dt_s);
                    } else {
                        target.approach_between(wanted, &up, &down, self.dt_s);
                    }
                } else {
                    target.approach(wanted, &self.limits, self.dt_s);
                }
            }
            Goal::Land(speed) => {
                target.approach_velocity(
                    &Vector1::new(-speed),
                    &none,
                    &self.limits.swing,
                    self.dt_s,
                );
            }
        }
    }
}
