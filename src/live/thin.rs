//! Flights as telemetry tells them: the channels of a log, thinned to the rate of the link.
//!
//! The pulse is the mean over the outputs of the first motors (SERVO_OUTPUT_RAW), the lean that of ATTITUDE, velocity and
//! height those of GLOBAL_POSITION_INT, each at the time at which the board measured it.

use std::collections::{BTreeMap, VecDeque};
use std::path::PathBuf;

use crate::base::time::GpsTime;
use crate::fleet::telemetry::{Drone, Telemetry};
use crate::flight::{Alignment, Clock, Effort, Flight, Indicator, Series};
use crate::link::frame::MavMessage;
use crate::link::id::DroneId;
use crate::link::net::Received;

/// Samples that are kept of a channel: ten minutes at 4 Hz and more.
const MOST: usize = 4_000;
/// Between these a motor's pulse is one of flight, us.
const PULSES_US: std::ops::RangeInclusive<u16> = 800..=2_200;
/// Bounds of the outputs, us.
const LIMITS_US: (f64, f64) = (1_000.0, 2_000.0);
/// After so many us the time of the outputs begins anew.
const AGAIN_US: i64 = 1 << 32;

/// A channel: GPS times in s, and values.
#[derive(Clone, Debug, Default)]
struct Channel(VecDeque<(f64, f64)>);

impl Channel {
    /// Takes a value; one that is no later than the last came twice.
    fn push(&mut self, time_s: f64, value: f64) {
        if value.is_finite() && self.0.back().is_none_or(|(last_s, _)| time_s > *last_s) {
            self.0.push_back((time_s, value));
            if self.0.len() > MOST {
                self.0.pop_front();
            }
        }
    }

    /// Values from a show time on, by show time.
    fn series(&self, start_s: f64, from_s: f64) -> Series {
        let (time_s, value) = self
            .0
            .iter()
            .map(|(time_s, value)| (time_s - start_s, *value))
            .filter(|(time_s, _)| *time_s >= from_s)
            .unzip();
        Series { time_s, value }
    }
}

#[derive(Clone, Debug, Default)]
struct Channels {
    velocity: Channel,
    height: Channel,
    pulse: Channel,
    pulse_max: Channel,
    pulse_min: Channel,
    roll: Channel,
    pitch: Channel,
    voltage: Channel,
    current: Channel,
    restarts: u32,
}

/// Channels of all drones, bounded in memory.
#[derive(Clone, Debug, Default)]
pub struct Thin {
    drones: BTreeMap<DroneId, Channels>,
    motors: usize,
}

impl Thin {
    /// Channels of drones with so many motors, on their first outputs.
    pub fn new(motors: usize) -> Self {
        Self { drones: BTreeMap::new(), motors: motors.clamp(1, 8) }
    }

    /// Takes a message, after `telemetry` has.
    pub fn hear(&mut self, telemetry: &Telemetry, received: &Received) {
        let Some(of) = telemetry.get(received.from) else { return };
        let channels = self.drones.entry(received.from).or_default();
        if channels.restarts != of.restarts {
            *channels = Channels { restarts: of.restarts, ..Channels::default() };
        }
        let gps_s = |boot_ms: u32| of.clock.gps_ms_on_board(boot_ms).map(|ms| ms / 1000.0);
        match &received.message {
            MavMessage::GLOBAL_POSITION_INT(_) => {
                let Some((_, at)) = of.position else { return };
                let Some(time_s) = gps_s(at.boot_ms) else { return };
                channels.velocity.push(time_s, at.neu_mps[2]);
                channels.height.push(time_s, at.above_home_m);
            }
            MavMessage::ATTITUDE(_) => {
                let Some((_, at)) = of.attitude else { return };
                let Some(time_s) = gps_s(at.boot_ms) else { return };
                channels.roll.push(time_s, at.roll_rad);
                channels.pitch.push(time_s, at.pitch_rad);
            }
            MavMessage::SERVO_OUTPUT_RAW(_) => {
                let Some((_, out)) = of.outputs else { return };
                let Some(time_s) = outputs_ms(of, out.boot_us).and_then(gps_s) else { return };
                let pulses = out.pulses_us.iter().take(self.motors);
                let pulses: Vec<f64> = pulses
                    .filter(|pulse| PULSES_US.contains(pulse))
                    .map(|pulse| f64::from(*pulse))
                    .collect();
                if pulses.len() == self.motors {
                    let mean = pulses.iter().sum::<f64>() / pulses.len() as f64;
                    channels.pulse.push(time_s, mean);
                    channels
                        .pulse_max
                        .push(time_s, pulses.iter().copied().fold(f64::MIN, f64::max));
                    channels
                        .pulse_min
                        .push(time_s, pulses.iter().copied().fold(f64::MAX, f64::min));
                }
            }
            MavMessage::SYS_STATUS(_) => {
                // It has no time of the board's: that of its arrival is near enough for a battery.
                let Some((at, health)) = of.health else { return };
                let Some(time_s) = of.clock.gps_ms(at).map(|ms| ms / 1000.0) else { return };
                if let (Some(volts), Some(amps)) = (health.battery_v, health.battery_a) {
                    channels.voltage.push(time_s, volts);
                    channels.current.push(time_s, amps);
                }
            }
            _ => {}
        }
    }

    /// The flight of a drone from a show time on, s; `None` if it has not told its outputs.
    pub fn flight(&self, drone: DroneId, start: GpsTime, from_s: f64) -> Option<Flight> {
        let channels = self.drones.get(&drone)?;
        let start_s = start.total_ms() as f64 / 1000.0;
        let series = |channel: &Channel| channel.series(start_s, from_s);
        let pulse = series(&channels.pulse);
        if pulse.is_empty() {
            return None;
        }
        Some(Flight {
            source: PathBuf::from(format!("drone {drone}")),
            clock: Clock {
                method: Alignment::GpsTime,
                offset_s: 0.0,
                residual_s: 0.0,
                start: Some(start),
            },
            velocity_up_mps: series(&channels.velocity),
            height_m: series(&channels.height),
            effort: Effort { indicator: Indicator::Pulse, values: pulse },
            pulse_max_us: series(&channels.pulse_max),
            pulse_min_us: series(&channels.pulse_min),
            roll_rad: series(&channels.roll),
            pitch_rad: series(&channels.pitch),
            voltage_v: Some(series(&channels.voltage)).filter(|series| !series.is_empty()),
            current_a: Some(series(&channels.current)).filter(|series| !series.is_empty()),
            pulse_limits_us: LIMITS_US,
            ..Flight::default()
        })
    }
}

/// Time of outputs, ms since the vehicle was switched on: the one next to what its board has said last.
fn outputs_ms(of: &Drone, boot_us: u32) -> Option<u32> {
    let board_us = i64::from(of.board_ms()?) * 1000;
    let behind_us = (board_us - i64::from(boot_us)).rem_euclid(AGAIN_US);
    let ahead = behind_us > AGAIN_US / 2;
    let at_us = board_us - behind_us + if ahead { AGAIN_US } else { 0 };
    u32::try_from(at_us / 1000).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::conversation::Observer as _;
    use crate::link::frame::dialect;

    const DRONE: DroneId = DroneId { network: 0, system: 7 };
    /// 2026-06-01 12:00 UTC.
    const UNIX_US: u64 = 1_780_315_200_000_000;

    fn hear(thin: &mut Thin, telemetry: &mut Telemetry, message: MavMessage) {
        let received = Received { from: DRONE, message };
        telemetry.on_message(0, &received);
        thin.hear(telemetry, &received);
    }

    #[test]
    fn channels_have_the_times_at_which_the_board_measured_them() {
        // The outputs' time begins anew between the two.
        let boots_ms = [4_294_900_u32, 4_295_400];
        let (mut thin, mut telemetry) = (Thin::new(4), Telemetry::default());
        for (k, boot_ms) in boots_ms.into_iter().enumerate() {
            let time = dialect::SYSTEM_TIME_DATA {
                time_unix_usec: UNIX_US + u64::from(boot_ms) * 1000,
                time_boot_ms: boot_ms,
            };
            hear(&mut thin, &mut telemetry, MavMessage::SYSTEM_TIME(time));
            let at = dialect::GLOBAL_POSITION_INT_DATA {
                time_boot_ms: boot_ms,
                relative_alt: 100_000,
                vz: -50,
                ..Default::default()
            };
            hear(&mut thin, &mut telemetry, MavMessage::GLOBAL_POSITION_INT(at));
            let out = dialect::SERVO_OUTPUT_RAW_DATA {
                time_usec: boot_ms.wrapping_mul(1000),
                servo1_raw: 1500 + k as u16,
                servo2_raw: 1502,
                servo3_raw: 1504,
                servo4_raw: 1506,
                servo5_raw: 1100,
                ..Default::default()
            };
            hear(&mut thin, &mut telemetry, MavMessage::SERVO_OUTPUT_RAW(out));
        }
        let start = GpsTime::from_unix_ms((UNIX_US / 1000) as i64 + 4_294_000).unwrap();
        let flight = thin.flight(DRONE, start, 0.0).unwrap();
        assert_eq!(flight.velocity_up_mps.value, [0.5, 0.5]);
        assert_eq!(flight.effort.values.value, [1503.0, 1503.25], "a servo is no motor");
        for times in [&flight.velocity_up_mps.time_s, &flight.effort.values.time_s] {
            let near = |time: &f64, wanted: f64| (time - wanted).abs() < 2e-3;
            assert!(near(&times[0], 0.9) && near(&times[1], 1.4), "{times:?}");
        }
        assert_eq!(thin.flight(DRONE, start, 1.0).unwrap().effort.values.value, [1503.25]);
        // Motors that stand still tell nothing of the air.
        let still = dialect::SERVO_OUTPUT_RAW_DATA { time_usec: 5_000_000, ..Default::default() };
        hear(&mut thin, &mut telemetry, MavMessage::SERVO_OUTPUT_RAW(still));
        assert_eq!(thin.flight(DRONE, start, 0.0).unwrap().effort.values.value.len(), 2);
    }

    #[test]
    fn what_comes_twice_or_late_is_left_away_and_memory_is_bounded() {
        let mut channel = Channel::default();
        for time in [1.0, 2.0, 2.0, 1.5, 3.0] {
            channel.push(time, time);
        }
        assert_eq!(channel.series(0.0, 0.0).time_s, [1.0, 2.0, 3.0]);
        for time in 0..10_000 {
            channel.push(f64::from(time), 0.0);
        }
        assert_eq!(channel.0.len(), MOST);
    }
}
