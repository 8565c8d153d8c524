//! Off-library effects change the pulse by what they say; another step of the plant changes nothing
//! that matters, and the door that lets both in changes no byte when it is not used.

#![expect(clippy::unwrap_used, reason = "a test that cannot fly fails")]

use nalgebra::Vector3;
use std::path::Path;
use updraft::base::time::GpsTime;
use updraft::blind::Base;
use updraft::blind::foreign::{FOREIGN, find};

use updraft::effects::{Extra, LIBRARY, Reference, Signals, Values};
use updraft::flight::{Flight, FlightOptions, Series};
use updraft::log::Log;
use updraft::mission::Plan;
use updraft::mission::resolve::{Override, resolve};
use updraft::sim::{Beyond, FlightSetup, Hooks, Uniform, fly, fly_beyond};
use updraft::vehicle::Vehicle;

fn plan() -> Plan {
    let overrides = [
        Override::parse("grid.rows=1").unwrap(),
        Override::parse("grid.columns=1").unwrap(),
        Override::parse("speeds_mps=[2.0]").unwrap(),
    ];
    resolve("calibration", &overrides).unwrap().flights.remove(0).plan
}

fn quiet_vehicle() -> Vehicle {
    let mut vehicle = Base::Airsim.known().unwrap();
    vehicle.effects.clear();
    vehicle
}

/// A flight in a wind from behind (x forward); its log.
fn log(vehicle: &Vehicle, extra: &[Extra], plant_steps: u16, plain: bool) -> Vec<u8> {
    let plan = plan();
    let slot = &plan.slots[0];
    let trajectory = plan.trajectory(slot);
    let air = Uniform(Vector3::new(4.0, 0.0, 0.0));
    let setup = FlightSetup {
        vehicle,
        trajectory: &trajectory,
        home_m: slot.home_m.into(),
        frame: plan.site.frame(),
        atmosphere: &air,
        seed: 1,
        drone: 1,
        start: GpsTime { week: 2421, tow_ms: 129_618_000 },
        lights: &[],
        full_logs: false,
        hooks: Hooks::default(),
    };
    let mut bytes = Vec::new();
    if plain {
        fly(&setup, &mut bytes).unwrap();
    } else {
        fly_beyond(&setup, Beyond { effects: extra, plant_steps }, &mut bytes).unwrap();
    }
    bytes
}

fn read(bytes: Vec<u8>) -> Flight {
    let log = Log::from_bytes(bytes);
    Flight::from_log(&log, Path::new("test.BIN"), FlightOptions::default()).unwrap()
}

/// The end of each steady piece of the plan, s of show time: settled for 8 s.
fn steady() -> Vec<(f64, f64)> {
    let plan = plan();
    let segments = plan.segments(&plan.slots[0]);
    let times =
        segments.iter().map(|one| (one.start_ms as f64 / 1e3 + 8.0, one.end_ms as f64 / 1e3));
    let times: Vec<_> = times.map(|(from, to)| (from, to - 1.0)).collect();
    times.into_iter().filter(|(from, to)| to - from >= 1.0).collect()
}

fn mean(series: &Series, (from, to): (f64, f64)) -> f64 {
    let values = series.between(from, to);
    values.iter().sum::<f64>() / values.len() as f64
}

#[test]
fn the_pulse_changes_by_what_they_say() {
    let vehicle = quiet_vehicle();
    let without = read(log(&vehicle, &[], 2, false));
    let set = |values: &[f64]| -> Values {
        let mut all = Values::default();
        all[..values.len()].copy_from_slice(values);
        all
    };
    for (name, values) in [
        ("step", set(&[18.0, 60.0])),
        ("step", set(&[-9.0, 60.0])),
        ("height-wave", set(&[12.0, 40.0, 0.7])),
        ("climb-time", set(&[9.0, 100.0])),
        ("heading", set(&[15.0, 1.0])),
    ] {
        let effect = find(name).unwrap().effect;
        let with = read(log(&vehicle, &[(effect, values)], 2, false));
        let motors_s = with.armed_s[0].0 + 2.0;
        let (mut largest, mut count) = (0.0_f64, 0);
        for window in steady() {
            let found = mean(&with.effort.values, window) - mean(&without.effort.values, window);
            // Along a window that climbs the wave is not flat: mean of the closed form.
            let times = with.height_m.times_between(window.0, window.1);
            let heights = with.height_m.between(window.0, window.1);
            let climb_mps = mean(&with.velocity_up_mps, window);
            let said = times.iter().zip(heights).map(|(time_s, height_m)| {
                let signals = Signals {
                    climb_mps,
                    horizontal_mps: -4.0,
                    height_m: *height_m,
                    time_s: time_s - motors_s,
                    ..Signals::default()
                };
                effect.pulse_us(&Reference::of(&vehicle), &values, &signals)
            });
            let said = said.sum::<f64>() / times.len() as f64;
            let near_step =
                name == "step" && (window.0 - 5.0..window.1 + 5.0).contains(&(60.0 + motors_s));
            if !near_step {
                assert!((found - said).abs() < 1.0, "{name} {window:?}: {found}, said {said}");
                (largest, count) = (largest.max(said.abs()), count + 1);
            }
        }
        assert!(largest > 5.0 && count >= 4, "{name}: {largest} us in {count} windows");
    }
}

#[test]
fn no_library_lists_them() {
    for foreign in FOREIGN {
        let name = foreign.effect.definition().name;
        assert!(!LIBRARY.iter().any(|known| known.definition().name == name), "{name}");
    }
}

#[test]
fn the_door_unused_changes_no_byte_and_another_step_hardly_a_pulse() {
    let mut vehicle = Base::Pixel.known().unwrap();
    vehicle.effects.remove("thrust-spread");
    let standard = log(&vehicle, &[], 1, true);
    assert!(standard == log(&vehicle, &[], 1, false));
    assert!(standard == log(&vehicle, &[], 0, false));
    let finer = log(&vehicle, &[], 2, false);
    assert!(standard != finer);
    let (standard, finer) = (read(standard), read(finer));
    for window in steady() {
        let moved = mean(&finer.effort.values, window) - mean(&standard.effort.values, window);
        assert!(moved.abs() < 1.0, "{window:?}: {moved}");
    }
}
