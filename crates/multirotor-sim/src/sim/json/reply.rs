//! The reply: one JSON object on a line, north-east-down and forward-right-down.
//!
//! ArduPilot looks for `"key":` and reads what follows at once, so there is no space anywhere.

use std::fmt::Write as _;

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use super::imu::Imu;
use crate::sim::plant::Motion;
use skybrush_show::frame::ShowFrame;

/// Replaces `text` with the reply for a motion.
///
/// `home_m` (show frame) is where ArduPilot's own home is: positions are relative to it.
pub(super) fn write_reply(
    text: &mut String,
    time_s: f64,
    motion: &Motion,
    imu: &Imu,
    home_m: Vector3<f64>,
    frame: &ShowFrame,
) {
    text.clear();
    let [gx, gy, gz] = forward_right_down(imu.rate_radps);
    let [ax, ay, az] = forward_right_down(imu.force_mps2);
    let [north, east, down] = north_east_down(frame, motion.position_m - home_m);
    let [vn, ve, vd] = north_east_down(frame, motion.velocity_mps);
    let turn = attitude(frame, motion.attitude);
    let [q1, q2, q3, q4] = [turn.w, turn.i, turn.j, turn.k];
    // ArduPilot wants a line end before the first object as well.
    let _ = writeln!(
        text,
        "\n{{\"timestamp\":{time_s:.9},\
         \"imu\":{{\"gyro\":[{gx:.9},{gy:.9},{gz:.9}],\"accel_body\":[{ax:.7},{ay:.7},{az:.7}]}},\
         \"position\":[{north:.6},{east:.6},{down:.6}],\
         \"quaternion\":[{q1:.9},{q2:.9},{q3:.9},{q4:.9}],\
         \"velocity\":[{vn:.7},{ve:.7},{vd:.7}]}}"
    );
}

/// Show axes to north, east, down. Adding zero turns -0 into 0.
fn north_east_down(frame: &ShowFrame, show: Vector3<f64>) -> [f64; 3] {
    let neu = frame.to_neu(show);
    [neu.x + 0.0, neu.y + 0.0, 0.0 - neu.z]
}

/// Forward, left, up to forward, right, down.
fn forward_right_down(body: Vector3<f64>) -> [f64; 3] {
    [body.x + 0.0, 0.0 - body.y, 0.0 - body.z]
}

/// The rotation from forward-right-down to north-east-down.
fn attitude(frame: &ShowFrame, show_from_body: UnitQuaternion<f64>) -> UnitQuaternion<f64> {
    // Between show axes and north-east-down lies half a turn about the horizontal axis that halves
    // the angle from north to show x; between the two sets of body axes one about forward.
    let (sin, cos) = (frame.orientation_deg.to_radians() / 2.0).sin_cos();
    let ned_from_show = UnitQuaternion::new_unchecked(Quaternion::new(0.0, cos, sin, 0.0));
    let flu_from_frd = UnitQuaternion::new_unchecked(Quaternion::new(0.0, 1.0, 0.0, 0.0));
    let turn = ned_from_show * show_from_body * flu_from_frd;
    if turn.w < 0.0 { UnitQuaternion::new_unchecked(-turn.into_inner()) } else { turn }
}

#[cfg(test)]
mod tests {
    use super::*;
    use skybrush_show::frame::Geodetic;

    fn frame(orientation_deg: f64) -> ShowFrame {
        let origin = Geodetic { lat_deg: 47.0, lon_deg: 19.0, amsl_m: 150.0 };
        ShowFrame { origin, orientation_deg }
    }

    fn euler_deg(turn: UnitQuaternion<f64>) -> [f64; 3] {
        let (roll, pitch, yaw) = turn.euler_angles();
        [roll, pitch, yaw].map(f64::to_degrees)
    }

    fn near(got: [f64; 3], want: [f64; 3]) {
        assert!(got.iter().zip(want).all(|(g, w)| (g - w).abs() < 1e-9), "{got:?}, not {want:?}");
    }

    #[test]
    fn a_level_body_heads_along_the_orientation() {
        for orientation in [0.0, 59.0, 90.0, -120.0, 179.0] {
            let turn = attitude(&frame(orientation), UnitQuaternion::identity());
            near(euler_deg(turn), [0.0, 0.0, orientation]);
        }
    }

    #[test]
    fn signs_of_roll_pitch_and_yaw_are_the_firmwares() {
        let about = |axis, deg: f64| UnitQuaternion::from_axis_angle(&axis, deg.to_radians());
        let seen = |turn| euler_deg(attitude(&frame(0.0), turn));
        // About forward, left side up: rolls right. About left: nose down. About up: turns left.
        near(seen(about(Vector3::x_axis(), 10.0)), [10.0, 0.0, 0.0]);
        near(seen(about(Vector3::y_axis(), 10.0)), [0.0, -10.0, 0.0]);
        near(seen(about(Vector3::z_axis(), 10.0)), [0.0, 0.0, -10.0]);
    }

    #[test]
    fn the_attitude_turns_body_vectors_into_the_same_place() {
        let frame = frame(59.0);
        let turn = UnitQuaternion::from_euler_angles(0.3, -0.4, 2.0);
        let body = Vector3::new(0.7, -1.3, 2.1);
        let direct = Vector3::from(north_east_down(&frame, turn * body));
        let wire = attitude(&frame, turn) * Vector3::from(forward_right_down(body));
        assert!((direct - wire).norm() < 1e-12, "{direct} {wire}");
    }
}
