//! What effects cost: the same flight by vehicles without and with them.
//!
//! Items are control steps of 2.5 ms. The stock vehicle has no effects and must not pay for them.

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use nalgebra::Vector3;
use updraft::base::frame::{Geodetic, ShowFrame};
use updraft::base::time::GpsTime;
use updraft::effects::LIBRARY;
use updraft::effects::select::choose;
use updraft::show::{Segment, SegmentPath, Trajectory};
use updraft::sim::{FlightSetup, Hooks, Uniform, fly_without_log};
use updraft::vehicle::Vehicle;
use updraft::vehicle::library::builtin;

fn main() {
    divan::main();
}

fn bench(bencher: Bencher<'_, '_>, vehicle: &Vehicle) {
    let to = |height_m: f64, duration_ms| Segment {
        duration_ms,
        path: SegmentPath::Line(Vector3::new(0.0, 0.0, height_m)),
    };
    let segments = vec![to(20.0, 10_000), to(60.0, 20_000), to(20.0, 20_000), to(2.5, 9_000)];
    let trajectory = Trajectory { start_m: Vector3::zeros(), segments };
    let origin = Geodetic { lat_deg: 47.4733, lon_deg: 19.0621, amsl_m: 190.0 };
    let air = Uniform(Vector3::new(2.5, 0.0, 0.0));
    let setup = FlightSetup {
        vehicle,
        lights: &[],
        trajectory: &trajectory,
        home_m: Vector3::zeros(),
        frame: ShowFrame { origin, orientation_deg: 0.0 },
        atmosphere: &air,
        seed: 1,
        drone: 1,
        start: GpsTime { week: 2445, tow_ms: 442_755_000 },
        full_logs: false,
        hooks: Hooks::default(),
    };
    let steps = fly_without_log(&setup).expect("a flight").steps;
    bencher.counter(ItemsCount::new(steps)).bench(|| fly_without_log(black_box(&setup)));
}

fn vehicle(name: &str) -> Vehicle {
    builtin(name).expect("a built-in vehicle")
}

#[divan::bench]
fn stock(bencher: Bencher<'_, '_>) {
    bench(bencher, &vehicle("airsim-generic-quad"));
}

#[divan::bench]
fn pixel_without_effects(bencher: Bencher<'_, '_>) {
    let mut pixel = vehicle("pixel");
    pixel.effects.clear();
    bench(bencher, &pixel);
}

#[divan::bench]
fn pixel(bencher: Bencher<'_, '_>) {
    bench(bencher, &vehicle("pixel"));
}

#[divan::bench]
fn pixel_with_the_whole_library(bencher: Bencher<'_, '_>) {
    let mut pixel = vehicle("pixel");
    for effect in LIBRARY {
        choose(&mut pixel, effect.definition().name).expect("an effect");
    }
    bench(bencher, &pixel);
}
