//! Attitude control: direction of thrust to turn rates to torque demands (AC_AttitudeControl).

use nalgebra::{Vector2, Vector3};

use super::filter::LowPass;
use super::params as p;
use super::shaping::RootLaw;
use crate::sim::sensors::Estimate;

/// Gains of a rate controller.
struct Gains {
    p: f64,
    i: f64,
    d: f64,
}

const TILT: Gains = Gains { p: p::ATC_RAT_P, i: p::ATC_RAT_P, d: p::ATC_RAT_D };
const YAW: Gains = Gains { p: p::ATC_RAT_YAW_P, i: p::ATC_RAT_YAW_I, d: 0.0 };

/// Rate controller of one axis.
#[derive(Clone, Copy, Debug)]
struct RatePid {
    target: LowPass,
    /// Filtered change of the error in a step.
    change: LowPass,
    error: f64,
    integral: f64,
    /// Gains of integral and derivative for one step.
    step_i: f64,
    step_d: f64,
}

impl RatePid {
    fn new(gains: &Gains, dt_s: f64) -> Self {
        let filter = LowPass::new(p::ATC_RAT_FLT, dt_s);
        let (step_i, step_d) = (gains.i * dt_s, gains.d / dt_s);
        Self { target: filter, change: filter, error: 0.0, integral: 0.0, step_i, step_d }
    }

    /// The gains are constants, so that each axis is compiled for its own.
    #[inline]
    fn update(&mut self, gains: &Gains, target_radps: f64, rate_radps: f64) -> f64 {
        let error = self.target.apply(target_radps) - rate_radps;
        let before = std::mem::replace(&mut self.error, error);
        self.integral =
            (self.integral + self.step_i * error).clamp(-p::ATC_RAT_IMAX, p::ATC_RAT_IMAX);
        let mut output = gains.p * error + self.integral;
        if gains.d != 0.0 {
            output += self.step_d * self.change.apply(error - before);
        }
        output.clamp(-1.0, 1.0)
    }
}

/// Attitude controller. Fields that are logged are public.
#[derive(Clone, Copy, Debug)]
pub struct Attitude {
    /// Direction of thrust that the attitude follows, show frame, length 1.
    pub thrust_direction: Vector3<f64>,
    /// Turn rate of that direction about its own forward and left axes, rad/s.
    pub target_turn: Vector2<f64>,
    /// Angle to the target attitude about the body's forward, left and up axes, rad.
    pub error_rad: Vector3<f64>,
    /// Target of the turn rates about forward, left and up, rad/s.
    pub rate_target: Vector3<f64>,
    /// Torque demands about forward, left and up, -1 to 1.
    pub output: Vector3<f64>,
    rate: [RatePid; 3],
    /// Of `thrust_direction`, made when that was.
    axes: Axes,
    to_lean: RootLaw,
    turn_step: f64,
    dt_s: f64,
}

impl Attitude {
    /// A controller of a level attitude with heading along show x, for steps of `dt_s`.
    pub fn new(dt_s: f64) -> Self {
        let limit_radps2 = p::ATC_ACCEL_RP_MAX_DEG.to_radians();
        Self {
            thrust_direction: Vector3::z(),
            target_turn: Vector2::zeros(),
            error_rad: Vector3::zeros(),
            rate_target: Vector3::zeros(),
            output: Vector3::zeros(),
            rate: [&TILT, &TILT, &YAW].map(|gains| RatePid::new(gains, dt_s)),
            axes: Axes::of(&Vector3::z()),
            to_lean: RootLaw::new(1.0 / p::ATC_INPUT_TC, limit_radps2, dt_s),
            turn_step: limit_radps2 * dt_s,
            dt_s,
        }
    }

    /// Advances by one step; returns torque demands that bring the thrust into a direction (show
    /// frame, of any length) and the heading to show x.
    #[inline]
    pub fn update(&mut self, direction: &Vector3<f64>, estimate: &Estimate) -> Vector3<f64> {
        let turn = self.shape(direction);
        let body = estimate.rotation.tr_mul(&self.thrust_direction);
        // The turn from the body's up axis to the wanted direction: axis up x direction; the angle
        // is its sine for the few degrees that matter, and no less than half of it at 90 degrees.
        let heading = estimate.rotation.column(0);
        self.error_rad = Vector3::new(-body.y, body.x, -heading.y);
        self.rate_target = self.error_rad.component_mul(&Vector3::new(
            p::ATC_ANG_P,
            p::ATC_ANG_P,
            p::ATC_ANG_YAW_P,
        ));
        self.rate_target.x += self.target_turn.x;
        self.rate_target.y += self.target_turn.y;
        let (target, rate) = (&self.rate_target, &estimate.rate_radps);
        let [roll, pitch, yaw] = &mut self.rate;
        self.output = Vector3::new(
            roll.update(&TILT, target.x, rate.x),
            pitch.update(&TILT, target.y, rate.y),
            yaw.update(&YAW, target.z, rate.z),
        );
        self.thrust_direction = turned(self.thrust_direction + turn);
        self.axes = Axes::of(&self.thrust_direction);
        self.output
    }

    /// Turns the followed direction towards a wanted one with limited angular acceleration; returns
    /// its change in this step.
    #[inline]
    fn shape(&mut self, wanted: &Vector3<f64>) -> Vector3<f64> {
        let Axes { forward, left } = self.axes;
        let error = Vector2::new(-wanted.dot(&left), wanted.x * forward.x + wanted.z * forward.z)
            * wanted.norm().recip();
        let rate = self.to_lean.rate(error, f64::INFINITY);
        let most = self.turn_step;
        for axis in 0..2 {
            self.target_turn[axis] += (rate[axis] - self.target_turn[axis]).clamp(-most, most);
        }
        (forward * self.target_turn.y - left * self.target_turn.x) * self.dt_s
    }
}

/// Axes of an attitude that heads along show x and has its thrust in a direction.
#[derive(Clone, Copy, Debug)]
struct Axes {
    forward: Vector3<f64>,
    left: Vector3<f64>,
}

impl Axes {
    /// For a direction of length 1.
    #[inline]
    fn of(up: &Vector3<f64>) -> Self {
        // Forward is (z, 0, -x) of `up` over its length, left is up x forward.
        let length = (1.0 - up.y * up.y).sqrt();
        let per_length = length.recip();
        let lean = up.y * per_length;
        Self {
            forward: Vector3::new(up.z * per_length, 0.0, -up.x * per_length),
            left: Vector3::new(-up.x * lean, length, -up.z * lean),
        }
    }
}

/// A vector that is off length 1 by little, brought back to it.
#[inline]
fn turned(direction: Vector3<f64>) -> Vector3<f64> {
    direction * (1.5 - 0.5 * direction.norm_squared())
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix3;

    #[test]
    fn the_followed_lean_comes_to_the_wanted_one_within_its_acceleration() {
        const DT_S: f64 = 0.0025;
        let mut attitude = Attitude::new(DT_S);
        let level = Estimate {
            position_m: Vector3::zeros(),
            velocity_mps: Vector3::zeros(),
            acceleration_mps2: Vector3::zeros(),
            rotation: Matrix3::identity(),
            rate_radps: Vector3::zeros(),
        };
        let wanted = Vector3::new(0.3, -0.2, 0.9).normalize();
        let most = p::ATC_ACCEL_RP_MAX_DEG.to_radians() * DT_S;
        let mut reached_s = f64::NAN;
        for step in 0..800 {
            let before = attitude.target_turn;
            attitude.update(&wanted, &level);
            let change = attitude.target_turn - before;
            assert!(change.amax() <= most + 1e-12);
            assert!((attitude.thrust_direction.norm() - 1.0).abs() < 1e-6);
            if reached_s.is_nan() && attitude.thrust_direction.dot(&wanted) > 0.9998 {
                reached_s = f64::from(step) * DT_S;
            }
        }
        assert!((attitude.thrust_direction - wanted).norm() < 1e-4);
        // Some time constants of 0.15 s, at first held up by the acceleration.
        assert!((0.3..0.7).contains(&reached_s), "{reached_s} s");
    }
}
