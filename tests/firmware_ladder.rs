//! dump
mod firmware_support;
use firmware_support::*;
use nalgebra::Vector3;
#[test]
fn dump() {
    let v = updraft::vehicle::library::builtin("arducopter-sitl").unwrap();
    let sq = {
        let mut v = v.clone();
        let f = v.airframe.sitl.as_mut().unwrap();
        f.momentum_drag = 0.0;
        f.reference_speed_mps = 8.0;
        f.reference_current_a = 88.0;
        f.thrust_expo = 0.0;
        v.autopilot.mot_thst_expo = 0.0;
        v
    };
    std::fs::write("/tmp/fw/our-still.BIN", flown(&v, &ladder(), Vector3::zeros())).unwrap();
    std::fs::write("/tmp/fw/our-wind.BIN", flown(&v, &ladder(), Vector3::new(5.0, 0.0, 0.0)))
        .unwrap();
    std::fs::write("/tmp/fw/our-square.BIN", flown(&sq, &ladder(), Vector3::zeros())).unwrap();
}
