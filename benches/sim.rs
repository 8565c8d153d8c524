//! Speed of the embedded simulator: a flight of 8.5 minutes, with and without its log.
//!
//! Items are control steps of 2.5 ms: items per second / 400 is how many drones one core flies in
//! real time. `part_*` show where a step's time goes.

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use nalgebra::Vector3;
use updraft::base::frame::{Geodetic, ShowFrame};
use updraft::base::time::GpsTime;
use updraft::show::{Segment, SegmentPath, Trajectory};
use updraft::sim::air::Surroundings;
use updraft::sim::autopilot::Autopilot;
use updraft::sim::plant::Plant;
use updraft::sim::sensors::Sensors;
use updraft::sim::{FlightSetup, Hooks, Uniform, fly, fly_without_log};
use updraft::vehicle::library::builtin;

fn main() {
    divan::main();
}

/// Climbs to 20 m, moves up and down at 2 m/s for eight minutes, and comes down to 2.5 m.
fn ladder() -> Trajectory {
    let to = |height_m: f64, duration_ms| Segment {
        duration_ms,
        path: SegmentPath::Line(Vector3::new(0.0, 0.0, height_m)),
    };
    let mut segments = vec![to(20.0, 10_000)];
    for _ in 0..8 {
        segments.push(to(60.0, 20_000));
        segments.push(Segment { duration_ms: 10_000, path: SegmentPath::Hold });
        segments.push(to(20.0, 20_000));
        segments.push(Segment { duration_ms: 10_000, path: SegmentPath::Hold });
    }
    segments.push(to(2.5, 8_750));
    Trajectory { start_m: Vector3::zeros(), segments }
}

/// Runs a flight; the counter is in simulated control steps of 2.5 ms.
fn bench(bencher: Bencher<'_, '_>, run: impl Fn(&FlightSetup<'_>) + Sync) {
    let vehicle = builtin("airsim-generic-quad").expect("a built-in vehicle");
    let trajectory = ladder();
    let origin = Geodetic { lat_deg: 47.4733, lon_deg: 19.0621, amsl_m: 190.0 };
    let air = Uniform(Vector3::new(2.5, 0.0, 0.0));
    let setup = FlightSetup {
        vehicle: &vehicle,
        trajectory: &trajectory,
        home_m: Vector3::zeros(),
        frame: ShowFrame { origin, orientation_deg: 0.0 },
        atmosphere: &air,
        seed: 1,
        drone: 1,
        start: GpsTime { week: 2445, tow_ms: 442_755_000 },
        lights: &[],
        full_logs: false,
        hooks: Hooks::default(),
    };
    let steps = fly_without_log(&setup).expect("a flight").steps;
    bencher.counter(ItemsCount::new(steps)).bench(|| run(black_box(&setup)));
}

#[divan::bench]
fn without_log(bencher: Bencher<'_, '_>) {
    bench(bencher, |setup| {
        black_box(fly_without_log(setup).expect("a flight"));
    });
}

#[divan::bench]
fn default_log(bencher: Bencher<'_, '_>) {
    bench(bencher, |setup| {
        black_box(fly(setup, std::io::sink()).expect("a flight"));
    });
}

#[divan::bench]
fn full_log(bencher: Bencher<'_, '_>) {
    bench(bencher, |setup| {
        let setup = FlightSetup { full_logs: true, ..*setup };
        black_box(fly(&setup, std::io::sink()).expect("a flight"));
    });
}

const STEP_S: f64 = 0.0025;
const STEPS: u64 = 40_000;

#[divan::bench]
fn part_plant(bencher: Bencher<'_, '_>) {
    let vehicle = builtin("airsim-generic-quad").expect("a built-in vehicle");
    let around =
        Surroundings { air_velocity_mps: Vector3::new(2.5, 0.0, 0.0), density_ratio: 0.98 };
    bencher.counter(ItemsCount::new(STEPS)).bench(|| {
        let mut plant = Plant::new(&vehicle.airframe, Vector3::zeros(), STEP_S);
        for _ in 0..STEPS {
            plant.step(black_box(&[0.7; 4]), &around);
        }
        *plant.motion()
    });
}

#[divan::bench]
fn part_sensors(bencher: Bencher<'_, '_>) {
    let vehicle = builtin("airsim-generic-quad").expect("a built-in vehicle");
    let plant = Plant::new(&vehicle.airframe, Vector3::zeros(), STEP_S);
    bencher.counter(ItemsCount::new(STEPS)).bench(|| {
        let mut sensors = Sensors::new(1, 1, STEP_S);
        for _ in 0..STEPS {
            black_box(sensors.sense(black_box(plant.motion())));
        }
    });
}

#[divan::bench]
fn part_autopilot(bencher: Bencher<'_, '_>) {
    let vehicle = builtin("airsim-generic-quad").expect("a built-in vehicle");
    let trajectory = ladder();
    let mut plant = Plant::new(&vehicle.airframe, Vector3::zeros(), STEP_S);
    let around = Surroundings { air_velocity_mps: Vector3::zeros(), density_ratio: 0.98 };
    let mut sensors = Sensors::new(1, 1, STEP_S);
    for _ in 0..200 {
        plant.step(&[0.6; 4], &around);
    }
    let estimate = sensors.sense(plant.motion());
    let settings = &vehicle.autopilot;
    bencher.counter(ItemsCount::new(STEPS)).bench(|| {
        let mut pilot = Autopilot::new(&trajectory, settings, Vector3::zeros(), 190.0, STEP_S)
            .expect("a show with a take-off");
        for step in 0..STEPS {
            black_box(pilot.update(step as f64 * STEP_S, black_box(&estimate)));
        }
    });
}
