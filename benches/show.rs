//! Show files of 5000 drones, the most a `.skyc` file may hold, with 60 pieces each.

use nalgebra::Vector3;
use updraft::show::derive::{DeriveParams, Firmware, derive};
use updraft::show::skyb::SkybOptions;
use updraft::show::{
    Segment, SegmentPath, Show, ShowDrone, Trajectory, csv, lights, quantise, skyc,
};

fn main() {
    divan::main();
}

fn show() -> Show {
    let drone = |number: usize| {
        let home = Vector3::new((number % 71) as f64 * 1.37, (number / 71) as f64 * 1.41, 0.0);
        let segments = (0..60_u32).map(|i| {
            let z = f64::from(i % 7) * 3.217 + 2.5;
            let to = home + Vector3::new(f64::from(i % 5) * 0.731, 0.0, z);
            let path = match i % 3 {
                0 => SegmentPath::Hold,
                1 => SegmentPath::Line(to),
                _ => SegmentPath::Cubic([home + (to - home) * 0.25, to - Vector3::z(), to]),
            };
            Segment { duration_ms: 5000 + i * 37, path }
        });
        let step = |i: u32| lights::LightStep {
            duration_ms: 5000,
            color: [(i * 40) as u8, number as u8, 99],
            fade: i % 2 == 1,
        };
        ShowDrone {
            name: format!("Drone {}", number + 1),
            home_m: Some(home),
            land_at_m: Some(home),
            trajectory: Trajectory { start_m: home, segments: segments.collect() },
            lights: lights::encode(&(0..20).map(step).collect::<Vec<_>>()),
            ..ShowDrone::default()
        }
    };
    Show { drones: (0..5000).map(drone).collect(), ..Show::default() }
}

#[divan::bench(sample_count = 5, sample_size = 1)]
fn write_skyc_5000(bencher: divan::Bencher<'_, '_>) {
    let show = show();
    bencher.bench(|| skyc::write(&show).map(|bytes| bytes.len()));
}

#[divan::bench(sample_count = 5, sample_size = 1)]
fn read_skyc_5000(bencher: divan::Bencher<'_, '_>) {
    let bytes = skyc::write(&show()).unwrap_or_default();
    bencher.bench(|| skyc::read(&bytes).map(|show| show.drones.len()));
}

#[divan::bench(sample_count = 5, sample_size = 1)]
fn write_skyb_5000(bencher: divan::Bencher<'_, '_>) {
    let show = show();
    bencher.bench(|| quantise::report(&show, &SkybOptions::default()).len());
}

#[divan::bench(sample_count = 3, sample_size = 1)]
fn write_csv_5000(bencher: divan::Bencher<'_, '_>) {
    let show = show();
    bencher.bench(|| csv::write(&show, &csv::CsvOptions::default()).map(|bytes| bytes.len()));
}

#[divan::bench(sample_count = 5, sample_size = 1)]
fn derive_5000(bencher: divan::Bencher<'_, '_>) {
    let show = show();
    let params = DeriveParams::default();
    bencher.bench(|| {
        let valid = |drone: &&ShowDrone| derive(&drone.trajectory, Firmware::V46, &params).valid;
        show.drones.iter().filter(valid).count()
    });
}
