//! Legs around the autopilot's nominal climb speed are flown as calmly as any other: nothing in the
//! pulse or the speed may swing because a limit is near.

use crate::effects::support::{Flight, steady, vehicle};

#[test]
fn no_climb_near_the_nominal_speed_swings() {
    for name in ["airsim-generic-quad", "arducopter-sitl", "pixel", "phantom4"] {
        for gain in [0.3, 0.6, 0.8, 1.0] {
            let mut flown = vehicle(name, &[]);
            flown.autopilot.show_vel_ff_gain = gain;
            for limit_mps in [1.5, 2.5] {
                flown.autopilot.wpnav_speed_up_mps = limit_mps;
                for share in [0.96, 1.0, 1.04, 1.2, 1.3] {
                    let speed_mps = limit_mps * share;
                    let leg = steady(&flown, &Flight::moving(speed_mps));
                    let case = format!("{name}, gain {gain}, {speed_mps} of {limit_mps} m/s");
                    let sd_us = leg.pulse_sd_us;
                    // Targets in whole centimetres make up to 3.2 us, evenly more with speed and lag; a swing
                    // makes 17 to 28 us.
                    assert!(sd_us < 4.0, "{case}: the pulse swings by {sd_us:.1} us");
                    assert!((leg.climb_mps - speed_mps).abs() < 0.02, "{case}: {}", leg.climb_mps);
                }
            }
        }
    }
}
