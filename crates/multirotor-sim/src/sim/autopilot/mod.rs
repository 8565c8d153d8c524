//! An autopilot that does what ArduCopter 4.4 does in show mode.
//!
//! The cascade: show targets at 10 Hz, shaped to what the vehicle can follow; position to velocity
//! to acceleration; horizontally to a direction of thrust and turn rates, vertically to throttle;
//! boost for tilt, mixing, thrust curve, whole microseconds. 400 Hz throughout.

pub mod attitude;
pub mod director;
pub mod filter;
pub mod guided;
pub mod horizontal;
pub mod motors;
pub mod params;
pub mod shaping;
pub mod vertical;

use nalgebra::Vector3;

use super::air::density_ratio;
use super::plant::{GRAVITY, rotor::ROTORS};
use super::sensors::Estimate;
use crate::vehicle;
use attitude::Attitude;
use director::{Director, Stage, Touchdown};
use horizontal::Horizontal;
use motors::{Motors, Spool};
use skybrush_show::Trajectory;
use vertical::{ThrottleLimits, Vertical};

/// Temperature lost per height.
const LAPSE_K_PER_M: f64 = 6.5e-3;

/// Autopilot of one drone; its parts are public for the recorder.
#[derive(Clone, Debug)]
pub struct Autopilot<'a> {
    /// Director of the show: its stages and targets.
    pub director: Director<'a>,
    /// Controller of height and climb.
    pub vertical: Vertical,
    /// Controller of horizontal position and velocity.
    pub horizontal: Horizontal,
    /// Controller of attitude and body rates.
    pub attitude: Attitude,
    /// Mixer and outputs of the motors.
    pub motors: Motors,
    /// Throttle before the boost for tilt (CTUN.ThI).
    pub throttle_in: f64,
    home_m: Vector3<f64>,
    air: BaroAir,
    dt_s: f64,
}

impl<'a> Autopilot<'a> {
    /// An autopilot that is armed on the ground. `None` if the trajectory never rises to
    /// SHOW_TAKEOFF_ALT.
    pub fn new(
        trajectory: &'a Trajectory,
        settings: &vehicle::Autopilot,
        home_m: Vector3<f64>,
        home_amsl_m: f64,
        dt_s: f64,
    ) -> Option<Self> {
        let director = Director::new(trajectory, home_m, settings, dt_s)?;
        Some(Self::with(director, settings, home_m, home_amsl_m, dt_s))
    }

    /// An autopilot that is armed on the ground for a ground station's orders; the trajectory is
    /// not flown.
    pub fn guided(
        trajectory: &'a Trajectory,
        settings: &vehicle::Autopilot,
        home_m: Vector3<f64>,
        home_amsl_m: f64,
        dt_s: f64,
    ) -> Self {
        let director = Director::guided(trajectory, home_m, settings, dt_s);
        Self::with(director, settings, home_m, home_amsl_m, dt_s)
    }

    fn with(
        director: Director<'a>,
        settings: &vehicle::Autopilot,
        home_m: Vector3<f64>,
        home_amsl_m: f64,
        dt_s: f64,
    ) -> Self {
        Self {
            director,
            vertical: Vertical::new(settings, home_m.z, dt_s),
            horizontal: Horizontal::new(home_m.xy(), dt_s),
            attitude: Attitude::new(dt_s),
            motors: Motors::new(settings, dt_s),
            throttle_in: 0.0,
            home_m,
            air: BaroAir { home_amsl_m, ground_c: settings.baro_ground_temperature_c },
            dt_s,
        }
    }

    /// Advances by one control step; returns the pulse width of each rotor, whole us.
    #[inline]
    pub fn update(&mut self, time_s: f64, estimate: &Estimate) -> [u16; ROTORS] {
        let goals = self.director.update(time_s, estimate, &mut self.motors);
        if self.motors.spool == Spool::Flying {
            if goals.restart {
                self.vertical.restart(estimate, self.throttle_in);
                self.horizontal.restart(estimate);
            }
            let push = self.horizontal.update(goals.horizontal.as_ref(), estimate);
            self.throttle_in = if self.director.touchdown == Touchdown::Complete {
                self.vertical.relax(estimate, self.throttle_in)
            } else {
                self.vertical.update(&goals.vertical, estimate, self.motors.limits)
            };
            let direction = Vector3::new(push.x, push.y, GRAVITY);
            let torque = self.attitude.update(&direction, estimate);
            let boosted = self.throttle_in * self.boost(estimate);
            let height_m = estimate.position_m.z - self.home_m.z;
            self.motors.set_density(height_m, |height_m| self.air.ratio(height_m));
            self.motors.update(boosted, &torque);
            if self.director.stage == Stage::Performing {
                self.vertical.learn_hover(self.motors.throttle, estimate);
            }
        } else {
            self.stand(estimate);
            self.motors.update(0.0, &Vector3::zeros());
        }
        self.motors.pulses_us
    }

    /// Factor by which the throttle is multiplied to make up for the tilt, at most 10.
    #[inline]
    pub fn boost(&self, estimate: &Estimate) -> f64 {
        1.0 / estimate.rotation[(2, 2)].max(0.1)
    }

    /// On the ground, the controllers start from where the vehicle is and from no throttle.
    #[cold]
    #[inline(never)]
    fn stand(&mut self, estimate: &Estimate) {
        self.horizontal = Horizontal::new(estimate.position_m.xy(), self.dt_s);
        self.attitude = Attitude::new(self.dt_s);
        self.throttle_in = self.vertical.relax(estimate, 0.0);
    }

    /// Whether a rotor or the throttle is at an end of its range in flight.
    #[inline]
    pub fn saturated(&self) -> bool {
        let (low, high) = self.motors.pulse_range_us();
        let at_end = |pulse: &u16| *pulse <= low || *pulse >= high;
        self.motors.limits != ThrottleLimits::default() || self.motors.pulses_us.iter().any(at_end)
    }
}

/// Density of the air as the barometer has it.
#[derive(Clone, Copy, Debug)]
struct BaroAir {
    home_amsl_m: f64,
    /// Temperature taken for that of the air at home, if not the standard one.
    ground_c: Option<f64>,
}

impl BaroAir {
    /// Share of the density at sea level at a height above home, m.
    fn ratio(&self, height_m: f64) -> f64 {
        let amsl_m = self.home_amsl_m + height_m;
        let standard_k = 288.15 - LAPSE_K_PER_M * amsl_m;
        let taken_k = self.ground_c.map_or(standard_k, |c| 273.15 + c - LAPSE_K_PER_M * height_m);
        density_ratio(amsl_m) * standard_k / taken_k
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_warm_barometer_finds_the_air_thinner() {
        let standard = BaroAir { home_amsl_m: 584.0, ground_c: None };
        assert!((standard.ratio(100.0) - density_ratio(684.0)).abs() < 1e-12);
        // 584 m: 94502 Pa; ArduPilot's gas constant differs by 0.07 %.
        let warm = BaroAir { home_amsl_m: 584.0, ground_c: Some(30.74) };
        let expected = 94_502.0 / (287.26 * 303.89) / 1.225;
        assert!((warm.ratio(0.0) / expected - 1.0).abs() < 1e-3, "{}", warm.ratio(0.0));
    }
}
