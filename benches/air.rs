//! Cost of the air: queries of each kind, and whole hovers in still and in moving air.
//!
//! `look_up_*` asks the atmosphere itself, `along_*` a drone's sampler 100 times a second, as the
//! simulator does; items are queries. `hover_*` flies ten minutes without a log; items are
//! simulated seconds.

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use nalgebra::Vector3;
use updraft::base::frame::{Geodetic, ShowFrame};
use updraft::base::time::GpsTime;
use updraft::show::{Segment, SegmentPath, Trajectory};
use updraft::sim::air::Sum;
use updraft::sim::air::spec::{Air, build, load};
use updraft::sim::{Atmosphere, FlightSetup, Hooks, fly_without_log};
use updraft::vehicle::library::builtin;

/// Queries per iteration: ten seconds.
const QUERIES: u32 = 1_000;

fn main() {
    divan::main();
}

fn frame() -> ShowFrame {
    let origin = Geodetic { lat_deg: 47.4733, lon_deg: 19.0621, amsl_m: 190.0 };
    ShowFrame { origin, orientation_deg: 59.0 }
}

fn air(spec: &str) -> Sum {
    let specs = load(spec).expect("a valid specification");
    build(&Air::new([0.0; 3], &specs), &frame(), 1, "bench")
}

/// Place and time of a query: a drone that hovers not quite still.
fn query(index: u32) -> (Vector3<f64>, f64) {
    let time_s = f64::from(index) * 0.01;
    (Vector3::new(7.0, -14.0 + 0.05 * time_s.sin(), 100.0), time_s)
}

#[divan::bench(args = ["still", "thermals", "field", "field:modes=2400", "dryden", "field-day"])]
fn look_up(bencher: Bencher<'_, '_>, spec: &str) {
    let air = air(spec);
    bencher.counter(ItemsCount::new(QUERIES)).bench(|| {
        for index in 0..QUERIES {
            let (position_m, time_s) = query(index);
            black_box(air.air_velocity(&position_m, time_s));
        }
    });
}

#[divan::bench(args = ["still", "thermals", "field", "field:modes=2400", "dryden", "field-day"])]
fn along(bencher: Bencher<'_, '_>, spec: &str) {
    let air = air(spec);
    bencher.counter(ItemsCount::new(QUERIES)).bench(|| {
        let mut sampler = air.sampler(1);
        for index in 0..QUERIES {
            let (position_m, time_s) = query(index);
            black_box(sampler.air_velocity(&position_m, time_s));
        }
    });
}

#[divan::bench(args = ["still", "uniform:east=2,up=0.5", "field", "thermal-day", "field-day"], sample_count = 10)]
fn hover(bencher: Bencher<'_, '_>, spec: &str) {
    let vehicle = builtin("airsim-generic-quad").expect("a built-in vehicle");
    let to = |height_m: f64, duration_ms| Segment {
        duration_ms,
        path: SegmentPath::Line(Vector3::new(0.0, 0.0, height_m)),
    };
    let hold = Segment { duration_ms: 600_000, path: SegmentPath::Hold };
    let segments = vec![to(100.0, 30_000), hold, to(2.5, 40_000)];
    let trajectory = Trajectory { start_m: Vector3::zeros(), segments };
    let air = air(spec);
    let setup = FlightSetup {
        vehicle: &vehicle,
        lights: &[],
        trajectory: &trajectory,
        home_m: Vector3::zeros(),
        frame: frame(),
        atmosphere: &air,
        seed: 1,
        drone: 1,
        start: GpsTime { week: 2445, tow_ms: 442_755_000 },
        full_logs: false,
        hooks: Hooks::default(),
    };
    let steps = fly_without_log(&setup).expect("a flight").steps;
    bencher.counter(ItemsCount::new(steps / 400)).bench(|| fly_without_log(black_box(&setup)));
}
