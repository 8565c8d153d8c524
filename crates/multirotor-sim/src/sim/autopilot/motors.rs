//! Motors: spooling, mixing, thrust curve, whole microseconds (AP_MotorsMulticopter).

use nalgebra::Vector3;

use super::filter::LowPass;
use super::params as p;
use super::vertical::ThrottleLimits;
use crate::sim::plant::rotor::{LAYOUT, ROTORS};
use crate::vehicle;

/// Altitude change after which the firmware refreshes its air density, m.
const DENSITY_STEP_M: f64 = 25.0;

/// Spool state of the motors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Spool {
    /// Disarmed, or armed and not yet spinning.
    Stopped,
    /// Spinning on the ground.
    Idle,
    /// Spinning up to flight, with the share of the lowest output in flight.
    Up(f64),
    /// The throttle is not limited by the spool state.
    Flying,
}

/// Outputs of the motors. Fields that are logged are public.
#[derive(Clone, Copy, Debug)]
pub struct Motors {
    /// Spool state of the motors.
    pub spool: Spool,
    /// Pulse width of each rotor, whole us.
    pub pulses_us: [u16; ROTORS],
    /// Throttle after the filter, 0 to 1 (CTUN.ThO).
    pub throttle: f64,
    /// Limits that were reached in this step.
    pub limits: ThrottleLimits,
    throttle_filter: LowPass,
    curve: Curve,
    expo: f64,
    spin_min: f64,
    spin_span: f64,
    pulse_range_us: (u16, u16),
    density_gain: f64,
    density_height_m: f64,
    voltage_limits: (f64, f64),
    /// Inverse of the battery's voltage as a share of MOT_BAT_VOLT_MAX, and the share of full thrust
    /// that this voltage gives.
    per_voltage: f64,
    lift: f64,
    /// What throttle and torque are multiplied by for the air's density and the voltage.
    gain: f64,
    dt_s: f64,
}

impl Motors {
    /// Motors that stand still, for steps of `dt_s`.
    pub fn new(settings: &vehicle::Autopilot, dt_s: f64) -> Self {
        Self {
            spool: Spool::Stopped,
            pulses_us: [p::MOT_PWM_MIN as u16; ROTORS],
            throttle: 0.0,
            limits: ThrottleLimits::default(),
            throttle_filter: LowPass::new(p::THROTTLE_FLT, dt_s),
            curve: Curve::new(settings.mot_thst_expo),
            expo: settings.mot_thst_expo,
            spin_min: settings.mot_spin_min,
            spin_span: settings.mot_spin_max - settings.mot_spin_min,
            pulse_range_us: (whole_us(settings.mot_spin_min), whole_us(settings.mot_spin_max)),
            density_gain: 1.0,
            density_height_m: f64::NEG_INFINITY,
            voltage_limits: (
                settings.mot_bat_volt_min.max(0.6 * settings.mot_bat_volt_max),
                settings.mot_bat_volt_max,
            ),
            per_voltage: 1.0,
            lift: 1.0,
            gain: 1.0,
            dt_s,
        }
    }

    /// Smallest and largest pulse width in flight, us.
    #[inline]
    pub fn pulse_range_us(&self) -> (u16, u16) {
        self.pulse_range_us
    }

    /// Sets the height above home (m) and the density of the air there, as a share of that at sea
    /// level, for the compensation of density.
    #[inline]
    pub fn set_density(&mut self, height_m: f64, ratio: impl FnOnce(f64) -> f64) {
        if (height_m - self.density_height_m).abs() >= DENSITY_STEP_M {
            self.density_height_m = height_m;
            self.density_gain = 1.0 / ratio(height_m).clamp(0.5, 1.25);
            self.gain = self.density_gain / self.lift;
        }
    }

    /// Sets the resting voltage of the battery, V, for the compensation of voltage; without
    /// MOT_BAT_VOLT_MAX there is none.
    pub fn set_voltage(&mut self, resting_v: f64) {
        let (low, high) = self.voltage_limits;
        if low < high {
            let voltage = resting_v.clamp(low, high) / high;
            self.per_voltage = 1.0 / voltage;
            self.lift = voltage * (1.0 - self.expo + self.expo * voltage);
            self.gain = self.density_gain / self.lift;
        }
    }

    /// Advances by one step with the boosted throttle and the torque demands (forward, left, up).
    #[inline]
    pub fn update(&mut self, throttle: f64, torque: &Vector3<f64>) {
        match self.spool {
            Spool::Stopped => self.hold(0.0),
            Spool::Idle => self.hold(p::MOT_SPIN_ARM),
            Spool::Up(share) => {
                self.hold(share * self.spin_min);
                let share = share + self.dt_s / p::MOT_SPOOL_TIME;
                self.spool = if share < 1.0 { Spool::Up(share) } else { Spool::Flying };
            }
            Spool::Flying => self.fly(throttle, torque),
        }
    }

    #[inline(never)]
    fn hold(&mut self, actuator: f64) {
        self.pulses_us = [whole_us(actuator); ROTORS];
        self.throttle_filter.value = 0.0;
        self.throttle = 0.0;
        self.limits = ThrottleLimits { upper: false, lower: true };
    }

    #[inline]
    fn fly(&mut self, throttle: f64, torque: &Vector3<f64>) {
        let filtered = self.throttle_filter.apply(throttle);
        let [roll, pitch, yaw] = (torque * (0.5 * self.gain)).into();
        let share = LAYOUT.map(|(forward, left, turn)| left * roll - forward * pitch + turn * yaw);
        let wanted = filtered * self.gain;
        // No rotor's share is greater than this: most of the time nothing has to give way.
        let reach = roll.abs() + pitch.abs() + yaw.abs();
        let free = filtered > 0.0 && filtered < 1.0 && wanted > reach && wanted + reach < 1.0;
        let thrust = if free {
            self.throttle = filtered;
            self.limits = ThrottleLimits::default();
            share.map(|share| wanted + share)
        } else {
            self.limited(filtered, share)
        };
        let output = self.curve.actuators(thrust.map(|thrust| thrust * self.lift));
        let slope = self.spin_span * self.per_voltage;
        self.pulses_us = output.map(|output| whole_us(self.spin_min + slope * output));
    }

    /// Thrust of each rotor where the throttle or a rotor may be at an end of its range.
    #[cold]
    #[inline(never)]
    fn limited(&mut self, throttle: f64, share: [f64; ROTORS]) -> [f64; ROTORS] {
        self.throttle = throttle.clamp(0.0, 1.0);
        self.throttle_filter.value = self.throttle;
        self.limits = ThrottleLimits { upper: self.throttle >= 1.0, lower: self.throttle <= 0.0 };
        let wanted = self.throttle * self.gain;
        // Attitude before throttle: the collective gives way where a rotor would leave its range.
        let low = share.iter().copied().fold(0.0, f64::min);
        let high = share.iter().copied().fold(0.0, f64::max);
        let scale = if high - low > 1.0 { 1.0 / (high - low) } else { 1.0 };
        let collective = if wanted > 1.0 - high * scale {
            self.limits.upper = true;
            1.0 - high * scale
        } else {
            wanted
        };
        share.map(|share| (collective + share * scale).clamp(0.0, 1.0))
    }
}

/// Actuator share for a thrust share: the inverse of (1 - expo) a + expo a².
#[derive(Clone, Copy, Debug)]
struct Curve {
    linear: f64,
    square: f64,
    four_expo: f64,
    per_two_expo: f64,
    straight: bool,
}

impl Curve {
    fn new(expo: f64) -> Self {
        let linear = 1.0 - expo;
        Self {
            linear,
            square: linear * linear,
            four_expo: 4.0 * expo,
            per_two_expo: 1.0 / (2.0 * expo),
            straight: expo.abs() < 1e-6,
        }
    }

    #[inline]
    fn actuators(&self, thrust: [f64; ROTORS]) -> [f64; ROTORS] {
        if self.straight {
            return thrust;
        }
        thrust.map(|thrust| {
            let root = (self.square + self.four_expo * thrust).max(0.0).sqrt();
            (root - self.linear) * self.per_two_expo
        })
    }
}

/// Pulse of an actuator share: the fraction is cut off, as the firmware does.
#[inline]
fn whole_us(actuator: f64) -> u16 {
    // The small addition keeps decimal fractions such as 0.95 from falling below their value.
    (p::MOT_PWM_MIN + (p::MOT_PWM_MAX - p::MOT_PWM_MIN) * actuator + 1e-9) as u16
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicle::library::builtin;

    fn flying() -> Motors {
        let mut motors = Motors::new(&builtin("airsim-generic-quad").unwrap().autopilot, 0.0025);
        motors.spool = Spool::Flying;
        motors
    }

    fn settled(throttle: f64, torque: Vector3<f64>) -> Motors {
        let mut motors = flying();
        for _ in 0..4_000 {
            motors.update(throttle, &torque);
        }
        motors
    }

    #[test]
    fn pulses_are_whole_and_stay_between_the_spin_limits() {
        assert_eq!(settled(5.0, Vector3::zeros()).pulses_us, [1950; 4]);
        assert_eq!(settled(-5.0, Vector3::zeros()).pulses_us, [1150; 4]);
        assert_eq!(
            settled(0.5012, Vector3::zeros()).pulses_us,
            [1550; 4],
            "the fraction is cut off"
        );
        assert_eq!(flying().pulse_range_us(), (1150, 1950));
        assert!(settled(5.0, Vector3::zeros()).limits.upper);
    }

    #[test]
    fn attitude_keeps_its_difference_at_the_upper_limit() {
        let pulses = settled(1.0, Vector3::new(0.25, 0.0, 0.0)).pulses_us;
        assert_eq!(pulses, [1750, 1950, 1950, 1750]);
    }

    #[test]
    fn a_lower_voltage_is_made_up_for_in_the_command() {
        let mut settings = builtin("arducopter-sitl").unwrap().autopilot;
        settings.mot_spin_min = 0.0;
        settings.mot_spin_max = 1.0;
        let command = |resting_v| {
            let mut motors = Motors::new(&settings, 0.0025);
            motors.spool = Spool::Flying;
            motors.set_voltage(resting_v);
            (0..4_000).for_each(|_| motors.update(0.4, &Vector3::zeros()));
            f64::from(motors.pulses_us[0] - 1000)
        };
        // The voltage at the motor is what stays the same.
        assert!((command(11.52) * 0.9 - command(12.8)).abs() < 2.0);
        assert_eq!(command(5.0), command(9.6), "below the least voltage it grows no more");
        assert_eq!(command(20.0), command(12.8));
    }

    #[test]
    fn thrust_curve_is_inverted_exactly() {
        for expo in [-0.3, 0.0, 0.5, 0.65, 1.0] {
            for thrust in [0.0, 0.2, 0.7, 1.0] {
                let [actuator, ..] = Curve::new(expo).actuators([thrust; ROTORS]);
                let back = (1.0 - expo) * actuator + expo * actuator * actuator;
                assert!((back - thrust).abs() < 1e-12, "{expo} {thrust}");
            }
        }
    }
}
