//! What the tests of the JSON interface share: replies read back, and a firmware's side of a socket.

#![allow(dead_code, clippy::allow_attributes, reason = "each test file uses its own part")]
#![expect(clippy::unwrap_used, reason = "this is test code")]

use multirotor_sim::sim::json::ServoPacket;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use skybrush_show::frame::{Geodetic, ShowFrame};

/// A reply, as a firmware reads it: north, east, down and forward, right, down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Reply {
    pub(crate) time_s: f64,
    pub(crate) gyro: Vector3<f64>,
    pub(crate) accel: Vector3<f64>,
    pub(crate) position: Vector3<f64>,
    pub(crate) velocity: Vector3<f64>,
    pub(crate) attitude: UnitQuaternion<f64>,
}

/// Reads a reply the way ArduPilot does: a line between two line ends, each key followed at once by
/// its value.
pub(crate) fn read(text: &str) -> Reply {
    let line = text.strip_prefix('\n').unwrap().strip_suffix('\n').unwrap();
    assert!(!line.contains('\n'), "{line}");
    let after = |key: &str| {
        let quoted = format!("\"{key}\":");
        line.split_once(&quoted).unwrap_or_else(|| panic!("{key} is missing: {line}")).1
    };
    let list = |key: &str| -> Vec<f64> {
        let inside = after(key).strip_prefix('[').unwrap().split_once(']').unwrap().0;
        inside.split(',').map(|value| value.parse().unwrap()).collect()
    };
    let vector = |key: &str| Vector3::from_iterator(list(key).into_iter().take(3));
    let turn = list("quaternion");
    Reply {
        time_s: after("timestamp").split_once(',').unwrap().0.parse().unwrap(),
        gyro: vector("gyro"),
        accel: vector("accel_body"),
        position: vector("position"),
        velocity: vector("velocity"),
        attitude: UnitQuaternion::new_normalize(Quaternion::new(
            turn[0], turn[1], turn[2], turn[3],
        )),
    }
}

/// A packet with the rotors' pulses.
pub(crate) fn packet(rate_hz: u16, count: u32, pulses: [u16; 4]) -> [u8; 40] {
    let mut pulses_us = [0; 32];
    pulses_us[..4].copy_from_slice(&pulses);
    ServoPacket { frame_rate_hz: rate_hz, frame_count: count, pulses_us }.to_bytes()
}

/// A show frame at an altitude, heading east-north-east.
pub(crate) fn frame(amsl_m: f64) -> ShowFrame {
    let origin = Geodetic { lat_deg: 47.4733, lon_deg: 19.0621, amsl_m };
    ShowFrame { origin, orientation_deg: 59.0 }
}
