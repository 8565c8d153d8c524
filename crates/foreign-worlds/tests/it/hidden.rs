//! Hidden effects do what their files say, in trim and in flight.

use foreign_worlds::hidden::{Drawn, KINDS, Parameter};
use foreign_worlds::{Condition, Trim};

use super::support::{BLADES, LAW, flown, hiding};

/// Pulse of a hidden effect in steady flight, us.
fn pulse_us(kind: &str, values: &[f64], at: &Condition) -> f64 {
    let world = hiding(&LAW, kind, values);
    let [with, without] = [world.acting(), Vec::new()]
        .map(|acting| Trim::new(&LAW, acting, 1.0).at(at).unwrap().pulse_us);
    with - without
}

fn climbing(climb_mps: f64) -> Condition {
    Condition { relative_mps: [0.0, 0.0, climb_mps], time_s: 100.0, ..Condition::default() }
}

#[test]
fn closed_forms_are_those_of_the_files() {
    let close =
        |found: f64, wanted: f64| assert!((found - wanted).abs() < 1e-6, "{found} {wanted}");
    close(pulse_us("inflow", &[20.0], &climbing(1.5)), 30.0);
    close(pulse_us("drift", &[6.0, 400.0], &climbing(-2.0)), -3.0);
    close(pulse_us("warming", &[10.0, 100.0], &climbing(0.0)), 10.0 * (1.0 - (-1.0_f64).exp()));
    let full_us = 1000.0 * (9.80665 + 0.1 * 1.225 * 4.0) / 18.3;
    let drag_us = 1000.0 * 0.1 * 1.225 * 4.0 / 18.3;
    close(pulse_us("base-drag", &[0.5], &climbing(2.0)), 0.5 * drag_us);
    close(
        pulse_us("voltage", &[0.6], &Condition { supply_ratio: 0.95, ..climbing(2.0) }),
        full_us * (0.95_f64.powf(-0.6) - 1.0),
    );
    // At its centre the dip takes its depth of the thrust.
    let descent = 1000.0 * (9.80665 - 0.1 * 1.225 * 9.0) / 18.3;
    close(
        pulse_us("vortex-dip", &[0.08, -3.0, 1.2], &climbing(-3.0)),
        descent * (1.0 / 0.92 - 1.0),
    );
    close(pulse_us("momentum-drag", &[0.2], &climbing(2.0)), 1000.0 * 0.4 / 18.3);
    close(pulse_us("curve", &[0.5], &climbing(0.0)), 0.0);
    close(pulse_us("icing", &[12.0, 5.0, 99.0], &climbing(1.0)), 17.0);
    close(pulse_us("icing", &[12.0, 5.0, 101.0], &climbing(1.0)), 0.0);
    close(pulse_us("side-wake", &[12.0], &Condition { has_left: true, ..climbing(0.0) }), 12.0);
}

#[test]
fn every_kind_flies_on_both_plants_and_comes_home() {
    for plant in [&LAW, &BLADES] {
        for kind in KINDS {
            let value = |one: &Parameter| match one.drawn {
                Drawn::FlightShare => 90.0 * one.high,
                _ => one.high,
            };
            let values: Vec<f64> = kind.parameters.iter().map(value).collect();
            let mut world = hiding(plant, kind.name, &values);
            world.air.wind_mps = [4.0, 2.0];
            let (flown, _) = flown(&world);
            let most_m = if kind.name == "ceiling" { 12.0 } else { 5.0 };
            assert!(flown.farthest_m < most_m, "{}: {flown:?}", kind.name);
            assert!(flown.landed_s < 110.0, "{}: {flown:?}", kind.name);
        }
    }
}
