//! Legs around the autopilot's nominal climb speed are flown as calmly as any other: nothing in the
//! pulse or the speed may swing because a limit is near.

mod effects_support;

use effects_support::{Flight, Steady, steady, vehicle};
use updraft::vehicle::Vehicle;

/// Legs at shares of the nominal speed, and the largest spread of their pulses (us).
fn largest_sd_us(vehicle: &Vehicle, limit_mps: f64) -> (f64, f64) {
    // What the feed-forward leaves is made up for at the nominal speed at most.
    let reached = |share: f64| (1.0 - vehicle.autopilot.show_vel_ff_gain) * share < 1.0;
    let spread = |share: f64| {
        let speed_mps = limit_mps * share;
        let flown: Steady = steady(vehicle, &Flight::moving(speed_mps));
        if std::env::var("NOA").is_err() { assert!((flown.climb_mps - speed_mps).abs() < 0.02, "{flown:?} instead of {speed_mps}"); }
        (flown.pulse_sd_us, share)
    };
    let shares = [0.95, 0.99, 1.0, 1.01, 1.05, 1.1, 1.2, 1.3, 1.5];
    shares.into_iter().filter(|share| reached(*share)).map(spread).fold((0.0, 0.0), |most, one| if one.0 > most.0 { one } else { most })
}

#[test]
fn no_speed_near_the_nominal_one_swings() {
    for name in ["airsim-generic-quad", "arducopter-sitl", "pixel", "phantom4"] {
        for gain in [0.0, 0.3, 0.6, 0.8, 1.0] {
            let mut flown = vehicle(name, &[]);
            flown.autopilot.show_vel_ff_gain = gain;
            for limit_mps in [1.0, 1.5, 2.0, 2.5, 3.0] {
                flown.autopilot.wpnav_speed_up_mps = limit_mps;
                let (sd_us, share) = largest_sd_us(&flown, limit_mps);
                println!("{name} {gain} {limit_mps}: {sd_us:.2} at {share}");
            }
        }
    }
}
