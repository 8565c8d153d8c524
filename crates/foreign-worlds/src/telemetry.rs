//! Telemetry of the motors' controllers: what a log has of rotor speed and current besides the pulses.

use rand_pcg::Pcg64;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::random::{Coloured, Purpose, normal, stream};

/// Rotors of a vehicle.
pub(crate) const ROTORS: usize = 4;
/// Differences of the rotors' speeds that hold the attitude, relative; they add up to nothing.
const SHARES: [f64; ROTORS] = [0.004, -0.003, 0.002, -0.003];

/// Errors of telemetry and of the sensor of the battery's current.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TelemetrySettings {
    /// Standard deviation of the white part of each reported speed, rev/min.
    pub speed_white_rpm: f64,
    /// Step of reported speeds, rev/min: controllers send hundreds of electrical revolutions.
    pub speed_step_rpm: f64,
    /// Standard deviation of a drone's current sensor, constant in a flight, relative.
    pub current_share: f64,
    /// Standard deviation of the part of the current's error that remembers, relative.
    pub current_coloured_share: f64,
    /// Its correlation time, s.
    pub current_coloured_s: f64,
    /// Standard deviation of the white part of each logged current, A.
    pub current_white_a: f64,
    /// Step of logged currents, A.
    pub current_step_a: f64,
}

/// Telemetry of one drone.
pub(crate) struct Telemetry {
    settings: TelemetrySettings,
    current_gain: f64,
    current_error: Coloured,
    white: Pcg64,
}

impl Telemetry {
    pub(crate) fn new(settings: TelemetrySettings, seed: u64, slot: u16, step_s: f64) -> Self {
        let rng = |part: u64| stream(seed ^ (part << 40), slot, Purpose::Telemetry);
        let (sd, time_s) = (settings.current_coloured_share, settings.current_coloured_s);
        Self {
            settings,
            current_gain: 1.0 + settings.current_share * normal(&mut rng(0)),
            current_error: Coloured::new(sd, time_s, step_s, rng(1)),
            white: rng(2),
        }
    }

    /// The current as its sensor has it, A.
    pub(crate) fn current_a(&mut self, current_a: f64) -> f64 {
        let white_a = self.settings.current_white_a * normal(&mut self.white);
        let gain = self.current_gain + self.current_error.step();
        stepped(current_a * gain + white_a, self.settings.current_step_a).max(0.0)
    }

    /// The rotors' speeds as their controllers report them, rev/min.
    pub(crate) fn speeds_rpm(&mut self, mean_radps: f64) -> [f64; ROTORS] {
        let mean_rpm = mean_radps * 60.0 / std::f64::consts::TAU;
        SHARES.map(|share| {
            let white_rpm = self.settings.speed_white_rpm * normal(&mut self.white);
            let is_turning = f64::from(u8::from(mean_rpm > 0.0));
            let rpm = mean_rpm * (1.0 + share) + is_turning * white_rpm;
            stepped(rpm, self.settings.speed_step_rpm).max(0.0)
        })
    }
}

fn stepped(value: f64, step: f64) -> f64 {
    if step > 0.0 { (value / step).round() * step } else { value }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn speeds_come_in_steps_around_the_true_one() {
        let settings = TelemetrySettings {
            speed_white_rpm: 20.0,
            speed_step_rpm: 100.0 / 7.0,
            current_share: 0.02,
            current_coloured_share: 0.0,
            current_coloured_s: 30.0,
            current_white_a: 0.05,
            current_step_a: 0.01,
        };
        let mut telemetry = Telemetry::new(settings, 3, 1, 0.1);
        let rows: Vec<[f64; ROTORS]> = (0..4000).map(|_| telemetry.speeds_rpm(840.0)).collect();
        let mean = rows.iter().flatten().sum::<f64>() / (4 * rows.len()) as f64;
        // 840 rad/s are 8021.4 rev/min; 20 rev/min over the root of 16,000 are 0.16.
        assert!((mean - 8021.4).abs() < 0.7, "{mean}");
        let step = rows[0][0] * 7.0 / 100.0;
        assert!((step - step.round()).abs() < 1e-9);
        let currents: Vec<f64> = (0..4000).map(|_| telemetry.current_a(5.0)).collect();
        let mean_a = currents.iter().sum::<f64>() / currents.len() as f64;
        assert!((mean_a / 5.0 - telemetry.current_gain).abs() < 1e-3, "{mean_a}");
        assert!((telemetry.current_gain - 1.0).abs() < 0.08);
    }

    #[test]
    fn rotors_that_stand_report_nothing() {
        let settings = TelemetrySettings {
            speed_white_rpm: 20.0,
            speed_step_rpm: 0.0,
            current_share: 0.0,
            current_coloured_share: 0.0,
            current_coloured_s: 30.0,
            current_white_a: 0.0,
            current_step_a: 0.0,
        };
        let mut telemetry = Telemetry::new(settings, 3, 1, 0.1);
        assert_eq!(telemetry.speeds_rpm(0.0), [0.0; ROTORS]);
        assert_eq!(telemetry.current_a(2.0), 2.0);
    }
}
