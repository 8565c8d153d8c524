//! One simulated vehicle for one firmware: packets in, replies out.

use std::net::SocketAddr;

use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::Serialize;
use thiserror::Error;

use super::imu::Imu;
use super::packet::{PacketError, ServoPacket};
use super::reply::write_reply;
use super::track::Track;
use crate::effects::Active;
use crate::sim::air::{Atmosphere, Surroundings, density_ratio};
use crate::sim::flight::command;
use crate::sim::plant::{Plant, rotor::ROTORS};
use crate::vehicle::Vehicle;
use skybrush_show::frame::ShowFrame;

/// Slowest rate at which the body moves, steps per second: longer frames take several steps.
const MIN_STEP_RATE_HZ: u16 = 400;
/// Air motion and density are looked up so often, s.
const AIR_INTERVAL_S: f64 = 0.01;
/// At most so much is flown at once when packets were lost, s.
const MAX_CATCH_UP_S: f64 = 0.1;

/// Setup of an instance: its vehicle, place and air.
#[derive(Clone, Copy)]
pub struct InstanceSetup<'a> {
    /// Vehicle to simulate.
    pub vehicle: &'a Vehicle,
    /// Place where the vehicle stands, show frame, m; its z is the ground there. ArduPilot's home
    /// is at this place.
    pub home_m: Vector3<f64>,
    /// Position and orientation of the show frame; the origin's altitude is the ground above mean
    /// sea level.
    pub frame: ShowFrame,
    /// Motion of the air, at the time since the firmware's start.
    pub atmosphere: &'a dyn Atmosphere,
    /// Seed of the differences between drones and of random effects.
    pub seed: u64,
    /// Slot of the drone in the fleet.
    pub drone: u16,
}

impl InstanceSetup<'_> {
    /// The body with the vehicle's effects, at home. A vehicle whose effects cannot start flies
    /// without them: whoever loads it checks that before.
    fn plant(&self, step_s: f64) -> Plant {
        match Active::start(self.vehicle, self.seed, self.drone, self.home_m, step_s) {
            Ok((effects, airframe)) => Plant::with_effects(&airframe, effects, self.home_m, step_s),
            Err(_) => Plant::new(&self.vehicle.airframe, self.home_m, step_s),
        }
    }
}

/// A body in its air, in lockstep with one firmware.
#[derive(Clone)]
pub struct Instance<'a> {
    setup: InstanceSetup<'a>,
    plant: Plant,
    around: Surroundings,
    air_until_s: f64,
    time_s: f64,
    step_s: f64,
    peer: Option<Peer>,
    reply: String,
    status: Status,
    track: Option<Track>,
}

#[derive(Clone, Copy)]
struct Peer {
    address: SocketAddr,
    frame_count: u32,
}

/// Statistics and state of an instance. Counts are since the program's start, the rest is the
/// present.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct Status {
    /// Address of the firmware that flies the instance.
    pub peer: Option<SocketAddr>,
    /// Number of frames flown.
    pub frames: u64,
    /// Number of frames that were asked for again and answered again without flying.
    pub repeated: u64,
    /// Number of frames whose packet never came.
    pub skipped: u64,
    /// Number of times that a firmware started, or started again, with the body at home.
    pub starts: u64,
    /// Number of packets that were not answered: not of the interface, or from a second firmware.
    pub refused: u64,
    /// Number of times that the motion became undefined and the body was put back home.
    pub diverged: u64,
    /// Frames per second that the firmware asks for.
    pub frame_rate_hz: u16,
    /// Time since the firmware's start, s.
    pub time_s: f64,
    /// Height above home, m.
    pub height_m: f64,
    /// Vertical speed, m/s, up positive.
    pub climb_mps: f64,
    /// Mean pulse of the rotors, us.
    pub pulse_us: f64,
}

/// Reason why a packet is not answered.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum Refusal {
    /// The datagram is not a servo packet.
    #[error(transparent)]
    Packet(#[from] PacketError),
    /// The instance is flown by another firmware.
    #[error("{from} is not {peer}, which flies this instance; give every firmware its own -I")]
    Stranger {
        /// Address that the packet came from.
        from: SocketAddr,
        /// Address of the firmware that flies the instance.
        peer: SocketAddr,
    },
}

impl<'a> Instance<'a> {
    /// An instance whose body stands at home and waits for its firmware.
    pub fn new(setup: InstanceSetup<'a>) -> Self {
        let step_s = 1.0 / f64::from(MIN_STEP_RATE_HZ);
        Self {
            setup,
            plant: setup.plant(step_s),
            around: Surroundings { air_velocity_mps: Vector3::zeros(), density_ratio: 1.0 },
            air_until_s: f64::NEG_INFINITY,
            time_s: 0.0,
            step_s,
            peer: None,
            reply: String::new(),
            status: Status::default(),
            track: None,
        }
    }

    /// An instance that takes note of the air that its body meets; see [`Instance::truth`].
    #[must_use]
    pub fn with_truth(mut self) -> Self {
        self.track = Some(Track::default());
        self
    }

    /// The air that the body has met since its firmware started, as the CSV text of a truth file
    /// ([`crate::sim::air::truth`]): a row per second since that start, with the place where the body
    /// truly was. `None` before its first frame, and without [`Instance::with_truth`].
    ///
    /// The ten-second mean of the first and last five seconds is of the part that was flown. No more
    /// than a day is kept.
    pub fn truth(&self) -> Option<String> {
        self.track.as_ref()?.to_csv(&self.setup.frame)
    }

    /// Answers one datagram with the text to send back.
    ///
    /// A frame count that goes on flies on; the same again gets the same reply again; a lower one is
    /// a firmware that has started anew and finds the body at home at time 0, also when it comes
    /// from another address. Frames that were skipped are flown with the newest pulses, up to a
    /// tenth of a second. The replies depend on the setup and the packets alone.
    ///
    /// # Errors
    /// See [`Refusal`]; nothing has moved then.
    pub fn answer(&mut self, from: SocketAddr, datagram: &[u8]) -> Result<&str, Refusal> {
        let frames = match self.admit(from, datagram) {
            Ok((_, 0)) => {
                self.status.repeated += 1;
                0
            }
            Ok((packet, frames)) => {
                self.fly(&packet, frames);
                frames
            }
            Err(refusal) => {
                self.status.refused += 1;
                return Err(refusal);
            }
        };
        self.status.frames += u64::from(frames);
        Ok(&self.reply)
    }

    /// Statistics and present state of the instance.
    pub fn status(&self) -> &Status {
        &self.status
    }

    /// Body of the vehicle.
    pub fn plant(&self) -> &Plant {
        &self.plant
    }

    /// Decides who may fly, and how many frames a packet is worth.
    fn admit(&mut self, from: SocketAddr, datagram: &[u8]) -> Result<(ServoPacket, u32), Refusal> {
        let packet = ServoPacket::parse(datagram)?;
        let (count, rate_hz) = (packet.frame_count, packet.frame_rate_hz);
        // The counter may wrap; half its range tells forward from back.
        let ahead = self.peer.map(|peer| count.wrapping_sub(peer.frame_count) as i32);
        let frames = match (self.peer, ahead) {
            (Some(peer), Some(ahead)) if peer.address != from && ahead > 0 => {
                return Err(Refusal::Stranger { from, peer: peer.address });
            }
            (Some(peer), Some(ahead)) if peer.address == from && ahead >= 0 => {
                let ahead = ahead.unsigned_abs();
                self.status.skipped += u64::from(ahead.saturating_sub(1));
                let most = (MAX_CATCH_UP_S * f64::from(rate_hz)).max(1.0) as u32;
                ahead.min(most)
            }
            _ => {
                self.restart(rate_hz);
                self.track = self.track.take().map(|_| Track::default());
                self.status.starts += 1;
                1
            }
        };
        self.peer = Some(Peer { address: from, frame_count: count });
        self.status.peer = Some(from);
        Ok((packet, frames))
    }

    /// Puts the body back home at time 0.
    fn restart(&mut self, rate_hz: u16) {
        self.step_s = step_s(rate_hz).1;
        self.plant = self.setup.plant(self.step_s);
        self.time_s = 0.0;
        self.air_until_s = f64::NEG_INFINITY;
    }

    /// Flies frames with the same pulses and makes the reply.
    fn fly(&mut self, packet: &ServoPacket, frames: u32) {
        let rate_hz = packet.frame_rate_hz;
        let (steps, step_s) = step_s(rate_hz);
        if step_s != self.step_s {
            self.plant.set_step(&self.setup.vehicle.airframe, step_s);
            self.step_s = step_s;
        }
        let mut pulses_us = [0; ROTORS];
        pulses_us.copy_from_slice(&packet.pulses_us[..ROTORS]);
        let commands = pulses_us.map(command);
        let before = *self.plant.motion();
        let frame_s = 1.0 / f64::from(rate_hz);
        for _ in 0..frames {
            self.look_at_air();
            for _ in 0..steps {
                self.plant.step(&commands, &self.around);
            }
            self.time_s += frame_s;
        }
        let mut imu = Imu::between(&before, self.plant.motion(), frame_s * f64::from(frames));
        let motion = self.plant.motion();
        let sum = motion.position_m.sum() + imu.force_mps2.sum() + imu.rate_radps.sum();
        if !(sum + self.around.air_velocity_mps.sum()).is_finite() {
            let time_s = self.time_s;
            self.restart(rate_hz);
            self.time_s = time_s;
            self.status.diverged += 1;
            imu = Imu::at_rest();
        }
        let InstanceSetup { home_m, frame, .. } = &self.setup;
        let motion = self.plant.motion();
        write_reply(&mut self.reply, self.time_s, motion, &imu, *home_m, frame);
        self.status.frame_rate_hz = rate_hz;
        self.status.time_s = self.time_s;
        self.status.height_m = motion.position_m.z - home_m.z;
        self.status.climb_mps = motion.velocity_mps.z;
        self.status.pulse_us = pulses_us.map(f64::from).iter().sum::<f64>() / ROTORS as f64;
    }

    fn look_at_air(&mut self) {
        // Half a microsecond of slack, as the sum of frames is not exact.
        if self.time_s + 5e-7 < self.air_until_s {
            return;
        }
        self.air_until_s = self.time_s + AIR_INTERVAL_S;
        let place = &self.plant.motion().position_m;
        self.around = Surroundings {
            air_velocity_mps: self.setup.atmosphere.air_velocity(place, self.time_s),
            density_ratio: density_ratio(self.setup.frame.origin.amsl_m + place.z),
        };
        if let Some(track) = &mut self.track {
            let velocity_mps = self.around.air_velocity_mps;
            track.meet(self.time_s, *place, velocity_mps, &self.setup.frame);
        }
    }
}

/// Steps per frame of the body's motion, and their length, s.
fn step_s(rate_hz: u16) -> (u16, f64) {
    let steps = MIN_STEP_RATE_HZ.div_ceil(rate_hz);
    (steps, 1.0 / (f64::from(rate_hz) * f64::from(steps)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::air::Uniform;
    use crate::vehicle::library::builtin;
    use skybrush_show::frame::Geodetic;

    const STILL: Uniform = Uniform(Vector3::new(0.0, 0.0, 0.0));

    fn address(port: u16) -> SocketAddr {
        SocketAddr::from(([127, 0, 0, 1], port))
    }

    fn with<T>(atmosphere: &dyn Atmosphere, test: impl FnOnce(Instance<'_>) -> T) -> T {
        let vehicle = builtin("airsim-generic-quad").unwrap();
        let origin = Geodetic { lat_deg: 47.0, lon_deg: 19.0, amsl_m: 200.0 };
        test(Instance::new(InstanceSetup {
            vehicle: &vehicle,
            home_m: Vector3::new(7.0, -14.0, 0.5),
            frame: ShowFrame { origin, orientation_deg: 59.0 },
            atmosphere,
            seed: 1,
            drone: 1,
        }))
    }

    fn packet(rate: u16, count: u32, pulses: [u16; 4]) -> [u8; 40] {
        let mut pulses_us = [0; 32];
        pulses_us[..4].copy_from_slice(&pulses);
        ServoPacket { frame_rate_hz: rate, frame_count: count, pulses_us }.to_bytes()
    }

    fn send(instance: &mut Instance<'_>, count: u32, pulse: u16) -> serde_json::Value {
        let reply = instance.answer(address(1), &packet(400, count, [pulse; 4])).unwrap();
        serde_json::from_str(reply).unwrap()
    }

    #[test]
    fn at_rest_the_accelerometer_feels_gravitys_reaction() {
        with(&STILL, |mut instance| {
            let reply = instance.answer(address(1), &packet(1200, 0, [1000; 4])).unwrap();
            insta::assert_snapshot!("reply_at_rest", reply);
            // Also with rotors that do not lift it yet, and without any output.
            for (count, pulse) in (1..400).zip([0, 1100, 1500].into_iter().cycle()) {
                let reply = send(&mut instance, count, pulse);
                assert_eq!(reply["imu"]["accel_body"], serde_json::json!([0.0, 0.0, -9.80665]));
            }
        });
    }

    #[test]
    fn a_frame_takes_the_time_the_firmware_says() {
        with(&STILL, |mut instance| {
            for (count, (rate, time_s)) in
                [(1200, 1.0 / 1200.0), (400, 0.0025), (50, 0.02), (1, 1.0), (4000, 0.00025)]
                    .into_iter()
                    .enumerate()
            {
                let before = instance.status.time_s;
                instance.answer(address(1), &packet(rate, count as u32, [1000; 4])).unwrap();
                assert!((instance.status.time_s - before - time_s).abs() < 1e-12, "{rate} Hz");
            }
            assert_eq!(instance.status.starts, 1);
        });
    }

    /// The same flight in frames of 1 s to 1 ms: the rotors' lag and the air are what they were.
    #[test]
    fn the_frame_rate_does_not_change_the_physics() {
        let climb = |rate: u16| {
            with(&STILL, |mut instance| {
                for count in 0..u32::from(rate) * 3 {
                    instance.answer(address(1), &packet(rate, count, [1700; 4])).unwrap();
                }
                instance.status
            })
        };
        let finest = climb(4000);
        for rate in [1, 50, 399, 400, 1200] {
            let status = climb(rate);
            // The lag of one step and the integrator's error: millimetres after 3 s.
            assert!((status.height_m - finest.height_m).abs() < 0.02, "{rate}: {status:?}");
            assert!((status.climb_mps - finest.climb_mps).abs() < 0.01, "{rate}: {status:?}");
        }
    }

    #[test]
    fn a_changing_rate_flies_like_a_constant_one() {
        let climb = |rates: [u16; 2]| {
            with(&STILL, |mut instance| {
                for count in 0..3600 {
                    let rate = rates[count as usize % 2];
                    instance.answer(address(1), &packet(rate, count, [1700; 4])).unwrap();
                }
                instance.status
            })
        };
        let (constant, changing) = (climb([1200, 1200]), climb([1199, 1201]));
        assert!((constant.height_m - changing.height_m).abs() < 1e-3, "{constant:?} {changing:?}");
    }

    #[test]
    fn a_repeated_frame_gets_the_same_reply_and_does_not_fly() {
        with(&STILL, |mut instance| {
            for count in 0..400 {
                send(&mut instance, count, 1700);
            }
            let before = send(&mut instance, 400, 1700);
            assert_eq!(send(&mut instance, 400, 1200), before);
            assert_eq!((instance.status.frames, instance.status.repeated), (401, 1));
        });
    }

    #[test]
    fn a_lower_frame_count_finds_the_body_at_home_at_time_0() {
        with(&STILL, |mut instance| {
            let first = send(&mut instance, 0, 1700);
            for count in 1..800 {
                send(&mut instance, count, 1700);
            }
            assert!(instance.status.height_m > 1.0);
            assert_eq!(send(&mut instance, 0, 1700), first);
            assert_eq!(instance.status.starts, 2);
        });
    }

    #[test]
    fn skipped_frames_are_flown_up_to_a_tenth_of_a_second() {
        with(&STILL, |mut instance| {
            send(&mut instance, 0, 1700);
            send(&mut instance, 11, 1700);
            assert!((instance.status.time_s - 12.0 / 400.0).abs() < 1e-12);
            send(&mut instance, 2_000_000_000, 1700);
            assert!((instance.status.time_s - 52.0 / 400.0).abs() < 1e-12);
            assert_eq!(instance.status.skipped, 10 + 2_000_000_000 - 12);
            assert_eq!(instance.status.frames, 52);
        });
    }

    #[test]
    fn the_frame_counter_may_wrap() {
        with(&STILL, |mut instance| {
            send(&mut instance, u32::MAX, 1000);
            send(&mut instance, 0, 1000);
            assert_eq!((instance.status.starts, instance.status.frames), (1, 2));
        });
    }

    #[test]
    fn a_second_firmware_is_refused_and_a_restarted_one_is_not() {
        with(&STILL, |mut instance| {
            for count in 0..10 {
                send(&mut instance, count, 1000);
            }
            let stranger = instance.answer(address(2), &packet(400, 500, [2000; 4]));
            let message = stranger.unwrap_err().to_string();
            assert!(message.contains("127.0.0.1:2") && message.contains("-I"), "{message}");
            assert_eq!((instance.status.frames, instance.status.refused), (10, 1));
            instance.answer(address(2), &packet(400, 0, [1000; 4])).unwrap();
            assert_eq!((instance.status.starts, instance.status.peer), (2, Some(address(2))));
        });
    }

    #[test]
    fn nothing_moves_for_what_is_refused() {
        with(&STILL, |mut instance| {
            let before = send(&mut instance, 0, 1700);
            for bytes in [&b""[..], b"{}", &[0; 40], &packet(0, 1, [2000; 4])] {
                assert!(instance.answer(address(1), bytes).is_err());
            }
            assert_eq!(instance.status.refused, 4);
            assert_eq!(send(&mut instance, 0, 1700), before);
        });
    }

    #[test]
    fn undefined_air_puts_the_body_back_home_and_says_so() {
        with(&Uniform(Vector3::new(f64::NAN, 0.0, 0.0)), |mut instance| {
            for count in 0..100 {
                send(&mut instance, count, 1900);
            }
            assert_eq!(instance.status.diverged, 100);
            assert_eq!(instance.status.height_m, 0.0);
        });
    }

    /// What ArduPilot's mixer does for a demand must turn the body that way on the wire.
    #[test]
    fn more_thrust_on_a_side_turns_the_body_as_the_firmware_expects() {
        // Front right, rear left, front left, rear right; gyro roll right, nose up, yaw right.
        let cases = [
            ([1600, 1610, 1610, 1600], 0, "left side up: rolls right"),
            ([1610, 1600, 1610, 1600], 1, "front up: nose up"),
            ([1610, 1610, 1600, 1600], 2, "counter-clockwise rotors: turns right"),
        ];
        for (pulses, axis, what) in cases {
            with(&STILL, |mut instance| {
                for count in 0..40 {
                    instance.answer(address(1), &packet(400, count, [1700; 4])).unwrap();
                }
                let reply = instance.answer(address(1), &packet(400, 80, pulses)).unwrap();
                let reply: serde_json::Value = serde_json::from_str(reply).unwrap();
                for other in 0..3 {
                    let rate = reply["imu"]["gyro"][other].as_f64().unwrap();
                    if other == axis {
                        assert!(rate > 1e-3, "{what}: {reply}");
                    } else {
                        assert!(rate.abs() < 1e-3, "{what}: {reply}");
                    }
                }
            });
        }
    }
}
