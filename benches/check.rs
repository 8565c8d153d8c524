//! Whole checks of large fleets.

use nalgebra::Vector3;
use updraft::check::{CheckInput, CheckReport, check};
use updraft::mission::plan::Fence;
use updraft::show::trajectory::{Segment, SegmentPath, Trajectory};
use updraft::show::{Show, ShowDrone};
use updraft::vehicle::Limits;

fn main() {
    divan::main();
}

const LIMITS: Limits = Limits {
    max_speed_xy_mps: 20.0,
    max_speed_up_mps: 10.0,
    max_speed_down_mps: 10.0,
    max_acceleration_mps2: 50.0,
    max_velocity_step_mps: 20.0,
    max_altitude_m: 120.0,
    min_distance_m: 2.0,
    endurance_s: 2000.0,
    endurance_reserve: 0.2,
};

/// A ladder of 60 pieces; `phase_ms` says how much later a drone of this row and column flies it.
fn ladder(count: usize, phase_ms: fn(usize, usize) -> u32) -> Show {
    let columns = (count as f64).sqrt().ceil() as usize;
    let drones = (0..count).map(|i| {
        let (row, column) = (i / columns, i % columns);
        let home = Vector3::new(7.0 * row as f64, 7.0 * column as f64, 0.0);
        let line = |duration_ms, z| Segment {
            duration_ms,
            path: SegmentPath::Line(home + Vector3::new(0.0, 0.0, z)),
        };
        let hold = |duration_ms| Segment { duration_ms, path: SegmentPath::Hold };
        let mut segments = vec![hold(1000 + phase_ms(row, column)), line(20_000, 20.0)];
        for rung in 0..14 {
            let top = 20.0 + 10.0 * f64::from(rung % 7 + 1);
            segments.extend([hold(10_000), line(20_000, top), hold(10_000), line(20_000, 20.0)]);
        }
        segments.extend([hold(5_000), line(17_500, 2.5)]);
        drone(i, home, segments)
    });
    Show { drones: drones.collect(), ..Show::default() }
}

fn drone(i: usize, home: Vector3<f64>, segments: Vec<Segment>) -> ShowDrone {
    ShowDrone {
        name: format!("Drone {}", i + 1),
        home_m: Some(home),
        trajectory: Trajectory { start_m: home, segments },
        ..ShowDrone::default()
    }
}

/// Every drone wanders in its own cell of 12 m along 60 cubics.
fn wander(count: usize) -> Show {
    let columns = (count as f64).sqrt().ceil() as usize;
    let mut state = 1_u64;
    let mut random = move || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / f64::from(1_u32 << 31)
    };
    let drones = (0..count).map(|i| {
        let home = Vector3::new(12.0 * (i / columns) as f64, 12.0 * (i % columns) as f64, 0.0);
        let mut point = || {
            home + Vector3::new(9.0 * random() - 4.5, 9.0 * random() - 4.5, 20.0 + 40.0 * random())
        };
        let climb = SegmentPath::Line(home + Vector3::new(0.0, 0.0, 20.0));
        let mut segments = vec![Segment { duration_ms: 20_000, path: climb }];
        for _ in 0..59 {
            let path = SegmentPath::Cubic([point(), point(), point()]);
            segments.push(Segment { duration_ms: 10_000, path });
        }
        drone(i, home, segments)
    });
    Show { drones: drones.collect(), ..Show::default() }
}

/// All drones cross to a random other place of the grid at once, on 40 levels of 2.5 m.
fn transition(count: usize) -> Show {
    let columns = (count as f64).sqrt().ceil() as usize;
    let place =
        |i: usize| Vector3::new(7.0 * (i / columns) as f64, 7.0 * (i % columns) as f64, 0.0);
    let drones = (0..count).map(|i| {
        let home = place(i);
        let level = Vector3::new(0.0, 0.0, 15.0 + 2.5 * (i % 40) as f64);
        let line = |duration_ms, to| Segment { duration_ms, path: SegmentPath::Line(to) };
        let mut segments = vec![line(30_000, home + level)];
        let mut at = i;
        for _ in 0..10 {
            at = (at * 2_654_435_761 + 12_345) % count;
            segments.push(line(60_000, place(at) + level));
        }
        drone(i, home, segments)
    });
    Show { drones: drones.collect(), ..Show::default() }
}

fn run(bencher: divan::Bencher<'_, '_>, show: &Show) {
    let fence = Fence {
        polygon_m: vec![[-50.0, -50.0], [1000.0, -50.0], [1000.0, 1000.0], [-50.0, 1000.0]],
        max_altitude_m: 150.0,
        margin_m: 5.0,
    };
    bencher.bench(|| -> CheckReport {
        check(&CheckInput { fence: Some(&fence), ..CheckInput::new(show, &LIMITS) })
    });
}

const COUNTS: [usize; 2] = [1000, 5000];

#[divan::bench(args = COUNTS, sample_count = 5)]
fn together(bencher: divan::Bencher<'_, '_>, count: usize) {
    run(bencher, &ladder(count, |_, _| 0));
}

#[divan::bench(args = COUNTS, sample_count = 5)]
fn counter_phase(bencher: divan::Bencher<'_, '_>, count: usize) {
    run(bencher, &ladder(count, |row, column| if (row + column) % 2 == 0 { 0 } else { 30_000 }));
}

#[divan::bench(args = COUNTS, sample_count = 5)]
fn every_drone_at_another_time(bencher: divan::Bencher<'_, '_>, count: usize) {
    run(bencher, &ladder(count, |row, column| (row * 1009 + column * 2003) as u32 % 60_000));
}

#[divan::bench(args = COUNTS, sample_count = 5)]
fn cubics(bencher: divan::Bencher<'_, '_>, count: usize) {
    run(bencher, &wander(count));
}

#[divan::bench(args = COUNTS, sample_count = 3)]
fn crossing_transitions(bencher: divan::Bencher<'_, '_>, count: usize) {
    run(bencher, &transition(count));
}
