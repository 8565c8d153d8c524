//! What the simulator flies is what an effect's closed form says: the autopilot is closed around
//! the plant, and the mean pulse of a steady window with and without the effect is compared.

#![expect(clippy::print_stdout, reason = "the numbers are the point of a closer look")]

use crate::effects::support::{Flight, Steady, fly_windows, steady, vehicle};
use multirotor_sim::effects::active::deviation;
use multirotor_sim::effects::select::values_of;
use multirotor_sim::effects::{LIBRARY, Model, Reference, Signals, find};
use multirotor_sim::vehicle::Vehicle;

/// Signals of a flown window in horizontal wind.
fn signals(flown: &Steady, flight: &Flight) -> Signals {
    Signals {
        climb_mps: flown.climb_mps - flight.air_mps.z,
        horizontal_mps: flight.air_mps.x.abs(),
        tilt_rad: if flight.air_mps.x == 0.0 { 0.0 } else { flown.tilt_rad },
        height_m: flown.height_m,
        density_ratio: flown.density_ratio,
        charge_used_ah: flown.used_ah,
        ..Signals::default()
    }
}

/// Pulse change by an effect: as flown, and by its closed form.
fn compared(
    name: &str,
    base: &[&str],
    extra: &[&str],
    effect: &str,
    flight: &Flight,
    more: impl Fn(&Vehicle, Signals) -> Signals,
) -> (f64, f64) {
    let mut without = vehicle(name, base);
    let mut with = vehicle(name, &[base, &[effect], extra].concat());
    if effect == "rotor-inflow" {
        // Formulas add to one another to first order; AirSim's large drag would show the second.
        without.airframe.drag_coefficient = 0.0;
        with.airframe.drag_coefficient = 0.0;
    }
    let (before, after) = (steady(&without, flight), steady(&with, flight));
    let effect = find(effect).expect("an effect");
    let values = values_of(effect, &with).expect("values");
    let at = Reference::of(&with).in_air(after.density_ratio);
    let signals = more(&with, signals(&after, flight));
    let formula = effect.pulse_us(&at, &values, &signals);
    let flown = after.pulse_us - before.pulse_us;
    println!(
        "{:20} {name:20} flown {flown:+8.3}, formula {formula:+8.3} us",
        effect.definition().name
    );
    (flown, formula)
}

fn assert_near(case: &str, (flown, formula): (f64, f64), share: f64) {
    let tolerance = 0.35 + share * formula.abs();
    assert!((flown - formula).abs() < tolerance, "{case}: flown {flown}, formula {formula} us");
    assert!(formula.abs() > 0.5, "{case}: nothing to compare, {formula} us");
}

fn same(_: &Vehicle, signals: Signals) -> Signals {
    signals
}

#[test]
fn axial_effects_fly_as_their_formulas_say() {
    for name in ["airsim-generic-quad", "pixel", "phantom4"] {
        for speed in [-2.0, -0.4, 0.4, 3.0] {
            let flight = Flight::moving(speed);
            let inflow = compared(name, &[], &[], "rotor-inflow", &flight, same);
            assert_near(&format!("{name} {speed} inflow"), inflow, 0.005);
        }
    }
    for speed in [-3.0, 3.0] {
        let drag = compared(
            "pixel",
            &["rotor-inflow"],
            &[],
            "parasitic-drag",
            &Flight::moving(speed),
            same,
        );
        assert_near(&format!("{speed} drag"), drag, 0.06);
    }
    for speed in [-2.0, -3.5] {
        let flight = Flight::moving(speed);
        let ring = compared(
            "pixel",
            &["rotor-inflow"],
            &["vortex-ring.jitter=0"],
            "vortex-ring",
            &flight,
            same,
        );
        assert_near(&format!("{speed} vortex ring"), ring, 0.02);
    }
    for expo in ["thrust-curve.expo=0.52", "thrust-curve.expo=-0.2"] {
        let curve = compared(
            "airsim-generic-quad",
            &[],
            &[expo],
            "thrust-curve",
            &Flight::moving(3.0),
            |vehicle, signals| {
                let model = Model::of(&crate::effects::support::vehicle(&vehicle.name, &[]))
                    .expect("a model");
                let hover = model.reference.in_air(signals.density_ratio).hover_us();
                Signals { increment_us: model.pulse_us(&signals) - hover, ..signals }
            },
        );
        assert_near(expo, curve, 0.01);
    }
}

#[test]
fn vortex_ring_shakes_only_in_descent() {
    let calm = vehicle("pixel", &["rotor-inflow"]);
    let ring = vehicle("pixel", &["rotor-inflow", "vortex-ring"]);
    let shaking = |speed| {
        let flight = Flight::moving(speed);
        steady(&ring, &flight).pulse_sd_us / steady(&calm, &flight).pulse_sd_us
    };
    let (down, up) = (shaking(-3.5), shaking(3.0));
    println!("pulse s.d. with vortex ring over without: {down:.2} down, {up:.2} up");
    assert!(down > 1.5 && (up - 1.0).abs() < 1e-9);
}

#[test]
fn horizontal_effects_fly_as_their_formulas_say() {
    for wind in [2.0, 5.0, 8.0] {
        let flight = Flight::hover(50.0).wind(wind);
        let lift = compared("pixel", &["rotor-inflow"], &[], "translational-lift", &flight, same);
        assert_near(&format!("{wind} lift"), lift, 0.02);
        let flap = compared("pixel", &[], &[], "blade-flapping", &flight, same);
        if wind > 2.0 {
            assert_near(&format!("{wind} flapping"), flap, 0.02);
        }
    }
    // Both, and inflow through the leaning disc.
    let flight = Flight::hover(50.0).wind(5.0);
    let choices = ["rotor-inflow", "translational-lift", "blade-flapping"];
    let with = vehicle("pixel", &choices);
    let flown = steady(&with, &flight);
    let formula = Model::of(&with).expect("a model").pulse_us(&signals(&flown, &flight));
    println!("wind 5 m/s, all horizontal: flown {:.3}, model {formula:.3} us", flown.pulse_us);
    assert!((flown.pulse_us - formula).abs() < 1.0, "{} {formula}", flown.pulse_us);
    let lean = flown.tilt_rad.to_degrees() / 5.0;
    assert!((1.0..1.5).contains(&lean), "{lean} degrees per m/s");
}

#[test]
fn slow_effects_fly_as_their_formulas_say() {
    let mut low = Flight::hover(0.5);
    low.legs = vec![(4, 3.0), (10, 3.0), (6, 0.5), (40, 0.5)];
    low.windows = vec![(30.0, 58.0)];
    let ground = compared("pixel", &[], &[], "ground-effect", &low, same);
    assert_near("ground effect", ground, 0.03);

    let hover = Flight::hover(50.0);
    for charge in ["battery.initial_charge=0.9", "battery.initial_charge=0.4"] {
        for name in ["pixel", "airsim-generic-quad"] {
            let sag = compared(name, &[], &[charge], "battery", &hover, same);
            assert_near(charge, sag, 0.01);
        }
    }
    let thermal = compared(
        "pixel",
        &[],
        &["motor-thermal.drift_us=-15", "motor-thermal.time_s=60"],
        "motor-thermal",
        &hover,
        // The motors start 6 s before the take-off, which is near show time 0.
        |_, signals| Signals { time_s: 69.0 + 6.0, ..signals },
    );
    assert_near("thermal", thermal, 0.03);
    for name in ["pixel", "airsim-generic-quad"] {
        let warm = compared(
            name,
            &[],
            &["air-density.temperature_offset_k=10"],
            "air-density",
            &hover,
            same,
        );
        assert_near("warm day", warm, 0.01);
        println!("10 K on {name}: {:.2} us", warm.0);
    }
}

#[test]
fn drones_differ_as_their_draws_say() {
    for effect in ["mass-spread", "thrust-spread"] {
        for drone in [1, 2] {
            let flight = Flight { drone, ..Flight::hover(50.0) };
            let sd = format!("{effect}.sd=0.03");
            let pair = compared("pixel", &[], &[&sd], effect, &flight, |_, signals| {
                let definition = find(effect).expect("an effect").definition();
                Signals { deviation: deviation(definition, 1, drone), ..signals }
            });
            let tolerance = 0.35 + 0.01 * pair.1.abs();
            assert!((pair.0 - pair.1).abs() < tolerance, "{effect} {drone}: {pair:?}");
        }
    }
}

#[test]
fn turbulence_rectifies_as_the_formula_says() {
    // Long windows: the mean of 120 s of gusts of 0.05 s has its own error.
    for (speed, expected) in [(0.3, 1.3), (0.6, 1.7)] {
        let flight = Flight {
            legs: vec![(4, 3.0), (20, 10.0), (150, 10.0 + 150.0 * speed), (60, 3.0)],
            windows: vec![(34.0, 174.0)],
            ..Flight::hover(0.0)
        };
        let choices = ["turbulence.sigma_mps=0.5", "turbulence.time_s=0.02"];
        let pair = compared("airsim-generic-quad", &[], &choices, "turbulence", &flight, same);
        assert!((pair.0 - pair.1).abs() < 0.35, "{speed}: {pair:?}");
        assert!((pair.1 - expected).abs() < 0.7, "{speed}: {pair:?}");
    }
}

#[test]
fn downwash_is_the_sink_times_the_slope() {
    let base = ["rotor-inflow"];
    let pair = compared(
        "pixel",
        &base,
        &[],
        "neighbour-downwash",
        &Flight::hover(50.0),
        |vehicle, signals| Signals {
            neighbours: 8.0,
            sensitivity: Model::of(vehicle).expect("a model").sensitivity(&signals),
            ..signals
        },
    );
    assert_near("downwash", pair, 0.03);
    assert!(pair.1 < 5.0, "catalogue: at most 5 us, {}", pair.1);
}

#[test]
fn velocity_error_shifts_the_measured_velocity_alone() {
    let biased =
        vehicle("airsim-generic-quad", &["velocity-error.bias_mps=0.1", "velocity-error.sd_mps=0"]);
    let plain = vehicle("airsim-generic-quad", &[]);
    let flight = Flight::moving(2.0);
    let (with, without) = (steady(&biased, &flight), steady(&plain, &flight));
    let shift = with.measured_mps - with.climb_mps - (without.measured_mps - without.climb_mps);
    assert!((shift - 0.1).abs() < 0.002, "{shift}");
    // At the measured velocity the pulse is too low by slope times bias: 2 A V b.
    let model = Model::of(&plain).expect("a model");
    let signals = signals(&with, &flight);
    let expected = model.pulse_us(&Signals { climb_mps: with.measured_mps, ..signals });
    let effect = find("velocity-error").expect("an effect");
    let values = values_of(effect, &biased).expect("values");
    let sensitivity = model.sensitivity(&signals);
    let formula = effect.pulse_us(&model.reference, &values, &Signals { sensitivity, ..signals });
    assert!(
        (with.pulse_us - expected - formula).abs() < 0.3,
        "{} {formula}",
        with.pulse_us - expected
    );
    assert!((formula + 3.2).abs() < 0.15, "{formula}");
}

#[test]
fn a_log_can_be_late_or_off_while_the_autopilot_is_not() {
    // From rest into a climb of 2 m/s: what lags by d has gone d times 2 m/s less far.
    let flight = Flight { windows: vec![(52.0, 62.0), (64.0, 73.0)], ..Flight::moving(2.0) };
    let flown = |more: &[&str]| {
        let choices = [&["velocity-error.sd_mps=0", "velocity-error.lag_s=0"], more].concat();
        fly_windows(&vehicle("pixel", &choices), &flight)
    };
    let plain = flown(&[]);
    let late = flown(&["velocity-error.lag_s=0.3", "velocity-error.log_only=1"]);
    let off = flown(&["velocity-error.bias_mps=-1.5", "velocity-error.log_only=1"]);
    let (mean, after) = (|one: &Steady| one.measured_mps, 0.3 * 2.0 / 10.0);
    assert!((mean(&plain[0]) - mean(&late[0]) - after).abs() < 0.005, "{late:?}");
    assert!((mean(&plain[1]) - mean(&late[1])).abs() < 0.005, "{late:?}");
    assert!((mean(&plain[1]) - mean(&off[1]) - 1.5).abs() < 1e-9, "{off:?}");
    for other in [&late, &off] {
        for (other, plain) in other.iter().zip(&plain) {
            assert_eq!(other.pulse_us, plain.pulse_us, "what is only logged moves nothing");
            assert_eq!(other.climb_mps, plain.climb_mps);
        }
    }
    // With the same lag the loop flies another way; with a bias it follows the heights all the same.
    let flies_late = flown(&["velocity-error.lag_s=0.3"]);
    assert_ne!(flies_late[0].pulse_us, plain[0].pulse_us);
    let flies_off = flown(&["velocity-error.bias_mps=0.4"]);
    assert!((flies_off[1].climb_mps - 2.0).abs() < 0.05, "{flies_off:?}");
    assert!((mean(&flies_off[1]) - flies_off[1].climb_mps - 0.4).abs() < 0.01, "{flies_off:?}");
    let refused = multirotor_sim::effects::select::choose(
        &mut vehicle("pixel", &[]),
        "velocity-error.log_only=0.5",
    );
    assert!(refused.unwrap_err().to_string().contains("0 or 1"));
}

#[test]
fn noise_of_the_pulse_remembers_for_as_long_as_it_says() {
    let flight = Flight {
        legs: vec![(4, 3.0), (20, 40.0), (320, 40.0), (20, 3.0)],
        windows: (0..140)
            .map(|at| (50.0 + 2.0 * f64::from(at), 52.0 + 2.0 * f64::from(at)))
            .collect(),
        ..Flight::hover(40.0)
    };
    let spread = |time: &str| {
        let choices = ["pulse-noise.sd_us=8", time];
        let windows = fly_windows(&vehicle("pixel", &choices), &flight);
        let n = windows.len() as f64;
        let mean = windows.iter().map(|one| one.pulse_us).sum::<f64>() / n;
        let off = |lag: usize| {
            let pairs = windows.iter().zip(&windows[lag..]);
            let product = |(a, b): (&Steady, &Steady)| (a.pulse_us - mean) * (b.pulse_us - mean);
            pairs.map(product).sum::<f64>() / n
        };
        (off(0).sqrt(), off(2) / off(0), mean)
    };
    let (long_us, kept, mean_us) = spread("pulse-noise.time_s=5");
    let (short_us, ..) = spread("pulse-noise.time_s=0.1");
    println!("means of 2 s: {long_us:.2} us, {kept:.2} kept after 4 s; short {short_us:.2} us");
    // Means of 2 s of what remembers for 5 s have 0.94 of its standard deviation; of 4 s later, exp(-4/5).
    assert!((5.5..9.5).contains(&long_us), "{long_us}");
    assert!((0.15..0.75).contains(&kept), "{kept}");
    assert!(short_us < 0.5 * long_us, "{short_us}");
    let calm = fly_windows(&vehicle("pixel", &[]), &flight);
    let calm_us = calm.iter().map(|one| one.pulse_us).sum::<f64>() / calm.len() as f64;
    // 280 s are some 28 independent values.
    assert!((mean_us - calm_us).abs() < 3.0 * 8.0 / 28.0_f64.sqrt(), "{mean_us} for {calm_us}");
}

#[test]
fn effects_that_are_off_or_do_nothing_change_no_bit() {
    let stock = vehicle("airsim-generic-quad", &[]);
    let flight = Flight { seed: 5, ..Flight::moving(2.5).wind(3.0) };
    let expected = format!("{:?}", fly_windows(&stock, &flight));
    let mut off = stock.clone();
    for effect in LIBRARY {
        multirotor_sim::effects::select::choose(
            &mut off,
            &format!("{}=off", effect.definition().name),
        )
        .expect("an effect");
    }
    assert_eq!(format!("{:?}", fly_windows(&off, &flight)), expected);
    let nothing = vehicle("airsim-generic-quad", &["tilt-formula", "mass-spread.sd=0"]);
    assert_eq!(format!("{:?}", fly_windows(&nothing, &flight)), expected);
    // And they can: any effect in the loop shows.
    let some = vehicle("airsim-generic-quad", &["blade-flapping"]);
    assert_ne!(format!("{:?}", fly_windows(&some, &flight)), expected);
}

#[test]
fn the_same_seed_gives_the_same_flight() {
    let pixel = multirotor_sim::vehicle::library::builtin("pixel").expect("a built-in vehicle");
    let flight = Flight::moving(-3.0).wind(2.0);
    let text = |flight: &Flight| format!("{:?}", fly_windows(&pixel, flight));
    assert_eq!(text(&flight), text(&flight));
    assert_ne!(text(&flight), text(&Flight { drone: 2, ..flight.clone() }));
}
